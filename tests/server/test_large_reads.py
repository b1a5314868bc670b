# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reads that may fill memory and cores take turns; others go on beside them."""

from __future__ import annotations

import csv
import io
import json
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast
from urllib.parse import quote

import pytest
from fastapi import Request
from openpyxl import load_workbook
from server_testing import Answer, Api, sqlite_database, wait_until

from silo.bom.errors import BusyError
from silo_server.actors import SYSTEM
from silo_server.db.transaction import Tx
from silo_server.db.turnstile import Turnstile
from silo_server.routes.call import Call, Server
from silo_server.routes.made_files import file_of
from silo_server.run import RunningServer, running_server
from silo_server.services.items import get_item
from silo_server.services.product.export import Export, Row, View
from silo_server.services.product.export_files import to_csv, to_json, to_xlsx

ITEM = "/api/items/{number}"
LARGE = [
    f"{ITEM}/bom/export.{form}?view={view}"
    for form in ("csv", "json", "xlsx")
    for view in ("single", "indented", "flat")
]
LARGE += [f"{ITEM}/bom/{name}" for name in ("expanded", "flat", "cost", "mass")]
LARGE += [f"{ITEM}/bom/changes{form}?from=2020-01-01" for form in ("", ".csv", ".xlsx")]
LARGE += [f"{ITEM}/order", f"{ITEM}/order.csv", f"{ITEM}/order.xlsx"]
LARGE += [f"/items/{{number}}/{page}" for page in ("changes", "order", "print")]
LARGE += [f"POST {ITEM}/releases", f"{ITEM}/scene"]


@pytest.fixture
def busy(tmp_path: Path) -> Iterator[tuple[RunningServer, Api, Server]]:
    """A server that waits for nobody."""
    with (
        running_server(sqlite_database(tmp_path / "x.db"), token="silo_busy") as running,
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

    def ask(asked: str) -> Answer:
        method, path = asked.split() if " " in asked else ("GET", asked)
        return api.call(method, path.format(number=quote(top)), {} if method == "POST" else None)

    with server.large_reads.enter():
        for path in LARGE:
            answer = ask(path)
            assert answer.status == 503, path
            assert "too many exports and large reads are waiting" in answer.json()["message"]
            assert answer.headers["retry-after"]
        assert api.get(f"/api/items/{top}/bom")[0]["quantity"] == 2
        api.merge(top, {child: 3})
    for path in LARGE:
        # A product without a file has no scene.
        assert ask(path).status in ((404,) if path.endswith("scene") else (200, 201)), path


def test_every_form_of_an_export_has_the_same_rows(busy: tuple[RunningServer, Api, Server]) -> None:
    """Written row by row, in the order of the tree, with the numbers of its branches."""
    _, api, _ = busy
    top, sub, bolt, nut = api.items(4)
    api.merge(sub, {bolt: 2, nut: 0.5})
    api.merge(top, {sub: 3, nut: 1})
    rows = {}
    for form in ("csv", "xlsx", "json"):
        answer = api.call("GET", f"/api/items/{top}/bom/export.{form}?view=indented")
        data = answer.body
        # It is streamed from the disk; a client still knows how much is to come.
        assert int(answer.headers["content-length"]) == len(data)
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


@pytest.mark.parametrize("write", [to_csv, to_json, to_xlsx])
def test_an_export_ends_with_the_server(busy: tuple[RunningServer, Api, Server], write: Any) -> None:
    """With its next row, and no other one begins."""
    _, api, server = busy
    (number,) = api.items(1)
    call = Call(cast(Request, None), server, SYSTEM)
    taken: list[int] = []

    def make(tx: Tx) -> Export:
        def rows() -> Iterator[Row]:
            for count in range(100_000):
                taken.append(count)
                yield {"Quantity": count}
                server.large_reads.close()

        return Export(get_item(tx, number), View.SINGLE, rows())

    with pytest.raises(BusyError, match="the server is stopping"):
        file_of(call, make, write, "", "bom")
    assert taken == [0, 1]
    assert api.call("GET", f"/api/items/{quote(number)}/bom/export.csv").status == 503


def test_who_waits_for_a_large_read_goes_with_the_server() -> None:
    """At once, whatever it waited for; also what is packed by then goes no further."""
    turn = Turnstile(1, 1, 600, "exports and large reads")
    told: list[BaseException] = []

    def enter() -> None:
        try:
            with turn.enter():
                raise AssertionError
        except BusyError as error:
            told.append(error)

    with turn.enter():
        other = threading.Thread(target=enter)
        other.start()
        wait_until(lambda: turn.here == 2, "the other one waits")
        turn.close()
        other.join(60)
    assert [str(one) for one in told] == ["the server is stopping; try again later"]
