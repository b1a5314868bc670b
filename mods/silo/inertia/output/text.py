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
    warnings = _warnings_text(report.warnings, with_links=not _is_one_body(report))
    return Group(_links_table(report), Text(), _parts_table(report), Text(), warnings)


def _links_table(report: InertiaReport) -> Table:
    table = Table(title=_plain(f"{report.assembly or 'assembly'}: mass properties"), title_justify="left")
    for heading, justify in (("Link", "left"), ("Mass kg", "right"), ("Centre of mass m", "right")):
        table.add_column(heading, justify=justify)  # type: ignore[arg-type]
    table.add_column("Ixx Iyy Izz / Ixy Ixz Iyz  kg m²", justify="right")
    table.add_column("Parts", justify="right")
    table.add_column("Warnings", justify="right")
    for link in report.links.values():
        table.add_row(*(_plain(cell) for cell in _link_cells(report, link)))
    if report.total is not None and not _is_one_body(report):
        table.add_section()
        loose = sum(part.total_mass for part in report.unclaimed)
        table.add_row(
            _plain("whole assembly"),
            _plain(_short(report.total.mass)),
            _plain(_vector(report.total.com, 1.0)),
            _plain(f"in no link: {_short(loose)} kg" if report.unclaimed else ""),
            _plain(str(sum(part.quantity for _, part in report.parts()))),
            _plain(str(len(report.warnings))),
        )
    return table


def _link_cells(report: InertiaReport, link: LinkResult) -> Sequence[str]:
    moments, products = _tensor(link)
    return (
        link.name,
        _short(link.props.mass),
        _vector(link.props.com, 1.0),
        f"{moments}\n{products}",
        str(sum(part.quantity for part in link.parts)),
        str(sum(w.link_name == link.name for w in report.warnings)),
    )


def _tensor(link: LinkResult) -> tuple[str, str]:
    t = link.props.inertia
    size = float(abs(t).max())
    return _vector((t[0, 0], t[1, 1], t[2, 2]), size), _vector((t[0, 1], t[0, 2], t[1, 2]), size)


def _parts_table(report: InertiaReport) -> RenderableType:
    table = Table(title="Parts and where their masses come from", title_justify="left")
    with_links = not _is_one_body(report)
    for heading in ("Link", "Part") if with_links else ("Part",):
        table.add_column(heading)
    for heading in ("Qty", "Volume cm³", "Mass kg"):
        table.add_column(heading, justify="right")
    for heading in ("Source", "Matched", "Material"):
        table.add_column(heading)
    rows = report.parts()
    for link, part in rows[:MAX_PART_ROWS]:
        cells = [
            part.name,
            str(part.quantity),
            f"{part.volume * 1e6:.5g}",
            _short(part.mass),
            SOURCE_WORDS[part.source],
            how(part),
            material_of(part),
        ]
        shown = [link or "(no link)", *cells] if with_links else cells
        table.add_row(*(_plain(cell) for cell in shown), style="yellow" if part.warnings else "")
    if len(rows) > MAX_PART_ROWS:
        table.caption = f"… and {len(rows) - MAX_PART_ROWS} more; --report parts.csv has them all"
    return table


def _is_one_body(report: InertiaReport) -> bool:
    return len(report.links) == 1 and not report.unclaimed


def _warnings_text(warnings: Sequence[PartWarning], *, with_links: bool) -> Text:
    if not warnings:
        return Text("No warnings.", style="green")
    text = Text(f"{len(warnings)} {'warning' if len(warnings) == 1 else 'warnings'}\n", style="yellow")
    for (message, code), where in _grouped(warnings, with_links=with_links).items():
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
        loose = sum(part.total_mass for part in report.unclaimed)
        out += [f"Parts without a link sum up to {_short(loose)} kg; they are in no link's mass.", ""]
    out += ["## Warnings", ""]
    out += [_warning_row(*group, where) for group, where in _grouped(report.warnings).items()] or ["None."]
    return "\n".join(out) + "\n"


def _link_rows(report: InertiaReport) -> Iterable[str]:
    yield "| Link | Mass kg | Centre of mass m | Ixx, Iyy, Izz kg m² | Ixy, Ixz, Iyz kg m² | Parts |"
    yield "|---|--:|--:|--:|--:|--:|"
    for link in report.links.values():
        moments, products = _tensor(link)
        yield (
            f"| {_cell(link.name)} | {_short(link.props.mass)} | {_vector(link.props.com, 1.0)} "
            f"| {moments} | {products} | {sum(part.quantity for part in link.parts)} |"
        )
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
    yield "| Link | Part | Qty | Mass kg | Source | Matched | Material | Volume cm³ |"
    yield "|---|---|--:|--:|---|---|---|--:|"
    for link, part in report.parts():
        yield (
            f"| {_cell(link) or '(no link)'} | {_cell(part.name)} | {part.quantity} | {_short(part.mass)} "
            f"| {SOURCE_WORDS[part.source]} | {how(part)} | {_cell(material_of(part))} "
            f"| {part.volume * 1e6:.4g} |"
        )


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
