# SPDX-License-Identifier: LGPL-2.1-or-later
"""What getting files from Silo asks of FreeCAD and its user, beside what all flows ask
(:mod:`silo.workbench.desk`).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

from silo.workbench.desk import Desk
from silo.workbench.ghost import Differences, Ghost


class RevisionDesk(Desk, Protocol):
    """The desk as the flows of revisions need it."""

    def save_copy(self, doc: Any, path: Path, /) -> None:
        """Write a document, with its unsaved edits, to another file."""

    def open_paths(self) -> tuple[str, ...]:
        """Return the files that this FreeCAD has open."""

    def is_open_elsewhere(self, path: str, /) -> bool:
        """Return True if another FreeCAD of this user has the file open."""

    def compare(self, path: str, revision: int, theirs: Sequence[Ghost], /) -> Differences | None:
        """Draw another revision as a ghost beside a document; None if it was drawn already, and is removed.

        Raises DocumentError if the document is not open.
        """
