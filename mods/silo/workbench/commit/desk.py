# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the flows need of FreeCAD and of the person in front of it; :mod:`silo.workbench.freecad.live_desk`
has it.

With a desk of a test's own the flows run without FreeCAD and Qt. All calls are made in the GUI thread.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from silo.workbench.commit.plan import Documents, Plan, Row
from silo.workbench.commit.snapshot import Snapshot
from silo.workbench.commit.theirs import Choice, Theirs

Look = Callable[[Callable[[Mapping[str, Theirs]], None]], object]


@dataclass(frozen=True)
class Answer:
    """What a person says in the commit dialog.

    register
        give it a part number as well.
    choices
        what to do about files that colleagues have changed, beside committing.
    """

    rows: tuple[Row, ...]
    comment: str = ""
    register: bool = False
    choices: tuple[tuple[Row, Theirs, Choice], ...] = ()


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

    def identity(self, doc: Any, /) -> str | None:
        """The item that a document belongs to, without looking at its components."""

    def ask(self, planned: Plan, note: str, comment: str, look: Look, /) -> Answer | None:
        """Which documents to commit, with which comment; None where the person does not want to.

        comment
            what the person wrote before and is not in Silo yet.
        look
            begins to look at Silo, and calls back with what colleagues did meanwhile.
        """

    def warn(self, title: str, text: str, /) -> None:
        """A message that a person must have seen."""

    def later(self, call: Callable[[], None], /) -> None:
        """Run something in a turn of its own, once the present event is done."""
