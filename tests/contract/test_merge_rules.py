# SPDX-License-Identifier: LGPL-2.1-or-later
"""The merge-rule table of bom-sync.md §4, row by row, and who owns a line."""

from __future__ import annotations

from typing import Any

import pytest
from server_testing import Api, bom

HUMAN_FIELDS: dict[str, Any] = {
    "notes": "torque 12 Nm",
    "reference_designators": ["B1", "B2"],
    "find_number": "10",
    "unit": "pcs",
    "metadata": {"bin": "A-7", "checked": True},
    "child_revision": 3,
}


def test_added(api: Api) -> None:
    """Added: in the assembly, not on the server → a new line of source assembly."""
    parent, a = api.items(2)
    answer = api.merge(parent, {a: 4})
    assert answer["diff"]["added"] == [{"part_number": a, "quantity": 4}]
    line = api.lines(parent)[a]
    assert (line["quantity"], line["source"], line["unreferenced_since"]) == (4, "assembly", None)


def test_quantity_changed(api: Api) -> None:
    """Quantity changed → the line takes the assembly's quantity."""
    parent, a = api.items(2)
    api.merge(parent, {a: 4})
    answer = api.merge(parent, {a: 6})
    assert answer["diff"]["quantity_changed"] == [{"part_number": a, "old_quantity": 4, "new_quantity": 6}]
    assert api.quantities(parent) == {a: 6}


def test_removed(api: Api) -> None:
    """Removed → NOT deleted: it stays as it is, flagged since when, and is warned of."""
    parent, a, b = api.items(3)
    api.merge(parent, {a: 4, b: 1})
    answer = api.merge(parent, {b: 1})
    assert answer["diff"]["removed"] == [{"part_number": a, "quantity": 4}]
    assert [(w["type"], w["part_number"]) for w in answer["warnings"]] == [("unreferenced", a)]
    lines = api.lines(parent)
    assert lines[a]["quantity"] == 4
    assert lines[a]["unreferenced_since"] is not None
    assert lines[b]["unreferenced_since"] is None


def test_removed_keeps_since_when(api: Api) -> None:
    """A line that stays unreferenced keeps the time it became so; each merge warns again."""
    parent, a = api.items(2)
    api.merge(parent, {a: 1})
    api.merge(parent, {})
    first = api.lines(parent)[a]["unreferenced_since"]
    answer = api.merge(parent, {})
    assert len(answer["warnings"]) == 1
    assert api.lines(parent)[a]["unreferenced_since"] == first


def test_referenced_again(api: Api) -> None:
    """Referenced again → the flag goes, the line (and its id) stays the same one."""
    parent, a = api.items(2)
    api.merge(parent, {a: 1})
    line_id = api.lines(parent)[a]["id"]
    api.merge(parent, {})
    answer = api.merge(parent, {a: 1})
    line = api.lines(parent)[a]
    assert (line["id"], line["unreferenced_since"]) == (line_id, None)
    assert answer["diff"]["unchanged"] == [{"part_number": a, "quantity": 1}]
    assert answer["warnings"] == []


def test_unchanged(api: Api) -> None:
    """Unchanged → no action: no line, no version changes."""
    parent, a = api.items(2)
    first = api.call("POST", bom(parent, "merge"), {"entries": [{"child_part_number": a, "quantity": 2}]})
    before = api.lines(parent)
    again = api.call("POST", bom(parent, "merge"), {"entries": [{"child_part_number": a, "quantity": 2}]})
    assert again.json()["diff"]["unchanged"] == [{"part_number": a, "quantity": 2}]
    assert again.json()["diff"]["added"] == []
    assert api.lines(parent) == before
    assert again.headers["etag"] == first.headers["etag"]


def own_words(lines: dict[str, Any]) -> dict[str, Any]:
    """The lines without what the server knows that the assembly says of them."""
    told = ("assembly_told", "assembly_quantity")
    return {child: {k: v for k, v in line.items() if k not in told} for child, line in lines.items()}


@pytest.mark.parametrize("cad", [{}, {"same": 2}, {"other": 5}], ids=["absent", "same", "other quantity"])
def test_manual_lines_never_change(api: Api, cad: dict[str, float]) -> None:
    """A manual line is the same, key by key, whatever the assembly says."""
    parent, a = api.items(2)
    api.good("POST", bom(parent), {"child_part_number": a, "quantity": 2, **HUMAN_FIELDS})
    before = own_words(api.lines(parent))
    answer = api.merge(parent, dict.fromkeys([a] * len(cad), sum(cad.values())))
    assert own_words(api.lines(parent)) == before
    assert answer["diff"]["removed"] == []
    assert answer["diff"]["added"] == []
    assert answer["diff"]["quantity_changed"] == []
    if "same" in cad:
        assert answer["diff"]["unchanged"] == [{"part_number": a, "quantity": 2}]
    expected = [("conflict", a, 5, 2)] if "other" in cad else []
    told = [
        (w["type"], w["part_number"], w["assembly_quantity"], w["server_quantity"])
        for w in answer["warnings"]
    ]
    assert told == expected


