# SPDX-License-Identifier: LGPL-2.1-or-later
"""The pages on which a company's tables come in: parts, categories, prices, a BOM; each checked first, each
with an *Undo*.
"""

from __future__ import annotations

import html
import re

import pytest
from server_testing import Answer, Api, form_body
from web_visitor import HTML, Visitor

PARTS = (
    "IPN;Name;Category;Units;Stock\nP/1;Hülse;Drehteile;m;3\nP#2;Blech;?;pcs;\nP/1;Hülse, lang;Drehteile;m;\n"
)


def choose(visitor: Visitor, path: str, text: str, name: str = "table.csv") -> Answer:
    """A file chosen in the form of a page."""
    body, headers = form_body({"csrf_token": visitor.csrf, "file": (name, text.encode())})
    return visitor.api.call("POST", path, body=body, headers={"Cookie": visitor.cookie, **HTML, **headers})


def fields(page: str, action: str) -> dict[str, str]:
    """The hidden fields of the form with this action."""
    form = re.search(rf'<form method="post" action="{re.escape(action)}"(?! enctype).*?</form>', page, re.S)
    assert form is not None, action
    found = re.findall(r'<input type="hidden" name="([^"]+)" value="([^"]*)"', form[0])
    return {name: html.unescape(value) for name, value in found if name != "csrf_token"}


def test_parts_come_in_by_their_page(api: Api, visitors: dict[str, Visitor]) -> None:
    """Questions first; what the user allows; the import; and all of it back."""
    visitor = visitors["editor"]
    checked = choose(visitor, "/items/import/check", PARTS).body.decode()
    assert "stands in the file more than once" in checked
    assert "there is no category" in checked
    assert 'id="unused"' in checked
    carried = fields(checked, "/items/import/check")
    allowed = visitor.post(
        "/items/import/check", **{**carried, "category": "M01", "duplicates": "new"}
    ).body.decode()
    assert "3 to add, 0 to change" in allowed
    done = visitor.post("/items/import", **fields(allowed, "/items/import"))
    assert done.status == 303
    assert api.get("/api/items/P~2F1")["unit"] == "m"
    again = choose(visitor, "/items/import/check", PARTS).body.decode()
    after = visitor.post(
        "/items/import/check", **{**fields(again, "/items/import/check"), "duplicates": "new"}
    )
    assert "3 rows are the same as in Silo" in after.body.decode()
    page = visitor.get("/items/import").body.decode()
    assert visitor.post("/imports/undo", **fields(page, "/imports/undo")).status == 303
    api.bad(404, "GET", "/api/items/P~2F1")
    assert visitors["viewer"].post("/imports/undo", **{"import": "1"}).status == 403


def test_columns_that_were_assigned_are_remembered(api: Api, visitors: dict[str, Visitor]) -> None:
    """For a file with the same headings, through each door; another heading is a new file."""
    visitor = visitors["editor"]
    table = "Kode,Text\nQ-1,one\n"
    checked = choose(visitor, "/items/import/check", table).body.decode()
    chosen = {**fields(checked, "/items/import/check"), "header": "0", "delimiter": ",", "mark": ""}
    chosen |= {"column_part_number": "0", "column_name": "1"}
    shown = visitor.post("/items/import/check", **chosen).body.decode()
    assert visitor.post("/items/import", **fields(shown, "/items/import")).status == 303
    assert api.get("/api/items/Q-1")["name"] == "one"
    sent = api.good("POST", "/api/items/import?dry_run=1", body=b"Kode,Text\nQ-1,two\n")
    assert sent["rows"][0]["changes"] == {"name": {"before": "one", "after": "two"}}
    assert any("chose for a file with the same headings" in note for note in sent["notes"])
    assert "1 to change" in choose(visitor, "/items/import/check", "Kode,Text\nQ-1,two\n").body.decode()
    api.bad(400, "POST", "/api/items/import?dry_run=1", body=b"Kode,Texte\nQ-1,two\n")


@pytest.fixture
def shipped(api: Api) -> str:
    """The categories as they come with the server; each test leaves them so."""
    return api.call("GET", "/api/categories/export.csv").body.decode()


def test_categories_are_the_sites_own(api: Api, visitors: dict[str, Visitor], shipped: str) -> None:
    """A page and a file: prefix, digits, parent, standard parts; items keep theirs, and an editor cannot."""
    old = api.good("POST", "/api/items", {"category": "F01", "name": "old"})["part_number"]
    own = (
        "Code,Name,Prefix,Digits,Parent,Item type,Standard parts\n"
        'NT,Normteile,NT-,3,,,\nNS,Schrauben,S.,6,Normteile,,"screw, nut"\nBG,Baugruppen,BG,2,,assembly,\n'
    )
    assert visitors["editor"].post("/categories").status == 403
    admin = visitors["admin"]
    checked = choose(admin, "/categories/check", own).body.decode()
    assert "F01" in re.findall(r'id="kept">.*?</p>', checked)[0]
    assert admin.post("/categories", **fields(checked, "/categories")).status == 303
    made = api.good("POST", "/api/items", {"category": "ns", "name": "new"})
    assert (made["part_number"], made["category"]) == ("S.000001", "NS")
    assert api.good("POST", "/api/items", {"category": "BG", "name": "b"})["item_type"] == "assembly"
    api.bad(400, "POST", "/api/items", {"category": "M02", "name": "none"})
    assert api.get(f"/api/items/{old}")["category"] == "F01"
    (schema,) = api.get("/api/schemas")
    assert schema["standard_parts"] == {"screw": "NS", "nut": "NS"}
    shown = re.sub("<[^>]+>", "", visitors["viewer"].get("/categories").body.decode())
    assert "Normteile › Schrauben" in shown
    rows = api.good("POST", "/api/items/import", body=b"Name,Category\nx,Normteile/Schrauben\n")["rows"]
    assert rows[0]["status"] == "add"
    sent = api.call("GET", "/api/categories/export.csv").body
    rows = api.good("POST", "/api/categories/import", body=sent)["rows"]
    assert {row["status"] for row in rows} == {"same"}
    wrong = "Code,Name,Parent,Digits\nA,a,B,4\nB,b,A,4\nC,c,,0\nA,again,,4\n"
    assert len(api.bad(400, "POST", "/api/categories/import", body=wrong.encode())["problems"]) >= 3
    api.good("POST", "/api/categories/import", body=shipped.encode())
    assert api.good("POST", "/api/items", {"category": "M01", "name": "m"})["part_number"].startswith("M01-")
