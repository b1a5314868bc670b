# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: an afternoon with the example assembly, for ``scripts/screenshots_freecad.py``."""

from __future__ import annotations

import faulthandler
import os
import shutil
import stat
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from inside import (
    FOLDER,
    App,
    Gui,
    QtCore,
    QtGui,
    QtWidgets,
    ask,
    boxes,
    close,
    dialog,
    in_property_editor,
    preview,
    ready,
    registering,
    run,
    settled,
    unmark,
    wait,
)

PICTURES = Path(os.environ["SILO_PICTURES"])
WIDTH, HEIGHT = 1320, 800
MACHINE = FOLDER / "gearbox"
PANE_WIDTH = 400


def story() -> None:
    # A long afternoon, on a busy machine; whoever started it ends what does not end.
    faulthandler.cancel_dump_traceback_later()
    one = ready(comments=True)
    top = open_machine()
    arrange(one)
    if os.environ.get("SILO_TOUR"):
        tour(one, top)
        return
    new_parts(top)
    photograph_and_close(preview(top), "preview")
    photograph_and_close(registering_with_edits(top), "register")
    commit(one, top)
    project(one)
    offline(one, top)
    settings(one)


def said(text: str) -> str:
    """A text of the add-on in FreeCAD's language, up to what differs."""
    from silo.workbench.words import translate

    return translate("Silo", text).partition("{")[0]


# --- the stage -------------------------------------------------------------------------------------------


def open_machine() -> Any:
    doc = App.openDocument(str(MACHINE / "TopAssembly.FCStd"))
    App.openDocument(str(MACHINE / "Gearbox.FCStd"))
    App.setActiveDocument(doc.Name)
    # FreeCAD marks files of an earlier version as changed when it opens them.
    recompute()
    return doc


def recompute() -> None:
    for doc in App.listDocuments().values():
        doc.recompute()
    for doc in App.listDocuments().values():
        unmark(doc)


def mark(doc: Any) -> None:
    """Mark a document as changed."""
    try:
        Gui.getDocument(doc.Name).Modified = True
    except AttributeError:  # FreeCAD 0.20
        for obj in doc.Objects:
            obj.Label = obj.Label


def arrange(one: Any) -> None:
    """A window of a size that can still be read in a page, the pane on its right."""
    window = Gui.getMainWindow()
    Gui.activateWorkbench("SiloModWorkbench")
    still()
    window.showNormal()
    window.setGeometry(0, 0, WIDTH, HEIGHT)
    wait(lambda: window.width() == WIDTH)
    inside = window.findChildren(QtWidgets.QWidget)
    if any("OverlayTab" in widget.metaObject().className() and widget.isVisible() for widget in inside):
        # The empty task panel of newer FreeCADs lies over the model.
        Gui.runCommand("Std_DockOverlayToggleRight")
    for dock in window.findChildren(QtWidgets.QDockWidget):
        dock.setVisible(dock.objectName() in ("Model", "Database Activity"))
    for bar in window.findChildren(QtWidgets.QToolBar):
        bar.setVisible(bar.objectName() in ("File", "Workbench", "Silo"))
    one.dock.show_and_raise()
    window.resizeDocks([one.dock], [PANE_WIDTH], QtCore.Qt.Orientation.Horizontal)
    still()


def still(milliseconds: int = 400) -> None:
    """Let FreeCAD draw what it has to draw."""
    waited = QtCore.QElapsedTimer()
    waited.start()
    wait(lambda: waited.elapsed() > milliseconds)


def photograph(widget: Any, name: str) -> None:
    """Save a widget as a small picture."""
    still()
    save(widget.grab().toImage(), name)


def photograph_window(name: str) -> None:
    """Save the main window as it is on the screen: what lies hidden in it is not."""
    still()
    screen = QtGui.QGuiApplication.primaryScreen() if hasattr(QtGui, "QGuiApplication") else None
    save(screen.grabWindow(0, 0, 0, WIDTH, HEIGHT).toImage(), name)


