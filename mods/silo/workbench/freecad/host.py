# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD, seen through plain functions: the only file that imports ``FreeCAD`` and ``FreeCADGui``.

Everything here belongs in FreeCAD's main thread, except the console functions. Behaviour that differs
between FreeCAD 0.20, 1.0 and 1.1 was measured and is handled here, so that no other module needs to know it.
Imported at FreeCAD's start: what only some functions need, they import themselves.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import FreeCAD

from silo.workbench.words import visible

# --- FreeCAD itself --------------------------------------------------------------------------------------


def gui() -> Any:
    """Return the GUI module. It can be imported without a GUI too, so ask :func:`has_gui` first."""
    import FreeCADGui

    return FreeCADGui


def has_gui() -> bool:
    """Return True if FreeCAD has a window."""
    return bool(FreeCAD.GuiUp)


def version() -> tuple[int, int]:
    """Return the version of FreeCAD as (major, minor), such as (1, 0)."""
    freecad_version = FreeCAD.Version()
    return int(freecad_version[0]), int(freecad_version[1])


def program() -> str:
    """Find the command line program of this FreeCAD. Raises ConfigError if it is not found."""
    from silo.bom.errors import ConfigError
    from silo.bom.message import message

    folders = (os.path.dirname(sys.executable or ""), os.path.join(FreeCAD.getHomePath(), "bin"))
    names = (os.path.basename(sys.executable or ""), "freecadcmd", "FreeCADCmd", "freecadcmd.exe")
    for path in (os.path.join(folder, name) for folder in folders for name in names):
        if "freecadcmd" in os.path.basename(path).lower() and os.path.isfile(path):
            return path
    raise ConfigError(message("FreeCAD does not say which program runs it"))


def user_data_folder() -> str:
    """Return FreeCAD's folder for the user's data, add-ons and Python packages."""
    return str(FreeCAD.getUserAppDataDir())


def packages_folder() -> str:
    """Return the folder in which this FreeCAD looks for additional Python packages (facts §7.3)."""
    base = os.path.join(user_data_folder(), "AdditionalPythonPackages")
    return base if version() < (1, 0) else os.path.join(base, "py{}{}".format(*sys.version_info))


def translate(context: str, text: str) -> str:
    """Return FreeCAD's translation of a text."""
    return str(FreeCAD.Qt.translate(context, text))


def message(text: str) -> None:
    """Print a line in the report view. Like all of these functions, it is safe for a terminal, no matter who
    wrote the text.
    """
    FreeCAD.Console.PrintMessage(visible(text) + "\n")


def warning(text: str) -> None:
    """Print a warning in the report view."""
    FreeCAD.Console.PrintWarning(visible(text) + "\n")


def error(text: str) -> None:
    """Print an error in the report view."""
    FreeCAD.Console.PrintError(visible(text) + "\n")


def log(text: str) -> None:
    """Print a line for people who look for the cause of a problem; hidden unless FreeCAD is set to
    show it.
    """
    FreeCAD.Console.PrintLog(visible(text) + "\n")


def parameters(group: str) -> Any:
    """Return a group of FreeCAD's parameters."""
    return FreeCAD.ParamGet(group)


def save_parameters() -> None:
    """Write the parameters to disk now; FreeCAD itself does that only on a normal exit."""
    FreeCAD.saveParameter()


class Pieces:
    """How many solids FreeCAD shows for an object: visible, hidden, and marked as left out.

    One for each sub-object path. FreeCAD itself says what an object shows (``getSubObjects``), with all that
    it links to. Its shape of a container (``Part.getShape``) would have twice what lies in a folder.

    own_shapes
        the solids of single shapes, kept for the next assembly.
    top
        the assembly: what leads back to it shows nothing.
    """

    def __init__(self, own_shapes: dict[tuple[str, str], int], top: Any = None) -> None:
        from silo.bom.walk.arrays import left_out_by

        self._left_out_by = left_out_by
        self._own_shapes = own_shapes
        self._known = {} if top is None else {(top.Document.Name, top.Name): (0, 0, 0)}

    def of(self, obj: Any, is_visible: bool = True) -> tuple[int, int, int]:
        """Count the solids of an object: visible, hidden, left out. ``is_visible``: False if a container
        hides it.
        """
        obj = real(obj)
        target = obj.LinkedObject if obj.isDerivedFrom("App::Link") else None
        if isinstance(target, tuple) and not target[1].endswith("."):  # a face or an edge
            return (0, 0, 0)
        end = obj.getLinkedObject(True) or obj
        key = (end.Document.Name, end.Name)
        if key not in self._known:
            self._known[key] = (0, 0, 0)  # what leads back to itself shows nothing
            self._known[key] = self._inside(end, key)
        visible, hidden, left_out = self._known[key]
        if not is_visible:
            visible, hidden, left_out = 0, visible + hidden, left_out
        return (
            (0, hidden, left_out + visible)
            if self._left_out_by(obj) or self._left_out_by(end)
            else (visible, hidden, left_out)
        )

    def _inside(self, obj: Any, key: tuple[str, str]) -> tuple[int, int, int]:
        inside = sub_objects(obj)
        if inside is None:
            if key not in self._own_shapes:
                self._own_shapes[key] = _solids(obj)
            return (self._own_shapes[key], 0, 0)
        pieces = [self.of(member, is_visible) for member, is_visible in inside]
        visible, hidden, left_out = map(sum, zip(*pieces, strict=True)) if pieces else (0, 0, 0)
        return (visible, hidden, left_out)


