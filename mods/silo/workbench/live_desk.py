# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD and its user, as the flows want them (:mod:`silo.workbench.desk`)."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

from silo.bom.errors import DocumentError
from silo.bom.message import message
from silo.bom.walk.links import extract, file_item
from silo.freecads.open_documents import open_in_any
from silo.workbench.commit.desk import CommitAnswer, Look
from silo.workbench.commit.plan import CommitPlan
from silo.workbench.documents.opened import Opened
from silo.workbench.documents.snapshot import Snapshot, take
from silo.workbench.freecad import host, live, saving, witness
from silo.workbench.freecad.components import (
    look_at,
    remove_identity,
    restore_identity,
    unedited,
    write_identity,
)
from silo.workbench.freecad.damage import damage
from silo.workbench.freecad.identities import write_answer
from silo.workbench.freecad.lost import lost_objects
from silo.workbench.freecad.modified import is_edited, is_modified
from silo.workbench.freecad.opening import open_fully
from silo.workbench.freecad.relink import relink
from silo.workbench.gui import qt

if TYPE_CHECKING:
    from silo.bom.entry import Extraction
    from silo.bom.key import Key
    from silo.workbench.colleagues.theirs import Theirs
    from silo.workbench.freecad.overlay import Overlay
    from silo.workbench.freecad.witness import SolidCount
    from silo.workbench.ghost import Differences, Ghost
    from silo.workbench.preview.flow import PreviewFlow
    from silo.workbench.register.flow import RegisterFlow


class LiveDocuments:
    """FreeCAD's documents, as :class:`silo.workbench.desk.Documents` wants them."""

    linked = staticmethod(host.linked_documents)
    is_partial = staticmethod(host.is_partial)
    is_modified = staticmethod(is_modified)
    is_edited = staticmethod(is_edited)
    is_writable = staticmethod(saving.is_writable)
    lost_objects = staticmethod(lost_objects)
    save = staticmethod(saving.save)

    def __init__(self, opened: Opened) -> None:
        self.base = opened.of

    def is_damaged(self, doc: Any) -> bool:
        """Return True if the document's file cannot be read to its end."""
        return damage(doc.FileName) is not None


class LiveDesk:
    """One per FreeCAD. Widgets are imported when a user is to see one."""

    def __init__(self, opened: Opened, count_hardware: Callable[[], bool] = lambda: True) -> None:
        self._count_hardware = count_hardware
        self.documents = LiveDocuments(opened)

    def snapshot(self, doc: Any) -> Snapshot:
        """Take a snapshot; the assembly that is active in the 3D view decides between several."""
        hardware = self._count_hardware()
        if (whole := live.in_file(doc)) is not None:
            return take(whole, walk=partial(extract, hardware=hardware))
        cached = live.cached_document(doc)
        walk = partial(live.extract_object, hardware=hardware)
        return take(cached, assembly=self._hint(doc, cached), walk=walk)

    def _hint(self, doc: Any, cached: Any) -> Any:
        active = host.active_assembly() if host.has_gui() else None
        return cached.getObject(active.Name) if active is not None and active.Document == doc else None

    find = staticmethod(host.find_document)
    open = staticmethod(open_fully)
    close = staticmethod(host.close_document)
    save_copy = staticmethod(saving.save_copy)

    def open_paths(self) -> tuple[str, ...]:
        """Return the files that this FreeCAD has open."""
        return tuple(doc.FileName for doc in host.documents() if doc.FileName)

    def is_open_elsewhere(self, path: str) -> bool:
        """Return True if another FreeCAD of this user has the file open."""
        return open_in_any().has_file(path)

    look_at = staticmethod(look_at)
    write_identity = staticmethod(write_identity)
    remove_identity = staticmethod(remove_identity)
    restore_identity = staticmethod(restore_identity)
    unedited = staticmethod(unedited)
    save_marked = staticmethod(saving.save_marked)
    relink = staticmethod(relink)
    write_answer = staticmethod(write_answer)

    def accounts(self, extraction: Extraction) -> list[SolidCount]:
        """Compare the solids that FreeCAD shows with those that the BOM explains."""
        with qt.wait_cursor():
            return witness.accounts(extraction, hardware=self._count_hardware())

    def why(self, doc: Any, assembly: str, parts: Collection[Key]) -> list[str]:
        """Say why an assembly has this quantity of a part: the number, then each chain to it."""
        return live.why_object(doc, assembly, parts, hardware=self._count_hardware())

    def save_as(self, _doc: Any) -> None:
        """Show FreeCAD's own dialog to save the active document."""
        host.run_command("Std_Save")

    def identity(self, doc: Any) -> str | None:
        """Return the item of a document; if it holds several assemblies, that of the active one. Each commit
        begins with this.
        """
        cached = live.cached_document(doc)
        return file_item(cached, self._hint(doc, cached))

    def ask(self, planned: CommitPlan, note: str, comment: str, look: Look) -> CommitAnswer | None:
        """Show the commit dialog, and return the answer; None if the person cancels."""
        from silo.workbench.commit.dialog import CommitDialog

        dialog = CommitDialog(planned, host.main_window(), note=note, comment=comment)
        shown = [dialog]

        def back(theirs: Mapping[str, Theirs]) -> None:
            for commit_dialog in shown:  # the look at Silo may end after the person has answered
                commit_dialog.show_theirs(theirs)

        look(back)
        try:
            return dialog.answer() if qt.run_dialog(dialog) else None
        finally:
            shown.clear()
            dialog.deleteLater()

    def preview_window(self, title: str, path: str, flow: PreviewFlow) -> Any:
        """Open the preview window."""
        from silo.workbench.preview.dialog import PreviewDialog

        window = PreviewDialog(title, path, flow, host.main_window())
        window.show()
        return window

    def light(self, doc: Any, names: Sequence[str]) -> int:
        """Select objects and draw them in front of what covers them."""
        return self._overlay.light(doc, names)

    def compare(self, path: str, revision: int, theirs: Sequence[Ghost]) -> Differences | None:
        """Draw another revision as a ghost beside a document, or remove it."""
        doc = host.find_document(path)
        if doc is None:
            raise DocumentError(path, message("it is not open any more"))
        if self._overlay.ghost_of == (path, revision):
            self._overlay.clear()
            return None
        extraction = self.snapshot(doc).extraction
        if extraction is None:
            raise DocumentError(path, message("it holds no assembly, so there is nothing to compare"))
        mine = [name for entry in extraction.entries for name in entry.instances]
        differences = self._overlay.compare(doc, extraction.assembly.object_name, mine, theirs)
        self._overlay.ghost_of = (path, revision)
        return differences

    @cached_property
    def _overlay(self) -> Overlay:
        from silo.workbench.freecad.overlay import Overlay

        return Overlay()

    def register_window(self, title: str, path: str, flow: RegisterFlow, *, asks: bool) -> Any:
        """Open the Register Parts dialog."""
        from silo.workbench.register.dialog import RegisterDialog

        window = RegisterDialog(title, path, flow, host.main_window(), asks=asks)
        window.show()
        return window

    def warn(self, title: str, text: str) -> None:
        """Show a message box."""
        from silo.workbench.gui import widgets

        widgets.warn(host.main_window(), title, text)

    def later(self, call: Callable[[], None]) -> None:
        """Run it later, in Qt's event loop."""
        qt.later(0, call)
