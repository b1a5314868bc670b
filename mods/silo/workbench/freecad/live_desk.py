# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD and the person in front of it, as the flows want them
(:class:`silo.workbench.commit.flow.Desk`).

Part number and state of the selected components in FreeCAD's property editor, as the group "Silo".

The properties are shown only: they are read only, are not written into the file, touch nothing and mark no
document. FreeCAD measures the whole assembly for its axis cross after each change of a member, so an object
gets them when it is selected, which is when the property editor shows it. GUI thread.

How the files of components stand, and identities in them. GUI thread.

Live links that lead nowhere, led to the file that was meant. GUI thread; the person saves them.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from silo.bom.document import LinkProblem, located
from silo.bom.errors import DocumentError
from silo.bom.findings import Finding
from silo.bom.links import file_item
from silo.freecads import open_in_any, open_in_others
from silo.registering.offer import Candidate, Seen, State
from silo.workbench.commit import plan
from silo.workbench.commit.flow import Answer, Look
from silo.workbench.commit.opened import Opened
from silo.workbench.commit.plan import Plan, Snapshot, leaves_first
from silo.workbench.freecad import host, live, saving
from silo.workbench.freecad.edits import SHOWN_NUMBER, SHOWN_STATE
from silo.workbench.gui import qt
from silo.workbench.words import translate

if TYPE_CHECKING:
    from silo.bom.model import BomEntry, Extraction
    from silo.bom.walk.tree import Key
    from silo.workbench.commit.flow import Theirs
    from silo.workbench.freecad.witness import Account
    from silo.workbench.preview.flow import PreviewFlow
    from silo.workbench.register.flow import RegisterFlow


# Of more objects the property editor shows only what they have in common.
MOST = 20
# FreeCAD's numbers for "asks for no recompute" and "not written into the file" (App::PropertyType).
_OUTPUT, _NO_PERSIST = 8, 32


class SiloGroup:
    """A selection observer. It keeps part number and state of each component: document → its file, and
    object → both. A click costs no look at the disk, which may be a slow network's."""

    def __init__(self) -> None:
        self._known: dict[str, tuple[str, dict[str, tuple[str, str]]]] = {}
        self._is_due = False
        host.add_selection_observer(self)

    def know(self, path: str, entries: Iterable[BomEntry]) -> None:
        """Take over what Silo knows of the components of a document, where it is open."""
        doc = host.find_document(path)
        if doc is None:
            return
        open_now = {one.Name for one in host.documents()}
        self._known = {name: known for name, known in self._known.items() if name in open_now}
        in_silo = translate("Silo", "in Silo")
        left_out = translate("Silo", "not registered: left out of the BOM")
        components = {
            name: (entry.part_number or "", in_silo if entry.part_number else left_out)
            for entry in entries
            for name in entry.instances
        }
        self._known[doc.Name] = str(doc.FileName), components
        self._soon()

    # FreeCAD calls these, once for each object; what is selected then is looked at once.

    def addSelection(self, *_what: Any) -> None:
        """One more is selected."""
        self._soon()

    def setSelection(self, *_what: Any) -> None:
        """Others are selected."""
        self._soon()

    def _soon(self) -> None:
        if not self._is_due:
            self._is_due = True
            qt.later(0, self._show)

    def _show(self) -> None:
        self._is_due = False
        wanted = []
        for doc, name in host.selected():
            file, components = self._known.get(doc.Name, ("", {}))
            if name in components and doc.FileName == file:  # another document may have its name by now
                wanted.append((doc.getObject(name), components[name]))
        left = [(obj, told) for obj, told in wanted[:MOST] if obj is not None and not _is_shown(obj, *told)]
        if left:
            with saving.others_unmarked():
                for obj, (number, state) in left:
                    _put(obj, SHOWN_NUMBER, number, translate("Silo", "Part number in Silo"))
                    _put(obj, SHOWN_STATE, state, translate("Silo", "What Silo knows of this component"))


def _is_shown(obj: Any, number: str, state: str) -> bool:
    # A link without them would answer with those of its part.
    if SHOWN_STATE not in obj.PropertiesList:
        return False
    return (number, state) == (obj.getPropertyByName(SHOWN_NUMBER), obj.getPropertyByName(SHOWN_STATE))


def _put(obj: Any, name: str, value: str, tip: str) -> None:
    if name not in obj.PropertiesList:
        obj.addProperty("App::PropertyString", name, "Silo", tip, _OUTPUT | _NO_PERSIST, True)
    if obj.getPropertyByName(name) == value:
        return
    obj.setPropertyStatus(name, "NoModify")
    setattr(obj, name, value)


def look_at(paths: Iterable[str]) -> dict[str, Seen]:
    """How the files of components stand. GUI thread; what needs the disk's content is left to the worker."""
    known = host.documents_by_path()
    own = next((str(doc.TransientDir) for doc in known.values()), "")
    elsewhere = open_in_others(own)
    seen = {}
    for path in dict.fromkeys(paths):
        seen[path] = _look_at(path, known)
        spelt = known[path].FileName if path in known else ""
        if seen[path].state.usable and elsewhere.has(path, spelt):
            seen[path] = replace(seen[path], state=State.ELSEWHERE)
    return seen


