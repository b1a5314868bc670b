# SPDX-License-Identifier: LGPL-2.1-or-later
"""Two states of a BOM side by side, line by line."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from silo_server.fields import names_of
from silo_server.services.bom.history import NamedItem, PastLine
from silo_server.values import LineState


class Difference(NamedTuple):
    """A line in two states; ``fields`` names what differs. ``status``: added removed changed unchanged."""

    child: NamedItem
    status: str
    before: LineState | None
    after: LineState | None
    fields: Sequence[str]


def compare(before: Sequence[PastLine], after: Sequence[PastLine]) -> list[Difference]:
    """Compare two states side by side; pure. The order is that of the later one; removed lines are last."""
    old = {line.line_id: line.state for line in before}
    new = {line.line_id for line in after}
    rows = [_difference(line.child, old.get(line.line_id), line.state) for line in after]
    rows.extend(_difference(line.child, line.state, None) for line in before if line.line_id not in new)
    return rows


def _difference(child: NamedItem, before: LineState | None, after: LineState | None) -> Difference:
    if before is None:
        return Difference(child, "added", None, after, ())
    if after is None:
        return Difference(child, "removed", before, None, ())
    names = [name for name in names_of(LineState) if getattr(before, name) != getattr(after, name)]
    return Difference(child, "changed" if names else "unchanged", before, after, names)
