# SPDX-License-Identifier: LGPL-2.1-or-later
"""Two columns of one meaning whose cells differ: which one counts is a question."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from silo.bom.headers import plain_cell


@dataclass(frozen=True, slots=True)
class Clash:
    """Two columns of one meaning that differ in a row: index of that row, and both texts."""

    role: str
    ours: str
    other: str
    row: int
    used: str
    unused: str


def find_clashes(
    header: Sequence[str],
    rows: Sequence[Sequence[str]],
    at: Mapping[str, int],
    seconds: Iterable[tuple[str, int]],
    is_empty: Callable[[str], bool] = lambda text: not text,
) -> list[Clash]:
    """Make a clash for each of the ``seconds`` that differs from the used column (``at``)."""
    return [
        Clash(role, header[at[role]].strip(), header[index].strip(), number, used, unused)
        for role, index in seconds
        for number, used, unused in _differences(rows, at[role], index, is_empty)
    ]


def _differences(
    rows: Sequence[Sequence[str]], used: int, other: int, is_empty: Callable[[str], bool]
) -> list[tuple[int, str, str]]:
    """Return the first row in which the columns differ; [] if none does."""
    for number, cells in enumerate(rows):
        ours, theirs = (plain_cell(cells[i].strip()) if i < len(cells) else "" for i in (used, other))
        if not is_empty(theirs) and theirs != ours:
            return [(number, ours, theirs)]
    return []
