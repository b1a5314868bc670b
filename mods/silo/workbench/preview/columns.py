# SPDX-License-Identifier: LGPL-2.1-or-later
"""The columns of the preview, each once: its title, its text, how wide it may be. No Qt.

A new column is a line here (and, where its value is new, a field of
:class:`~silo.workbench.preview.rows.Row`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from silo.workbench.preview.rows import Kind, Row
from silo.workbench.words import translate

SIGNS = {
    Kind.ADDED: "+",
    Kind.CHANGED: "~",
    Kind.CONFLICT: "⚡",
    Kind.UNREFERENCED: "⚠",
    Kind.MANUAL: "✎",
    Kind.UNREGISTERED: "?",
    Kind.UNCHANGED: "=",
}


@dataclass(frozen=True)
class Column:
    """One column.

    least, most
        its width in pixels; ``most`` 0 takes the rest of the window.
    right
        numbers stand at the right.
    tip
        its text is a tool tip too.
    """

    name: str
    title: str
    text: Callable[[Row], str]
    least: int = 0
    most: int = 0
    right: bool = False
    tip: bool = False


def columns() -> tuple[Column, ...]:
    """From left to right; made anew, for titles are translated."""
    return (
        Column("number", translate("Silo", "Part number"), _number, 130, 240),
        Column("name", translate("Silo", "Name"), lambda row: row.name, 150, 280),
        Column("cad", translate("Silo", "Assembly"), lambda row: row.cad, 66, 110, right=True),
        Column("silo", translate("Silo", "In Silo"), lambda row: row.silo, 66, 110, right=True),
        Column("note", translate("Silo", "What a sync does"), lambda row: row.note, tip=True),
    )


def sentence(row: Row) -> str:
    """The text of a row that is a sentence and takes the whole width."""
    return " ".join(filter(None, (row.number, row.name or row.note)))


def _number(row: Row) -> str:
    return f"{SIGNS.get(row.kind, '')} {row.number}".strip()
