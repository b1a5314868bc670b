# SPDX-License-Identifier: LGPL-2.1-or-later
"""Masses back to Silo: plan first, then do. One new revision per item whose numbers changed.

Only numbers that somebody vouched for go out: a BOM mass, a material's density, the file's own density when
it was asked for. A default density or a zero is a gap in the data, and a mass that other data make doubtful
is no fact yet; both are listed as such. A sub-assembly's BOM mass goes to its own item.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Set
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from silo.api.policy import ends_run
from silo.bom.errors import NotFoundError, SiloError
from silo.bom.message import message
from silo.inertia.bom.table import BomCode
from silo.inertia.codes import MassCode, Source
from silo.inertia.digits import number, rounded
from silo.inertia.notes import DOUBTFUL
from silo.inertia.report import InertiaReport, PartResult, SubAssemblyResult

if TYPE_CHECKING:
    from silo.api.client import SiloClient

DOUBTS = (
    MassCode.AMBIGUOUS,
    MassCode.ROW_TOTAL,
    MassCode.IMPLAUSIBLE,
    MassCode.GUESSED_MATERIAL,
    BomCode.AMBIGUOUS_MASS,
    *DOUBTFUL,
)
"""Warnings under which a number is not written: it may well be another part's, or in another unit."""

VOUCHED = (Source.BOM_MASS, Source.MATERIAL, Source.STEP_DENSITY)


@dataclass(frozen=True)
class PushItem:
    """New properties of one item: ``mass_kg`` [kg], ``volume_m3`` [m^3], ``com_m`` (x, y, z) [m]."""

    part_number: str
    name: str
    properties: Mapping[str, Any]


@dataclass(frozen=True)
class Skipped:
    """A part that is not pushed, and why, in words."""

    name: str
    reason: str


@dataclass(frozen=True)
class PushPlan:
    """What would be written. ``comment`` goes with each new revision."""

    items: tuple[PushItem, ...]
    skipped: tuple[Skipped, ...] = ()
    comment: str = ""


@dataclass(frozen=True)
class Pushed:
    """What was done: part numbers by outcome. ``failed``: not written, and why.

    by_hand
        items that keep what a user typed or a scale said.
    """

    written: tuple[str, ...] = ()
    unchanged: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()
    by_hand: tuple[str, ...] = ()
    failed: tuple[tuple[str, SiloError], ...] = ()
    plan: PushPlan = field(default_factory=lambda: PushPlan(()))


def plan_push(
    report: InertiaReport, part_numbers: Mapping[str, str] | None = None, top: str | None = None
) -> PushPlan:
    """Plan what a report sets on each item. Pure.

    part_numbers
        prototype key → number, if neither BOM nor geometry file has it (a FreeCAD document's identities).
    top
        part number of the whole assembly; its mass and centre are pushed as well, if no part is a gap.
    """
    number_of = part_numbers or {}
    by_number: dict[str, list[PartResult]] = defaultdict(list)
    push_items: list[PushItem | Skipped] = []
    unsure: dict[str, str] = {}
    gaps = 0
    lost = next((str(w.code) for w in report.warnings if w.code in DOUBTS and not w.part_name), "")
    doubt = message("the whole file is in doubt ({lost}), and so may be this part", lost=lost) if lost else ""
    for _, part in report.parts():
        gap = doubt or _gap(part)
        gaps += gap is not None
        numbers = (
            [part.part_number]
            if part.part_number
            else [number_of[k] for k in part.products if k in number_of]
        )
        if gap is not None or not numbers:
            push_items.append(Skipped(part.name, gap or message("it has no part number")))
            if part.source is not Source.SUB_ASSEMBLY_MASS:
                unsure |= dict.fromkeys(numbers, part.name)
            continue
        for part_number in dict.fromkeys(numbers):
            by_number[part_number].append(part)
    for part_number, parts in by_number.items():
        values = [_properties(part) for part in parts]
        different = sum(value not in values[:index] for index, value in enumerate(values))
        if part_number in unsure:
            reason = message(
                "{part} has the part number {part_number} as well, and no sure mass",
                part=repr(unsure[part_number]),
                part_number=part_number,
            )
            push_items.append(Skipped(parts[0].name, reason))
        elif different > 1:
            reason = message(
                "{different} different shapes or masses have the part number {part_number}",
                different=different,
                part_number=part_number,
            )
            push_items.append(Skipped(parts[0].name, reason))
        else:
            push_items.append(PushItem(part_number, parts[0].name, values[0]))
    for value in report.sub_assemblies:
        taken = {item.part_number for item in push_items if isinstance(item, PushItem)}
        push_items.append(Skipped(value.name, doubt) if doubt else _sub_assembly(value, taken))
    for warning in report.warnings:
        if warning.code == MassCode.ROW_UNUSED:
            push_items.append(
                Skipped(warning.part_name, message("no part of the geometry belongs to its row"))
            )
    if top is not None:
        push_items.append(_whole(report, top, gaps))
    items = tuple(value for value in push_items if isinstance(value, PushItem))
    skipped = dict.fromkeys(value for value in push_items if isinstance(value, Skipped))
    return PushPlan(items, tuple(skipped), _comment(report))


