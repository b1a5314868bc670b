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
import shutil
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo.bom.document import LinkProblem, located, saved_by
from silo.bom.errors import DocumentError, SiloError
from silo.bom.findings import Finding
from silo.bom.links import extract, file_item
from silo.freecads import open_in_any, open_in_others
from silo.outbox.store import KEPT_ASIDE_DAYS
from silo.platform import replacing
from silo.registering.offer import Candidate, ComponentState, OpenedFile
from silo.workbench.commit import plan
from silo.workbench.commit.flow import CommitAnswer, Look
from silo.workbench.commit.opened import Opened
from silo.workbench.commit.plan import CommitPlan, Snapshot, leaves_first
from silo.workbench.freecad import host, live, saving
from silo.workbench.freecad.edits import SHOWN_NUMBER, SHOWN_STATE
from silo.workbench.gui import qt
from silo.workbench.pane.activity import PaneEntry, Tone
from silo.workbench.pane.entries import own_box
from silo.workbench.words import filled, plain, translate

if TYPE_CHECKING:
    from silo.bom.model import BomEntry, Extraction
    from silo.bom.objects import Key
    from silo.outbox.store import Store
    from silo.workbench.commit.flow import Theirs
    from silo.workbench.freecad.drawing import Overlay
    from silo.workbench.freecad.live import SolidCount
    from silo.workbench.preview.flow import PreviewFlow
    from silo.workbench.register.flow import RegisterFlow
    from silo.workbench.revisions.flow import Differences, Ghost


# For more objects, the property editor shows only what they have in common.
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
        """Take over what Silo knows of the components of a document, if it is open."""
        doc = host.find_document(path)
        if doc is None:
            return
        open_now = {document.Name for document in host.documents()}
        self._known = {name: states for name, states in self._known.items() if name in open_now}
        in_silo = translate("Silo", "in Silo")
        left_out = translate("Silo", "not registered: left out of the BOM")
        components = {
            name: (entry.part_number or "", in_silo if entry.part_number else left_out)
            for entry in entries
            for name in entry.instances
        }
        self._known[doc.Name] = str(doc.FileName), components
        self.addSelection()

    # FreeCAD calls these once for each object; the selection is then looked at once.

    def addSelection(self, *_what: Any) -> None:
        """Note that something else is selected."""
        if not self._is_due:
            self._is_due = True
            qt.later(0, self._show)

    setSelection = addSelection

    def _show(self) -> None:
        self._is_due = False
        wanted = []
        for doc, name in host.selected():
            file, components = self._known.get(doc.Name, ("", {}))
            if name in components and doc.FileName == file:  # another document may have its name by now
                wanted.append((doc.getObject(name), components[name]))
        outdated = [
            (obj, texts) for obj, texts in wanted[:MOST] if obj is not None and not _is_shown(obj, *texts)
        ]
        if outdated:
            with saving.others_unmarked():
                for obj, (number, state) in outdated:
                    _put(obj, SHOWN_NUMBER, number, translate("Silo", "Part number in Silo"))
                    _put(obj, SHOWN_STATE, state, translate("Silo", "Silo's data of this component"))


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


def look_at(paths: Iterable[str]) -> dict[str, OpenedFile]:
    """Find out how the files of components stand. GUI thread; the worker reads the contents from the disk."""
    documents = host.documents_by_path()
    own = next((str(doc.TransientDir) for doc in documents.values()), "")
    elsewhere = open_in_others(own)
    seen = {}
    for path in dict.fromkeys(paths):
        seen[path] = _look_at(path, documents)
        spelt = documents[path].FileName if path in documents else ""
        if seen[path].state.usable and elsewhere.has(path, spelt):
            seen[path] = replace(seen[path], state=ComponentState.ELSEWHERE)
    return seen


def _look_at(path: str, states: Mapping[str, Any]) -> OpenedFile:
    if not path:
        return OpenedFile(ComponentState.UNNAMED)
    if not os.path.isfile(path):
        return OpenedFile(ComponentState.MISSING)
    if not saving.is_writable(path):
        return OpenedFile(ComponentState.READ_ONLY)
    doc = states.get(path)
    if doc is None:
        return OpenedFile(ComponentState.READY)
    if saving.lost_objects(doc):
        return OpenedFile(ComponentState.LOST)
    saved_at = str(getattr(doc, "LastModifiedDate", "") or "")
    if not saving.is_modified(doc):
        return OpenedFile(ComponentState.READY, saved_at)
    return OpenedFile(ComponentState.PARTIAL if host.is_partial(doc) else ComponentState.EDITED, saved_at)


