# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD, seen through plain functions: the only file that imports ``FreeCAD`` and ``FreeCADGui``.

Everything here belongs in FreeCAD's main thread, except the console functions. Behaviour that differs
between FreeCAD 0.20, 1.0 and 1.1 was measured and is handled here, so that nobody else needs to know it.
Imported at FreeCAD's start: what only some functions need, they import themselves.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator, Set
from contextlib import contextmanager
from typing import Any

import FreeCAD

from silo.workbench.words import visible

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


def program() -> str:
    """The command line program that runs this FreeCAD. ConfigError where it cannot be told."""
    from silo.bom.errors import ConfigError

    homes = (sys.executable, os.path.join(FreeCAD.getHomePath(), "bin", "freecadcmd"))
    for path in (*homes, f"{homes[1]}.exe"):
        if "freecadcmd" in os.path.basename(path or "").lower() and os.path.isfile(path):
            return path
    raise ConfigError("FreeCAD does not say which program runs it")


def user_data_folder() -> str:
    """FreeCAD's folder for the user's data, add-ons and Python packages."""
    return str(FreeCAD.getUserAppDataDir())


def packages_folder() -> str:
    """Where this FreeCAD looks for additional Python packages (facts §7.3)."""
    base = os.path.join(user_data_folder(), "AdditionalPythonPackages")
    return base if version() < (1, 0) else os.path.join(base, "py{}{}".format(*sys.version_info))


def translate(context: str, text: str) -> str:
    """FreeCAD's translation of a text."""
    return str(FreeCAD.Qt.translate(context, text))


def message(text: str) -> None:
    """A line in the report view. Like all of these, harmless to a terminal, whoever wrote the text."""
    FreeCAD.Console.PrintMessage(visible(text) + "\n")


def warning(text: str) -> None:
    """A warning in the report view."""
    FreeCAD.Console.PrintWarning(visible(text) + "\n")


def error(text: str) -> None:
    """An error in the report view."""
    FreeCAD.Console.PrintError(visible(text) + "\n")


def log(text: str) -> None:
    """A line for those who look for the cause of a problem; hidden unless FreeCAD is set to show it."""
    FreeCAD.Console.PrintLog(visible(text) + "\n")


def parameters(group: str) -> Any:
    """A group of FreeCAD's parameters."""
    return FreeCAD.ParamGet(group)


def save_parameters() -> None:
    """Write the parameters to disk now; by itself FreeCAD does it only on a normal exit."""
    FreeCAD.saveParameter()


Leaves = dict[tuple[str, str], tuple[Any, int]]


class ShownLeaves:
    """The objects with a shape of their own that FreeCAD shows for an object, and how often each.

    FreeCAD itself says what an object shows (``getSubObjects``), with all that it links to; what is hidden is
    not shown. Its shape of a container (``Part.getShape``) would have twice what lies in a folder.

    though_hidden
        document and name of objects that are taken as shown wherever they lie, with all their elements.
    """

    def __init__(self, though_hidden: Set[tuple[str, str]] = frozenset()) -> None:
        self._though_hidden = though_hidden
        self._known: dict[tuple[str, str, bool], Leaves] = {}

    def of(self, obj: Any, hidden: bool = False) -> Leaves:
        """Document and name of each leaf → the leaf, and how often it is shown. ``hidden``: the object is."""
        obj = getattr(obj, "real", obj)
        linked = obj.getLinkedObject(True)
        if linked is not None and linked != obj:
            if hidden:
                return {}
            obj = linked
        key = (obj.Document.Name, obj.Name, hidden)
        if key not in self._known:
            self._known[key] = {}  # what leads back to itself shows nothing
            self._known[key] = self._inside(obj, hidden)
        return self._known[key]

    def _inside(self, obj: Any, hidden: bool) -> Leaves:
        holds = "Group" in obj.PropertiesList or obj.isDerivedFrom("App::LinkGroup")
        if hidden and not holds:
            return {}
        names = obj.getSubObjects()
        is_link = obj.hasExtension("App::LinkBaseExtension")
        if not names or (obj.isDerivedFrom("Part::Feature") and not is_link):
            return {} if hidden else {(obj.Document.Name, obj.Name): (obj, 1)}
        # A part lists what lies in its folders beside the folders.
        skip_folders = "Group" in obj.PropertiesList and not obj.isDerivedFrom("App::DocumentObjectGroup")
        whole = is_link and (obj.Document.Name, obj.Name) in self._though_hidden
        leaves: Leaves = {}
        for name in names:
            shown = obj.getSubObject(name, retType=1)
            if shown is None or (skip_folders and shown.isDerivedFrom("App::DocumentObjectGroup")):
                continue
            visible = obj.isElementVisible(name.rstrip("."))
            is_hidden = hidden or visible == 0 or (visible < 0 and not shown.Visibility)
            if whole or (holds and (shown.Document.Name, shown.Name) in self._though_hidden):
                is_hidden = False
            for key, (leaf, times) in self.of(shown, is_hidden).items():
                leaves[key] = (leaf, times + (leaves[key][1] if key in leaves else 0))
        return leaves