def save(image: Any, name: str) -> None:
    """Save with 256 colours: for a window they are enough, and the file is a fifth."""
    image = image.convertToFormat(QtGui.QImage.Format.Format_RGB32)
    width, height = image.width(), image.height()
    pixels = memoryview(bytes(image.constBits())[: 4 * width * height]).cast("I")
    found = Counter(pixels)
    # The commonest, and those of each further shade, so that many greys do not push out the one red.
    common = [colour for colour, _count in found.most_common()]
    shades: dict[int, int] = {}
    for colour in common:
        shades.setdefault(colour & 0xF0F0F0, colour)
    table = list(dict.fromkeys((*common[:96], *shades.values())))[:256]
    places = {colour: place for place, colour in enumerate(table)}
    for colour in found:
        if colour not in places:
            places[colour] = min(range(len(table)), key=lambda place: distance(table[place], colour))
    # A line of an image begins at a multiple of four bytes.
    padding = bytes(-width % 4)
    lines = (bytes(places[c] for c in pixels[width * y : width * (y + 1)]) for y in range(height))
    data = b"".join(line + padding for line in lines)
    few = QtGui.QImage(data, width, height, width + len(padding), QtGui.QImage.Format.Format_Indexed8)
    few.setColorTable(table)
    few.save(str(PICTURES / f"addon-{name}.png"), "PNG", 0)


def distance(one: int, other: int) -> int:
    return sum(((one >> shift & 255) - (other >> shift & 255)) ** 2 for shift in (0, 8, 16))


def part(file: str, label: str, size: tuple[float, float, float]) -> Any:
    doc = App.newDocument(file)
    box = doc.addObject("Part::Box", "Body")
    box.Label = label
    box.Length, box.Width, box.Height = size
    doc.recompute()
    doc.saveAs(str(MACHINE / "parts" / f"{file}.FCStd"))
    unmark(doc)
    return box


def new_parts(top: Any) -> None:
    """What the designer added this afternoon; one of them is a file of somebody else's, one a copy."""
    container = top.getObject("TopAssembly")
    made = [
        part("SensorBracket", "Sensor Bracket", (30, 12, 40)),
        part("Guard", "Guard", (200, 3, 60)),
        part("ParallelKey", "Parallel Key", (6, 6, 24)),
    ]
    (MACHINE / "parts" / "Guard.FCStd").chmod(stat.S_IRUSR)
    shutil.copy(MACHINE / "parts" / "BasePlate.FCStd", MACHINE / "parts" / "BasePlateLong.FCStd")
    copy = App.openDocument(str(MACHINE / "parts" / "BasePlateLong.FCStd"))
    unmark(copy)
    made.append(next(o for o in copy.Objects if o.isDerivedFrom("Part::Feature")))
    App.setActiveDocument(top.Name)
    for number, obj in enumerate(made):
        link = top.addObject("App::Link", obj.Document.Name)
        link.LinkedObject = obj
        link.Label = obj.Label
        container.addObject(link)
        link.Placement.Base = App.Vector(150 + 8 * number, -60, 12)
    top.getObject("CoverBolts" if top.getObject("CoverBolts") else _named(top, "CoverBolts")).ElementCount = 6
    recompute()
    mark(top)
    show(top)


def _named(doc: Any, label: str) -> str:
    return str(doc.getObjectsByLabel(label)[0].Name)


def show(top: Any) -> None:
    view = Gui.getDocument(top.Name).activeView()
    view.viewIsometric()
    view.fitAll()
    view.setNavigationType("Gui::CADNavigationStyle")


# --- the tour --------------------------------------------------------------------------------------------


