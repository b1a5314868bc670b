# SPDX-License-Identifier: LGPL-2.1-or-later
"""A report for people: rich tables for a terminal, Markdown for a file. Names are text, never markup."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from urllib.parse import quote

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from silo.inertia.codes import Decided, Source
from silo.inertia.report import InertiaReport, LinkResult, PartResult, PartWarning
from silo.inertia.wording import counted

MAX_PART_ROWS = 60
"""Rows of parts in a terminal; JSON, CSV and Markdown have them all."""

NOISE = 1e-9
"""Relative: what is rounding in a table for people. Files have every digit."""

MAX_PLACES = 6
"""Links and parts that one warning names; JSON has one entry for each."""

SOURCE_WORDS = {
    Source.BOM_MASS: "BOM mass",
    Source.MATERIAL: "material × volume",
    Source.SUB_ASSEMBLY_MASS: "share of the sub-assembly's BOM mass",
    Source.STEP_DENSITY: "density in the file × volume",
    Source.DEFAULT_DENSITY: "default density × volume",
    Source.ZERO: "zero",
}


def how(part: PartResult) -> str:
    """How a part found its row, in words: "normalised, by quantity"."""
    if part.decided_by in (Decided.ONLY, Decided.SAME_DATA):
        return part.rule.replace("_", " ")
    return f"{part.rule.replace('_', ' ')}, by {part.decided_by}"


def material_of(part: PartResult) -> str:
    """The BOM's material, and what it was understood as where that is another word."""
    text = part.material or ""
    name = part.material_name or ""
    if not name or name.casefold() == text.casefold():
        return text or name
    return f"{text} → {name}" if text else name


def report_tables(report: InertiaReport) -> RenderableType:
    """Links, parts and warnings for a terminal."""
    return Group(_links_table(report), Text(), _parts_table(report), Text(), report_warnings(report))


def _table(title: str, headings: Iterable[str]) -> Table:
    """``headings``: those of columns that are flush right begin with ">"."""
    table = Table(title=_plain(title), title_justify="left")
    for heading in headings:
        table.add_column(heading.lstrip(">"), justify="right" if heading[0] == ">" else "left")
    return table


def _links_table(report: InertiaReport) -> Table:
    tensor = ">Ixx Iyy Izz / Ixy Ixz Iyz  kg m²"
    headings = ("Link", ">Mass kg", ">Centre of mass m", tensor, ">Parts", ">Warnings")
    table = _table(f"{report.assembly or 'assembly'}: mass properties", headings)
    for link in report.links.values():
        name, mass, com, moments, products, parts = _link_cells(link)
        warnings = str(sum(w.link_name == link.name for w in report.warnings))
        table.add_row(*map(_plain, (name, mass, com, f"{moments}\n{products}", parts, warnings)))
    if report.total is not None and not _is_one_body(report):
        table.add_section()
        cells = (
            "whole assembly",
            _short(report.total.mass),
            _vector(report.total.com, 1.0),
            f"in no link: {_short(_loose(report))} kg" if report.unclaimed else "",
            str(sum(part.quantity for _, part in report.parts())),
            str(len(report.warnings)),
        )
        table.add_row(*map(_plain, cells))
    return table


def _link_cells(link: LinkResult) -> tuple[str, str, str, str, str, str]:
    """Name, mass, centre, moments, products, number of parts."""
    t = link.props.inertia
    size = float(abs(t).max())
    return (
        link.name,
        _short(link.props.mass),
        _vector(link.props.com, 1.0),
        _vector((t[0, 0], t[1, 1], t[2, 2]), size),
        _vector((t[0, 1], t[0, 2], t[1, 2]), size),
        str(sum(part.quantity for part in link.parts)),
    )


def _loose(report: InertiaReport) -> float:
    return sum(part.total_mass for part in report.unclaimed)


_PART_HEADINGS = ("Link", "Part", ">Qty", ">Volume cm³", ">Mass kg", "Source", "Matched", "Material")


def _part_cells(link: str, part: PartResult) -> tuple[str, ...]:
    return (
        link or "(no link)",
        part.name,
        str(part.quantity),
        f"{part.volume * 1e6:.5g}",
        _short(part.mass),
        SOURCE_WORDS[part.source],
        how(part),
        material_of(part),
    )


def _parts_table(report: InertiaReport) -> RenderableType:
    skip = int(_is_one_body(report))  # the link's name
    table = _table("Parts and where their masses come from", _PART_HEADINGS[skip:])
    rows = report.parts()
    for link, part in rows[:MAX_PART_ROWS]:
        table.add_row(*map(_plain, _part_cells(link, part)[skip:]), style="yellow" if part.warnings else "")
    if len(rows) > MAX_PART_ROWS:
        table.caption = f"… and {len(rows) - MAX_PART_ROWS} more; --report parts.csv has them all"
    return table


