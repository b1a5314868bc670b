# SPDX-License-Identifier: LGPL-2.1-or-later
"""The characters of texts: one rule at every way in, and exports that every reader can read."""

from __future__ import annotations

import csv
import io
import json
import sys
import unicodedata
from collections.abc import Callable
from html.parser import HTMLParser
from typing import Any
from urllib.parse import quote

import pytest
from hypothesis import given
from hypothesis import strategies as st
from model_file import model_file
from openpyxl import load_workbook
from server_testing import Answer, Api, bom, form_body
from sqlalchemy import update

from silo.bom.text import character_problem, clean_name, with_allowed_characters
from silo_server.db.database import Database
from silo_server.db.tables import bom_lines
from silo_server.run import RunningServer

NON_CHARACTERS = [
    *range(0xFDD0, 0xFDF0),
    *(plane * 0x10000 + last for plane in range(17) for last in (0xFFFE, 0xFFFF)),
]
REFUSED = [
    chr(code)
    for code in (*range(9), 11, 12, *range(14, 32), *range(127, 160), 0xD800, 0xDFFF, *NON_CHARACTERS)
]

Way = Callable[[Api, str], Answer]


def _line(api: Api, **fields: Any) -> Answer:
    parent, child = api.items(2)
    return api.call("POST", bom(parent), {"child_part_number": child, **fields})


def _upload(api: Api, **parts: Any) -> Answer:
    body, headers = form_body({"file": ("a.FCStd", model_file(b"x")), **parts})
    return api.call("POST", f"/api/items/{api.item()}/file", body=body, headers=headers)


def _import(api: Api, note: str) -> Answer:
    parent, child = api.items(2)
    cells = f'Part number,Quantity,Notes\r\n{child},1,"{note}"\r\n'
    return api.call("POST", bom(parent, "import"), body=cells.encode())


def _merge(api: Api, **fields: Any) -> Answer:
    return api.call("POST", bom(api.item(), "merge"), {"entries": [], **fields})


WAYS: dict[str, Way] = {
    "name": lambda api, text: api.call("POST", "/api/items", {"category": "F01", "name": text}),
    "part number": lambda api, text: api.call("POST", "/api/items", {"part_number": f"a{text}b"}),
    "description": lambda api, text: api.call("PUT", f"/api/items/{api.item()}", {"description": text}),
    "property": lambda api, text: api.call("PUT", f"/api/items/{api.item()}", {"properties": {"a": [text]}}),
    "property's name": lambda api, text: api.call("PATCH", f"/api/items/{api.item()}/properties", {text: 1}),
    "comment": lambda api, text: api.call("POST", f"/api/items/{api.item()}/revisions", {"comment": text}),
    "comment of a file": lambda api, text: _upload(api, comment=text),
    "path of a file": lambda api, text: _upload(api, path=text),
    "links of a file": lambda api, text: _upload(
        api, links=json.dumps([{"path": text, "item": "", "sha256": ""}])
    ),
    "notes": lambda api, text: _line(api, notes=text),
    "unit": lambda api, text: _line(api, unit=text),
    "designator": lambda api, text: _line(api, reference_designators=["R1", text]),
    "metadata": lambda api, text: _line(api, metadata={"a": {"b": text}}),
    "cell of a CSV": _import,
    "component left out": lambda api, text: _merge(api, left_out=[{"reason": "missing", "name": text}]),
    "document": lambda api, text: _merge(api, document={"file": text}),
    "reason": lambda api, text: api.call("POST", bom(api.item(), "restore"), {"change": 0, "reason": text}),
    "display name": lambda api, text: api.call("POST", "/api/users", {"username": "u", "display_name": text}),
    "token": lambda api, text: api.call("POST", "/api/auth/tokens", {"name": text}),
}


@pytest.mark.parametrize("way", WAYS)
def test_every_way_in_refuses_them_with_one_sentence(api: Api, way: str) -> None:
    """400, which character it is, and what to do."""
    for code in (0x01, 0x10FFFF):
        answer = WAYS[way](api, f"a{chr(code)}b")
        assert answer.status == 400, answer.body[:300]
        said = json.dumps(answer.json(), ensure_ascii=False)
        assert "without control characters and non-characters" in said
        assert f"U+{code:04X}" in said


def test_the_rule_is_unicodes() -> None:
    """All control characters but tab and line ends, all non-characters, all surrogates; nothing else."""
    refused = {code for code in range(sys.maxunicode + 1) if character_problem(chr(code))}
    control = {code for code in range(sys.maxunicode + 1) if unicodedata.category(chr(code)) == "Cc"}
    assert refused == (control - {9, 10, 13}) | set(NON_CHARACTERS) | set(range(0xD800, 0xE000))


@given(st.text())
def test_a_text_of_any_characters_can_be_made_one_of_allowed_ones(text: str) -> None:
    """As clients do with names of files and labels."""
    assert character_problem(with_allowed_characters(text)) is None
    assert character_problem(clean_name(text)) is None


class _Page(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.seen = ""

    def handle_data(self, data: str) -> None:
        self.seen += data


def test_exports_can_be_read_whatever_is_in_them(api: Api, server: RunningServer) -> None:
    """Each form is parsed again: what is let in, and what older databases may hold."""
    kept = "a\tb é 螺栓 🔩 \u200f\u2028 <b>&amp; ]]> \ufffd \ue000 =1+1"
    parent, child = api.items(2)
    api.good("PUT", f"/api/items/{child}", {"name": kept})
    api.add_line(parent, child, notes="old")
    db = Database(server.settings)
    old = "".join(c for c in REFUSED if c not in "\x00\ud800\udfff")
    with db.write() as tx:
        tx.conn.execute(update(bom_lines).where(bom_lines.c.notes == "old").values(notes=old))
    db.close()
    for view in ("single", "flat"):
        rows = {}
        for form in ("csv", "xlsx", "json"):
            data = api.call("GET", bom(parent, f"export.{form}?view={view}")).body
            if form == "csv":
                rows[form] = next(csv.DictReader(io.StringIO(data.decode("utf-8-sig"), newline="")))["Name"]
            elif form == "xlsx":
                head, row = load_workbook(io.BytesIO(data)).active.iter_rows(values_only=True)
                rows[form] = dict(zip(head, row, strict=True))["Name"]
            else:
                rows[form] = json.loads(data)["lines"][0]["name"]
        assert rows == dict.fromkeys(("csv", "xlsx", "json"), kept)
    page = _Page()
    page.feed(api.call("GET", f"/items/{quote(parent)}/print").body.decode())
    assert "螺栓 🔩" in page.seen
