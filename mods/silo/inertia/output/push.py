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
from silo.inertia.bom.table import BomCode
from silo.inertia.model import GeometryCode
from silo.inertia.output.text import number
from silo.inertia.report import InertiaReport, MassCode, PartResult, Source, SubAssemblyResult

if TYPE_CHECKING:
    from silo.api.client import SiloClient

DOUBTS = (
    MassCode.AMBIGUOUS,
    MassCode.ROW_TOTAL,
    MassCode.IMPLAUSIBLE,
    MassCode.GUESSED_MATERIAL,
    BomCode.AMBIGUOUS_MASS,
    GeometryCode.BODY_MISSING,
    GeometryCode.INVALID_SHAPE,
    GeometryCode.MESH_MISMATCH,
    GeometryCode.OPEN_SHELL,
    GeometryCode.OVERLAPPING_SOLIDS,
    GeometryCode.NOT_WATERTIGHT,
    GeometryCode.WINDING,
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
    """What was done: part numbers by outcome. ``failed``: not written, and why."""

    written: tuple[str, ...] = ()
    unchanged: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()
    failed: tuple[tuple[str, SiloError], ...] = ()
    plan: PushPlan = field(default_factory=lambda: PushPlan(()))


def plan_push(
    report: InertiaReport, part_numbers: Mapping[str, str] | None = None, top: str | None = None
) -> PushPlan:
    """Return what a report says of each item. Pure.

    part_numbers
        prototype key → number, if neither BOM nor geometry file has it (a FreeCAD document's identities).
    top
        part number of the whole assembly; its mass and centre are pushed as well, if no part is a gap.
    """
    known = part_numbers or {}
    by_number: dict[str, list[PartResult]] = defaultdict(list)
    found: list[PushItem | Skipped] = []
    unsure: dict[str, str] = {}
    gaps = 0
    lost = next((str(w.code) for w in report.warnings if w.code in DOUBTS and not w.part_name), "")
    doubt = f"the whole file is in doubt ({lost}), and so may be this part" if lost else ""
    for _, part in report.parts():
        gap = doubt or _gap(part)
        gaps += gap is not None
        numbers = [part.part_number] if part.part_number else [known[k] for k in part.products if k in known]
        if gap is not None or not numbers:
            found.append(Skipped(part.name, gap or "it has no part number"))
            if part.source is not Source.SUB_ASSEMBLY_MASS:
                unsure |= dict.fromkeys(numbers, part.name)
            continue
        for part_number in dict.fromkeys(numbers):
            by_number[part_number].append(part)
    for part_number, parts in by_number.items():
        values = [_properties(part) for part in parts]
        different = sum(one not in values[:index] for index, one in enumerate(values))
        if part_number in unsure:
            reason = f"{unsure[part_number]!r} has the part number {part_number} as well, and no sure mass"
            found.append(Skipped(parts[0].name, reason))
        elif different > 1:
            reason = f"{different} different shapes or masses have the part number {part_number}"
            found.append(Skipped(parts[0].name, reason))
        else:
            found.append(PushItem(part_number, parts[0].name, values[0]))
    for one in report.sub_assemblies:
        taken = {item.part_number for item in found if isinstance(item, PushItem)}
        found.append(Skipped(one.name, doubt) if doubt else _sub_assembly(one, taken))
    for warning in report.warnings:
        if warning.code == MassCode.ROW_UNUSED:
            found.append(Skipped(warning.part_name, "no part of the geometry belongs to its row"))
    if top is not None:
        found.append(_whole(report, top, gaps))
    items = tuple(one for one in found if isinstance(one, PushItem))
    skipped = dict.fromkeys(one for one in found if isinstance(one, Skipped))
    return PushPlan(items, tuple(skipped), _comment(report))


def push(items: SiloClient, plan: PushPlan, told: Callable[[str], None] = lambda part_number: None) -> Pushed:
    """Write a plan. Other properties of an item stay; an item that has the numbers already is left alone.

    An item whose properties cannot be read is not written. An error that concerns all items ends the run: the
    items that are left have it as their reason.
    """
    written: list[str] = []
    unchanged: list[str] = []
    unknown: list[str] = []
    failed: list[tuple[str, SiloError]] = []
    stopped: SiloError | None = None
    for wanted in plan.items:
        if stopped is not None:
            failed.append((wanted.part_number, stopped))
            continue
        told(wanted.part_number)
        try:
            (written if _write(items, wanted, plan.comment) else unchanged).append(wanted.part_number)
        except NotFoundError:
            unknown.append(wanted.part_number)
        except SiloError as error:
            failed.append((wanted.part_number, error))
            stopped = error if ends_run(error, items) else None
    return Pushed(tuple(written), tuple(unchanged), tuple(unknown), tuple(failed), plan)


def _write(items: SiloClient, wanted: PushItem, comment: str) -> bool:
    """Write the numbers; return False if the item has them already."""
    known = items.get_properties(wanted.part_number)
    # The server replaces properties as a whole, so that what others wrote goes along.
    merged = {**known, **wanted.properties}
    if merged == dict(known):
        return False
    items.update_item(wanted.part_number, properties=merged, comment=comment)
    return True


def _gap(part: PartResult) -> str | None:
    if part.source is Source.SUB_ASSEMBLY_MASS:
        return "its mass is a share of its sub-assembly's, which is written to that one's item"
    if part.source is Source.TARGET_MASS:
        return "its mass is a share of what was weighed, and the scale's reading is of no item"
    if part.source not in VOUCHED:
        return "neither BOM nor material gives its mass"
    if part.mass <= 0:
        return "its mass is zero"
    doubts = [warning for warning in part.warnings if warning.code in DOUBTS]
    if doubts:
        return f"its mass is in doubt ({', '.join(dict.fromkeys(str(w.code) for w in doubts))})"
    return None


def _sub_assembly(one: SubAssemblyResult, taken: Set[str]) -> PushItem | Skipped:
    reason = ""
    if not one.part_number:
        reason = "it has no part number"
    elif one.mass <= 0:
        reason = "its mass is zero"
    elif not one.agrees:
        reason = "its parts sum up to another mass than its own row says"
    elif one.doubtful:
        reason = "its mass is in doubt (see the warnings)"
    elif one.part_number in taken:
        reason = f"another part has the part number {one.part_number}"
    return Skipped(one.name, reason) if reason else PushItem(one.part_number, one.name, _properties(one))


def _whole(report: InertiaReport, top: str, gaps: int) -> PushItem | Skipped:
    total = report.total
    if total is None or total.mass <= 0 or gaps:
        return Skipped(report.assembly, f"{gaps} of its parts have no sure mass")
    com = [_rounded(value) for value in total.com]
    return PushItem(top, report.assembly, {"mass_kg": _rounded(total.mass), "com_m": com})


def _properties(part: PartResult | SubAssemblyResult) -> dict[str, Any]:
    found: dict[str, Any] = {"mass_kg": _rounded(part.mass)}
    if part.volume:
        found["volume_m3"] = _rounded(part.volume)
        if part.com is not None:
            found["com_m"] = [_rounded(value) for value in part.com]
    return found


def _rounded(value: float) -> float:
    # Twelve digits: a second run on another machine must not make a revision of the last bit.
    return float(f"{value + 0.0:.12g}") if abs(value) > 1e-15 else 0.0


def _comment(report: InertiaReport) -> str:
    source = report.source.replace("\\", "/").rpartition("/")[2] or report.assembly
    bom = report.bom.replace("\\", "/").rpartition("/")[2]
    return f"Mass properties from {source}" + (f" and {bom}" if bom else "")


def describe(item: PushItem) -> str:
    """Return a line for people."""
    volume = item.properties.get("volume_m3")
    text = f"{item.part_number}  {item.name}: {number(item.properties['mass_kg'])} kg"
    return text + (f", {volume * 1e6:.6g} cm³" if volume else "")
