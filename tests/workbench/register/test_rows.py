# SPDX-License-Identifier: LGPL-2.1-or-later
"""The rows of the Register Parts dialog while a person edits them."""

from __future__ import annotations

import pytest

from silo.bom.model import BomEntry
from silo.bom.resolve import Categories, Proposal
from silo.registering.offer import Candidate, Offer, Similar, State
from silo.workbench.register.flow import ASK, NEW, SAME, EditedRow, choose, notices, number_texts, retype

NUMBERS = {"M01": "M01-0007"}


def row(
    file: str, *, state: State = State.READY, same_as: str = "", similar: tuple[Similar, ...] = ()
) -> EditedRow:
    entry = BomEntry(f"vault/{file}.FCStd", silo_uuid="one" if same_as else None, label=file)
    proposal = Proposal(entry, file, "part", "M01")
    return EditedRow.of(Candidate(proposal, state, same_as=same_as, similar=similar))


def test_a_new_part_shows_the_number_that_it_would_get() -> None:
    """The first of a category gets the next number; what comes after it gets a later one."""
    assert number_texts([row("A"), row("B")], NUMBERS) == ["M01-0007 (new)", "M01-0007 or later"]


def test_a_person_learns_that_look_alikes_were_not_looked_for() -> None:
    """And of mistakes in the site's rules, each in a line of its own."""
    assert notices(Offer((), {})) == ""
    told = notices(Offer((), Categories({}, problem="line 3"), unsearched="the index\nis broken"))
    assert [line.partition(": ")[2] for line in told.splitlines()] == ["line 3", "the index is broken"]


def test_what_cannot_be_registered_is_promised_no_number() -> None:
    """A read-only file gets none, and takes none from the others."""
    rows = [row("A", state=State.READ_ONLY), row("B")]
    assert number_texts(rows, NUMBERS) == ["", "M01-0007 (new)"]
    assert (rows[0].can_register, rows[0].can_choose, rows[0].checked) == (False, False, False)


def test_an_item_that_has_this_very_file_is_not_doubled_by_default() -> None:
    """A person has to look first; the item can be joined instead."""
    one = row("A", similar=(Similar("M01-0001", "id", "A", same_file=True),))
    assert not one.checked
    assert list(one.choices()) == [NEW, "M01-0001"]
    choose([one], one, "M01-0001")
    assert one.checked
    existing = one.order().existing
    assert existing is not None
    assert existing.part_number == "M01-0001"


def test_a_copied_identity_is_a_question_until_it_is_answered() -> None:
    """Nothing is decided by pressing Register for other rows."""
    rows = [row("A", same_as="M01-0001"), row("B", same_as="M01-0001")]
    for one in rows:
        assert (one.number, one.checked, one.can_register, one.can_keep) == (ASK, False, False, False)
        assert one.can_choose
        assert list(one.choices()) == [SAME, NEW]


def test_the_same_part_is_said_of_all_files_of_an_identity() -> None:
    """One answer for the group; others are not touched."""
    rows = [row("A", same_as="M01-0001"), row("B", same_as="M01-0001"), row("C", same_as="M01-0002")]
    choose(rows, rows[0], SAME)
    assert [one.number for one in rows] == [SAME, SAME, ASK]
    assert [one.can_keep for one in rows] == [True, True, False]
    rows[0].keep()
    assert rows[0].finished
    assert rows[0].note()[0] == "stays as it is"
    assert number_texts(rows, NUMBERS)[0] == "M01-0001"


def test_where_all_others_are_new_parts_the_last_one_keeps_the_number() -> None:
    """With three files, the question stays open for two of them until they are answered too."""
    rows = [row(name, same_as="M01-0001") for name in "ABC"]
    choose(rows, rows[2], NEW)
    assert [one.number for one in rows] == [ASK, ASK, NEW]
    choose(rows, rows[1], NEW)
    assert [one.number for one in rows] == [SAME, NEW, NEW]


def test_a_read_only_copy_can_be_kept_but_not_made_new() -> None:
    """Keeping writes nothing into the file."""
    one = row("A", state=State.READ_ONLY, same_as="M01-0001")
    assert list(one.choices()) == [SAME]
    choose([one], one, SAME)
    assert one.can_keep
    assert not one.can_register


@pytest.mark.parametrize("name", ["", "  "])
def test_a_part_needs_a_name(name: str) -> None:
    """Without one there is nothing to register."""
    one = row("A")
    one.name = name
    assert not one.can_register


def test_the_category_follows_the_type() -> None:
    """An assembly's category for an assembly, unless the person has chosen one."""
    categories = {"A01": "Assemblies", "M01": "Machined parts", "M02": "Sheet metal parts"}
    one = row("Mount")
    retype(one, "assembly", categories)
    assert (one.item_type, one.category) == ("assembly", "A01")
    retype(one, "part", categories)
    assert one.category == "M01"
    one.category = "M02"
    retype(one, "assembly", categories)
    assert one.category == "M02"
