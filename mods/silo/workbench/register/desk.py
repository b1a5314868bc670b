# SPDX-License-Identifier: LGPL-2.1-or-later
"""What registering asks of FreeCAD and its user, beside what all flows ask (:mod:`silo.workbench.desk`)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Protocol

from silo.workbench.desk import Desk

if TYPE_CHECKING:
    from silo.registering.candidate import Candidate, OpenedFile
    from silo.workbench.register.flow import RegisterFlow, RegisterWindow


class RegisterDesk(Desk, Protocol):
    """The desk as registering needs it."""

    def register_window(self, title: str, path: str, flow: RegisterFlow, /, *, asks: bool) -> RegisterWindow:
        """Open the Register Parts dialog of a document."""

    def look_at(self, paths: Iterable[str], /) -> dict[str, OpenedFile]:
        """Find out how the files of components stand."""

    def write_identity(self, candidate: Candidate, identity: str, /) -> None:
        """Write an identity into a component's document and save it."""

    def remove_identity(self, candidate: Candidate, /, *, no_part: bool) -> None:
        """Take the identity from an object modelled in an assembly's own file, and save it; with or without
        the mark that it is no part.
        """

    def restore_identity(self, candidate: Candidate, /) -> None:
        """Give a component's file the identity that it had before it was registered, or none, and save it."""

    def unedited(self) -> list[Any]:
        """Return the documents without unsaved edits, each after those to which it links."""

    def save_marked(self, doc: Any, /) -> None:
        """Save a document that was unedited, if FreeCAD has marked it because of a file below it."""
