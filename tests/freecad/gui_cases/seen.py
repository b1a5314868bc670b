# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD's window: lit parts, and another revision as a ghost."""

from __future__ import annotations

import os
from typing import Any

from inside import (
    App,
    Gui,
    QtWidgets,
    addon,
    ask,
    assembly,
    button_texts,
    commit,
    link,
    part,
    picture,
    press,
    ready,
    register,
    run,
    settled,
    tell,
    unmark,
    wait,
)


def draw(doc: Any) -> None:
    """Commit, and wait for the models."""
    commit(doc)
    wait(lambda: addon().session._models.idle, 240)
    tell(drawn=ask("drawn"))


def nodes() -> int:
    """Of our own in the view."""
    graph = Gui.ActiveDocument.ActiveView.getSceneGraph()
    names = [graph.getChild(n).getTypeId().getName().getString() for n in range(graph.getNumChildren())]
    return names.count("Separator") - bare[0]


bare = [0]


def view(name: str) -> None:
    if folder := os.environ.get("SILO_TEST_PICTURES"):
        Gui.ActiveDocument.ActiveView.saveImage(os.path.join(folder, f"{name}.png"), 900, 600, "White")


def story() -> None:
    one = ready()
    plate, bolt, knob = part("Plate"), part("Bolt"), part("Knob")
    plate.Length, plate.Width, plate.Height = 100, 60, 5
    bolt.Height = 30
    for doc in (plate.Document, bolt.Document):
        # FreeCAD 0.20 asks about edited parts when the assembly is saved.
        doc.recompute()
        doc.save()
        unmark(doc)
    top = assembly("Top", ("Plate", plate, 0), ("Bolt", bolt, 0), ("Row", bolt, 3), ("Gone", knob, 0))
    doc = top.Document
    for name, x in (("Bolt", 10), ("Gone", 80)):
        doc.getObject(name).Placement.Base = App.Vector(x, 20, -10)
    doc.getObject("Row").PlacementList = [
        App.Placement(App.Vector(30 + 12 * n, 40, -10), App.Rotation()) for n in range(3)
    ]
    doc.recompute()
    numbers = register(plate.Document, bolt.Document, knob.Document, doc)
    App.setActiveDocument(doc.Name)
    Gui.ActiveDocument.ActiveView.viewIsometric()
    Gui.SendMsgToActiveView("ViewFit")
    draw(doc)
    doc.getObject("Bolt").Placement.Base = App.Vector(60, 10, -10)
    doc.removeObject("Gone")
    link(top, "New", knob).Placement.Base = App.Vector(85, 45, 5)
    doc.recompute()
    draw(doc)
    tell(numbers=numbers, modified_before=modified_now())
    import pivy.coin  # noqa: F401 - wraps the scene graph

    bare[0] = nodes()
    lights(doc)
    compares()
    tell(modified=modified_now())
    held(one, doc)


def modified_now() -> list[str]:
    return [name for name in App.listDocuments() if Gui.getDocument(name).Modified]


def lights(doc: Any) -> None:
    """The preview's *Show*, and something else that is selected then."""
    addon().buttons.show_objects(doc.FileName, ("Row",))
    tell(lit=nodes(), selected=len(Gui.Selection.getSelection()))
    view("lit")
    Gui.Selection.clearSelection()
    Gui.Selection.addSelection(doc.Name, "Plate")
    tell(unlit=wait(lambda: not nodes()))
    Gui.Selection.clearSelection()


def compares() -> None:
    """*Compare in 3D* in the history, twice."""
    Gui.runCommand("Silo_History")
    window = addon()._window
    wait(lambda: window.revisions.topLevelItemCount() == 2)
    window.revisions.setCurrentItem(window.revisions.topLevelItem(1))
    window.compare_button.click()
    wait(lambda: settled() and window.news.text())
    tell(said=window.news.text(), ghost=nodes())
    view("ghost")
    picture(window, "history")
    window.compare_button.click()
    wait(lambda: "removed" in window.news.text())
    tell(after=nodes())
    window.close()


def held(one: Any, doc: Any) -> None:
    """*Compare with revision 3* of a commit that waits, since a colleague was quicker; pressed twice."""
    from silo.workbench.commit.plan import plan

    ask("colleague")
    one.commits.run(plan(doc, one.desk.documents).rows, "mine")
    wait(lambda: [entry for entry in one.session.shown.waiting if entry.newer] and settled())
    one.dock.show_and_raise()
    compare = "Compare with revision 3"
    wait(lambda: compare in button_texts(one.dock))
    press(one.dock, compare)
    wait(lambda: settled() and nodes())
    tell(held_said=QtWidgets.QToolTip.text(), held_ghost=nodes())
    view("held")
    picture(Gui.getMainWindow(), "held window")
    press(one.dock, compare)
    tell(held_after=wait(lambda: settled() and not nodes()), held_modified=modified_now())


run(story)
