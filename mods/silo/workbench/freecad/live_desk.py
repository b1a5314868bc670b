# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD and the person in front of it, as the flows want them
(:class:`silo.workbench.commit.desk.Desk`)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from silo.open_in_freecad import open_in_any
from silo.workbench.commit import snapshot
from silo.workbench.commit.desk import Answer, Look
from silo.workbench.commit.opened import Opened
from silo.workbench.commit.plan import Plan
from silo.workbench.commit.snapshot import Snapshot
from silo.workbench.freecad import components, host, live, saving
from silo.workbench.gui import qt

if TYPE_CHECKING:
    from silo.bom.findings import Finding
    from silo.bom.model import Extraction
    from silo.workbench.commit.theirs import Theirs
    from silo.workbench.freecad.witness import Account
    from silo.workbench.preview.flow import PreviewFlow
    from silo.workbench.register.flow import RegisterFlow


class LiveDocuments:
    """FreeCAD's documents, as :class:`silo.workbench.commit.plan.Documents` wants them."""

    linked = staticmethod(host.linked_documents)
    is_partial = staticmethod(host.is_partial)
    is_modified = staticmethod(saving.is_modified)
    is_edited = staticmethod(saving.is_edited)
    is_writable = staticmethod(saving.is_writable)
    lost_assemblies = staticmethod(live.lost_assemblies)
    save = staticmethod(saving.save)

    def __init__(self, opened: Opened) -> None:
        self.base = opened.of

    def is_damaged(self, doc: Any) -> bool:
        """True where the document's file cannot be read to its end."""
        return saving.damage(doc.FileName) is not None


class LiveDesk:
    """One per FreeCAD. Widgets are imported when a person is to see one."""

    def __init__(self, opened: Opened, count_hardware: Callable[[], bool] = lambda: True) -> None:
        self._count_hardware = count_hardware
        self.documents = LiveDocuments(opened)

    def snapshot(self, doc: Any) -> Snapshot:
        """The assembly that is active in the 3D view decides between several."""
        cached = live.cached_document(doc)
        hardware = self._count_hardware()
        walk = partial(live.extract_object, hardware=hardware)
        return snapshot.take(cached, assembly=self._hint(doc, cached), walk=walk)

    def _hint(self, doc: Any, cached: Any) -> Any:
        active = host.active_assembly() if host.has_gui() else None
        return cached.getObject(active.Name) if active is not None and active.Document == doc else None

    find = staticmethod(host.find_document)
    open = staticmethod(saving.open_fully)
    close = staticmethod(host.close_document)
    save_copy = staticmethod(saving.save_copy)

    def open_paths(self) -> tuple[str, ...]:
        """The files that this FreeCAD has open."""
        return tuple(doc.FileName for doc in host.documents() if doc.FileName)

    def is_open_elsewhere(self, path: str) -> bool:
        """True where another FreeCAD of this user has the file open."""
        return open_in_any().has_file(path)

    look_at = staticmethod(components.look_at)
    write_identity = staticmethod(components.write_identity)
    remove_identity = staticmethod(components.remove_identity)
    unedited = staticmethod(components.unedited)
    save_marked = staticmethod(components.save_marked)

    def accounts(self, extraction: Extraction) -> list[Account]:
        """The solids that FreeCAD shows, against those that the BOM explains."""
        from silo.workbench.freecad import witness

        with qt.wait_cursor():
            return witness.accounts(extraction, hardware=self._count_hardware())

    def relink(self, finding: Finding) -> list[str]:
        """Set live links to the file that was meant; their labels."""
        from silo.workbench.freecad import relinking

        return relinking.relink(finding)

    def save_as(self, _doc: Any) -> None:
        """FreeCAD's own dialog, for the active document."""
        host.run_command("Std_Save")

    def identity(self, doc: Any) -> str | None:
        """By the assembly that is active, where the document holds several."""
        cached = live.cached_document(doc)
        return snapshot.identity(cached, self._hint(doc, cached))

    def is_registered(self, doc: Any) -> bool:
        """As :meth:`identity` finds it, sooner: each commit begins with this."""
        cached = live.cached_document(doc)
        return snapshot.is_registered(cached, self._hint(doc, cached))

    def ask(self, planned: Plan, note: str, comment: str, look: Look) -> Answer | None:
        """The commit dialog."""
        from silo.workbench.commit.dialog import CommitDialog

        dialog = CommitDialog(planned, host.main_window(), note=note, comment=comment)
        shown = [dialog]

        def back(found: Mapping[str, Theirs]) -> None:
            for one in shown:  # the look at Silo may end after the person has answered
                one.show_theirs(found)

        look(back)
        try:
            return dialog.answer() if qt.run_dialog(dialog) else None
        finally:
            shown.clear()
            dialog.deleteLater()

    def preview_window(self, title: str, path: str, flow: PreviewFlow) -> Any:
        """The preview window."""
        from silo.workbench.preview.dialog import PreviewDialog

        window = PreviewDialog(title, path, flow, host.main_window())
        window.show()
        return window

    def register_window(self, title: str, path: str, flow: RegisterFlow, *, asks: bool) -> Any:
        """The Register Parts dialog."""
        from silo.workbench.register.dialog import RegisterDialog

        window = RegisterDialog(title, path, flow, host.main_window(), asks=asks)
        window.show()
        return window

    def warn(self, title: str, text: str) -> None:
        """A message box."""
        from silo.workbench.gui import widgets

        widgets.warn(host.main_window(), title, text)

    def later(self, call: Callable[[], None]) -> None:
        """In Qt's event loop."""
        qt.later(0, call)
