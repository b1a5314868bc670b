# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: a recompute marks all files of a project; which does a commit take?"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from inside import (
    VAULT,
    App,
    Gui,
    QtCore,
    QtGui,
    QtWidgets,
    assembly,
    boxes,
    close_all,
    committed,
    dialog,
    labels,
    modified,
    part,
    ready,
    register,
    registering,
    run,
    settled,
    tell,
    unmark,
    wait,
)

PARTS = 11


def story() -> None:
    one = ready(comments=True)
    of_each_kind()
    project(one)


def project(one: Any) -> None:
    """Parts in an assembly, opened as people do it; everything is recomputed, one part is edited."""
    made = [part(f"Part{number}") for number in range(PARTS)]
    top = assembly("Top", *((f"L{n}", box, 0) for n, box in enumerate(made))).Document
    register(top)
    path = top.FileName
    close_all()
    doc = App.openDocument(path)
    recompute()
    tell(marked=sum(map(modified, App.listDocuments().values())))
    App.getDocument("Part7").getObject("Box").Length = 77
    from silo.workbench.commit.plan import plan

    tell(states={row.label: row.state.value for row in plan(doc, one.desk.documents).rows})

    def look(window: Any) -> None:
        told: dict[str, Any] = {"texts": labels(window), "checked": checked(window)}
        for name in ("all", "none", "this", "edited"):
            window.findChild(QtWidgets.QPushButton, name).click()
            told[name] = [len(checked(window)), window.commit.isEnabled()]
        window.comment.setPlainText("longer")
        tell(dialog=told)
        press_keys(window)

    App.setActiveDocument(doc.Name)
    with dialog("SiloCommitDialog", look):
        Gui.runCommand("Origin_Commit")
    wait(lambda: committed() and settled())
    tell(
        left=sum(map(modified, App.listDocuments().values())), edited_left=modified(App.getDocument("Part7"))
    )
    unregistered()


def press_keys(window: Any) -> None:
    """Ctrl+Return, from the comment."""
    for kind in (QtCore.QEvent.Type.ShortcutOverride, QtCore.QEvent.Type.KeyPress):
        event = QtGui.QKeyEvent(kind, QtCore.Qt.Key.Key_Return, QtCore.Qt.KeyboardModifier.ControlModifier)
        QtWidgets.QApplication.sendEvent(window.comment, event)
    if window.isVisible():
        # No window manager gives it the focus here, so Qt does not look for a shortcut.
        window.shortcuts[0].activated.emit()


def checked(window: Any) -> list[str]:
    return [row.label for row in window.chosen()]


def unregistered() -> None:
    """A commit of an assembly without a number: its comment goes along with its registration."""
    close_all()
    doc = assembly("New", ("P", part("FreshPlate"), 0)).Document
    doc.getObject("P").Label = "The part"
    App.setActiveDocument(doc.Name)

    def look(window: Any) -> None:
        tell(offers=window.register.isVisible() and window.register.isChecked())
        window.comment.setPlainText("my first words")
        window.commit.click()

    with dialog("SiloCommitDialog", look):
        Gui.runCommand("Origin_Commit")
    found = registering()
    found.register_button.click()
    wait(lambda: all(row.finished for row in found.rows) and settled())
    numbers = {row.component(): row.result.part_number for row in found.rows}
    wait(lambda: boxes(f"BOM Updated: {numbers['New.FCStd']}") and settled())
    tell(numbers=numbers)
    found.close()


# --- kinds of properties ---------------------------------------------------------------------------------


def of_each_kind() -> None:
    """A sketch, a pad, a cut, a spreadsheet: recomputed, edited, undone."""
    import Part
    import Sketcher

    doc = App.newDocument("Kinds")
    body = doc.addObject("PartDesign::Body", "Body")
    sketch = body.newObject("Sketcher::SketchObject", "Sketch")
    corners = [App.Vector(0, 0, 0), App.Vector(10, 0, 0), App.Vector(10, 5, 0), App.Vector(0, 5, 0)]
    for number in range(4):
        sketch.addGeometry(Part.LineSegment(corners[number], corners[(number + 1) % 4]), False)
    for number in range(4):
        sketch.addConstraint(Sketcher.Constraint("Coincident", number, 2, (number + 1) % 4, 1))
    width = sketch.addConstraint(Sketcher.Constraint("Distance", 0, 10))
    pad = body.newObject("PartDesign::Pad", "Pad")
    pad.Profile, pad.Length = sketch, 4
    sheet = doc.addObject("Spreadsheet::Sheet", "Sheet")
    sheet.set("A1", "12")
    ball = doc.addObject("Part::Sphere", "Ball")
    doc.recompute()
    doc.saveAs(str(VAULT / "Kinds.FCStd"))
    unmark(doc)
    path = doc.FileName
    App.closeDocument("Kinds")
    doc = App.openDocument(path)
    recompute()
    told: dict[str, Any] = {"recomputed": [modified(doc), edited(doc)]}
    edits: dict[str, Callable[[], None]] = {
        "length": lambda: setattr(doc.getObject("Pad"), "Length", 6),
        "constraint": lambda: doc.getObject("Sketch").setDatum(width, 12),
        "placement": lambda: setattr(doc.getObject("Ball").Placement, "Base", App.Vector(0, 0, 1)),
        "label": lambda: setattr(doc.getObject("Ball"), "Label", "Other"),
        "sheet": lambda: doc.getObject("Sheet").set("A1", "13"),
        "new": lambda: doc.addObject("Part::Box", "More") and None,
        "gone": lambda: doc.removeObject("Ball"),
        "property": lambda: doc.getObject("Ball").addProperty("App::PropertyString", "Finish") and None,
        "hidden": lambda: setattr(doc.getObject("Ball"), "Visibility", False),
    }
    for name, edit in edits.items():
        doc.openTransaction(name)
        edit()
        doc.recompute()
        doc.commitTransaction()
        found = edited(doc)
        doc.undo()
        doc.recompute()
        told[name] = [found, edited(doc)]
        # What undo does not bring back as it was must not hide what the next edit does.
        App.closeDocument(doc.Name)
        doc = App.openDocument(path)
    doc.getObject("Pad").Length = 9
    doc.save()
    told["saved"] = edited(doc)
    doc.getObject("Pad").Length = 8
    doc.saveCopy(str(VAULT / "Copy.FCStd"))
    told["saved a copy"] = edited(doc)
    tell(kinds=told)
    del ball, pad
    close_all()


def edited(doc: Any) -> list[str]:
    """What differs from the file."""
    from silo.workbench.freecad.modified import watch_edits

    return sorted(watch_edits().differences(doc))


def recompute() -> None:
    """All of it, as Ctrl+Shift+R does."""
    for doc in App.listDocuments().values():
        for obj in doc.Objects:
            obj.touch()
    for doc in App.listDocuments().values():
        doc.recompute()


run(story)
