# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: every command on a project without edits; what is marked, touched or undoable after it."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from typing import Any

from inside import (
    VAULT,
    App,
    Gui,
    QtCore,
    QtWidgets,
    assembly,
    close,
    close_all,
    commit,
    part,
    preview,
    ready,
    register,
    registering,
    run,
    settled,
    tell,
    unmark,
    wait,
)


def story() -> None:
    from silo.workbench.commands import commands

    one = ready()
    top = project()
    register(*(doc for doc in App.listDocuments().values() if doc.Name in ("Plate", "Top")))
    # Opened as people do it: what the assembly links to has no window of its own.
    close_all()
    doc = App.openDocument(top)
    wait(settled)
    one.desk  # noqa: B018  # made when first needed; what is edited from now on is seen
    edited_and_saved(doc)
    done: dict[str, Any] = {}
    tell(start=states())
    for name in sorted(commands(one)):
        before = states()
        App.setActiveDocument(doc.Name)
        RUNS.get(name, nothing)(one)
        wait(settled)
        done[name] = {"known": name in RUNS, "changed": difference(before, states())}
    tell(done=done, **selecting(doc))
    # Another save, so that what must not be in the file could be.
    from silo.workbench.freecad import saving

    saving.save(doc)
    with zipfile.ZipFile(top) as packed:
        tell(in_file=b"SiloNumber" in packed.read("Document.xml"))
    reopened(top)


def project() -> str:
    """Two parts, of materials where FreeCAD has such, in an assembly; its path."""
    parts = [part("Plate"), part("Bolt")]
    for box in parts:
        if "ShapeMaterial" in box.PropertiesList:
            box.ShapeMaterial = card()
            box.Document.recompute()
            box.Document.save()
    path = str(assembly("Top", ("P", parts[0], 0), ("B", parts[1], 3)).Document.FileName)
    for name in ("Plate", "Bolt", "Top"):
        App.getDocument(name).recompute()
        App.getDocument(name).save()
        unmark(App.getDocument(name))
    return path


def card() -> Any:
    import Materials

    found = Materials.MaterialManager().Materials.values()
    return next(material for material in found if material.hasPhysicalProperty("Density"))


def edited_and_saved(top: Any) -> None:
    """Each document has one step to undo, and is saved with it."""
    from silo.workbench.freecad import saving

    for name in ("Plate", "Bolt", "Top"):
        doc = App.getDocument(name)
        doc.openTransaction("Longer")
        obj = doc.getObject("Box") or doc.getObject("P")
        obj.Placement.Base = App.Vector(1, 2, 3)
        doc.commitTransaction()
        doc.recompute()
    tell(edited=states())
    for name in ("Plate", "Bolt", "Top"):
        saving.save(App.getDocument(name))
    tell(saved=states(), active=App.ActiveDocument.Name, windows=windows())


def states() -> dict[str, Any]:
    return {
        doc.Name: {
            "modified": bool(Gui.getDocument(doc.Name).Modified),
            "undo": list(doc.UndoNames),
            "touched": [obj.Name for obj in doc.Objects if "Touched" in obj.State],
        }
        for doc in App.listDocuments().values()
    }


def difference(before: dict[str, Any], after: dict[str, Any]) -> dict[str, Any]:
    return {name: after[name] for name in after if before.get(name) != after[name]}


def windows() -> list[str]:
    """Titles of the 3D views."""
    area = Gui.getMainWindow().findChild(QtWidgets.QMdiArea)
    return [one.windowTitle() for one in area.subWindowList()]


def nothing(_one: Any) -> None:
    """A command that this story does not know."""


def compare(_one: Any) -> None:
    window = preview(App.ActiveDocument)
    if window.sync_button.isEnabled():
        window.sync_button.click()
        wait(lambda: settled() and window._preview is not None)
    close(window)


def register_parts(_one: Any) -> None:
    window = registering(App.ActiveDocument)
    window.register_button.click()
    wait(lambda: all(row.finished for row in window.rows) and settled())
    tell(registered=[row.component() for row in window.rows])
    close(window)


def mass(one: Any) -> None:
    Gui.runCommand("Silo_Mass")
    window = wait(lambda: shown("SiloMass"))
    tell(mass=[window.table.topLevelItem(0).text(column) for column in range(6)])
    window.close()
    wait(lambda: shown("SiloMass") is None)


def shown(name: str) -> Any:
    windows = QtWidgets.QApplication.topLevelWidgets()
    return next((w for w in windows if w.objectName() == name and w.isVisible()), None)


def settings(one: Any) -> None:
    def end() -> None:
        found = QtWidgets.QApplication.activeModalWidget()
        if found is None:
            QtCore.QTimer.singleShot(50, end)
        else:
            found.reject()

    QtCore.QTimer.singleShot(50, end)
    Gui.runCommand("Silo_Settings")


def activity(one: Any) -> None:
    Gui.runCommand("Silo_Activity")


def selecting(doc: Any) -> dict[str, Any]:
    """Select one link in the tree, and one below the assembly, as a click in the 3D view does."""
    plate, bolt = doc.getObject("P"), doc.getObject("B")
    before = states()
    early = [obj.Name for obj in doc.Objects if "SiloState" in obj.PropertiesList]
    Gui.Selection.clearSelection()
    Gui.Selection.addSelection(plate)
    wait(lambda: "SiloState" in plate.PropertiesList)
    Gui.Selection.addSelection(doc.Name, bolt.InList[0].Name, "B.Box.Face1")
    wait(lambda: "SiloState" in bolt.PropertiesList)
    marked = difference(before, states())
    Gui.Selection.clearSelection()
    shown = {obj.Name: shown_in_editor(obj) for obj in (plate, bolt)}
    return {"shown": shown, "shown_early": early, "selecting_changed": marked}


def shown_in_editor(obj: Any) -> list[Any]:
    """Number, state, group and what a person can do about them."""
    names = ("SiloNumber", "SiloState")
    return [
        *(obj.getPropertyByName(name) for name in names),
        *{obj.getGroupOfProperty(name) for name in names},
        *{"ReadOnly" in (*obj.getPropertyStatus(name), *obj.getTypeOfProperty(name)) for name in names},
    ]


def reopened(top: str) -> None:
    """FreeCAD marks an assembly at once whose parts were saved after it."""
    close_all()
    App.openDocument(top)
    wait(settled)
    tell(reopened=states())


def help_page(one: Any) -> None:
    Gui.runCommand("Silo_Help")
    wait(lambda: shown("SiloHelp")).close()


def history(one: Any) -> None:
    Gui.runCommand("Silo_History")
    window = one._window
    wait(lambda: window.revisions.topLevelItemCount())
    window.reject()


def open_item(one: Any) -> None:
    Gui.runCommand("Silo_Open")
    one._window.reject()


def project_view(one: Any) -> None:
    """With the states of the files in FreeCAD's tree."""
    Gui.runCommand("Silo_Project")
    view = wait(lambda: one.project._content)
    view._choose(str(VAULT))
    wait(lambda: view._flow.view.rows and settled())
    one.project.close()


RUNS: dict[str, Callable[[Any], None]] = {
    "Origin_Commit": lambda _one: commit(App.ActiveDocument),
    "Silo_BOM": compare,
    "Silo_RegisterParts": register_parts,
    "Silo_Mass": mass,
    "Silo_Activity": activity,
    "Silo_Settings": settings,
    "Silo_Help": help_page,
    "Silo_History": history,
    "Silo_Open": open_item,
    "Silo_Project": project_view,
}

run(story)
