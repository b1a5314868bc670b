# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: a linked file is missing, so the BOM is held; it comes back, and the BOM goes out."""

from __future__ import annotations

import os
from typing import Any

from inside import (
    App,
    Gui,
    QtCore,
    QtWidgets,
    addon,
    assembly,
    boxes,
    close_all,
    labels,
    part,
    picture,
    ready,
    register,
    run,
    settled,
    tell,
    wait,
)


def sign() -> Any:
    return Gui.getMainWindow().findChild(QtWidgets.QToolButton, "SiloStatusSign")


def tips() -> list[str]:
    """The tips of the documents in FreeCAD's tree."""
    found = []
    for tree in Gui.getMainWindow().findChildren(QtWidgets.QTreeWidget):
        model = tree.model()
        if tree.metaObject().className() == "Gui::TreeWidget" and model.rowCount():
            tops = [model.index(row, 0) for row in range(model.rowCount())]
            below = [model.index(row, 0, top) for top in tops for row in range(model.rowCount(top))]
            tips = (model.data(row, QtCore.Qt.ItemDataRole.ToolTipRole) for row in (*tops, *below))
            found += [str(tip) for tip in tips if tip and "held" in str(tip)]
    return found


def story() -> None:
    one = ready()
    bolt, plate = part("Bolt"), part("Plate")
    top = assembly("Top", ("B1", bolt, 0), ("P1", plate, 0))
    tell(numbers=register(*(obj.Document for obj in (bolt, plate, top))))
    path, lost = top.Document.FileName, plate.Document.FileName
    close_all()
    os.rename(lost, f"{lost}.away")
    one.dock.hide()
    doc = App.openDocument(path)
    doc.getObject("B1").Placement.Base.x += 5
    App.setActiveDocument(doc.Name)
    Gui.runCommand("Origin_Commit")
    wait(lambda: one.session.shown.held and settled())
    wait(lambda: sign() is not None and sign().isVisible())
    wait(lambda: any("held" in tip for tip in tips()))
    tell(
        held=[[held.part_number, str(held.why)] for held in one.session.shown.held],
        sign=sign().text(),
        pane=one.dock.isVisible(),
        labels=labels(one.dock),
        tree=[tip for tip in tips() if tip],
    )
    picture(Gui.getMainWindow(), "held-window")
    picture(one.dock, "held-pane")
    one.show_project()
    one.projects.choose(os.path.dirname(path))
    one.project.refresh()
    wait(lambda: any("BOM is held" in text for text in labels(one.project)) and settled())
    tell(project=[text for text in labels(one.project) if "held" in text])
    picture(one.project, "held-project")
    # The pane was closed; the file comes back, and a look at the project is enough.
    one.dock.hide()
    os.rename(f"{lost}.away", lost)
    before = len(boxes("BOM Updated"))
    one.project.refresh()
    wait(lambda: not one.session.shown.held and settled() and len(boxes("BOM Updated")) > before)
    wait(lambda: not sign().isVisible())
    tell(after=sign().isVisible(), pane_after=one.dock.isVisible(), tree_after=[tip for tip in tips() if tip])
    tell(state=addon().session.shown.connection)


run(story)
