# SPDX-License-Identifier: LGPL-2.1-or-later
"""The end of a commit that is not ours: a fork's ``Origin_Commit``, or an origin's ``commitDocument``.

Nothing is replaced. A menu, a toolbar or a shortcut runs the command through its QAction, which signals us
afterwards; a macro runs it without one, but then the document is saved, which an observer sees, or the origin
is asked, whose method calls us. All of these only note the document; a moment later its BOM is synced, once.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

# Commands of the Kindred workbench that upload a revision (silo-contract §3.3).
FOREIGN = ("Origin_Commit", "Silo_Commit", "Silo_Save")

WAIT_MS = 400


class HookHost(Protocol):
    """What hooking needs of FreeCAD; :mod:`silo.workbench.freecad.host` has it."""

    def command_actions(self, name: str, /) -> list[Any]: ...

    def active_document(self) -> Any: ...

    def documents(self) -> list[Any]: ...

    def origin_of(self, doc: Any, /) -> Any: ...

    def add_document_observer(self, observer: Any, /) -> None: ...


class CommitHook:
    """Notes documents that somebody else commits, and hands each over once.

    ended
        gets a document whose commit has ended.
    has_identity
        True for a document that belongs to Silo: only such a one is synced after a mere save.
    later
        runs a function after some milliseconds.
    """

    def __init__(
        self,
        host: HookHost,
        *,
        ended: Callable[[Any], None],
        has_identity: Callable[[Any], bool],
        later: Callable[[int, Callable[[], None]], None],
    ) -> None:
        self._host, self._ended, self._has_identity, self._later = host, ended, has_identity, later
        self._names: list[str] = []
        self._connected: list[Any] = []
        # Name of the document → True if its commit was seen, False if only its saving was seen.
        self._noted: dict[str, bool] = {}
        self._waiting = False

    def watch(self, name: str) -> None:
        """Notice from now on when this command ends."""
        if not self._names:
            self._host.add_document_observer(self)
        if name not in self._names:
            self._names.append(name)

    def connect(self, _workbench: str = "") -> None:
        """Connect to the commands' QActions; FreeCAD makes them when a workbench shows the command."""
        for name in self._names:
            for action in self._host.command_actions(name):
                if action not in self._connected:
                    self._connected.append(action)
                    action.triggered.connect(self._triggered)
        self._wrap_origin()

    def _triggered(self, *_arguments: Any) -> None:
        doc = self._host.active_document()
        if doc is not None:
            self.note(doc)

    # FreeCAD calls these; an exception in them would only be printed.

    def slotFinishSaveDocument(self, doc: Any, filename: str) -> None:
        """Note that a document is completely on the disk."""
        # "Save a copy" names another file than the document's own.
        from silo.platform.spelling import one_path

        if doc.FileName and one_path(filename) == one_path(doc.FileName):
            self.note(doc, committed=False)

    def slotActivateDocument(self, _doc: Any) -> None:
        """Look again when a user changes to another document."""
        # The document is not the active one yet while FreeCAD reports it.
        self._later(0, self._wrap_origin)

    def _wrap_origin(self) -> None:
        doc = self._host.active_document()
        origin = self._host.origin_of(doc) if doc is not None else None
        commit = getattr(origin, "commitDocument", None)
        if origin is None or not callable(commit) or getattr(commit, "tells_silo", False):
            return

        def commit_document(*arguments: Any) -> Any:
            result = commit(*arguments)
            if result is not False and arguments:
                self.note(arguments[0])
            return result

        commit_document.tells_silo = True  # type: ignore[attr-defined]
        try:
            origin.commitDocument = commit_document
        except (AttributeError, TypeError):
            # An origin written in C++ takes no attributes; its command's QAction signals us.
            return

    def note(self, doc: Any, *, committed: bool = True) -> None:
        """Note that a commit of this document has ended, or that it was only saved."""
        self._noted[doc.Name] = committed or self._noted.get(doc.Name, False)
        if not self._waiting:
            self._waiting = True
            self._later(WAIT_MS, self._flush)

    def _flush(self) -> None:
        self._waiting = False
        noted, self._noted = self._noted, {}
        for doc in self._host.documents():
            if doc.Name in noted and (noted[doc.Name] or self._has_identity(doc)):
                self._ended(doc)
