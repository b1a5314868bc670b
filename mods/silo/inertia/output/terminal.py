# SPDX-License-Identifier: LGPL-2.1-or-later
"""A report as tables for a terminal. Names are text, never markup."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from silo.bom.errors import counted, listed
from silo.bom.message import message
from silo.inertia.output.words import (
    MAX_PLACES,
    PART_HEADINGS,
    Say,
    clean,
    grouped,
    link_cells,
    loose,
    part_cells,
    short,
    vector,
)
from silo.inertia.report import InertiaReport

MAX_PART_ROWS = 60
"""Rows of parts in a terminal; a pipe, JSON, CSV and Markdown have them all."""


def report_tables(report: InertiaReport, *, whole: bool = False, say: Say = str) -> RenderableType:
    """Write links, parts and warnings for a terminal, in the words of ``say``.

    ``whole``: all rows, each on one line, for a pipe.
    """
    tables = (_links_table(report, say, whole=whole), _parts_table(report, say, whole=whole))
    head = [Text(clean(say(report.reconciliation.sentence))), Text()] if report.reconciliation else []
    return Group(*head, tables[0], Text(), tables[1], Text(), report_warnings(report, whole=whole, say=say))


def _table(title: str, headings: Iterable[str], say: Say) -> Table:
    """Lay out a table; ``headings`` of columns that are flush right begin with ">"."""
    table = Table(title=_plain(say(title)), title_justify="left")
    for heading in headings:
        table.add_column(say(heading.lstrip(">")), justify="right" if heading[0] == ">" else "left")
    return table


def _links_table(report: InertiaReport, say: Say, *, whole: bool) -> Table:
    tensor = ">Ixx Iyy Izz / Ixy Ixz Iyz  kg m²"
    headings = ("Link", ">Mass kg", ">Centre of mass m", tensor, ">Parts", ">Warnings")
    table = _table(
        message("{assembly}: mass properties", assembly=report.assembly or "assembly"), headings, say
    )
    for link in report.links.values():
        name, mass, com, moments, products, parts = link_cells(link)
        warnings = str(sum(w.link_name == link.name for w in report.warnings))
        inertia = f"{moments}{' / ' if whole else chr(10)}{products}"
        table.add_row(*map(_plain, (name, mass, com, inertia, parts, warnings)))
    if report.total is not None and not _is_one_body(report):
        table.add_section()
        cells: tuple[str, ...] = (
            say(message("whole assembly")),
            short(report.total.mass),
            vector(report.total.com, 1.0),
            say(message("in no link: {report} kg", report=short(loose(report)))) if report.unclaimed else "",
            str(sum(part.quantity for _, part in report.parts())),
            str(len(report.warnings)),
        )
        table.add_row(*map(_plain, cells))
    return table


def _parts_table(report: InertiaReport, say: Say, *, whole: bool) -> RenderableType:
    skip = int(_is_one_body(report))  # the link's name
    table = _table(message("Parts and where their masses come from"), PART_HEADINGS[skip:], say)
    rows = report.parts()
    most = len(rows) if whole else MAX_PART_ROWS
    for link, part in rows[:most]:
        table.add_row(
            *map(_plain, part_cells(link, part, say)[skip:]), style="yellow" if part.warnings else ""
        )
    if len(rows) > most:
        table.caption = say(
            message("… and {count} more; --report parts.csv has them all", count=len(rows) - most)
        )
    return table


def _is_one_body(report: InertiaReport) -> bool:
    return len(report.links) == 1 and not report.unclaimed


def report_warnings(report: InertiaReport, *, whole: bool = False, say: Say = str) -> Text:
    """Write the warnings for a terminal, a line for each cause: mass at stake, parts, the first message.

    ``whole``: with all places; ``say`` says them in the language of a user.
    """
    if not report.warnings:
        return Text(say(message("No warnings.")), style="green")
    text = Text(
        message("{warnings}\n", warnings=say(counted(len(report.warnings), "warning"))), style="yellow"
    )
    for cause in report.causes():
        groups = grouped(cause.warnings, with_links=not _is_one_body(report))
        where = list(dict.fromkeys(place for places in groups.values() for place in places))
        mass = message("{mass} kg in ", mass=short(cause.mass)) if cause.mass > 0 else ""
        places = ", ".join(where) if whole else listed(where, MAX_PLACES)
        text.append(message("  {mass}{places}: ", mass=mass, places=places) if where else "  ", style="bold")
        text.append(clean(say(next(iter(groups))[0])))
        more = (
            message("; {count} more like it, each in --json and in a report", count=len(groups) - 1)
            if len(groups) > 1
            else ""
        )
        text.append(message("{more}  [{code}]\n", more=say(more), code=cause.code), style="dim")
    return text


def _plain(text: str) -> Text:
    return Text("\n".join(clean(line) for line in text.split("\n")))