def real(obj: Any) -> Any:
    """Return FreeCAD's own object, also for a view of it (:mod:`silo.workbench.freecad.cached`)."""
    return getattr(obj, "real", obj)


def sub_objects(obj: Any) -> list[tuple[Any, bool]] | None:
    """Return the objects inside an object, each with its visibility there; None if it has a shape of
    its own.
    """
    if {"BuildShape", "Freeze", "Group"}.issubset(obj.PropertiesList):
        return [member for group in obj.Group for member in _in_group(group)]
    names = obj.getSubObjects()
    if not names or (obj.isDerivedFrom("Part::Feature") and not obj.hasExtension("App::LinkBaseExtension")):
        return None
    # A part lists what lies in its folders beside the folders.
    skip_folders = "Group" in obj.PropertiesList and not obj.isDerivedFrom("App::DocumentObjectGroup")
    objects = []
    for name in names:
        shown = obj.getSubObject(name, retType=1)
        if shown is not None and not (skip_folders and shown.isDerivedFrom("App::DocumentObjectGroup")):
            visible = obj.isElementVisible(name.rstrip("."))
            objects.append((shown, bool(shown.Visibility if visible < 0 else visible)))
    return objects


def _in_group(group: Any) -> list[tuple[Any, bool]]:
    """Return the members of a group of Assembly3, each with its visibility, with or without the add-on.

    The add-on hides each of its groups; the group's own list says which members are shown.
    """
    listed = list(getattr(group, "VisibilityList", ()))
    members = list(group.Group)
    if len(listed) != len(members):
        listed = [group.Visibility] * len(members)
    return [
        (member, bool(shown and member.Visibility)) for member, shown in zip(members, listed, strict=True)
    ]


def root_objects(document: Any) -> list[tuple[Any, bool]]:
    """Return what FreeCAD shows at the root of a document: the objects in no part, link group, array or
    body.
    """
    holders = [member for member in document.Objects if not member.isDerivedFrom("App::DocumentObjectGroup")]
    held = {
        member.Name
        for holder in holders
        for name in ("Group", "ElementList")
        if name in holder.PropertiesList
        for member in getattr(holder, name)
    }
    return [(obj, obj.Visibility) for obj in holders if obj.Name not in held]


def _solids(obj: Any) -> int:
    import Part

    def count(shape: Any) -> int:
        # shape.Solids lists equal solids at one place only once.
        if shape.isNull():
            return 0
        return 1 if shape.ShapeType == "Solid" else sum(map(count, shape.SubShapes))

    return count(Part.getShape(obj))


# --- documents -------------------------------------------------------------------------------------------


def documents() -> list[Any]:
    """Return all open documents, including those that a link has loaded."""
    return list(FreeCAD.listDocuments().values())


def is_object(value: Any) -> bool:
    """Return True for an object of a document."""
    return isinstance(value, FreeCAD.DocumentObject)


def active_document() -> Any:
    """Return the document in which a user works; None if there is none."""
    return FreeCAD.ActiveDocument


def documents_by_path() -> dict[str, Any]:
    """Return the open documents by the paths of their files, each in the spelling that its folder lists."""
    from silo.platform.spelling import Spelling

    real = Spelling().real
    return {real(doc.FileName): doc for doc in documents() if doc.FileName}


def find_document(path: str) -> Any:
    """Return the open document of a file; None if it is not open."""
    from silo.platform.spelling import one_path

    return documents_by_path().get(one_path(path))


def linked_documents(doc: Any) -> list[Any]:
    """Return a document and all documents to which it links, directly or not, in no order."""
    return list(doc.getDependentDocuments(False))


def is_partial(doc: Any) -> bool:
    """Return True if only the objects that links need are loaded; saving such a document writes nothing."""
    return bool(getattr(doc, "Partial", False))


def open_document(path: str) -> Any:
    """Open a file in FreeCAD; the document becomes the active one. For people's files use :mod:`saving`."""
    return FreeCAD.openDocument(path)


def activate(doc: Any) -> None:
    """Make a document the active one."""
    FreeCAD.setActiveDocument(doc.Name)


@contextmanager
def same_active_document() -> Iterator[None]:
    """Make the person's document the active one again after the block."""
    active = FreeCAD.ActiveDocument
    name = active.Name if active is not None else ""
    try:
        yield
    finally:
        if name in FreeCAD.listDocuments() and getattr(FreeCAD.ActiveDocument, "Name", "") != name:
            FreeCAD.setActiveDocument(name)


