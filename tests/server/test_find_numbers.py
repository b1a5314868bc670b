# SPDX-License-Identifier: LGPL-2.1-or-later
"""BOMs that are older than find numbers get theirs with the next merge, and keep them."""

from __future__ import annotations

from server_testing import Api, bom
from sqlalchemy import update

from silo_server.db.tables import bom_change_lines, bom_lines
from silo_server.run import RunningServer


def numbers(api: Api, parent: str) -> dict[str, str | None]:
    """Part number → find number of a BOM."""
    return {line["child_part_number"]: line["find_number"] for line in api.get(bom(parent))}


def test_an_older_bom_gets_its_numbers_and_keeps_them(server: RunningServer, api: Api) -> None:
    """In the order of its lines; an undo, or the restore of a state without numbers, leaves them there."""
    top, a, b, c = api.items(4)
    api.merge(top, {a: 1, b: 1})
    before = api.get(bom(top, "history"))[0]["id"]
    # As the server wrote them before lines had numbers.
    with server.app.state.server.db.write() as tx:
        line = bom_change_lines.c
        tx.conn.execute(update(bom_lines).values(find_number=None))
        for row in tx.conn.execute(bom_change_lines.select().where(line.change_id == before)).all():
            after = row.after.replace(',"find_number":"10"', "").replace(',"find_number":"20"', "")
            assert after != row.after
            of_line = (line.change_id == before) & (line.line_id == row.line_id)
            tx.conn.execute(update(bom_change_lines).where(of_line).values(after=after))
    assert numbers(api, top) == {a: None, b: None}
    api.merge(top, {a: 5, b: 1, c: 1})
    assert numbers(api, top) == {a: "10", b: "20", c: "30"}
    merge = api.get(bom(top, "history"))[0]["id"]
    api.good("POST", bom(top, "undo"), {"change_id": merge})
    assert numbers(api, top) == {a: "10", b: "20"}
    assert api.quantities(top) == {a: 1, b: 1}
    api.merge(top, {a: 5, b: 1, c: 1})
    api.good("POST", bom(top, "restore"), {"change_id": before})
    assert numbers(api, top) == {a: "10", b: "20"}
    assert api.quantities(top) == {a: 1, b: 1}