def solids(obj: Any) -> int:
    """How many solids the own shape of an object has."""
    import Part

    def count(shape: Any) -> int:
        # shape.Solids has those only once that lie in one place.
        if shape.isNull():
            return 0
        return 1 if shape.ShapeType == "Solid" else sum(map(count, shape.SubShapes))

    return count(Part.getShape(obj))


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
    """The open documents by the paths of their files, each in the one spelling that its folder lists."""
    from silo.spelling import Spelling  # late: FreeCAD's start waits for this module

    real = Spelling().real
    return {real(doc.FileName): doc for doc in documents() if doc.FileName}


def find_document(path: str) -> Any:
    """The open document of a file, or None."""
    from silo.spelling import one_path

    return documents_by_path().get(one_path(path))


def linked_documents(doc: Any) -> list[Any]:
    """A document and all that it links to, directly or not, in no order."""
    return list(doc.getDependentDocuments(False))


def is_partial(doc: Any) -> bool:
    """True where only the objects that links need are loaded: saving such a document writes nothing."""
    return bool(getattr(doc, "Partial", False))


def open_document(path: str) -> Any:
    """Have FreeCAD open a file; the document becomes the active one. For people's files: :mod:`saving`."""
    return FreeCAD.openDocument(path)


def activate(doc: Any) -> None:
    """Make a document the active one."""
    FreeCAD.setActiveDocument(doc.Name)


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


def close_document(doc: Any) -> None:
    """Close a document without saving."""
    FreeCAD.closeDocument(doc.Name)


def close_all() -> None:
    """Close every document without saving; for batches, never with a person at work."""
    for name in list(FreeCAD.listDocuments()):
        # Closing one document may close others that only it had loaded.
        if name in FreeCAD.listDocuments():
            FreeCAD.closeDocument(name)


def add_document_observer(observer: Any) -> None:
    """Have an object notified of what happens to documents (``slotFinishSaveDocument`` and its like)."""
    FreeCAD.addDocumentObserver(observer)


# --- the window ------------------------------------------------------------------------------------------


def main_window() -> Any:
    """FreeCAD's main window."""
    return gui().getMainWindow()


def view_of(doc: Any) -> Any:
    """The GUI's half of a document (``Modified``, ``ActiveView``), or None."""
    try:
        return gui().getDocument(doc.Name)
    except NameError:  # FreeCAD's own choice of exception for "no such document"
        return None


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


def has_active_workbench() -> bool:
    """False while FreeCAD is still loading add-ons."""
    try:
        return gui().activeWorkbench() is not None
    except AssertionError:  # FreeCAD's own choice of exception for "none yet"
        return False


def add_workbench_manipulator(manipulator: Any) -> bool:
    """Have an object put commands into every workbench's menus; False where FreeCAD (0.20) cannot."""
    add = getattr(gui(), "addWorkbenchManipulator", None)
    if add is None:
        return False
    add(manipulator)
    return True


def add_resources(icons: str, translations: str) -> None:
    """Make folders of icons and of translations known."""
    gui().addIconPath(icons)
    # Loading the translations anew takes FreeCAD 10 ms, so it is done where there are any.
    if any(name.endswith(".qm") for name in os.listdir(translations)):
        gui().addLanguagePath(translations)
        gui().updateLocale()


# FreeCAD looks through all that is selected for each further object: 10 000 take it many seconds.
MOST_SELECTED = 2000


def select(doc: Any, names: Iterable[str]) -> int:
    """Select objects of a document in the 3D view and the tree; how many there are.

    Of very many, only the first :data:`MOST_SELECTED` are selected.
    """
    gui().Selection.clearSelection()
    found = [name for name in names if doc.getObject(name) is not None]
    for name in found[:MOST_SELECTED]:
        gui().Selection.addSelection(doc.Name, name)
    return len(found)


def add_selection_observer(observer: Any) -> None:
    """Have an object notified of what is selected (``addSelection`` and its like)."""
    gui().Selection.addObserver(observer, 0)


def selected() -> list[tuple[Any, str]]:
    """Document and name of each selected object, and of each that lies on the way to it: once."""
    found: dict[tuple[str, str], Any] = {}
    for one in gui().Selection.getSelectionEx("*", 0):
        for name in (one.ObjectName, *(part for path in one.SubElementNames for part in path.split("."))):
            found[one.DocumentName, name] = one.Document
    return [(doc, name) for (_, name), doc in found.items()]


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
