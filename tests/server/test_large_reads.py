# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reads that may fill memory and cores take turns; others go on beside them."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import quote

import pytest
from openpyxl import load_workbook
from server_testing import Api

from silo_server.db.engine import Turnstile
from silo_server.routes.context import Server
from silo_server.run import RunningServer, running_server

LARGE = [
    f"export.{form}?view={view}"
    for form in ("csv", "json", "xlsx")
    for view in ("single", "indented", "flat")
]
LARGE += ["expanded", "flat", "cost", "mass"]


@pytest.fixture
def busy(url: str, tmp_path: Path) -> Iterator[tuple[RunningServer, Api, Server]]:
    """A server that waits for nobody."""
    with (
        running_server(url, token="silo_busy", files_dir=tmp_path) as running,
        Api(running.base_url, "silo_busy") as api,
    ):
        parts: Server = running.app.state.server
        running.app.state.server = Server(
            parts.settings,
            parts.db,
            parts.hub,
            parts.files,
            parts.probe,
            Turnstile(1, 0, 0.1, "exports and large reads"),
        )
        yield running, api, running.app.state.server


def test_only_one_large_read_at_a_time(busy: tuple[RunningServer, Api, Server]) -> None:
    """The others get 503 with a sentence and a time; small reads and changes are not concerned."""
    _, api, server = busy
    top, child = api.items(2)
    api.merge(top, {child: 2})
    with server.large_reads.enter():
        for path in LARGE:
            answer = api.call("GET", f"/api/items/{quote(top)}/bom/{path}")
            assert answer.status == 503, path
            assert "too many exports and large reads are waiting" in answer.json()["message"]
            assert answer.headers["retry-after"]
        assert api.get(f"/api/items/{top}/bom")[0]["quantity"] == 2
        api.merge(top, {child: 3})
    for path in LARGE:
        assert api.call("GET", f"/api/items/{quote(top)}/bom/{path}").status == 200, path


def test_every_form_of_an_export_has_the_same_rows(busy: tuple[RunningServer, Api, Server]) -> None:
    """Written row by row, in the order of the tree, with the numbers of its branches."""
    _, api, _ = busy
    top, sub, bolt, nut = api.items(4)
    api.merge(sub, {bolt: 2, nut: 0.5})
    api.merge(top, {sub: 3, nut: 1})
    rows = {}
    for form in ("csv", "xlsx", "json"):
        data = api.call("GET", f"/api/items/{top}/bom/export.{form}?view=indented").body
        if form == "csv":
            table = csv.DictReader(io.StringIO(data.decode("utf-8-sig"), newline=""))
            rows[form] = [(r["Item"], r["Part number"], float(r["Total quantity"])) for r in table]
        elif form == "xlsx":
            head, *body = load_workbook(io.BytesIO(data)).active.iter_rows(values_only=True)
            table_ = [dict(zip(head, row, strict=True)) for row in body]
            rows[form] = [(r["Item"], r["Part number"], r["Total quantity"]) for r in table_]
        else:
            lines = json.loads(data)["lines"]
            rows[form] = [(r["item"], r["part_number"], r["total_quantity"]) for r in lines]
    wanted = [("1", sub, 3), ("1.1", bolt, 6), ("1.2", nut, 1.5), ("2", nut, 1)]
    assert rows == {"csv": wanted, "xlsx": wanted, "json": wanted}
