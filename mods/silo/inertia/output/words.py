# SPDX-License-Identifier: LGPL-2.1-or-later
"""The words and numbers of a report in a table: sources, materials, cells of links and parts."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable

from silo.bom.message import message
from silo.inertia.codes import Decided, Source
from silo.inertia.report import InertiaReport, LinkResult, PartResult, PartWarning

# Says a finished sentence in the language of a user, as ``silo.spoken`` does.
Say = Callable[[str], str]

NOISE = 1e-9
"""Relative: what is rounding in a table for people. Files have every digit."""

MAX_PLACES = 6
"""Links and parts that one warning names in a terminal and in Markdown; a pipe has all of them."""

SOURCE_WORDS = {
    Source.BOM_MASS: message("BOM mass"),
    Source.MATERIAL: message("material × volume"),
    Source.TARGET_MASS: message("share of what was weighed"),
    Source.SUB_ASSEMBLY_MASS: message("share of the sub-assembly's BOM mass"),
    Source.STEP_DENSITY: message("density in the file × volume"),
    Source.DEFAULT_DENSITY: message("default density × volume"),
    Source.ZERO: "zero",
}


def how(part: PartResult) -> str:
    """Say how a part found its row: "normalised, by quantity"."""
    words = part.rule.replace("_", " ")
    return (
        words
        if part.decided_by in (Decided.ONLY, Decided.SAME_DATA)
        else message("{words}, by {decided_by}", words=words, decided_by=part.decided_by)
    )


def material_of(part: PartResult, say: Say = str) -> str:
    """Return the BOM's material, followed by its name in the table if that differs, or by its card."""
    text = part.material or ""
    name = part.material_name or ""
    if part.material_card:
        return f"{text} → {say(message('FreeCAD card {name}', name=part.material_card))}"
    if not name or name.casefold() == text.casefold():
        return text or name
    return f"{text} → {name}" if text else name


def link_cells(link: LinkResult) -> tuple[str, str, str, str, str, str]:
    """Write the cells of a link: name, mass, centre, moments, products, number of parts."""
    t = link.props.inertia
    size = float(abs(t).max())
    return (
        link.name,
        short(link.props.mass),
        vector(link.props.com, 1.0),
        vector((t[0, 0], t[1, 1], t[2, 2]), size),
        vector((t[0, 1], t[0, 2], t[1, 2]), size),
        str(sum(part.quantity for part in link.parts)),
    )


def loose(report: InertiaReport) -> float:
    return sum(part.total_mass for part in report.unclaimed)


PART_HEADINGS = (
    "Link",
    "Part",
    ">Qty",
    ">Volume cm³",
    ">Mass kg",
    "Source",
    "Matched",
    "Material",
)


def part_cells(link: str, part: PartResult, say: Say = str) -> tuple[str, ...]:
    return (
        link or say(message("(no link)")),
        part.name,
        str(part.quantity),
        f"{part.volume * 1e6:.5g}",
        short(part.mass),
        say(SOURCE_WORDS[part.source]),
        say(how(part)),
        material_of(part, say),
    )


def grouped(warnings: Iterable[PartWarning], *, with_links: bool = True) -> dict[tuple[str, str], list[str]]:
    """Group warnings by message and code → where; a warning about twenty parts is one line."""
    groups: dict[tuple[str, str], list[str]] = {}
    for warning in warnings:
        where = groups.setdefault((warning.message, str(warning.code)), [])
        link = warning.link_name if with_links or not warning.part_name else ""
        names = " / ".join(clean(word) for word in (link, warning.part_name) if word)
        if names:
            where.append(names)
    return groups


def clean(text: str) -> str:
    """Put a text on one line without control characters, since a part's name must not steer a terminal."""
    return " ".join(re.sub(r"[\x00-\x1f\x7f-\x9f]", " ", text).split())


def short(value: float) -> str:
    return f"{value:.6g}"


def vector(values: Iterable[float], size: float = 0.0) -> str:
    """Write each value with five digits; noise against ``size`` becomes 0."""
    return "  ".join(f"{value:.5g}" if abs(value) > NOISE * size else "0" for value in values)
