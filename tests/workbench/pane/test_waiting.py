# SPDX-License-Identifier: LGPL-2.1-or-later
"""What waits, as a person reads it: always with its reason, and with what can be done."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from silo.bom.compare.three_states import ThreeLines
from silo.bom.entry import BomEntry
from silo.outbox.entry import Commit, Entry, State
from silo.outbox.store import Store
from silo.workbench.activity.box import Do
from silo.workbench.colleagues.theirs import of_held
from silo.workbench.pane.waiting import WaitingRow, can_send, heading, meant_for_another, rows

HERE = "https://silo.example.com"


def row_of(entry: Entry, **changes: Any) -> WaitingRow:
    """The row of an entry of which this is different."""
    (row,) = rows([replace(entry, **changes)], HERE)
    return row


def asked(row: WaitingRow) -> list[Do]:
    return [action.do for action in row.actions]


@pytest.fixture(name="entry")
def _entry(tmp_path: Path) -> Entry:
    path = tmp_path / "Top.FCStd"
    path.write_bytes(b"x")
    commit = Commit(str(path), 1001.0, "Top", "id", file=path, request="{}")
    return Store(tmp_path / "outbox.sqlite3").add(commit, "HTTPS://Silo.example.com:443/")


def test_what_simply_waits(entry: Entry) -> None:
    """Which document, what of it, since when."""
    row = row_of(entry)
    assert (row.title, row.what, row.since, row.reason) == ("Top", "file and BOM", 1001.0, "")
    assert (row.urgent, row.actions) == (False, ())


def test_what_a_person_must_look_at_comes_first(entry: Entry) -> None:
    """With all four ways out of it, as far as they make sense."""
    held = replace(entry, state=State.HELD, reason="413: too large", bom_left=False)
    first, _ = rows([entry, held], HERE)
    assert (first.urgent, first.reason, first.what) == (True, "413: too large", "file")
    assert asked(first) == [Do.RETRY, Do.SAVE_COPY, Do.DISCARD]
    assert {a.target for a in first.actions} == {str(entry.id)}


def test_a_bom_has_no_copy_to_save(entry: Entry) -> None:
    """Its file has arrived."""
    row = row_of(entry, state=State.HELD, file_left=False, reason="no")
    assert asked(row) == [Do.RETRY, Do.DISCARD]


def test_what_is_meant_for_another_address_says_so(entry: Entry) -> None:
    """And can be sent here, by a person's word only."""
    away = replace(entry, server="http://old.example:80/api")
    row = row_of(away)
    assert row.urgent
    assert row.reason == "It is meant for old.example:80, which is not the server in use."
    assert asked(row) == [Do.SEND_HERE, Do.SAVE_COPY, Do.DISCARD]
    assert meant_for_another([entry, away], HERE) == (away.id,)


def test_without_a_server_nothing_is_meant_for_another(entry: Entry) -> None:
    """All of it waits for settings."""
    assert meant_for_another([entry], "") == ()
    assert not rows([entry], "")[0].urgent


def test_what_is_out_of_date_is_not_offered_again(entry: Entry) -> None:
    """A retry would undo something newer."""
    row = row_of(entry, state=State.HELD, superseded=True, reason="x")
    assert asked(row) == [Do.SAVE_COPY, Do.DISCARD]
    assert "would undo it" in row.reason


def test_a_held_commit_has_the_choices_of_the_dialog(entry: Entry) -> None:
    """Open theirs, take theirs, mine on top; a commit without a path of its own can only go or be dropped."""
    newer = {"revision_number": 2, "created_by": "alice", "comment": "less"}
    held = replace(entry, state=State.HELD, reason="alice committed revision 2", newer=newer)
    row = row_of(held)
    assert [(a.do, a.text) for a in row.actions[:4]] == [
        (Do.OPEN_THEIRS, "Open theirs beside mine"),
        (Do.COMPARE, "Compare with revision 2"),
        (Do.TAKE_THEIRS, "Take theirs"),
        (Do.RETRY, "Commit mine on top"),
    ]
    assert [a.do for a in row.actions[4:]] == [Do.SAVE_COPY, Do.DISCARD]
    row = row_of(held, path="")
    assert asked(row) == [Do.RETRY, Do.SAVE_COPY, Do.DISCARD]
    row = row_of(held, server="http://old.example:80")
    assert asked(row) == [Do.SEND_HERE, Do.SAVE_COPY, Do.DISCARD]


def test_the_reason_that_stands_above_is_not_repeated(entry: Entry) -> None:
    """Without a connection each row would give the same one; what can be done about it stays."""
    failed = replace(entry, reason="nothing answers")
    (row,) = rows([failed], HERE, said="nothing answers")
    assert (row.reason, asked(row)) == ("", [Do.SAVE_COPY, Do.DISCARD])
    assert rows([failed], HERE, said="the disk is full")[0].reason == "nothing answers"


def test_send_now_is_there_only_where_something_can_be_sent(entry: Entry) -> None:
    """What is held waits for a person, and what is meant for another address or no server for settings."""
    held, away = replace(entry, state=State.HELD), replace(entry, server="http://old.example")
    keeping = replace(entry, state=State.KEEPING, server="")
    assert can_send([held, entry], HERE)
    assert can_send([keeping], HERE)
    assert not can_send([held, away], HERE)
    assert not can_send([entry], "")
    assert heading([entry], HERE) == "1 thing waits to be sent"
    assert heading([held], HERE) == "1 thing waits for your choice"
    assert heading([held, away], HERE) == "2 things wait for your choice"
    assert heading([held, entry, entry], HERE) == "3 things wait to be sent, 1 of them for your choice"


def test_a_held_commit_shows_what_each_changed(entry: Entry) -> None:
    """In the words of the dialog, where it is known by now."""
    newer = {"revision_number": 2, "created_by": "alice", "comment": "less"}
    held = replace(entry, state=State.HELD, newer=newer)
    bolt = BomEntry("Bolt.FCStd", label="Bolt", quantity=6)
    theirs = replace(of_held(held), base=1, lines=(ThreeLines(bolt, None, bolt),))
    (row,) = rows([held], HERE, {held.id: theirs})
    assert row.details == ("Bolt: 6 → 0 by them, as before in yours",)
    assert row.more == ()
    placed = replace(theirs, lines=(ThreeLines(bolt, None, replace(bolt, instances=("B1", "B2"))),))
    ((shown,),) = [one.more for one in rows([held], HERE, {held.id: placed})]
    assert (shown.do, shown.document, shown.objects) == (Do.SHOW, held.path, ("B1", "B2"))
    # A long one has its first lines, and a button for all of them.
    (row,) = rows([held], HERE, {held.id: replace(theirs, lines=theirs.lines * 15)})
    assert len(row.details) == 3
    assert [(a.do, a.text, a.target) for a in row.more] == [(Do.DETAILS, "… and 12 more lines", "1")]
    for known in ({}, {held.id: None}):
        assert rows([held], HERE, known)[0].details == ()


def test_what_a_server_that_was_set_back_has_lost_goes_with_retry_all(entry: Entry) -> None:
    """Also where nothing else waits; a colleague's revision is a question for each commit."""
    for newer, can in (({"revision_number": 1, "set_back": True}, True), ({"revision_number": 1}, False)):
        held = replace(entry, state=State.HELD, newer=newer)
        assert can_send([held], HERE) is can
        # Nothing of a colleague's could be taken: the server's revision is an older one of this computer.
        row = row_of(held)
        assert (Do.TAKE_THEIRS not in [one.do for one in row.actions]) is can
        assert ("Retry" in [one.text for one in row.actions]) is can
