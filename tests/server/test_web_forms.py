# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a form changes where others changed the same thing meanwhile: laws of the three-way comparison."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from silo.bom.errors import RejectedError
from silo_server.values import LineState
from silo_server.web.forms import AmbiguousError, amount, compared
from silo_server.web.line_form import LineForm, edit_of, shown, values_of

FIELDS = ("quantity", "unit", "notes")
texts = st.fixed_dictionaries({name: st.sampled_from(["", "1", "2"]) for name in FIELDS})


@given(now=texts, seen=texts, typed=texts)
def test_every_field_is_mine_theirs_or_asked_about(
    now: dict[str, str], seen: dict[str, str], typed: dict[str, str]
) -> None:
    """Nothing typed is lost and nothing of others is reverted: each field against its definition."""
    edit = compared(now, seen, typed)
    for name in FIELDS:
        changed, moved = typed[name] != seen[name], now[name] != seen[name]
        assert (name in edit.mine) == (changed and not moved)
        assert (name in edit.clashes) == (changed and moved and typed[name] != now[name])
        assert (name in edit.theirs) == (moved and not changed)
    assert all(edit.mine[name] == typed[name] for name in edit.mine)


@given(now=texts, seen=texts, typed=texts)
def test_fields_that_belong_together_clash_together(
    now: dict[str, str], seen: dict[str, str], typed: dict[str, str]
) -> None:
    """6 pieces and 4 m are no 6 m: a unit of mine never joins a quantity of theirs unasked."""
    edit = compared(now, seen, typed, together=[("quantity", "unit")])
    after = {**now, **edit.mine}
    pair = (after["quantity"], after["unit"])
    assert ("quantity" in edit.clashes) == ("unit" in edit.clashes)
    if "quantity" not in edit.clashes:
        assert pair in [(form["quantity"], form["unit"]) for form in (now, typed)]


def test_fields_that_were_not_sent_stay() -> None:
    """A form of one field changes one field."""
    assert dict(compared({"a": "1", "b": "2"}, {}, {"a": "5"}).mine) == {"a": "5"}


@pytest.mark.parametrize(
    ("typed", "seen", "mine"),
    [
        ({"quantity": "4.0"}, {"quantity": "4"}, {}),  # the same number
        ({"quantity": "4,5"}, {"quantity": "4.5"}, {}),
        ({"quantity": "5"}, {"quantity": "4"}, {"quantity": "5"}),
        ({"unit": "ab"}, {"unit": "a\nb"}, {}),  # an input of one line drops the break
        ({"notes": "a b"}, {"notes": "a\nb"}, {"notes": "a b"}),
        ({"notes": "a\nb"}, {"notes": " a\r\nb\n"}, {}),
        ({"unit": "m"}, {"unit": "m "}, {}),
        ({"reference_designators": "R1, R2"}, {"reference_designators": "R1 R2"}, {}),
    ],
)
def test_what_only_looks_different_is_no_change(
    typed: dict[str, str], seen: dict[str, str], mine: dict[str, str]
) -> None:
    """Only what a person meant to change is written."""
    line = LineState(4.0, "assembly")
    now = {**shown(line), **seen}
    state = LineState(
        amount(now["quantity"]),
        "assembly",
        unit=now["unit"] or None,
        notes=now["notes"] or None,
        reference_designators=tuple(now["reference_designators"].split()),
    )
    assert dict(edit_of(LineForm(typed, seen), state).mine) == mine


def test_a_choice_that_was_asked_for_must_be_made() -> None:
    """Saving again is none."""
    line = LineState(6.0, "manual")
    with pytest.raises(RejectedError, match="choose yours or theirs"):
        edit_of(LineForm({"quantity": "8"}, {"quantity": "6"}, asked=["quantity"]), line)
    theirs = LineForm({"quantity": "8"}, {"quantity": "6"}, {"quantity": "theirs"}, ["quantity"])
    assert edit_of(theirs, line).mine == {}
    # Somebody was quicker once more: the choice was about another number.
    mine = LineForm({"quantity": "8"}, {"quantity": "6"}, {"quantity": "mine"}, ["quantity"])
    assert list(edit_of(mine, LineState(7.0, "manual")).clashes) == ["quantity", "unit"]


def test_two_readings_are_given_with_the_refusal() -> None:
    """So that the page can ask."""
    with pytest.raises(AmbiguousError) as refused:
        amount("1.000")
    assert refused.value.readings == ("1000", "1")
    with pytest.raises(RejectedError, match="Quantity"):
        values_of({"quantity": "many"})
    with pytest.raises(RejectedError, match="at most 32"):
        values_of({"unit": "x" * 33})
