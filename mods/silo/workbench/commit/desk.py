# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a commit asks of FreeCAD and its user, beside what all flows ask (:mod:`silo.workbench.desk`)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from silo.workbench.colleagues.theirs import Choice, Theirs
from silo.workbench.commit.plan import CommitPlan, DocumentRow
from silo.workbench.desk import Desk

Look = Callable[[Callable[[Mapping[str, Theirs]], None]], object]


@dataclass(frozen=True)
class CommitAnswer:
    """What a user says in the commit dialog.

    register
        give it a part number as well.
    choices
        what to do about files that colleagues have changed, beside committing.
    """

    rows: tuple[DocumentRow, ...]
    comment: str = ""
    register: bool = False
    choices: tuple[tuple[DocumentRow, Theirs, Choice], ...] = ()


class CommitDesk(Desk, Protocol):
    """The desk as a commit needs it."""

    def save_as(self, doc: Any, /) -> None:
        """Let a user give a document its first name."""

    def ask(self, planned: CommitPlan, note: str, comment: str, look: Look, /) -> CommitAnswer | None:
        """Ask which documents to commit, and with which comment; None if the person cancels.

        comment
            what the person wrote before, if it is not in Silo yet.
        look
            asks Silo, and calls back with what colleagues did meanwhile.
        """