def write_identity(candidate: Candidate, identity: str) -> None:
    """Write an identity into a component's document and save it. GUI thread."""
    entry = candidate.entry
    doc = saving.open_fully(entry.doc_path)
    saving.refuse_loss(doc)
    for name in _objects(candidate):
        saving.write_identity(doc, name, identity, whole_document=not candidate.shares_file)
    saving.save(doc, mark_parents=True)


def remove_identity(candidate: Candidate, *, no_part: bool = False) -> None:
    """Take the identity from a component's file, and save it. GUI thread.

    no_part
        also mark it as no part; otherwise such a mark is removed too.
    """
    doc = saving.open_fully(candidate.entry.doc_path)
    saving.refuse_loss(doc)
    for name in _objects(candidate):
        saving.remove_identity(doc, name, no_part=no_part, whole_document=not candidate.shares_file)
    saving.save(doc, mark_parents=True)


def restore_identity(candidate: Candidate) -> None:
    """Give a component's file the identity that it had before it was registered, or none, and save it."""
    if candidate.entry.silo_uuid:
        write_identity(candidate, candidate.entry.silo_uuid)
    else:
        remove_identity(candidate)


def _objects(candidate: Candidate) -> tuple[str, ...]:
    article = candidate.article
    return article.objects if article is not None else (candidate.entry.object_name,)


def unedited() -> list[Any]:
    """Return the documents without unsaved edits, each after those to which it links."""
    clean = {doc.Name: doc for doc in host.documents() if doc.FileName and not saving.is_modified(doc)}
    ordered: dict[str, Any] = {}
    for doc in clean.values():
        ordered.update((below.Name, below) for below in leaves_first(doc) if below.Name in clean)
    return list(ordered.values())


