# SPDX-License-Identifier: LGPL-2.1-or-later
"""Masses back to Silo: what is vouched for, once, without touching what others wrote."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import pytest
from bodies import box

from silo.bom.errors import AuthError, NotFoundError, ServerFaultError, SiloError
from silo.inertia.masses import Options
from silo.inertia.notes import Note
from silo.inertia.push import describe, plan_push, push

Fixture = Callable[..., Any]
HEAD = "Part number,Quantity,Material,Mass,Name\n"


@dataclass
class StoredItem:
    part_number: str
    properties: Mapping[str, Any]


@dataclass
class MemoryItems:
    """A server in a dictionary; counts revisions."""

    items: dict[str, StoredItem]
    revisions: list[tuple[str, str]] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)
    trouble: SiloError | None = None

    def get_properties(self, part_number: str, /) -> Mapping[str, Any]:
        self.asked.append(part_number)
        if self.trouble is not None:
            raise self.trouble
        if part_number not in self.items:
            raise NotFoundError(f"no item {part_number}")
        return self.items[part_number].properties

    def update_item(self, part_number: str, /, **changes: Any) -> StoredItem:
        self.revisions.append((part_number, changes["comment"]))
        self.items[part_number] = StoredItem(part_number, changes["properties"])
        return self.items[part_number]


@pytest.fixture(name="report")
def _report(assemble: Fixture, compute: Fixture) -> Any:
    """A BOM mass, a material, a gap, a part without number."""
    return compute(
        assemble(
            ("l/plate", box("plate", 0.1, 0.2, 0.01)),
            ("l/bolt1", box("bolt", 0.01, 0.01, 0.01)),
            ("l/bolt2", box("bolt", 0.01, 0.01, 0.01)),
            ("l/gap", box("gap", 0.01, 0.01, 0.01)),
            ("l/nameless", box("nameless", 0.01, 0.01, 0.01)),
            source="models/arm.step",
        ),
        HEAD + "F01-0001,1,steel,,plate\nF01-0002,2,,0.0080 kg,bolt\nF01-0003,1,,,gap\n,1,steel,,nameless\n",
    )


def test_plan_holds_what_is_vouched_for(report: Any) -> None:
    """Per piece, in SI, with the reasons for all that is left out."""
    plan = plan_push(report)
    assert {item.part_number: item.properties for item in plan.items} == {
        "F01-0001": {"mass_kg": 1.57, "volume_m3": 0.0002, "com_m": [0, 0, 0]},
        "F01-0002": {"mass_kg": 0.008, "volume_m3": 1e-6, "com_m": [0, 0, 0]},
    }
    assert [(s.name, s.reason) for s in plan.skipped] == [
        ("gap", "neither BOM nor material gives its mass"),
        ("nameless", "it has no part number"),
    ]
    assert plan.comment == "Mass properties from arm.step and bom.csv"
    assert describe(plan.items[1]) == "F01-0002  bolt: 0.008 kg, 1 cm³"


@pytest.mark.parametrize("code", ["body_missing", "invalid_shape", "open_shell"])
def test_a_doubt_about_the_whole_file_keeps_all_of_it_here(
    code: str, assemble: Fixture, compute: Fixture
) -> None:
    """A body that no reader gave may be of any part: no part, sub-assembly or whole is sure."""
    parts = (("l/s/a", box("plate", 0.1, 0.1, 0.01), None, "l/s/a"), ("l/b", box("bolt", 0.01, 0.01, 0.01)))
    bom = HEAD + "F01-1,1,steel,,plate\nF01-2,1,,0.008 kg,bolt\nF01-3,1,,0.785 kg,s\n"
    names = {"plate", "bolt", "s"}
    assert {item.name for item in plan_push(compute(assemble(*parts), bom)).items} == names
    doubted = assemble(*parts, problems=(Note(code, "something is missing"),))
    plan = plan_push(compute(doubted, bom), top="F01-0")
    assert plan.items == ()
    reason = f"the whole file is in doubt ({code}), and so may be this part"
    assert {s.name for s in plan.skipped if s.reason == reason} == names


def test_push_keeps_other_properties_and_runs_once(report: Any) -> None:
    """A new revision where the numbers changed; the second run makes none."""
    items = MemoryItems({"F01-0001": StoredItem("F01-0001", {"finish": "painted", "mass_kg": 9})})
    done = push(items, plan_push(report))
    assert (done.written, done.unknown) == (("F01-0001",), ("F01-0002",))
    assert items.items["F01-0001"].properties["finish"] == "painted"
    assert items.items["F01-0001"].properties["mass_kg"] == 1.57
    again = push(items, plan_push(report))
    assert (again.written, again.unchanged) == ((), ("F01-0001",))
    assert items.revisions == [("F01-0001", "Mass properties from arm.step and bom.csv")]


def test_properties_that_cannot_be_read_are_not_written_over(report: Any) -> None:
    """Each such item is named; the others are tried."""
    items = MemoryItems({}, trouble=ServerFaultError("cannot be read"))
    done = push(items, plan_push(report))
    assert [number for number, _ in done.failed] == ["F01-0001", "F01-0002"]
    assert (items.revisions, len(items.asked)) == ([], 2)


def test_a_refused_token_ends_the_run(report: Any) -> None:
    """Asked once, and reported for every item that was left."""
    items = MemoryItems({}, trouble=AuthError("no"))
    assert [number for number, _ in push(items, plan_push(report)).failed] == ["F01-0001", "F01-0002"]
    assert len(items.asked) == 1


def test_identities_of_the_document_give_numbers(report: Any) -> None:
    """Where neither BOM nor geometry file has a number."""
    plan = plan_push(report, {"nameless": "F01-0009", "other": "X"})
    assert "F01-0009" in {item.part_number for item in plan.items}


def test_one_number_with_two_masses_is_skipped(assemble: Fixture, compute: Fixture) -> None:
    """It cannot be both."""
    a, b = box("a", 0.1, 0.1, 0.1, part_number="P"), box("b", 0.1, 0.1, 0.2, part_number="P")
    report = compute(assemble(("l/a", a), ("l/b", b)), "Name,Material,Mass\na,steel,\nb,steel,\n")
    plan = plan_push(report)
    assert plan.items == ()
    assert "2 different shapes or masses have the part number P" in plan.skipped[0].reason


@pytest.mark.parametrize("row", ["b,", "b,steel,9000", ""])
def test_one_number_with_a_mass_in_doubt_is_skipped(assemble: Fixture, compute: Fixture, row: str) -> None:
    """The vouched mass of one shape is no answer for the other one."""
    a, b = box("a", 0.1, 0.1, 0.1, part_number="P"), box("b", 0.1, 0.1, 0.2, part_number="P")
    plan = plan_push(compute(assemble(("l/a", a), ("l/b", b)), f"Name,Material,Mass\na,steel,\n{row}\n"))
    assert plan.items == ()
    assert "'b' has the part number P as well" in " ".join(one.reason for one in plan.skipped)


def test_the_whole_assembly_only_without_gaps(assemble: Fixture, compute: Fixture, report: Any) -> None:
    """A total with a hole in it is no mass of the assembly."""
    assert [s.name for s in plan_push(report, top="A01-0001").skipped][-1] == "asm"
    whole = compute(assemble(("l/a", box("a", 0.1, 0.1, 0.1))), HEAD + "P-1,1,steel,,a\n")
    item = plan_push(whole, top="A01-0001").items[-1]
    assert (item.part_number, item.properties["mass_kg"]) == ("A01-0001", 7.85)


def test_default_densities_and_shares_stay_here(assemble: Fixture, compute: Fixture) -> None:
    """A guess does not become a fact by being uploaded."""
    part = box("a", 0.1, 0.1, 0.1, part_number="P")
    assert plan_push(compute(assemble(("l/a", part)), None)).items == ()
    zero = compute(assemble(("l/a", part)), None, options=Options(unknown_is_zero=True))
    assert plan_push(zero).items == ()
    motor = assemble(("l/motor/a", part))
    shared = compute(motor, "Name,Material,Mass\nmotor,,2.000 kg\n")
    assert "share" in plan_push(shared).skipped[0].reason


@pytest.mark.parametrize("apart", [0.0, 0.005])
def test_a_sub_assembly_gets_its_own_mass(
    assemble: Fixture, compute: Fixture, at: Fixture, apart: float
) -> None:
    """A bought motor is one item; its parts' shares stay here, its mass, volume and centre go to it.

    Five millimetres between the lids of two motors: the item gets a mass and no centre.
    """
    motors = []
    for i in range(2):
        for name, place in (("case", at(i, 0, 0)), ("lid", at(i, 0, 1 + i * apart))):
            motors.append((f"l/motor{i}/{name}", box(name, 0.1, 0.1, 0.1), place, f"l/motor/{name}"))
    frames = {("l", f"motor{i}"): at(i, 0, 0) for i in range(2)}
    report = compute(assemble(*motors, frames=frames), HEAD + "P01-0001,2,,2.000 kg,motor\n")
    (one,) = report.sub_assemblies
    assert (one.mass, one.agrees, one.paths) == (2.0, True, ("l/motor0", "l/motor1"))
    plan = plan_push(report)
    (item,) = plan.items
    centre = {} if apart else {"com_m": [0, 0, 0.5]}
    assert item.part_number == "P01-0001"
    assert item.properties == {"mass_kg": 2.0, "volume_m3": 0.002} | centre
    assert {s.name for s in plan.skipped} == {"case", "lid"}
    assert all("written to that one's item" in s.reason for s in plan.skipped)


@pytest.mark.parametrize(
    ("row", "reason"),
    [
        (",1,,2.000 kg,motor", "no part number"),
        ("P,1,,0 kg,motor", "its mass is zero"),
        ("P,1,,900 kg,motor", "in doubt"),
        ("P,1,,2.000 kg,motor\nQ,1,steel,,case", "sum up to another mass"),
        ("P,1,,8.000 kg,motor\nP,1,steel,,case", "another part has the part number P"),
    ],
)
def test_a_sub_assembly_that_nobody_vouches_for_is_named(
    assemble: Fixture, compute: Fixture, row: str, reason: str
) -> None:
    """With the reason, in words."""
    asm = assemble(("l/motor/case", box("case", 0.1, 0.1, 0.1), None, "l/motor/case"))
    plan = plan_push(compute(asm, HEAD + row + "\n"))
    assert "motor" not in {item.name for item in plan.items}
    (said,) = [s.reason for s in plan.skipped if s.name == "motor"]
    assert reason in said


@pytest.mark.parametrize(
    ("rows", "code"),
    [
        ("P,1,,50.00 kg,a\n", "mass_implausible"),
        ("P,4,steel,31.40 kg,a\n", "row_total"),
        ('P,1,,"1,234 kg",a\n', "bom_mass_ambiguous"),
    ],
)
def test_a_doubtful_mass_is_not_written(assemble: Fixture, compute: Fixture, rows: str, code: str) -> None:
    """Another part's, the row's, or in another unit: the warning keeps it from becoming a fact in Silo."""
    asm = assemble(*((f"l/{i}", box("a", 0.1, 0.1, 0.1)) for i in range(4 if code == "row_total" else 1)))
    plan = plan_push(compute(asm, HEAD + rows))
    assert plan.items == ()
    assert code in plan.skipped[0].reason


def test_two_sub_assemblies_of_one_number_are_not_both_written(assemble: Fixture, compute: Fixture) -> None:
    """The second would overwrite the first."""
    cubes = [
        (f"l/{name}/case", box("case", 0.1, 0.1, 0.1), None, f"l/{name}/case") for name in ("left", "right")
    ]
    report = compute(assemble(*cubes), HEAD + "P-1,1,,2.000 kg,left\nP-1,1,,3.000 kg,right\n")
    plan = plan_push(report)
    assert [(item.part_number, item.properties["mass_kg"]) for item in plan.items] == [("P-1", 2.0)]
    assert "another part has the part number P-1" in {skipped.reason for skipped in plan.skipped}
