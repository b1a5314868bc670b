# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the flows need of FreeCAD and of the person in front of it; :mod:`silo.workbench.freecad.live_desk`
has it.

With a desk of a test's own the flows run without FreeCAD and Qt. All calls are made in the GUI thread.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from silo.workbench.commit.plan import Documents, Plan, Row
from silo.workbench.commit.snapshot import Snapshot


class Desk(Protocol):
    """FreeCAD's documents, its window, and a person."""

    @property
    def documents(self) -> Documents: ...

    def snapshot(self, doc: Any, /) -> Snapshot:
        """Snapshot of a live document."""

    def find(self, path: str, /) -> Any | None:
        """The open document of a file; None where it is not open."""

    def save_as(self, doc: Any, /) -> None:
        """Let a person give a document its first name."""

    def ask(self, planned: Plan, note: str, /) -> tuple[tuple[Row, ...], str] | None:
        """Which documents to commit, and the comment; None where the person does not want to."""

    def warn(self, title: str, text: str, /) -> None:
        """A message that a person must have seen."""

    def later(self, call: Callable[[], None], /) -> None:
        """Run something in a turn of its own, once the present event is done."""
