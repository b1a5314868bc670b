# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD, seen through plain functions: the only file that imports ``FreeCAD`` and ``FreeCADGui``.

Everything here belongs into FreeCAD's main thread, except the console functions. Behaviour that differs
between FreeCAD 0.20, 1.0 and 1.1 was measured and is handled here, so that nobody else needs to know it.
Imported at FreeCAD's start: what only some functions need, they import themselves.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import FreeCAD

from silo.workbench.saved_marks import SavedMarks

# --- FreeCAD itself --------------------------------------------------------------------------------------


def gui() -> Any:
    """The GUI module. The import succeeds headless as well, so ask :func:`has_gui` first."""
    import FreeCADGui

    return FreeCADGui


def has_gui() -> bool:
    """True where FreeCAD has a window."""
    return bool(FreeCAD.GuiUp)


def version() -> tuple[int, int]:
    """Such as (1, 0)."""
    told = FreeCAD.Version()
    return int(told[0]), int(told[1])


def user_data_folder() -> str:
    """FreeCAD's folder for the user's data, add-ons and Python packages."""
    return str(FreeCAD.getUserAppDataDir())


def translate(context: str, text: str) -> str:
    """FreeCAD's translation of a text."""
    return str(FreeCAD.Qt.translate(context, text))


def message(text: str) -> None:
    """A line in the report view."""
    FreeCAD.Console.PrintMessage(text + "\n")


def warning(text: str) -> None:
    """A warning in the report view."""
    FreeCAD.Console.PrintWarning(text + "\n")


def error(text: str) -> None:
    """An error in the report view."""
    FreeCAD.Console.PrintError(text + "\n")


def log(text: str) -> None:
    """A line for those who look for the cause of a problem; hidden unless FreeCAD is told to show it."""
    FreeCAD.Console.PrintLog(text + "\n")


def parameters(group: str) -> Any:
    """A group of FreeCAD's parameters."""
    return FreeCAD.ParamGet(group)


def save_parameters() -> None:
    """Write the parameters to disk now; by itself FreeCAD does it only on a normal exit."""
    FreeCAD.saveParameter()


# --- documents -------------------------------------------------------------------------------------------


def documents() -> list[Any]:
    """All open documents, also those that a link has loaded."""
    return list(FreeCAD.listDocuments().values())


def is_object(value: Any) -> bool:
    """True for an object of a document."""
    return isinstance(value, FreeCAD.DocumentObject)


def active_document() -> Any:
    """The document that a person works in, or None."""
    return FreeCAD.ActiveDocument


def documents_by_path() -> dict[str, Any]:
    """The open documents by the real paths of their files; one file may have been opened by several paths."""
    return {os.path.realpath(doc.FileName): doc for doc in documents() if doc.FileName}


def find_document(path: str) -> Any:
    """The open document of a file, or None."""
    return documents_by_path().get(os.path.realpath(path))


def is_partial(doc: Any) -> bool:
    """True where only the objects that links need are loaded: saving such a document writes nothing."""
    return bool(getattr(doc, "Partial", False))


def is_modified(doc: Any) -> bool:
    """True where the document has edits that are not on disk."""
    if not has_gui():
        return bool(doc.isTouched()) if hasattr(doc, "isTouched") else False
    return _is_marked(doc) and not (version() < (0, 21) and _marks().is_clean(doc))


def _is_marked(doc: Any) -> bool:
    view = _gui_document(doc)
    return bool(view is not None and view.Modified)


def _gui_document(doc: Any) -> Any:
    try:
        return gui().getDocument(doc.Name)
    except NameError:  # FreeCAD's own choice of exception for "no such document"
        return None


@contextmanager
def same_active_document() -> Iterator[None]:
    """Whatever is opened inside, the person's document is the active one again afterwards."""
    active = FreeCAD.ActiveDocument
    name = active.Name if active is not None else ""
    try:
        yield
    finally:
        if name in FreeCAD.listDocuments() and getattr(FreeCAD.ActiveDocument, "Name", "") != name:
            FreeCAD.setActiveDocument(name)