def test_what_people_wrote_on_an_assembly_line_survives(api: Api) -> None:
    """Notes, reference designators, find number, unit, metadata and the line's id survive every merge."""
    parent, a = api.items(2)
    api.merge(parent, {a: 2})
    before = api.good("PUT", bom(parent, a), HUMAN_FIELDS)
    assert before["source"] == "assembly"
    for cad in ({a: 9.0}, {}, {a: 1.0}):
        api.merge(parent, cad)
    after = api.lines(parent)[a]
    assert {key: after[key] for key in HUMAN_FIELDS} == HUMAN_FIELDS
    assert after["id"] == before["id"]
    assert (after["quantity"], after["source"]) == (1, "assembly")


def test_alternates_and_references_belong_to_people(api: Api) -> None:
    """A line that is no component is left alone; the component of the same item is a line of its own."""
    parent, a = api.items(2)
    api.good("POST", bom(parent), {"child_part_number": a, "quantity": 1, "rel_type": "alternate"})
    answer = api.merge(parent, {a: 3})
    assert answer["diff"]["added"] == [{"part_number": a, "quantity": 3}]
    lines = {line["rel_type"]: line for line in api.get(bom(parent))}
    assert (lines["alternate"]["quantity"], lines["component"]["quantity"]) == (1, 3)
    answer = api.merge(parent, {})
    assert answer["diff"]["removed"] == [{"part_number": a, "quantity": 3}]


def test_part_numbers_are_found_whatever_their_case(api: Api) -> None:
    """A part number in another case is the same item, in merges too."""
    parent = api.item()
    number = api.item()
    api.merge(parent, {number.lower(): 1})
    answer = api.merge(parent.lower(), {number.upper(): 1})
    assert answer["diff"]["unchanged"] == [{"part_number": number, "quantity": 1}]
    assert answer["resolve_url"] == f"/items/{parent}/bom"


def test_one_child_twice_is_summed(api: Api) -> None:
    """Two entries of one child are one line with the summed quantity."""
    parent, a = api.items(2)
    entries = [{"child_part_number": a, "quantity": 2}, {"child_part_number": a.lower(), "quantity": 3}]
    answer = api.good("POST", bom(parent, "merge"), {"entries": entries})
    assert answer["diff"]["added"] == [{"part_number": a, "quantity": 5}]


def test_a_person_s_quantity_becomes_an_override_that_merges_report(api: Api) -> None:
    """Editing an assembly line makes it manual and remembers what CAD said; merges then leave it and warn."""
    parent, a = api.items(2)
    api.merge(parent, {a: 4})
    edited = api.good("PUT", bom(parent, a), {"quantity": 6})
    assert (edited["source"], edited["override"], edited["cad_quantity"]) == ("manual", True, 4)
    answer = api.merge(parent, {a: 4})
    assert answer["warnings"] == [
        {
            "type": "conflict",
            "part_number": a,
            "message": "The assembly has 4, Silo has 6 (set by a person); a person decides",
            "assembly_quantity": 4,
            "server_quantity": 6,
        }
    ]
    assert api.quantities(parent) == {a: 6}
    review = api.get(bom(parent, "review"))
    assert [(c["assembly_quantity"], c["server_quantity"]) for c in review["conflicts"]] == [(4, 6)]


def test_giving_the_assembly_s_quantity_back_ends_the_override(api: Api) -> None:
    """The edit taken back by hand: the line is the assembly's again."""
    parent, a = api.items(2)
    api.merge(parent, {a: 4})
    api.good("PUT", bom(parent, a), {"quantity": 6})
    back = api.good("PUT", bom(parent, a), {"quantity": 4})
    assert (back["source"], back["override"], back["cad_quantity"]) == ("assembly", False, None)


def test_an_override_that_left_the_assembly_is_reported(api: Api) -> None:
    """A person changed the quantity, then CAD dropped the part: the line stays, and is reported."""
    parent, a = api.items(2)
    api.merge(parent, {a: 4})
    api.good("PUT", bom(parent, a), {"quantity": 6})
    answer = api.merge(parent, {})
    assert [(w["type"], w["assembly_quantity"]) for w in answer["warnings"]] == [("conflict", 0)]
    assert answer["diff"]["removed"] == []
    assert api.quantities(parent) == {a: 6}
