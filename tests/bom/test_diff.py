# SPDX-License-Identifier: LGPL-2.1-or-later
"""CAD against server (spec §4): what is new, gone, changed, equal, people's, or in conflict."""

from __future__ import annotations

from decimal import Decimal
from typing import Any

import pytest

from silo.bom import BomDiff, BomEntry, FindingCode, Severity, diff_bom
from silo.bom.compare.merge import plan_merge
from silo.bom.quantities import as_number, same_quantity


def local(**quantities: Any) -> list[BomEntry]:
    return [
        BomEntry(f"/v/{number}.FCStd", part_number=number.replace("_", "-"), quantity=quantity)
        for number, quantity in quantities.items()
    ]


def line(number: str, quantity: Any, source: str | None = "assembly", **more: Any) -> dict[str, Any]:
    told = {} if source is None else {"source": source}
    return {"child_part_number": number, "quantity": quantity, **told, **more}


def test_the_specs_example() -> None:
    """Spec §5: one added, one removed, one changed, two unchanged; rows read as the spec's dicts."""
    diff = diff_bom(
        local(PRT_100=1, ASM_200=2, PRT_300=1, F01_001=12),
        [line("PRT-100", 1), line("ASM-200", 2), line("F01-001", 8), line("PRT-400", 2)],
    )
    assert diff == BomDiff(
        added=({"part_number": "PRT-300", "quantity": 1},),  # type: ignore[arg-type]
        removed=({"part_number": "PRT-400", "quantity": 2},),  # type: ignore[arg-type]
        quantity_changed=({"part_number": "F01-001", "local_quantity": 12, "remote_quantity": 8},),  # type: ignore[arg-type]
        unchanged=(
            {"part_number": "PRT-100", "quantity": 1},  # type: ignore[arg-type]
            {"part_number": "ASM-200", "quantity": 2},  # type: ignore[arg-type]
        ),
    )
    assert diff.added[0]["part_number"] == diff.added[0].part_number == "PRT-300"


@pytest.mark.parametrize(
    "told", [12, 12.0, "12", "12.0", " 12 ", Decimal("12"), Decimal("12.00"), 12 + 1e-10]
)
def test_quantities_compare_as_numbers(told: Any) -> None:
    """However a server writes twelve, it is twelve."""
    diff = diff_bom(local(P=12), [line("P", told)])
    assert diff.unchanged == ({"part_number": "P", "quantity": 12},)
    assert not diff.drifted


@pytest.mark.parametrize("told", [None, "", "twelve", float("nan"), float("inf"), True, 10**400, [12]])
def test_what_is_no_number_is_a_change_not_a_crash(told: Any) -> None:
    """An assembly line without a readable quantity takes the assembly's."""
    (change,) = diff_bom(local(P=12), [line("P", told)]).quantity_changed
    assert (change.local_quantity, change.remote_quantity) == (12, None)


def test_counts_read_as_counts() -> None:
    """12.0 from a database is reported as 12."""
    (change,) = diff_bom(local(P=3), [line("P", 12.0)]).quantity_changed
    assert (repr(change.local_quantity), repr(change.remote_quantity)) == ("3", "12")


@pytest.mark.parametrize("source", [{}, {"source": None}, {"source": ""}, {"source": "assembly"}], ids=str)
def test_a_line_without_a_source_is_an_assemblys(source: dict[str, Any]) -> None:
    """Missing, null, empty or named: it is compared, and removed where CAD has it no longer."""
    remote = [{**line("P", 1, None), **source}, {**line("GONE", 2, None), **source}]
    diff = diff_bom(local(P=3), remote)
    assert [c.part_number for c in diff.quantity_changed] == ["P"]
    assert [c.part_number for c in diff.removed] == ["GONE"]


def test_manual_lines_are_listed_apart() -> None:
    """Never removed, never changed, whatever CAD has."""
    diff = diff_bom([], [line("GREASE", "0.5", "manual"), line("P", 1)])
    assert diff.manual == ({"part_number": "GREASE", "quantity": 0.5},)
    assert [c.part_number for c in diff.removed] == ["P"]


def test_a_source_nobody_knows_is_somebodys() -> None:
    """Only what assemblies wrote may be rewritten by one."""
    diff = diff_bom(local(P=4), [line("P", 2, "erp"), line("Q", 1, "erp")])
    assert (diff.removed, diff.quantity_changed) == ((), ())
    assert [c.part_number for c in diff.manual] == ["P", "Q"]