def open_fully(path: str) -> Any:
    """The document of a file with all its objects, opened or completed where needed.

    FreeCAD completes a partly loaded document by closing and reading it again, so unsaved edits in it would
    be lost: then, and where the file cannot be read, :class:`DocumentError`.
    """
    from silo.bom.errors import DocumentError

    known = find_document(path)
    if known is not None and not is_partial(known):
        return known
    if known is not None and is_modified(known):
        raise DocumentError(
            path, "FreeCAD has loaded it only in part and it has unsaved edits, which opening it would lose"
        )
    with same_active_document():
        try:
            return FreeCAD.openDocument(known.FileName if known is not None else path)
        except (OSError, RuntimeError) as problem:
            raise DocumentError(path, f"FreeCAD cannot open it: {problem}") from problem


def close_all() -> None:
    """Close every document without saving; for batches, never with a person at work."""
    for name in list(FreeCAD.listDocuments()):
        # Closing one document may close others that only it had loaded.
        if name in FreeCAD.listDocuments():
            FreeCAD.closeDocument(name)


def save(doc: Any) -> None:
    """Save a document to its file; :class:`DocumentError` unless the file really was written."""
    from silo.bom.errors import DocumentError

    path = doc.FileName
    if not path:
        raise DocumentError(doc.Label, "it has never been saved; save it under a name first")
    if is_partial(doc):
        raise DocumentError(path, "FreeCAD has loaded it only in part and cannot save it")
    if not is_writable(path):
        raise DocumentError(path, "the file is read-only")
    before = _stamp(path)
    try:
        _save(doc)
    except (OSError, RuntimeError) as problem:
        raise DocumentError(path, f"FreeCAD could not save it: {problem}") from problem
    if _stamp(path) == before:
        raise DocumentError(path, "FreeCAD did not write the file; its report view says why")


def _save(doc: Any) -> None:
    view = _gui_document(doc) if has_gui() else None
    if view is None:
        doc.save()
    elif version() >= (0, 21):
        doc.save()
        view.Modified = False
    elif view.ActiveView is None or _asks_before_saving(doc):
        doc.save()
        _marks().saved(doc)
    else:
        with same_active_document():
            FreeCAD.setActiveDocument(doc.Name)
            gui().runCommand("Std_Save")


@cache
def _marks() -> SavedMarks:
    marks = SavedMarks()
    add_document_observer(marks)
    return marks


def _asks_before_saving(doc: Any) -> bool:
    """True where FreeCAD's own save command would ask about further modified files."""
    return any(other != doc and _is_marked(other) for other in doc.getDependentDocuments())


def _stamp(path: str) -> tuple[int, int, int]:
    try:
        status = os.stat(path)
    except OSError:
        return (0, 0, 0)
    return (status.st_mtime_ns, status.st_size, status.st_ino)


def is_writable(path: str) -> bool:
    """True where the file may be replaced; a file marked read-only may not, whoever asks."""
    folder = os.path.dirname(path) or "."
    if not os.path.exists(path):
        return os.access(folder, os.W_OK)
    marked = not os.stat(path).st_mode & 0o222
    return os.access(path, os.W_OK) and os.access(folder, os.W_OK) and not marked


def write_identity(doc: Any, name: str, identity: str, *, whole_document: bool) -> None:
    """Write a Silo identity in every place that survives in all versions; the caller saves.

    name
        ``Name`` of the component's object; "" for the document itself.
    whole_document
        the document is this one component, so it carries the identity as well. Otherwise the identity is the
        object's only (:mod:`silo.bom.identity` says where it is looked for).
    """
    from silo.bom.errors import DocumentError
    from silo.bom.identity import meta_key

    obj = doc.getObject(name) if name else None
    if name and obj is None:
        raise DocumentError(doc.FileName, f"it has no object {name} any more")
    if obj is not None:
        _set_text(obj, "SiloItemId", identity)
        if "SiloUUID" in obj.PropertiesList:
            obj.SiloUUID = identity
    # Meta gives a copy: only assigning a whole dictionary changes it.
    doc.Meta = {**doc.Meta, meta_key("" if whole_document else name): identity}
    if whole_document and hasattr(doc, "addProperty"):
        _set_text(doc, "SiloUUID", identity)


