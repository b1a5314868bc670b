# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the mass window shows: rows and sentences from an inertia report. No Qt."""

from __future__ import annotations

from dataclasses import dataclass

from silo.bom.message import message
from silo.inertia.codes import MassCode, Source
from silo.inertia.report import InertiaReport, PartResult
from silo.workbench.words import counted, spoken, translate


@dataclass(frozen=True)
class MassRow:
    """One line of the table: equal pieces of one part. Masses [kg]; ``doubtful`` has a reason in ``why``."""

    name: str
    quantity: int
    each: float
    total: float
    volume_cm3: float
    material: str
    why: str
    doubtful: bool

    def cells(self) -> tuple[str, ...]:
        """Write the cells, in the order of the columns."""
        return (
            self.name,
            str(self.quantity),
            mass_text(self.each),
            mass_text(self.total),
            f"{self.volume_cm3:.5g}",
            self.material,
            self.why,
        )


@dataclass(frozen=True)
class MassView:
    """Everything in the window. ``notes`` are about the assembly as a whole."""

    title: str
    summary: str
    incomplete: str
    rows: tuple[MassRow, ...]
    notes: tuple[str, ...]

    def table(self, headings: tuple[str, ...]) -> str:
        """Write the table for the clipboard: tab-separated, with numbers in kg and cm³ that a spreadsheet
        reads.
        """
        lines = ["\t".join(headings)]
        for row in self.rows:
            numbers = (f"{row.each:.9g}", f"{row.total:.9g}", f"{row.volume_cm3:.9g}")
            lines.append("\t".join((row.name, str(row.quantity), *numbers, row.material, row.why)))
        return "\n".join(lines) + "\n"


def shown(report: InertiaReport) -> MassView:
    """Make the window's content; the heaviest part comes first, parts without a mass come last."""
    parts = [part for link in report.links.values() for part in link.parts]
    rows = sorted((_row(part) for part in parts), key=lambda row: (-row.total, row.name))
    unknown = [row for row in rows if row.each == 0]
    incomplete = ""
    if unknown:
        incomplete = counted(
            len(unknown),
            translate("Silo", "1 part has no mass; it is missing from the sum."),
            translate("Silo", "{n} parts have no mass; they are missing from the sum."),
        )
    notes = tuple(spoken(w.message) for w in report.warnings if not w.part_name)
    return MassView(report.assembly, _summary(report, parts), incomplete, tuple(rows), notes)


def _summary(report: InertiaReport, parts: list[PartResult]) -> str:
    if report.total is None or report.total.mass <= 0:
        return translate("Silo", "No part of this assembly has a material with a density.")
    pieces = sum(part.quantity for part in parts)
    x, y, z = (f"{value * 1e3:.2f}" for value in report.total.com)
    return translate(
        "Silo",
        "{mass} in {pieces}, centre of mass at {x}, {y}, {z} mm",
        mass=mass_text(report.total.mass),
        pieces=counted(pieces, translate("Silo", "1 piece"), translate("Silo", "{n} pieces")),
        x=x,
        y=y,
        z=z,
    )


def _row(part: PartResult) -> MassRow:
    reasons = [spoken(w.message) for w in part.warnings if str(w.code) != MassCode.NO_MASS_NO_MATERIAL]
    if part.source is Source.ZERO and part.volume > 0:
        reasons.insert(0, translate("Silo", "no material with a density"))
    material = part.material_name or part.material or ""
    if part.density and part.mass > 0:
        material = f"{material} ({part.density:.5g} kg/m³)".strip()
    return MassRow(
        part.name,
        part.quantity,
        part.mass,
        part.total_mass,
        part.volume * 1e6,
        material,
        "; ".join(reasons),
        bool(reasons),
    )


def mass_text(mass: float) -> str:
    """Write a mass [kg] in a suitable unit: ``12.3 g``, ``1.2346 kg``; a dash for none."""
    if mass == 0:
        return "–"
    return f"{mass * 1e3:.5g} g" if abs(mass) < 1 else message("{mass} kg", mass=f"{mass:.5g}")
