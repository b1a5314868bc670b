# SPDX-License-Identifier: LGPL-2.1-or-later
"""A line of a BOM before and after a change, and why a BOM changes."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from silo_server.values import LineState


class ChangeKind(StrEnum):
    """Why a BOM changed."""

    MERGE = "merge"  # an assembly was synced
    EDIT = "edit"  # a user added, changed or removed lines
    RESOLVE = "resolve"  # a user decided on unreferenced lines or conflicts
    IMPORT = "import"  # a CSV was imported
    RESTORE = "restore"  # an earlier state was brought back
    UNDO = "undo"  # one change was taken back
    FOLDED = "folded"  # the state that changes led to which are no longer kept (SILO_HISTORY_DAYS)


@dataclass(frozen=True, slots=True)
class LineRecord:
    """One line that becomes something else: ``before`` None = new, ``after`` None = removed.

    ``position`` is its place in the BOM, None for a new line at the end.
    """

    line_id: str
    child_id: int
    before: LineState | None
    after: LineState | None
    position: int | None = None

    @property
    def action(self) -> str:
        if self.before is None:
            return "added"
        if self.after is None:
            return "removed"
        return "changed"