@pytest.mark.parametrize("told", [4, "4", 4.0])
def test_a_component_that_people_entered_with_the_same_quantity_is_there(told: Any) -> None:
    """Nothing to add, nothing to decide."""
    diff = diff_bom(local(P=4), [line("P", told, "manual")])
    assert diff == BomDiff(
        unchanged=({"part_number": "P", "quantity": 4},),  # type: ignore[arg-type]
        manual=({"part_number": "P", "quantity": 4},),  # type: ignore[arg-type]
    )
    assert not diff.drifted


@pytest.mark.parametrize("told", [6, None, "six"])
def test_a_component_that_people_entered_with_another_quantity_is_a_conflict(told: Any) -> None:
    """Not a change, not an addition: a person decides."""
    diff = diff_bom(local(P=4), [line("P", told, "manual")])
    (conflict,) = diff.conflicts
    assert (conflict.part_number, conflict.local_quantity) == ("P", 4)
    assert (diff.added, diff.quantity_changed, diff.unchanged) == ((), (), ())
    assert diff.drifted


def test_an_assembly_line_beside_a_manual_one() -> None:
    """Old data may have both: ours takes the quantity, theirs is a conflict and stays."""
    diff = diff_bom(local(P=4), [line("P", 3), line("P", 6, "manual")])
    assert [c.remote_quantity for c in diff.quantity_changed] == [3]
    assert [c.remote_quantity for c in diff.conflicts] == [6]


@pytest.mark.parametrize("rel_type", ["alternate", "reference"])
def test_other_relations_belong_to_people(rel_type: str) -> None:
    """An alternate is no component: never removed, never in conflict, and no reason not to add."""
    diff = diff_bom(local(P=4), [line("P", 1, rel_type=rel_type), line("Q", 1, rel_type=rel_type)])
    assert [c.part_number for c in diff.added] == ["P"]
    assert (diff.removed, diff.conflicts) == ((), ())
    assert [c.part_number for c in diff.manual] == ["P", "Q"]


@pytest.mark.parametrize("rel_type", ["component", "", None])
def test_components_are_components(rel_type: str | None) -> None:
    """The relation may be reported or not."""
    assert diff_bom([], [line("P", 1, rel_type=rel_type)]).removed


def test_local_lines_with_one_number_are_summed() -> None:
    """Also where nobody merged them before."""
    assert diff_bom([*local(P=2), *local(P=3)], []).added == ({"part_number": "P", "quantity": 5},)


def test_entries_without_a_number_are_not_compared() -> None:
    """Unregistered components are reported elsewhere."""
    assert diff_bom([BomEntry("/v/new.FCStd")], []) == BomDiff()


def test_a_request_compares_like_entries() -> None:
    """The server plans from the entries of the request."""
    request = [{"child_part_number": "P", "quantity": 2}, {"part_number": "Q", "quantity": 1}]
    assert [c.part_number for c in diff_bom(request, []).added] == ["P", "Q"]


def test_numbers_compare_as_they_are() -> None:
    """Part numbers are never parsed: case and dashes are part of them."""
    diff = diff_bom(local(F01_0001=1), [line("f01-0001", 1)])
    assert (len(diff.added), len(diff.removed)) == (1, 1)


@pytest.mark.parametrize(
    ("value", "number"),
    [(1, 1.0), ("1e3", 1000.0), (Decimal("0.1"), 0.1), ("", None), (object(), None), (False, None)],
)
def test_as_number(value: Any, number: float | None) -> None:
    """A number, or None; never an error."""
    assert as_number(value) == number


def test_unknown_equals_only_unknown() -> None:
    """Two missing quantities are the same, a missing one is not zero."""
    assert same_quantity(None, None)
    assert not same_quantity(None, 0)


