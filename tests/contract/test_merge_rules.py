# SPDX-License-Identifier: LGPL-2.1-or-later
"""The merge-rule table of bom-sync.md §4, row by row, and who owns a line."""

from __future__ import annotations

from typing import Any

from server_testing import Api, bom

HUMAN_FIELDS: dict[str, Any] = {
    "notes": "torque 12 Nm",
    "reference_designators": ["B1", "B2"],
    "find_number": "10",
    "unit": "pcs",
    "metadata": {"bin": "A-7", "checked": True},
    "child_revision": 3,
}


def test_the_rows_of_the_table(api: Api) -> None:
    """Added, quantity changed, removed (flagged, and warned of at each merge), again, unchanged."""
    parent, a, b = api.items(3)
    assert api.merge(parent, {a: 4, b: 1})["diff"]["added"] == [
        {"part_number": a, "quantity": 4},
        {"part_number": b, "quantity": 1},
    ]
    line = api.lines(parent)[a]
    assert (line["quantity"], line["source"], line["unreferenced_since"]) == (4, "assembly", None)
    changed = api.merge(parent, {a: 6, b: 1})["diff"]["quantity_changed"]
    assert changed == [{"part_number": a, "old_quantity": 4, "new_quantity": 6}]
    since = set()
    for _ in range(2):
        answer = api.merge(parent, {b: 1})
        assert answer["diff"]["removed"] == [{"part_number": a, "quantity": 6}]
        assert [(w["type"], w["part_number"]) for w in answer["warnings"]] == [("unreferenced", a)]
        lines = api.lines(parent)
        assert (lines[a]["quantity"], lines[b]["unreferenced_since"]) == (6, None)
        since.add(lines[a]["unreferenced_since"])
    assert len(since - {None}) == len(since) == 1
    for _ in range(2):
        answer = api.merge(parent, {a: 6, b: 1})
        unchanged = {line["part_number"]: line["quantity"] for line in answer["diff"]["unchanged"]}
        assert (unchanged, answer["diff"]["added"], answer["warnings"]) == ({a: 6, b: 1}, [], [])
        again = api.lines(parent)[a]
        assert (again["id"], again["unreferenced_since"]) == (line["id"], None)
    entries = {"entries": [{"child_part_number": number, "quantity": q} for number, q in ((a, 6), (b, 1))]}
    etags = {api.call("POST", bom(parent, "merge"), entries).headers["etag"] for _ in range(2)}
    assert etags == {api.call("GET", bom(parent)).headers["etag"]}


def own_words(lines: dict[str, Any]) -> dict[str, Any]:
    """The lines without what the server knows that the assembly says of them."""
    told = ("assembly_told", "assembly_quantity")
    return {child: {k: v for k, v in line.items() if k not in told} for child, line in lines.items()}


def test_manual_lines_never_change(api: Api) -> None:
    """A manual line is the same, key by key, whatever the assembly says."""
    parent, a = api.items(2)
    api.add_line(parent, a, quantity=2, **HUMAN_FIELDS)
    before = own_words(api.lines(parent))
    for cad in (None, 2, 5):
        answer = api.merge(parent, {a: cad} if cad else {})
        assert own_words(api.lines(parent)) == before
        diff = answer["diff"]
        assert (diff["removed"], diff["added"], diff["quantity_changed"]) == ([], [], [])
        assert diff["unchanged"] == ([{"part_number": a, "quantity": 2}] if cad == 2 else [])
        told = [
            (w["type"], w["part_number"], w["assembly_quantity"], w["server_quantity"])
            for w in answer["warnings"]
        ]
        assert told == ([("conflict", a, 5, 2)] if cad == 5 else [])


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


def test_part_numbers_are_found_whatever_their_case(api: Api) -> None:
    """A part number in another case is the same item; two entries of one child are one line."""
    parent, number = api.items(2)
    entries = [{"child_part_number": text, "quantity": 2} for text in (number.lower(), number.upper())]
    answer = api.good("POST", bom(parent.lower(), "merge"), {"entries": entries})
    assert answer["diff"]["added"] == [{"part_number": number, "quantity": 4}]
    assert answer["resolve_url"] == f"/items/{parent}/bom"


def test_a_person_s_quantity_becomes_an_override_that_merges_report(api: Api) -> None:
    """Editing an assembly line makes it manual and remembers what CAD said; merges then leave it and warn.

    So they do if CAD has dropped the part. CAD's quantity, typed again, ends the override.
    """
    parent, a = api.items(2)
    api.merge(parent, {a: 4})
    edited = api.edit_line(parent, a, quantity=6)
    assert (edited["source"], edited["override"], edited["cad_quantity"]) == ("manual", True, 4)
    answer = api.merge(parent, {a: 4})
    assert answer["warnings"] == [
        {
            "type": "conflict",
            "part_number": a,
            "message": "The assembly has 4, Silo has 6 (set by a user); a reviewer decides",
            "assembly_quantity": 4,
            "server_quantity": 6,
        }
    ]
    assert api.quantities(parent) == {a: 6}
    review = api.get(bom(parent, "review"))
    assert [(c["assembly_quantity"], c["server_quantity"]) for c in review["conflicts"]] == [(4, 6)]
    answer = api.merge(parent, {})
    assert [(w["type"], w["assembly_quantity"]) for w in answer["warnings"]] == [("conflict", 0)]
    assert (answer["diff"]["removed"], api.quantities(parent)) == ([], {a: 6})
    back = api.edit_line(parent, a, quantity=4)
    assert (back["source"], back["override"], back["cad_quantity"]) == ("assembly", False, None)


def test_an_alternate_of_a_component_keeps_its_quantity_through_a_merge(api: Api) -> None:
    """A merge changes CAD's line of the child; the alternate that a user added for the same child stays."""
    parent, child, other = api.items(3)
    api.merge(parent, {child: 1, other: 1})
    fields = {"rel_type": "alternate", "quantity": 7, "notes": "from the second supplier"}
    api.add_line(parent, child, **fields)
    mine = {**fields, "source": "manual", "unreferenced_since": None, "override": False}
    for entries in ({child: 3, other: 1}, {other: 1}, {child: 2, other: 1}):
        api.merge(parent, entries)
        lines = [line for line in api.get(bom(parent)) if line["rel_type"] == "alternate"]
        assert [{name: line[name] for name in mine} for line in lines] == [mine]
