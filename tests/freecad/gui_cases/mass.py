# SPDX-License-Identifier: LGPL-2.1-or-later
"""Runs inside FreeCAD's window: the mass of an unsaved assembly, its window, and a long one cancelled."""

from __future__ import annotations

import time
from itertools import pairwise
from typing import Any

import FreeCAD as App
import FreeCADGui as Gui
import Part
from inside import FOLDER, QtCore, QtWidgets, labels, run, tell, wait

HTML = "<b>Shaft</b>"


def part(doc: Any, whole: Any, label: str, shape: Any, density: str = "") -> Any:
    holder = doc.addObject("App::Part", "Holder")
    holder.Label = label
    body = doc.addObject("Part::Feature", "Body")
    body.Shape = shape
    holder.addObject(body)
    if density:
        material = doc.addObject("App::MaterialObjectPython", "Material")
        material.Material = {"Name": "Stuff", "Density": density}
        holder.Material = material
    whole.addObject(holder)
    return holder


def assembly(name: str) -> tuple[Any, Any]:
    doc = App.newDocument(name)
    whole = doc.addObject("App::Part", "Assembly")
    whole.Label = name
    whole.Type = "Assembly"
    return doc, whole


def window() -> Any:
    """The mass window that is open, or None."""
    return next(
        (
            w
            for w in QtWidgets.QApplication.topLevelWidgets()
            if w.objectName() == "SiloMass" and w.isVisible()
        ),
        None,
    )


def shown_rows(tree: Any) -> list[list[str]]:
    return [
        [tree.topLevelItem(n).text(column) for column in range(tree.columnCount())]
        for n in range(tree.topLevelItemCount())
    ]


def table() -> None:
    """Two parts, one of them twice, one without a material."""
    doc, whole = assembly("Machine")
    shaft = part(doc, whole, HTML, Part.makeBox(10, 20, 30), "7900 kg/m^3")
    link = doc.addObject("App::Link", "Again")
    link.LinkedObject = shaft
    link.Placement.Base = App.Vector(0, 0, 60)
    whole.addObject(link)
    part(doc, whole, "Cover", Part.makeCylinder(5, 10))
    doc.recompute()
    Gui.runCommand("Silo_Mass")
    found = wait(window)
    found.grab().save(str(FOLDER / "mass.png"))
    tell(rows=shown_rows(found.table), texts=labels(found), title=found.windowTitle())
    found.findChild(QtWidgets.QPushButton, "copy").click()
    tell(copied=QtWidgets.QApplication.clipboard().text())
    found.close()
    wait(lambda: window() is None)
    App.newDocument("Empty")
    Gui.runCommand("Silo_Mass")
    tell(empty=labels(wait(window)))
    window().close()
    wait(lambda: window() is None)


def long_one() -> None:
    """Some thousand faces: the window stays alive, and Cancel ends it."""
    doc, whole = assembly("Heavy")
    plate = Part.makeBox(160, 160, 5)
    holes = [
        Part.makeCylinder(3, 5, App.Vector(10 + 12 * x, 10 + 12 * y, 0)) for x in range(12) for y in range(12)
    ]
    heavy = plate.cut(Part.makeCompound(holes))
    for n in range(4):
        part(doc, whole, f"Plate {n}", heavy.copy(), "2700 kg/m^3")
    doc.recompute()
    ticks = [time.monotonic()]
    timer = QtCore.QTimer()
    timer.timeout.connect(lambda: ticks.append(time.monotonic()))
    timer.start(5)
    Gui.runCommand("Silo_Mass")
    wait(window)
    timer.stop()
    gaps = [b - a for a, b in pairwise(ticks)]
    tell(heavy=shown_rows(window().table), took=ticks[-1] - ticks[0], longest=max(gaps), ticks=len(ticks))
    window().close()
    wait(lambda: window() is None)

    def cancel() -> None:
        for found in QtWidgets.QApplication.topLevelWidgets():
            if found.objectName() == "SiloMeasuring" and found.isVisible():
                found.findChild(QtWidgets.QPushButton).click()
                tell(cancelled=True)
                return
        QtCore.QTimer.singleShot(20, cancel)

    cancel()
    Gui.runCommand("Silo_Mass")
    tell(after_cancel=window() is not None)


def story() -> None:
    table()
    long_one()


run(story)
