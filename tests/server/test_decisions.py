# SPDX-License-Identifier: LGPL-2.1-or-later
"""Decisions are about the lines that were seen; a line that changed meanwhile stays as it is."""

from __future__ import annotations

import pytest
from server_testing import merge_body

from silo.bom.errors import VersionConflictError
from silo_server.db.database import Database
from silo_server.db.transaction import Tx
from silo_server.errors import LinesChangedError
from silo_server.services.bom.decisions import Decision, ReviewAction, decide_all, resolve
from silo_server.services.bom.line_edit import change_line
from silo_server.services.bom.lines import lines_of
from silo_server.services.bom.merge import merge_bom
from silo_server.services.bom.merge_request import read_merge_request
from silo_server.services.bom.review import marks_of
from silo_server.services.bom.review import review as review_of
from silo_server.services.items import NewItem, create_item, get_item


def an_unreferenced_line(tx: Tx) -> tuple[str, str]:
    """An assembly, and a part that it no longer uses."""
    parent, part, other = (
        create_item(tx, NewItem(category=category, name=category))[0].part_number
        for category in ("A01", "F01", "F01")
    )
    for entries in ({part: 2, other: 1}, {other: 1}):
        merge_bom(tx, parent, read_merge_request(merge_body(entries), 100), None)
    return parent, part


def quantity_of(tx: Tx, parent: str, part: str) -> float:
    (line,) = (line for line in lines_of(tx, get_item(tx, parent)) if line.child_part_number == part)
    return float(line.state.quantity)


def test_a_line_that_changed_since_it_was_seen_is_not_removed(db: Database) -> None:
    """Another user edited it meanwhile: the decision names the line, and changes nothing."""
    with db.write() as tx:
        parent, part = an_unreferenced_line(tx)
        (line,) = review_of(tx, parent).unreferenced
        seen = marks_of([line], {})[line.id]
        change_line(tx, parent, part, {"quantity": 9.0})
    decision = Decision(part, ReviewAction.REMOVE, None, line.id, seen)
    with db.write() as tx, pytest.raises(LinesChangedError, match="changed meanwhile; nothing was changed"):
        resolve(tx, parent, [decision])
    with db.read() as tx:
        assert quantity_of(tx, parent, part) == 9


def test_one_decision_about_a_whole_bom_needs_the_bom_that_was_seen(db: Database) -> None:
    """What came since the look is not removed with what was looked at."""
    with db.write() as tx:
        parent, part = an_unreferenced_line(tx)
    with db.write() as tx, pytest.raises(VersionConflictError, match="has changed since you looked"):
        decide_all(tx, parent, ReviewAction.REMOVE, None, "the mark of an older look")
    with db.read() as tx:
        assert quantity_of(tx, parent, part) == 2