def test_what_a_person_has_to_decide_is_reported() -> None:
    """The spec's sentence for unreferenced lines, and each conflict with both quantities."""
    parent = BomEntry("/v/top.FCStd", object_name="Assembly")
    remote = [line("A", 1), line("B", 1), line("P", 6.5, "manual"), line("Q", None, "manual")]
    unreferenced, conflict, unknown = diff_bom(local(P=4, Q=1), remote).findings_at(parent)
    assert (
        "2 items in the Silo BOM are not referenced by components in this assembly." in unreferenced.message
    )
    assert "A, B" in unreferenced.message
    assert (unreferenced.code, unreferenced.severity) == (FindingCode.UNREFERENCED, Severity.WARNING)
    assert (conflict.code, conflict.severity) == (FindingCode.CONFLICT, Severity.WARNING)
    assert all(word in conflict.message for word in ("P:", "4", "6.5"))
    assert "no quantity" in unknown.message
    assert str(conflict.where[0]) == "/v/top.FCStd#Assembly"


def test_one_unreferenced_item_is_one_item() -> None:
    """Grammar is a courtesy."""
    (finding,) = diff_bom([], [line("A", 1)]).findings
    assert finding.message.startswith("1 item in the Silo BOM is not referenced")


def test_nothing_to_decide_is_not_reported() -> None:
    """Additions and changes need nobody."""
    assert diff_bom(local(P=4, Q=1), [line("P", 1), line("M", 1, "manual")]).findings == ()


def test_while_a_component_is_missing_no_line_of_unknown_origin_reads_as_removed() -> None:
    """A server that does not keep what lines stand for; the missing component may be any of them."""
    lines = [
        {"child_part_number": "P-1", "quantity": 2},
        {"child_part_number": "P-2", "quantity": 1},
        {"child_part_number": "P-3", "quantity": 9, "source": "manual"},
    ]
    local = [{"child_part_number": "P-1", "quantity": 3}]
    diff = diff_bom(local, lines, missing=[("parts/Lid.FCStd", "Body")])
    assert [change.part_number for change in diff.kept] == ["P-2"]
    assert diff.removed == ()
    assert [change.part_number for change in diff.quantity_changed] == ["P-1"]
    assert [change.part_number for change in diff_bom(local, lines).removed] == ["P-2"]


def test_a_missing_component_whose_line_is_known_keeps_that_one_only() -> None:
    """The other lines can be judged as ever."""
    lid = {"file": "parts/Lid.FCStd", "object": "Body"}
    lines = [
        {"child_part_number": "P-1", "quantity": 2, "components": [lid]},
        {"child_part_number": "P-2", "quantity": 1},
    ]
    diff = diff_bom([], lines, missing=[(lid["file"], lid["object"])])
    assert [change.part_number for change in diff.kept] == ["P-1"]
    assert [change.part_number for change in diff.removed] == ["P-2"]


@pytest.mark.parametrize("source", ["assembly", "manual"])
@pytest.mark.parametrize("unit", ["m", "box", "kg", "1000 pcs"])
def test_a_line_in_another_unit_is_a_persons(unit: str, source: str) -> None:
    """CAD counts pieces: the same number of metres is a conflict, and nothing makes boxes of pieces."""
    diff = diff_bom(local(P=9), [line("P", 9, source, unit=unit)])
    told = {"part_number": "P", "local_quantity": 9, "remote_quantity": 9, "unit": unit}
    assert diff.conflicts == (told,)
    assert not diff.quantity_changed + diff.unchanged + diff.removed
    assert f"has 9 {unit}" in diff.findings[0].message


@pytest.mark.parametrize("unit", [None, "", " ", "pcs", "Pcs.", "ea", "Stück", "pieces"])
def test_pieces_have_many_names(unit: str | None) -> None:
    """A line whose unit means pieces is CAD's as any other."""
    assert diff_bom(local(P=9), [line("P", 9, unit=unit)]).unchanged == ({"part_number": "P", "quantity": 9},)
    assert diff_bom(local(P=9), [line("P", 8, unit=unit)]).quantity_changed


def test_an_override_whose_component_is_gone_is_reported_until_the_server_knows() -> None:
    """A user changed the quantity of CAD's line; now CAD has no such component: the reviewers are asked."""
    override = {**line("A", 3, "manual"), "override": True, "assembly_told": False}
    assert plan_merge([], [override]).conflicts_to_report == ("A",)
    known = {**override, "assembly_told": True, "assembly_quantity": 0}
    assert plan_merge([], [known]).conflicts_to_report == ()
    assert plan_merge([], [{**override, "override": False}]).conflicts_to_report == ()
