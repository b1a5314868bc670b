# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a sync leaves out, in values and in words."""

from __future__ import annotations

from silo.bom.compare.difference import diff_bom
from silo.bom.compare.merge import apply_merge, plan_merge
from silo.bom.entry import BomEntry
from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.bom.left_out import LeftOut, Reason, components_of, in_words, left_out_of, remembered
from silo.bom_sync.resolved import Resolved

LOST = BomEntry("/v/parts/Lid.FCStd", object_name="Body", quantity=3, missing=True, instances=("L1", "L2"))


def error(*objects: str) -> Finding:
    places = tuple(Place("/v/top.FCStd", name) for name in objects)
    return Finding(FindingCode.MISSING_FILE, Severity.ERROR, "The file /v/parts/Lid.FCStd is missing", places)


def test_missing_and_unregistered_components_are_left_out() -> None:
    """With quantity, and the path as seen from the assembly."""
    new = BomEntry("/v/Pin.FCStd", object_name="Pin", label="Pin", quantity=2)
    known = BomEntry("/v/Nut.FCStd", object_name="Nut", part_number="N-1")
    assert left_out_of([LOST, known], [new], [error("L1", "L2")], "/v") == (
        LeftOut(Reason.MISSING, "Body", "parts/Lid.FCStd", "Body", 3),
        LeftOut(Reason.UNREGISTERED, "Pin", "Pin.FCStd", "Pin", 2),
    )


def test_an_error_that_no_missing_line_explains_is_left_out_itself() -> None:
    """A loop, or damage in the middle of a file, has no line; its message must do."""
    (lost, broken) = left_out_of([LOST], [], [error("L1"), error("L1", "Group")], "/v")
    assert lost.reason is Reason.MISSING
    assert broken == LeftOut(Reason.BROKEN, message="The file parts/Lid.FCStd is missing")


def test_a_line_is_known_by_all_its_components() -> None:
    """Also by those that were added to it for their common part number."""
    line = BomEntry("/v/a.FCStd", object_name="A", also=(("/v/sub/b.FCStd", "B"),))
    assert components_of(line, "/v") == [
        {"file": "a.FCStd", "object": "A"},
        {"file": "sub/b.FCStd", "object": "B"},
    ]


def test_a_standard_part_has_no_file_to_be_missing() -> None:
    """Its key is its designation."""
    from silo.bom.walk.standard import standard_uuid

    screw = BomEntry("/v/top.FCStd", standard_uuid("ISO 4762 M4×16"), standard="ISO 4762 M4×16")
    assert screw.is_standard
    assert components_of(screw, "/v") == []


def test_kept_lines_are_known_again() -> None:
    """What stands in the request, and for kept lines what was known before."""
    a, b = {"file": "a", "object": ""}, {"file": "b", "object": ""}
    before = {"P": [a, b], "Q": [a]}
    entries = [{"child_part_number": "P", "components": [b]}, {"child_part_number": "R", "components": [a]}]
    assert remembered(before, entries, ["P"]) == {"P": [b, a], "R": [a]}
    assert remembered(before, entries, ["Q"]) == {"P": [b], "Q": [a], "R": [a]}


def test_in_words() -> None:
    """The worst first, each with its count; nothing says nothing."""
    left = [LeftOut(Reason.UNREGISTERED), LeftOut(Reason.MISSING), LeftOut(Reason.MISSING)]
    assert in_words(left) == "2 missing, 1 unregistered"
    assert in_words([one.as_dict() for one in left] + [{"reason": "odd"}]) == (
        "2 missing, 1 unregistered, 1 odd"
    )
    assert in_words([]) == ""


def test_another_object_of_the_missing_file_keeps_nothing() -> None:
    """A line stands for a file and an object, never for the file alone."""
    line = {"child_part_number": "P", "quantity": 2, "components": [{"file": "kit.FCStd", "object": "Nut"}]}
    assert [c.part_number for c in diff_bom([], [line], [("kit.FCStd", "Bolt")]).removed] == ["P"]
    kept = diff_bom([], [line], [("kit.FCStd", "Nut")])
    assert (kept.removed, [c.part_number for c in kept.kept]) == ((), ["P"])


def test_a_kept_line_keeps_its_flag_too() -> None:
    """Whatever it was, it stays; a merge neither flags nor clears it."""
    component = {"file": "kit.FCStd", "object": "Nut"}
    line = {"child_part_number": "P", "quantity": 2, "unreferenced_since": "2026", "components": [component]}
    plan = plan_merge([], [line], [("kit.FCStd", "Nut")])
    assert (plan.flag, plan.unflag, plan.news) == ((), (), False)
    assert apply_merge([line], plan, "now") == [line]


def test_the_first_sync_is_news_even_where_nothing_differs() -> None:
    """Else an assembly whose lines somebody had typed in would read as never synced forever."""
    head = BomEntry("/v/top.FCStd", "u-top", part_number="A-1")
    plan = plan_merge([], [])
    assert Resolved(head, (), (), (), {"u-top": {"at": None}}).is_news(plan)
    assert not Resolved(head, (), (), (), {"u-top": {"at": "2026-11-22T00:00:00Z"}}).is_news(plan)
    assert not Resolved(head, (), (), ()).is_news(plan), "a server that keeps no syncs"