def relink(finding: Finding) -> list[str]:
    """Set the links that a finding names to the file that it says was meant; labels of what was mended.

    Makes one undo step per document. Raises DocumentError if the file lacks an object that a link wants; then
    nothing is changed.
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
    target = meant.getObject(problem.obj)
    if target is None:
        raise DocumentError(meant.FileName, f"it holds no object named {problem.obj!r}; nothing was changed")
    return target


class LossGuard:
    """A document observer: nothing of a newer FreeCAD's file is lost without a question.

    FreeCAD lets nobody stop a save. So the newer file is kept before it, and if the person says so it is put
    back after it; then the document has edits that are not on disk, and what was saved is kept aside.

    outbox
        gives the store, which keeps copies.
    add
        shows a box in the pane.
    ask
        True where the person wants to save over the newer file: title and text.
    """

    def __init__(
        self, outbox: Callable[[], Store], add: Callable[[PaneEntry], None], ask: Callable[[str, str], bool]
    ) -> None:
        self._outbox, self._add, self._ask = outbox, add, ask
        self._put_back: dict[str, Path] = {}
        for doc in host.documents():
            self._opened(doc.Name)

    # FreeCAD calls these; an exception in them would only be printed.

    def slotChangedDocument(self, doc: Any, prop: str) -> None:
        """Look at the file: FreeCAD sets its name before it reads it, and later knows what it could not
        load.
        """
        if prop == "FileName" and doc.FileName:
            name = doc.Name
            qt.later(0, lambda: self._opened(name))

    def _opened(self, name: str) -> None:
        doc = next((document for document in host.documents() if document.Name == name), None)
        if doc is not None and (lost := saving.lost_objects(doc)):
            text = translate(
                "Silo", "This FreeCAD {here} does not know these objects, nor load them: {lost}."
            )
            advice = translate("Silo", "Saving the file here would remove them from it: change it there.")
            self._tell(doc, _words(text, doc, lost), advice)

    def slotStartSaveDocument(self, doc: Any, filename: str) -> None:
        """Look at the file before it is replaced."""
        if os.path.realpath(filename) != os.path.realpath(doc.FileName or ""):
            return
        if not (lost := saving.lost_objects(doc)):
            return
        try:
            kept = self._outbox().keep_aside(doc.FileName)
        except SiloError as error:
            kept = None
            self._tell(doc, str(error))
        question = translate(
            "Silo",
            "{name} was saved by FreeCAD {there}. This FreeCAD {here} does not know, and would remove from "
            "the file: {lost}.",
        )
        if kept is None or self._ask(translate("Silo", "Newer file"), _words(question, doc, lost)):
            text = translate("Silo", "Saved over the newer file, without {lost}.")
            where = translate("Silo", "The newer file is kept for {n} days at {path}")
            self._tell(doc, _words(text, doc, lost), *([_kept_words(where, kept)] if kept else []))
        else:
            self._put_back[doc.Name] = kept

    def slotFinishSaveDocument(self, doc: Any, _filename: str) -> None:
        """Put the newer file back, if the person wants to keep it."""
        if (newer := self._put_back.pop(doc.Name, None)) is None:
            return
        path, name = doc.FileName, doc.Name
        mine = self._outbox().keep_aside(path)
        with newer.open("rb") as read, replacing(path, mode=0o644) as write:
            shutil.copyfileobj(read, write)
        where = translate("Silo", "What you saved is kept for {n} days at {path}")
        self._tell(
            doc, translate("Silo", "The newer file was kept."), *([_kept_words(where, mine)] if mine else [])
        )
        qt.later(0, lambda: saving.mark_modified(name))  # FreeCAD takes the mark away after this

    def _tell(self, doc: Any, *lines: str) -> None:
        title = translate("Silo", "Made by a newer FreeCAD: {name}", name=os.path.basename(doc.FileName))
        self._add(own_box(f"newer-freecad:{doc.FileName}", title, *lines, tone=Tone.WARNING))


def _words(text: str, doc: Any, lost: list[str]) -> str:
    here = "{}.{}".format(*host.version())
    by = ".".join(map(str, saved_by(doc.getProgramVersion()))) or "?"
    name = os.path.basename(doc.FileName)
    return filled(text, name=name, here=here, there=by, lost=plain(", ".join(lost), 300))


def _kept_words(text: str, path: Path) -> str:
    return filled(text, n=KEPT_ASIDE_DAYS, path=path)


class LiveDocuments:
    """FreeCAD's documents, as :class:`silo.workbench.commit.plan.Documents` wants them."""

    linked = staticmethod(host.linked_documents)
    is_partial = staticmethod(host.is_partial)
    is_modified = staticmethod(saving.is_modified)
    is_edited = staticmethod(saving.is_edited)
    is_writable = staticmethod(saving.is_writable)
    lost_objects = staticmethod(saving.lost_objects)
    save = staticmethod(saving.save)

    def __init__(self, opened: Opened) -> None:
        self.base = opened.of

    def is_damaged(self, doc: Any) -> bool:
        """Return True if the document's file cannot be read to its end."""
        return saving.damage(doc.FileName) is not None


class LiveDesk:
    """One per FreeCAD. Widgets are imported when a person is to see one."""

    def __init__(self, opened: Opened, count_hardware: Callable[[], bool] = lambda: True) -> None:
        self._count_hardware = count_hardware
        self.documents = LiveDocuments(opened)

    def snapshot(self, doc: Any) -> Snapshot:
        """Take a snapshot; the assembly that is active in the 3D view decides between several."""
        hardware = self._count_hardware()
        if (whole := live.in_file(doc)) is not None:
            return plan.take(whole, walk=partial(extract, hardware=hardware))
        cached = live.cached_document(doc)
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

    def accounts(self, extraction: Extraction) -> list[SolidCount]:
        """Compare the solids that FreeCAD shows with those that the BOM explains."""
        with qt.wait_cursor():
            return live.accounts(extraction, hardware=self._count_hardware())

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
            raise DocumentError(path, "it is not open any more")
        if self._overlay.ghost_of == (path, revision):
            self._overlay.clear()
            return None
        extraction = self.snapshot(doc).extraction
        if extraction is None:
            raise DocumentError(path, "it holds no assembly, so there is nothing to compare")
        mine = [name for entry in extraction.entries for name in entry.instances]
        differences = self._overlay.compare(doc, extraction.assembly.object_name, mine, theirs)
        self._overlay.ghost_of = (path, revision)
        return differences

    @cached_property
    def _overlay(self) -> Overlay:
        from silo.workbench.freecad.drawing import Overlay

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
