# SPDX-License-Identifier: LGPL-2.1-or-later
"""The rows of the Register Parts dialog while a person edits them."""

from __future__ import annotations

import pytest

from silo.bom.entry import BomEntry
from silo.bom.items.proposal import Proposal
from silo.bom.items.schema import Categories
from silo.registering.candidate import Candidate, ComponentState, Similar
from silo.registering.offer import Offer
from silo.workbench.register.rows import (
    ASK,
    NEW,
    SAME,
    EditedRow,
    Filter,
    choose,
    grouped,
    headings,
    notices,
    number_texts,
    retype,
    set_all,
)

NUMBERS = {"M01": "M01-0007"}


def row(
    file: str,
    *,
    state: ComponentState = ComponentState.READY,
    same_as: str = "",
    similar: tuple[Similar, ...] = (),
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
    rows = [row("A", state=ComponentState.READ_ONLY), row("B")]
    assert number_texts(rows, NUMBERS) == ["", "M01-0007 (new)"]
    assert (rows[0].can_register, rows[0].can_choose, rows[0].checked) == (False, False, False)


def test_an_item_that_has_this_very_file_is_not_doubled_by_default() -> None:
    """A person has to look first; the item can be joined instead."""
    one = row("A", similar=(Similar("M01-0001", "id", "A", same_file=True),))
    assert not one.checked
    assert list(one.choices()) == [NEW, "M01-0001"]
    choose([one], one, "M01-0001")
    assert one.checked
    existing = one.request().existing
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
    one = row("A", state=ComponentState.READ_ONLY, same_as="M01-0001")
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


def test_one_value_is_set_for_all_chosen_rows() -> None:
    """Names count; a category that a person sets is no guess; finished and standard ones stay as they are."""
    rows = [row("Left"), row("Right"), row("Fixed", state=ComponentState.READ_ONLY)]
    rows[0].checked = False
    set_all(rows, "name", "Jaw {n} ({name})", {})
    assert [one.name for one in rows] == ["Jaw 1 (Left)", "Jaw 2 (Right)", "Fixed"]
    set_all(rows, "category", "M02", {})
    assert [(one.category, one.checked) for one in rows] == [("M02", True), ("M02", True), ("M01", False)]
    set_all(rows[:1], "supplier", "Misumi", {})
    made = [one.request().proposal for one in rows]
    assert [(one.sourcing, one.supply) for one in made[:2]] == [
        ("purchased", {"supplier": "Misumi"}),
        ("", {}),
    ]
    set_all(rows[:1], "sourcing", "manufactured", {})
    assert rows[0].request().supplier == ""


@pytest.mark.parametrize(
    ("only", "words", "shown"),
    [
        (Filter.ALL, "", "ABC"),
        (Filter.ALL, "b", "B"),
        (Filter.ALL, "b m01", "B"),
        (Filter.NEW, "", "AC"),
        (Filter.DUPLICATES, "", "B"),
        (Filter.UNSURE, "", "BC"),
    ],
)
def test_rows_are_filtered(only: Filter, words: str, shown: str) -> None:
    same = Similar("M01-0001", "id", "B", same_file=True)
    rows = [row("A"), row("B", similar=(same,)), row("C", state=ComponentState.READ_ONLY)]
    assert "".join(one.name for one in rows if one.fits(only, words)) == shown


def test_rows_of_a_folder_stand_together_with_that_of_the_assembly_last() -> None:
    """One folder has no heading of its own."""
    order = [row(name).candidate for name in ("a/1", "top", "b/2", "a/3", "main")]
    rows = [EditedRow.of(one) for one in grouped(order)]
    assert [one.name for one in rows] == ["a/1", "a/3", "b/2", "top", "main"]
    texts = headings(rows)
    assert (texts[0], texts[0] == texts[1], len(set(texts))) == ("vault/a", True, 3)
    assert headings(rows[:2]) == ["Components"] * 2
