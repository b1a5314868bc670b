# SPDX-License-Identifier: LGPL-2.1-or-later
"""A report as Markdown."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from silo.bom.errors import listed
from silo.bom.message import message
from silo.inertia.output.words import (
    MAX_PLACES,
    PART_HEADINGS,
    clean,
    grouped,
    link_cells,
    loose,
    part_cells,
    short,
    vector,
)
from silo.inertia.report import InertiaReport


def report_markdown(report: InertiaReport) -> str:
    """Write the report as Markdown."""
    out = [
        message(
            "# Mass properties of {assembly}", assembly=_cell(report.assembly or message("the assembly"))
        ),
        "",
    ]
    out += [
        message("Geometry: {source}  ", source=_cell(report.source)),
        message("BOM: {bom}", bom=_cell(report.bom) or "none"),
        "",
    ]
    if report.reconciliation is not None:
        out += [_cell(report.reconciliation.sentence), ""]
    out += ["## Links", "", *_link_rows(report), "", *_frames(report), ""]
    out += ["## Parts", "", *_part_rows(report), ""]
    if report.unclaimed:
        out += [
            message(
                "Parts without a link sum up to {report} kg; they are in no link's mass.",
                report=short(loose(report)),
            ),
            "",
        ]
    out += ["## Warnings", ""]
    out += [_warning_row(*group, where) for group, where in grouped(report.warnings).items()] or ["None."]
    return "\n".join(out) + "\n"


def _link_rows(report: InertiaReport) -> Iterable[str]:
    yield "| Link | Mass kg | Centre of mass m | Ixx, Iyy, Izz kg m² | Ixy, Ixz, Iyz kg m² | Parts |"
    yield "|---|--:|--:|--:|--:|--:|"
    for link in report.links.values():
        yield _row(link_cells(link))
    if report.total is not None:
        total = report.total
        yield message(
            "| **whole assembly** | **{mass}** | {com} | | | |",
            mass=short(total.mass),
            com=vector(total.com, 1.0),
        )


def _frames(report: InertiaReport) -> Iterable[str]:
    frames = {link.frame.description for link in report.links.values()}
    if len(frames) == 1:
        frame = _cell(frames.pop())
        yield message(
            "Inertia is about each centre of mass. Frame: {frame}; of the whole assembly: its own.",
            frame=frame,
        )
        return
    yield message("Inertia is about each centre of mass. Frames:")
    yield ""
    for link in report.links.values():
        yield f"- {_cell(link.name)}: {_cell(link.frame.description)}"


def _part_rows(report: InertiaReport) -> Iterable[str]:
    yield _row(heading.lstrip(">") for heading in PART_HEADINGS)
    yield _row("--:" if heading[0] == ">" else "---" for heading in PART_HEADINGS)
    for link, part in report.parts():
        yield _row(part_cells(link, part))


def _row(cells: Iterable[str]) -> str:
    return f"| {' | '.join(map(_cell, cells))} |"


def _warning_row(message: str, code: str, where: Sequence[str]) -> str:
    return f"- {f'**{_cell(listed(where, MAX_PLACES))}**: ' if where else ''}{_cell(message)} (`{code}`)"


def _cell(text: str) -> str:
    return re.sub(r"([\\`*_{}\[\]<>|])", r"\\\1", clean(text))
