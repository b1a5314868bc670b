# SPDX-License-Identifier: LGPL-2.1-or-later
"""The terminal that commands print to.

Text of files and servers is shown as text: it may neither steer the terminal nor fill it.
"""

from __future__ import annotations

import sys
from typing import Any, TextIO

from rich.console import Console
from rich.table import Table

from silo import spoken
from silo.bom.message import Message, altered

# A hostile file's name may have 60 MB; a path of the system has 4096 at most.
_LONGEST = 5000

# Of a file or a pipe: each record is one line, but no rule, box or padding grows without bound.
_WIDEST = 20_000
_RULE = 80


class _Terminal(Console):
    def on_broken_pipe(self) -> None:
        """Raise the error when the reader closes the pipe; rich would end with exit code 1."""
        raise BrokenPipeError

    def print(self, *shown: Any, **how: Any) -> None:
        """Print; texts of ours in the person's language."""
        super().print(*(spoken(one) if isinstance(one, str) else one for one in shown), **how)

    def rule(self, title: Any = "", **how: Any) -> None:
        """Draw a line across, of a terminal's width also in a pipe."""
        width = self.width
        self.width = min(width, _RULE)
        super().rule(title, **how)
        self.width = width


def console(stream: TextIO | None = None) -> Console:
    """Open the terminal. A file or a pipe has no width: each record is one whole line there."""
    stream = stream or sys.stdout
    return _Terminal(file=stream, highlight=False, width=None if stream.isatty() else _WIDEST)


def plain(text: str) -> str:
    """Replace control characters in text of a file or a server, and cut it: it may neither steer the terminal
    nor fill it.
    """
    if isinstance(text, Message):
        return altered(text, plain)
    shown = text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"
    return "".join(c if c.isprintable() else "�" for c in shown)


def table_of(*titles: str) -> Table:
    """Begin a table without lines that has these headings."""
    table = Table(box=None, pad_edge=False)
    for title in titles:
        table.add_column(
            spoken(title),
            justify="right" if title == "Quantity" else "left",
            overflow="fold",
            no_wrap=title == "Part number",
            min_width=max((len(word) for word in spoken(title).split()), default=0),  # no heading breaks
        )
    return table
