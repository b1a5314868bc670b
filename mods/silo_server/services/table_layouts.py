# SPDX-License-Identifier: LGPL-2.1-or-later
"""How users assigned the columns of tables: remembered for files with the same headings.

A file is read as the last import of a file with the same headings was, for all users and through each door.
What a user says of a file itself wins.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence

from sqlalchemy import delete, insert, select

from silo.bom.errors import InputError
from silo.bom.headers import normal
from silo.bom.message import message
from silo.bom.numbers import Mark
from silo.tables.csv_text import DELIMITERS
from silo.tables.kind import TableKind
from silo.tables.sheet import Layout, first_lines
from silo_server.db.rows import one_of
from silo_server.db.tables import table_layouts
from silo_server.db.transaction import Tx
from silo_server.user_json import dumps


def remembered_layout(tx: Tx, kind: str, data: bytes, of: TableKind) -> tuple[Layout | None, tuple[str, ...]]:
    """Find how a file with these headings was read, and the sentence about that; None for a new one."""
    found: dict[str, tuple[str, int]] = {}
    for delimiter, rows in _beginnings(data, of):
        found |= {_key(cells): (delimiter, index) for index, cells in enumerate(rows) if any(cells)}
    row = table_layouts.c
    query = select(table_layouts).where(row.kind == kind, one_of(tx, row.headings, found.keys()))
    known = tx.conn.execute(query.order_by(row.at.desc())).first() if found else None
    if known is None:
        return None, ()
    delimiter, index = found[known.headings]
    said = json.loads(known.layout)
    mark = Mark(said["mark"]) if said["mark"] else None
    note = message(
        "the columns are those that {username} chose for a file with the same headings",
        username=known.username,
    )
    return Layout(delimiter, index, said["columns"], mark), (note,)


def remember_layout(tx: Tx, kind: str, data: bytes, of: TableKind, layout: Layout | None) -> None:
    """Remember how the columns of a file were assigned; None: nothing was assigned."""
    if layout is None:
        return
    rows = dict(_beginnings(data, of)).get(layout.delimiter, ())
    if layout.header >= len(rows):
        return
    this = {"kind": kind, "headings": _key(rows[layout.header])}
    mark = layout.mark.value if layout.mark else None
    said = dumps({"columns": dict(layout.columns), "mark": mark})
    tx.conn.execute(
        delete(table_layouts).where(*(table_layouts.c[name] == text for name, text in this.items()))
    )
    written = {"layout": said, "at": tx.stamp, "username": tx.actor.username}
    tx.conn.execute(insert(table_layouts).values(**this, **written))


def _beginnings(data: bytes, of: TableKind) -> list[tuple[str, Sequence[tuple[str, ...]]]]:
    """Read the first lines of a file with each separator that it may have."""
    found = {}
    for mark in DELIMITERS:
        try:
            delimiter, rows = first_lines(data, "file", of, mark)
        except InputError:
            continue
        found[delimiter if delimiter else ","] = rows
    return [*found.items()]


def _key(cells: Sequence[str]) -> str:
    """Return what files with the same headings have in common; the order of the columns counts."""
    titles = [normal(cell) for cell in cells]
    while titles and not titles[-1]:
        titles.pop()
    return hashlib.sha256(json.dumps(titles).encode()).hexdigest()