def _set_text(owner: Any, name: str, value: str) -> None:
    if name not in owner.PropertiesList:
        owner.addProperty("App::PropertyString", name, "Silo", "Identity of the item in Silo")
    setattr(owner, name, value)
    if hasattr(owner, "setEditorMode"):
        owner.setEditorMode(name, ["ReadOnly"])


def add_document_observer(observer: Any) -> None:
    """Have an object told of what happens to documents (``slotFinishSaveDocument`` and its like)."""
    FreeCAD.addDocumentObserver(observer)


def remove_document_observer(observer: Any) -> None:
    """Tell it no more."""
    FreeCAD.removeDocumentObserver(observer)


# --- the window ------------------------------------------------------------------------------------------


def main_window() -> Any:
    """FreeCAD's main window."""
    return gui().getMainWindow()


def has_command(name: str) -> bool:
    """True where FreeCAD, or another add-on, has a command of this name."""
    return gui().Command.get(name) is not None


def add_command(name: str, command: Any) -> bool:
    """Register a command. One that exists is never replaced (0.20 would do it silently); False then."""
    if has_command(name):
        return False
    gui().addCommand(name, command)
    return True


def run_command(name: str) -> None:
    """Run a command as if its menu entry had been chosen."""
    gui().runCommand(name)


def command_actions(name: str) -> list[Any]:
    """The QActions of a command; none until it stands in a menu or toolbar."""
    command = gui().Command.get(name)
    return list(command.getAction()) if command is not None else []


def command_info(name: str) -> dict[str, str]:
    """Menu text, tooltip and icon name of a command."""
    command = gui().Command.get(name)
    return dict(command.getInfo()) if command is not None else {}


def icon(name: str) -> Any:
    """An icon by name, from FreeCAD's and the add-ons' folders."""
    return gui().getIcon(name)


def add_workbench(workbench: Any) -> None:
    """Add a workbench."""
    gui().addWorkbench(workbench)


def has_active_workbench() -> bool:
    """False while FreeCAD is still loading add-ons."""
    try:
        return gui().activeWorkbench() is not None
    except AssertionError:  # FreeCAD's own choice of exception for "none yet"
        return False


def reload_workbench() -> None:
    """Build the menus and toolbars of the active workbench anew, with commands that are new."""
    gui().activeWorkbench().reloadActive()


def add_workbench_manipulator(manipulator: Any) -> bool:
    """Have an object put commands into every workbench's menus; False where FreeCAD (0.20) cannot."""
    add = getattr(gui(), "addWorkbenchManipulator", None)
    if add is None:
        return False
    add(manipulator)
    return True


def add_preference_page(page: Any, group: str) -> None:
    """Add a page (a class, or the path of a ``.ui`` file) to the preferences."""
    gui().addPreferencePage(page, group)


def show_preferences(group: str, page: int = 0) -> None:
    """Open the preferences at a page."""
    gui().showPreferences(group, page)


def add_resources(icons: str, translations: str) -> None:
    """Make folders of icons and of translations known."""
    gui().addIconPath(icons)
    # Loading the translations anew takes FreeCAD 10 ms, so it is done where there are any.
    if any(name.endswith(".qm") for name in os.listdir(translations)):
        gui().addLanguagePath(translations)
        gui().updateLocale()


def selected_objects() -> list[Any]:
    """The objects that are selected in the active document."""
    return list(gui().Selection.getSelection())


def select(doc: Any, names: Iterable[str]) -> int:
    """Select objects of a document in the 3D view and the tree; how many there were."""
    gui().Selection.clearSelection()
    found = [name for name in names if doc.getObject(name) is not None]
    for name in found:
        gui().Selection.addSelection(doc.Name, name)
    return len(found)


def active_assembly() -> Any:
    """The container that is active in the 3D view (the one new parts go into), or None."""
    view = getattr(gui().ActiveDocument, "ActiveView", None)
    ask = getattr(view, "getActiveObject", None)
    return ask("part") if callable(ask) else None


def origin_of(doc: Any) -> Any:
    """The origin (Kindred Create) that a document belongs to, where FreeCAD has origins; else None."""
    ask: Callable[[Any], Any] | None = getattr(gui(), "getOrigin", None)
    if ask is None:
        return None
    try:
        return ask(doc)
    except (TypeError, ValueError, RuntimeError):
        return None
