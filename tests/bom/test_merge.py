# SPDX-License-Identifier: LGPL-2.1-or-later
"""The merge rules of spec §4, row by row, and what a merge leaves alone."""

from __future__ import annotations

from typing import Any

from silo.bom import apply_merge, plan_merge
from silo.bom.compare.answer import summary

NOW = "2026-02-08T22:15:00Z"


def line(number: str, quantity: Any = 1, source: str = "assembly", **more: Any) -> dict[str, Any]:
    return {"child_part_number": number, "quantity": quantity, "source": source, **more}


def want(number: str, quantity: Any = 1) -> dict[str, Any]:
    return {"child_part_number": number, "quantity": quantity}


def merged(entries: list[dict[str, Any]], lines: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    after = apply_merge(lines, plan_merge(entries, lines), NOW)
    return {f"{row['child_part_number']}/{row['source']}": row for row in after}


def test_added_in_assembly_not_on_server() -> None:
    """Row 1: added, with source assembly."""
    plan = plan_merge([want("P", 3)], [])
    assert plan.writes
    assert apply_merge([], plan, NOW) == [
        {"child_part_number": "P", "quantity": 3, "source": "assembly", "unreferenced_since": None}
    ]


def test_quantity_changed() -> None:
    """Row 2: the line takes the assembly's quantity, and keeps all that people wrote on it."""
    before = line("P", 8, notes="torque 12 Nm", find_number="30", id="x", metadata={"a": 1})
    after = merged([want("P", 12)], [before])["P/assembly"]
    assert after == {**before, "quantity": 12}


def test_removed_on_server_not_in_assembly() -> None:
    """Row 3: never deleted; flagged with the time."""
    plan = plan_merge([], [line("P", 2)])
    assert plan.flag == ("P",)
    assert plan.writes
    assert apply_merge([line("P", 2)], plan, NOW) == [line("P", 2, unreferenced_since=NOW)]


def test_referenced_again() -> None:
    """The flag goes, with or without a change of quantity."""
    before = [line("P", 2, unreferenced_since="2025"), line("Q", 1, unreferenced_since="2025")]
    plan = plan_merge([want("P", 2), want("Q", 5)], before)
    assert plan.unflag == ("P", "Q")
    after = merged([want("P", 2), want("Q", 5)], before)
    assert [after[key]["unreferenced_since"] for key in ("P/assembly", "Q/assembly")] == [None, None]
    assert after["Q/assembly"]["quantity"] == 5


def test_unchanged() -> None:
    """Row 4: nothing is written, not even another form of the number."""
    before = [line("P", "2"), line("Q", 3.0)]
    plan = plan_merge([want("P", 2), want("Q", 3)], before)
    assert not plan.writes
    assert apply_merge(before, plan, NOW) == before


def test_a_line_without_a_quantity_is_not_given_one_in_passing() -> None:
    """Only a planned change writes a quantity."""
    before = {"child_part_number": "P", "source": "assembly"}
    after = apply_merge([before], plan_merge([], [before]), NOW)
    assert after == [{**before, "unreferenced_since": NOW}]


def test_what_was_given_is_not_changed() -> None:
    """Pure: the rows of the caller stay as they were."""
    before = line("P", 1)
    merged([want("P", 2)], [before])
    assert before == line("P", 1)


def test_lines_may_come_from_any_iterable() -> None:
    """The rows of a query are read once."""
    plan = plan_merge(iter([want("P", 2)]), iter([line("P", 1), line("Q", 1, unreferenced_since="2025")]))
    assert (len(plan.diff.quantity_changed), plan.flag) == (1, ())


def test_the_order_of_lines_stays() -> None:
    """Old lines keep their places, new ones come behind."""
    lines = [line("C"), line("A"), line("B", source="manual")]
    after = apply_merge(lines, plan_merge([want("Z"), want("A")], lines), NOW)
    assert [row["child_part_number"] for row in after] == ["C", "A", "B", "Z"]


def test_the_summary_reads_as_the_specs_event() -> None:
    """Spec §5."""
    lines = [line("F01-001", 8), line("PRT-400", 2)]
    plan = plan_merge([want("F01-001", 12), want("PRT-300")], lines)
    assert summary(plan.diff) == "BOM updated: 1 added, 1 quantity changed, 1 unreferenced"


def test_the_summary_reports_conflicts_where_there_are_any() -> None:
    """Something for a person is never left out."""
    plan = plan_merge([want("P", 1)], [line("P", 7, "manual")])
    assert summary(plan.diff).endswith("0 unreferenced, 1 in conflict")