def close_document(doc: Any) -> None:
    """Close a document without saving."""
    FreeCAD.closeDocument(doc.Name)


def close_all() -> None:
    """Close every document without saving; for batches, never while a user works."""
    for name in list(FreeCAD.listDocuments()):
        # Closing one document may close others that only it had loaded.
        if name in FreeCAD.listDocuments():
            FreeCAD.closeDocument(name)


def add_document_observer(observer: Any) -> None:
    """Let an object be notified of what happens to documents (``slotFinishSaveDocument`` and the like)."""
    FreeCAD.addDocumentObserver(observer)


# --- the window ------------------------------------------------------------------------------------------


def main_window() -> Any:
    """Return FreeCAD's main window."""
    return gui().getMainWindow()


def view_of(doc: Any) -> Any:
    """Return the GUI's half of a document (``Modified``, ``ActiveView``); None if it has none."""
    try:
        return gui().getDocument(doc.Name)
    except NameError:  # FreeCAD's own choice of exception for "no such document"
        return None


def has_command(name: str) -> bool:
    """Return True if FreeCAD, or another add-on, has a command of this name."""
    return gui().Command.get(name) is not None


def add_command(name: str, command: Any) -> bool:
    """Register a command; False if one of this name exists, which is never replaced (0.20 would do that
    silently).
    """
    if has_command(name):
        return False
    gui().addCommand(name, command)
    return True


def run_command(name: str) -> None:
    """Run a command as if its menu entry had been chosen."""
    gui().runCommand(name)


def command_actions(name: str) -> list[Any]:
    """Return the QActions of a command; [] until it is in a menu or a toolbar."""
    command = gui().Command.get(name)
    return list(command.getAction()) if command is not None else []


def command_info(name: str) -> dict[str, str]:
    """Return menu text, tooltip and icon name of a command."""
    command = gui().Command.get(name)
    return dict(command.getInfo()) if command is not None else {}


def icon(name: str) -> Any:
    """Return an icon by name, from FreeCAD's and the add-ons' folders."""
    return gui().getIcon(name)


def has_active_workbench() -> bool:
    """Return False while FreeCAD is still loading add-ons."""
    try:
        return gui().activeWorkbench() is not None
    except AssertionError:  # FreeCAD's own choice of exception for "none yet"
        return False


def add_workbench_manipulator(manipulator: Any) -> bool:
    """Let an object put commands into every workbench's menus; False if FreeCAD (0.20) cannot do that."""
    add = getattr(gui(), "addWorkbenchManipulator", None)
    if add is None:
        return False
    add(manipulator)
    return True


def add_resources(folder: Path) -> None:
    """Make the icons and the translations known. The folder of the translations may be missing."""
    gui().addIconPath(str(folder / "icons"))
    # Loading the translations again takes FreeCAD 10 ms, so it is only done if there are any.
    if any(folder.glob("translations/*.qm")):
        gui().addLanguagePath(str(folder / "translations"))
        gui().updateLocale()


# FreeCAD looks through all that is selected for each further object: 10 000 take it many seconds.
MOST_SELECTED = 2000


def select(doc: Any, names: Iterable[str]) -> int:
    """Select objects of a document in the 3D view and the tree; returns how many there are.

    If there are very many, only the first :data:`MOST_SELECTED` are selected.
    """
    gui().Selection.clearSelection()
    names_there = [name for name in names if doc.getObject(name) is not None]
    for name in names_there[:MOST_SELECTED]:
        gui().Selection.addSelection(doc.Name, name)
    return len(names_there)


def add_selection_observer(observer: Any) -> None:
    """Let an object be notified of what is selected (``addSelection`` and the like)."""
    gui().Selection.addObserver(observer, 0)


def selected() -> list[tuple[Any, str]]:
    """Return document and name of each selected object, and of each object on the way to it, once."""
    objects: dict[tuple[str, str], Any] = {}
    for selection in gui().Selection.getSelectionEx("*", 0):
        for name in (
            selection.ObjectName,
            *(part for path in selection.SubElementNames for part in path.split(".")),
        ):
            objects[selection.DocumentName, name] = selection.Document
    return [(doc, name) for (_, name), doc in objects.items()]


def active_assembly() -> Any:
    """Return the container that is active in the 3D view and gets new parts; None if there is none."""
    view = getattr(gui().ActiveDocument, "ActiveView", None)
    ask = getattr(view, "getActiveObject", None)
    return ask("part") if callable(ask) else None


def origin_of(doc: Any) -> Any:
    """Return the origin (Kindred Create) of a document; None if it has none, or if FreeCAD has no origins."""
    ask: Callable[[Any], Any] | None = getattr(gui(), "getOrigin", None)
    if ask is None:
        return None
    try:
        return ask(doc)
    except (TypeError, ValueError, RuntimeError):
        return None