def tour(one: Any, top: Any) -> None:
    """A commit while a colleague has committed the same assembly: frames for an animated picture."""
    frames: list[Any] = []

    def frame() -> None:
        still(600)
        screen = QtGui.QGuiApplication.primaryScreen() if hasattr(QtGui, "QGuiApplication") else None
        screen.grabWindow(0, 0, 0, WIDTH, HEIGHT).save(str(PICTURES / f"tour-{len(frames)}.png"))
        frames.append(None)

    show(top)
    frame()
    top.getObject(_named(top, "CoverBolts")).ElementCount = 6
    top.recompute()
    ask("colleague commits")
    wait(lambda: boxes(said("Revision {n} of {number}")) and settled())
    frame()

    def answer(found: Any) -> None:
        found.resize(860, 420)
        found.move(60, 180)
        found.comment.setPlainText("Two more cover bolts")
        frame()
        wait(lambda: found._choices)
        frame()
        for box in found._choices.values():
            box.showPopup()
            frame()
            box.hidePopup()
            box.setCurrentIndex(next(n for n in range(box.count()) if box.itemData(n) == "on top"))
            box.activated.emit(box.currentIndex())
        frame()
        found.commit.click()

    with dialog("SiloCommitDialog", answer):
        Gui.runCommand("Origin_Commit")
    wait(lambda: boxes(said("BOM Updated: {number}")) or boxes(said("Committed: {number}")))
    wait(settled)
    frame()


# --- what is photographed --------------------------------------------------------------------------------


def photograph_and_close(window: Any, name: str) -> None:
    photograph(window, name)
    close(window)


def commit(one: Any, top: Any) -> None:
    mark(App.getDocument("Gearbox"))

    def answer(found: Any) -> None:
        found.comment.setPlainText("Guard and sensor bracket added, two more cover bolts")
        photograph(found, "commit")
        found.commit.click()

    App.setActiveDocument(top.Name)
    with dialog("SiloCommitDialog", answer):
        Gui.runCommand("Origin_Commit")
    wait(lambda: boxes(said("BOM Updated: {number}")) and settled())
    App.setActiveDocument(top.Name)
    show(top)
    photograph(one.dock, "activity")
    # Its number and state are in the property editor.
    bolt = top.getObject("FlangeBolt1")
    Gui.Selection.addSelection(bolt)
    wait(lambda: "Silo State" in in_property_editor())
    photograph_window("window")
    Gui.Selection.clearSelection()


def registering_with_edits(top: Any) -> Any:
    App.getDocument("ParallelKey").getObject("Body").Length = 8
    mark(App.getDocument("ParallelKey"))
    return registering(top)


def project(one: Any) -> None:
    Gui.runCommand("Silo_Project")
    view = wait(lambda: one.project._content)
    view._choose(str(MACHINE))
    wait(lambda: view._flow.view.rows and settled())
    one.project.setFloating(True)
    one.project.resize(620, 460)
    photograph(one.project, "project")
    one.project.setFloating(False)
    one.project.close()


def offline(one: Any, top: Any) -> None:
    ask("server down")
    wait(lambda: one.session.shown.connection == "offline")
    top.getObject(_named(top, "CoverBolts")).ElementCount = 8
    top.recompute()

    def answer(found: Any) -> None:
        found.comment.setPlainText("Bolts on the train")
        found.commit.click()

    with dialog("SiloCommitDialog", answer):
        Gui.runCommand("Origin_Commit")
    wait(lambda: one.session.shown.waiting and settled())
    photograph(one.dock, "offline")
    ask("server up")
    wait(lambda: one.session.shown.connection == "online", 60)


def settings(one: Any) -> None:
    def look(found: Any) -> None:
        wait(lambda: any("SILO_API" in t or "token" in t.lower() for t in texts(found)))
        photograph(found, "settings")
        found.reject()

    def sized(found: Any) -> None:
        found.resize(880, 640)
        look(found)

    while_modal(sized)
    Gui.showPreferences("Silo", 0)


def texts(widget: Any) -> list[str]:
    return [label.text() for label in widget.findChildren(QtWidgets.QLabel)]


def while_modal(look: Callable[[Any], None]) -> None:
    def try_again() -> None:
        found = QtWidgets.QApplication.activeModalWidget()
        if found is None:
            QtCore.QTimer.singleShot(100, try_again)
        else:
            look(found)

    QtCore.QTimer.singleShot(100, try_again)


run(story)