def push(
    items: SiloClient, plan: PushPlan, report: Callable[[str], None] = lambda part_number: None
) -> Pushed:
    """Write a plan. Other properties of an item stay; an item that already has the numbers is left alone.

    An item whose properties cannot be read is not written. An error that concerns all items ends the run: the
    remaining items have it as their reason.
    """
    written: list[str] = []
    unchanged: list[str] = []
    unknown: list[str] = []
    by_hand: list[str] = []
    failed: list[tuple[str, SiloError]] = []
    stopped: SiloError | None = None
    for wanted in plan.items:
        if stopped is not None:
            failed.append((wanted.part_number, stopped))
            continue
        report(wanted.part_number)
        try:
            outcome = _write(items, wanted, plan.comment)
            {True: written, False: unchanged, None: by_hand}[outcome].append(wanted.part_number)
        except NotFoundError:
            unknown.append(wanted.part_number)
        except SiloError as error:
            failed.append((wanted.part_number, error))
            stopped = error if ends_run(error, items) else None
    outcomes = tuple(written), tuple(unchanged), tuple(unknown), tuple(by_hand)
    return Pushed(*outcomes, tuple(failed), plan)


def _write(items: SiloClient, wanted: PushItem, comment: str) -> bool | None:
    """Write the numbers; returns False if the item has them already, None if it has others that it keeps."""
    properties = items.get_properties(wanted.part_number)
    # The server replaces properties as a whole, so that what others wrote goes along.
    merged = {**properties, **wanted.properties}
    if merged == dict(properties):
        return False
    after = items.update_item(wanted.part_number, properties=merged, comment=comment, source="cad")
    kept = "mass_kg" in after.properties and after.properties["mass_kg"] != merged.get("mass_kg")
    return None if kept else True


def _gap(part: PartResult) -> str | None:
    if part.source is Source.SUB_ASSEMBLY_MASS:
        return message("its mass is a share of its sub-assembly's, which is written to that one's item")
    if part.source is Source.TARGET_MASS:
        return message("its mass is a share of what was weighed, and the scale's reading is of no item")
    if part.source not in VOUCHED:
        return message("neither BOM nor material gives its mass")
    if part.mass <= 0:
        return message("its mass is zero")
    doubts = [warning for warning in part.warnings if warning.code in DOUBTS]
    if doubts:
        return message(
            "its mass is in doubt ({doubts})", doubts=", ".join(dict.fromkeys(str(w.code) for w in doubts))
        )
    return None


def _sub_assembly(result: SubAssemblyResult, taken: Set[str]) -> PushItem | Skipped:
    reason = ""
    if not result.part_number:
        reason = message("it has no part number")
    elif result.mass <= 0:
        reason = message("its mass is zero")
    elif not result.agrees:
        reason = message("its parts sum up to another mass than its own row says")
    elif result.doubtful:
        reason = message("its mass is in doubt (see the warnings)")
    elif result.part_number in taken:
        reason = message("another part has the part number {part_number}", part_number=result.part_number)
    return (
        Skipped(result.name, reason)
        if reason
        else PushItem(result.part_number, result.name, _properties(result))
    )


def _whole(report: InertiaReport, top: str, gaps: int) -> PushItem | Skipped:
    total = report.total
    if total is None or total.mass <= 0 or gaps:
        return Skipped(report.assembly, message("{gaps} of its parts have no sure mass", gaps=gaps))
    com = [rounded(value) for value in total.com]
    return PushItem(top, report.assembly, {"mass_kg": rounded(total.mass), "com_m": com})


def _properties(part: PartResult | SubAssemblyResult) -> dict[str, Any]:
    properties: dict[str, Any] = {"mass_kg": rounded(part.mass)}
    if part.volume:
        properties["volume_m3"] = rounded(part.volume)
        if part.com is not None:
            properties["com_m"] = [rounded(value) for value in part.com]
    return properties


def _comment(report: InertiaReport) -> str:
    source = report.source.replace("\\", "/").rpartition("/")[2] or report.assembly
    bom = report.bom.replace("\\", "/").rpartition("/")[2]
    return message("Mass properties from {source}", source=source) + (
        message(" and {bom}", bom=bom) if bom else ""
    )


def describe(item: PushItem) -> str:
    """Describe an item in one line, for people."""
    volume = item.properties.get("volume_m3")
    text = message(
        "{part_number}  {name}: {properties} kg",
        part_number=item.part_number,
        name=item.name,
        properties=number(item.properties["mass_kg"]),
    )
    return text + (message(", {volume} cm³", volume=f"{volume * 1000000.0:.6g}") if volume else "")