def _is_one_body(report: InertiaReport) -> bool:
    return len(report.links) == 1 and not report.unclaimed


def report_warnings(report: InertiaReport) -> Text:
    """The warnings for a terminal; what is said of twenty parts alike is said once."""
    if not report.warnings:
        return Text("No warnings.", style="green")
    text = Text(f"{counted(len(report.warnings), 'warning')}\n", style="yellow")
    groups = _grouped(report.warnings, with_links=not _is_one_body(report))
    for (message, code), where in groups.items():
        text.append(f"  {_places(where)}: " if where else "  ", style="bold")
        text.append(_clean(message))
        text.append(f"  [{code}]\n", style="dim")
    return text


def _grouped(warnings: Iterable[PartWarning], *, with_links: bool = True) -> dict[tuple[str, str], list[str]]:
    """Message and code → where; what is said of twenty parts alike is said once."""
    groups: dict[tuple[str, str], list[str]] = {}
    for warning in warnings:
        where = groups.setdefault((warning.message, str(warning.code)), [])
        link = warning.link_name if with_links or not warning.part_name else ""
        names = " / ".join(_clean(word) for word in (link, warning.part_name) if word)
        if names:
            where.append(names)
    return groups


def _places(where: Sequence[str]) -> str:
    more = f" and {len(where) - MAX_PLACES} more" if len(where) > MAX_PLACES else ""
    return ", ".join(where[:MAX_PLACES]) + more


def report_markdown(report: InertiaReport, picture: str | None = None) -> str:
    """The report as Markdown; ``picture``: path of an image, relative to the file it goes into."""
    out = [f"# Mass properties of {_cell(report.assembly or 'the assembly')}", ""]
    out += [f"Geometry: {_cell(report.source)}  ", f"BOM: {_cell(report.bom) or 'none'}", ""]
    if picture:
        out += [f"![Links with centres of mass and inertia ellipsoids]({quote(picture)})", ""]
    out += ["## Links", "", *_link_rows(report), "", *_frames(report), ""]
    out += ["## Parts", "", *_part_rows(report), ""]
    if report.unclaimed:
        out += [
            f"Parts without a link sum up to {_short(_loose(report))} kg; they are in no link's mass.",
            "",
        ]
    out += ["## Warnings", ""]
    out += [_warning_row(*group, where) for group, where in _grouped(report.warnings).items()] or ["None."]
    return "\n".join(out) + "\n"


def _link_rows(report: InertiaReport) -> Iterable[str]:
    yield "| Link | Mass kg | Centre of mass m | Ixx, Iyy, Izz kg m² | Ixy, Ixz, Iyz kg m² | Parts |"
    yield "|---|--:|--:|--:|--:|--:|"
    for link in report.links.values():
        yield _row(_link_cells(link))
    if report.total is not None:
        total = report.total
        yield f"| **whole assembly** | **{_short(total.mass)}** | {_vector(total.com, 1.0)} | | | |"


def _frames(report: InertiaReport) -> Iterable[str]:
    frames = {link.frame.description for link in report.links.values()}
    if len(frames) == 1:
        frame = _cell(frames.pop())
        yield f"Inertia is about each centre of mass. Frame: {frame}; of the whole assembly: its own."
        return
    yield "Inertia is about each centre of mass. Frames:"
    yield ""
    for link in report.links.values():
        yield f"- {_cell(link.name)}: {_cell(link.frame.description)}"


def _part_rows(report: InertiaReport) -> Iterable[str]:
    yield _row(heading.lstrip(">") for heading in _PART_HEADINGS)
    yield _row("--:" if heading[0] == ">" else "---" for heading in _PART_HEADINGS)
    for link, part in report.parts():
        yield _row(_part_cells(link, part))


def _row(cells: Iterable[str]) -> str:
    return f"| {' | '.join(map(_cell, cells))} |"


def _warning_row(message: str, code: str, where: Sequence[str]) -> str:
    return f"- {f'**{_cell(_places(where))}**: ' if where else ''}{_cell(message)} (`{code}`)"


def _cell(text: str) -> str:
    return re.sub(r"([\\`*_{}\[\]<>|])", r"\\\1", _clean(text))


def _plain(text: str) -> Text:
    return Text("\n".join(_clean(line) for line in text.split("\n")))


def _clean(text: str) -> str:
    """On one line, without control characters: a part's name must not steer a terminal."""
    return " ".join(re.sub(r"[\x00-\x1f\x7f-\x9f]", " ", text).split())


def _short(value: float) -> str:
    return f"{value:.6g}"


def _vector(values: Iterable[float], size: float = 0.0) -> str:
    """Five digits each; what is noise against ``size`` is shown as 0."""
    return "  ".join(f"{value:.5g}" if abs(value) > NOISE * size else "0" for value in values)