def _look_at(path: str, known: Mapping[str, Any]) -> Seen:
    if not path:
        return Seen(State.UNNAMED)
    if not os.path.isfile(path):
        return Seen(State.MISSING)
    if not saving.is_writable(path):
        return Seen(State.READ_ONLY)
    doc = known.get(path)
    if doc is None:
        return Seen(State.READY)
    if live.lost_assemblies(doc):
        return Seen(State.LOST)
    saved_at = str(getattr(doc, "LastModifiedDate", "") or "")
    if not saving.is_modified(doc):
        return Seen(State.READY, saved_at)
    return Seen(State.PARTIAL if host.is_partial(doc) else State.EDITED, saved_at)


def write_identity(candidate: Candidate, identity: str) -> None:
    """Write an identity into a component's document and save it. GUI thread."""
    entry = candidate.entry
    doc = saving.open_fully(entry.doc_path)
    if live.lost_assemblies(doc):
        raise DocumentError(entry.doc_path, "made by a newer FreeCAD; saving it here would destroy it")
    whole = not candidate.shares_file
    for name in candidate.article.objects if candidate.article is not None else (entry.object_name,):
        saving.write_identity(doc, name, identity, whole_document=whole)
    saving.save(doc, mark_parents=True)


def remove_identity(candidate: Candidate, *, no_part: bool) -> None:
    """Take the identity from what is modelled in an assembly's own file, and save it. GUI thread.

    no_part
        mark it as no part as well; otherwise such a mark goes too.
    """
    doc = saving.open_fully(candidate.entry.doc_path)
    if live.lost_assemblies(doc):
        raise DocumentError(doc.FileName, "made by a newer FreeCAD; saving it here would destroy it")
    for name in candidate.article.objects if candidate.article is not None else ():
        saving.remove_identity(doc, name, no_part=no_part)
    saving.save(doc, mark_parents=True)


def unedited() -> list[Any]:
    """The documents without unsaved edits, each after those that it links to."""
    clean = {doc.Name: doc for doc in host.documents() if doc.FileName and not saving.is_modified(doc)}
    ordered: dict[str, Any] = {}
    for doc in clean.values():
        ordered.update((below.Name, below) for below in leaves_first(doc) if below.Name in clean)
    return list(ordered.values())


def save_marked(doc: Any) -> None:
    """Save a document that was unedited, and that FreeCAD marked because something below it was saved."""
    if live.lost_assemblies(doc):
        return
    saving.save_marked(doc)


def relink(finding: Finding) -> list[str]:
    """Set the links that a finding names to the file that it says was meant; labels of what was mended.

    One step of undo per document. Raises DocumentError where the file lacks what a link wants; nothing is
    changed then.
    """
    meant = saving.open_fully(finding.did_you_mean)
    inspect = live.LinkInspector()
    mended: list[tuple[Any, Any, str]] = []
    for place in finding.where:
        document = host.find_document(place.doc_path)
        link = document.getObject(place.obj) if document is not None else None
        problem = inspect(link) if link is not None else None
        if link is None or problem is None or located(problem.file, document.FileName) != finding.file:
            continue  # mended meanwhile
        mended.append((link, _target(meant, problem), live.stored_sub_name(link)))
    for document in {link.Document.Name: link.Document for link, _, _ in mended}.values():
        document.openTransaction("Silo: relink")
    for link, target, sub in mended:
        link.LinkedObject = (target, sub) if sub else target
    for document in {link.Document.Name: link.Document for link, _, _ in mended}.values():
        document.commitTransaction()
        document.recompute()
    return [link.Label for link, _, _ in mended]


def _target(meant: Any, problem: LinkProblem) -> Any:
    found = meant.getObject(problem.obj)
    if found is None:
        raise DocumentError(meant.FileName, f"it holds no object named {problem.obj!r}; nothing was changed")
    return found


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
        return plan.take(cached, assembly=self._hint(doc, cached), walk=walk)

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

    look_at = staticmethod(look_at)
    write_identity = staticmethod(write_identity)
    remove_identity = staticmethod(remove_identity)
    unedited = staticmethod(unedited)
    save_marked = staticmethod(save_marked)

    def accounts(self, extraction: Extraction) -> list[Account]:
        """The solids that FreeCAD shows, against those that the BOM explains."""
        from silo.workbench.freecad import witness

        with qt.wait_cursor():
            return witness.accounts(extraction, hardware=self._count_hardware())

    def why(self, doc: Any, assembly: str, parts: Collection[Key]) -> list[str]:
        """Each chain from an assembly to a part of it."""
        return live.why_object(doc, assembly, parts, hardware=self._count_hardware())

    def relink(self, finding: Finding) -> list[str]:
        """Set live links to the file that was meant; their labels."""

        return relink(finding)

    def save_as(self, _doc: Any) -> None:
        """FreeCAD's own dialog, for the active document."""
        host.run_command("Std_Save")

    def identity(self, doc: Any) -> str | None:
        """By the assembly that is active, where the document holds several. Each commit begins with this."""
        cached = live.cached_document(doc)
        return file_item(cached, self._hint(doc, cached))

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
