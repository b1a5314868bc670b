# SPDX-License-Identifier: LGPL-2.1-or-later
"""Helpers for scripts that run inside FreeCAD with a window (see ``window.py``)."""

from __future__ import annotations

import faulthandler
import json
import os
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import FreeCAD as App
import FreeCADGui as Gui
from PySide import QtCore, QtGui

try:
    from PySide import QtWidgets
except ImportError:
    QtWidgets = QtGui

FOLDER = Path(os.environ["SILO_TEST_FOLDER"])
VAULT = FOLDER / "vault"
# These end what hangs; a machine that is ten times slower than usual must not reach them.
WAIT_S = 120
LONGEST_S = 560

_told: dict[str, Any] = {}


def run(
    story: Callable[[], None], *, closes: bool = False, ready: Callable[[], Any] = lambda: addon() is not None
) -> None:
    """Run the story once FreeCAD's window is ready, then end FreeCAD; a failed one ends it with 1.

    closes
        the story closes FreeCAD's window as its last step, and FreeCAD ends as it does for a person.
    """

    def go() -> None:
        code = 0
        try:
            wait(ready)
            story()
        except BaseException:  # noqa: BLE001  # whatever it is, the test has to hear of it
            code = 1
            (FOLDER / "trace.txt").write_text(traceback.format_exc())
        sys.stdout.flush()
        if code or not closes:
            os._exit(code)

    # A modal window that nobody expects would hold the story up forever.
    trace = (FOLDER / "trace.txt").open("w")
    faulthandler.dump_traceback_later(LONGEST_S, file=trace, exit=True)
    watch = QtCore.QTimer(Gui.getMainWindow())
    watch.timeout.connect(lambda: note_modal(trace))
    watch.start(2000)
    QtCore.QTimer.singleShot(500, go)


def note_modal(trace: Any) -> None:
    """Write down what a modal window says, for the message of a test that fails because of it."""
    found = QtWidgets.QApplication.activeModalWidget()
    if found is not None:
        print("modal window:", found.objectName(), labels(found), file=trace, flush=True)


def tell(**values: Any) -> None:
    """Write results; they are on disk at once, FreeCAD may be killed after."""
    _told.update(values)
    part = FOLDER / "told.part"
    part.write_text(json.dumps(_told))
    part.rename(FOLDER / "told.json")


def ask(name: str) -> Any:
    """Have the test do something (``Window.answers``) and wait for what it says."""
    question = FOLDER / "asked" / f"{time.monotonic_ns()}.question"
    part = question.with_suffix(".new")
    part.write_text(name)
    part.rename(question)
    answer = question.with_suffix(".answer")
    wait(answer.exists)
    return json.loads(answer.read_text())


def wait(reached: Callable[[], Any], seconds: float = WAIT_S) -> Any:
    """Let FreeCAD work until something is so; what it is then. An error after ``seconds``."""
    end = time.monotonic() + seconds
    while True:
        QtWidgets.QApplication.processEvents(QtCore.QEventLoop.ProcessEventsFlag.AllEvents, 20)
        found = reached()
        if found:
            return found
        if time.monotonic() > end:
            import inspect

            raise TimeoutError(f"not reached in {seconds} s: {inspect.getsource(reached).strip()}\n{state()}")
        # Worker threads want their turn too.
        time.sleep(0.005)


def state() -> str:
    """What the add-on shows, for messages."""
    session = addon().session if addon() is not None else None
    if session is None:
        return "no add-on"
    shown = session.shown
    return f"{shown.connection} {shown.reason!r} busy={shown.busy} waiting={shown.waiting}\n" + "\n".join(
        pane()
    )


def addon() -> Any:
    """The add-on, once FreeCAD has loaded it."""
    from silo.workbench import start

    late = next((kept for kept in start._kept if isinstance(kept, start.Late)), None)
    return late.addon if late is not None else None


def settled() -> bool:
    """Nothing is under way any more, and what the workers have handed over is done and shown.

    What they handed over may begin the next step, as the copy of a commit is followed by its sending; so one
    look at workers without work is not enough.
    """
    for _ in range(3):
        if not at_rest():
            return False
        QtWidgets.QApplication.processEvents()
    return at_rest()


def at_rest() -> bool:
    """No worker has anything to do at this moment."""
    one = addon()
    return bool(one.session.idle and not one.commits.running and one.session.shown.busy is None)


def pane() -> list[str]:
    """The boxes of the pane as text, newest first."""
    sys.path.append(str(Path(__file__).resolve().parents[2] / "support"))
    from activities import entry_text

    return [entry_text(entry) for entry in addon().session.shown.activity.entries]


def in_property_editor() -> list[str]:
    """The names of the properties that FreeCAD's property editor shows, as it spells them."""
    found = []
    for view in Gui.getMainWindow().findChildren(QtWidgets.QTreeView, "propertyEditorData"):
        model = view.model()
        for group in (model.index(row, 0) for row in range(model.rowCount())):
            found += [str(model.index(row, 0, group).data()) for row in range(model.rowCount(group))]
    return found


def boxes(title: str) -> list[str]:
    """The boxes whose title begins so."""
    return [text for text in pane() if text.startswith(title)]


def labels(widget: Any) -> list[str]:
    """All visible texts of a widget: what a person reads."""
    return [
        label.text() for label in widget.findChildren(QtWidgets.QLabel) if label.isVisible() and label.text()
    ]


def picture(widget: Any, name: str) -> None:
    """For those who look: what the test saw."""
    if folder := os.environ.get("SILO_TEST_PICTURES"):
        QtWidgets.QApplication.processEvents()
        widget.grab().save(os.path.join(folder, f"{name}.png"))


def press(widget: Any, text: str) -> None:
    """Press the first visible button with this text."""
    for button in widget.findChildren(QtWidgets.QPushButton):
        if button.isVisible() and button.text() == text:
            button.click()
            return
    raise AssertionError(f"no button {text!r}; there are {button_texts(widget)}")


def button_texts(widget: Any) -> list[str]:
    """What the visible buttons say."""
    return [b.text() for b in widget.findChildren(QtWidgets.QPushButton) if b.isVisible()]


@contextmanager
def dialog(name: str, answer: Callable[[Any], None]) -> Iterator[None]:
    """While a modal dialog of this object name comes up inside, answer it."""
    met: list[Any] = []

    def look() -> None:
        found = QtWidgets.QApplication.activeModalWidget()
        if found is None or found.objectName() != name:
            QtCore.QTimer.singleShot(50, look)
            return
        try:
            answer(found)
            met.append(True)
        except BaseException as problem:  # noqa: BLE001  # raised again below, in the story
            met.append(problem)
            found.reject()

    QtCore.QTimer.singleShot(50, look)
    yield
    wait(lambda: met)
    if met[0] is not True:
        raise met[0]


# --- documents -------------------------------------------------------------------------------------------


def part(name: str, label: str = "") -> Any:
    """A part document with a box, saved; gives the box."""
    doc = App.newDocument(name)
    box = doc.addObject("Part::Box", "Box")
    box.Label = label or name
    doc.recompute()
    doc.saveAs(str(VAULT / f"{name}.FCStd"))
    unmark(doc)
    return box


def assembly(name: str, *links: tuple[str, Any, int]) -> Any:
    """An assembly document as Assembly4 makes it (every FreeCAD knows it), saved; gives the assembly.

    links
        (name, target, element count; 0 for a plain link).
    """
    doc = App.newDocument(name)
    made = doc.addObject("App::Part", "Assembly")
    made.Type = "Assembly"
    doc.saveAs(str(VAULT / f"{name}.FCStd"))
    for link_name, target, count in links:
        link(made, link_name, target, count)
    doc.recompute()
    doc.save()
    unmark(doc)
    return made


def link(container: Any, name: str, target: Any, count: int = 0) -> Any:
    """A link in an assembly."""
    made = container.Document.addObject("App::Link", name)
    made.LinkedObject = target
    container.addObject(made)
    if count:
        made.ElementCount = count
    return made


def unmark(doc: Any) -> None:
    """Take away the mark of unsaved edits, as FreeCAD's own save command does."""
    view = Gui.getDocument(doc.Name)
    try:
        view.Modified = False
    except AttributeError:
        App.setActiveDocument(doc.Name)
        Gui.runCommand("Std_Save")


def modified(doc: Any) -> bool:
    """True while FreeCAD shows unsaved edits."""
    return bool(Gui.getDocument(doc.Name).Modified)


def register(*documents: Any) -> dict[str, str]:
    """Items for documents, made from outside; their identities are written and saved. Name → part number."""
    from silo.api.client import SiloClient

    numbers = {}
    with SiloClient(os.environ["SILO_API_URL"], os.environ["SILO_API_TOKEN"]) as client:
        for doc in documents:
            kind, category = ("assembly", "A01") if doc.getObject("Assembly") else ("part", "M01")
            item = client.create_item("kindred-rd", category, doc.Label, item_type=kind)
            doc.Meta = {"SiloUUID": item.id}
            doc.save()
            unmark(doc)
            numbers[doc.Name] = item.part_number
    return numbers


def ready(*, comments: bool = False) -> Any:
    """The add-on, once it is connected.

    comments
        a commit asks for one; without, none of its dialogs come up unless there is something to decide.
    """
    one = addon()
    one.preferences.set("AskRegister", False)
    one.preferences.set("AskComment", comments)
    wait(lambda: one.session.shown.connection == "online")
    return one


def commit(doc: Any) -> None:
    """Commit a document by the command, until its box is there."""
    seen = len(committed())
    App.setActiveDocument(doc.Name)
    Gui.runCommand("Origin_Commit")
    wait(lambda: len(committed()) > seen and settled())


def committed() -> list[str]:
    """The boxes of our commits."""
    return [*boxes("Committed"), *boxes("BOM Updated")]


def preview(doc: Any = None) -> Any:
    """The window of *Compare BOM with Silo* for a document, or that which is open, with its answer."""
    found = _window("Silo_BOM", doc, addon().previews)
    wait(lambda: found._preview is not None)
    return found


def registering(doc: Any = None) -> Any:
    """The dialog *Register Parts* for a document, or that which came up by itself, with its rows."""
    found = _window("Silo_RegisterParts", doc, addon().registrations)
    wait(lambda: found.rows)
    return found


def _window(command: str, doc: Any, flow: Any) -> Any:
    if doc is not None:
        App.setActiveDocument(doc.Name)
        Gui.runCommand(command)
    return wait(lambda: next(iter(flow._open.values()), None))


def row_of(dialog: Any, component: str) -> Any:
    """The row of a component in *Register Parts*."""
    return next(row for row in dialog.rows if row.component() == component)


def close(window: Any) -> None:
    """Close the window of a preview or of a registration."""
    window.close()
    wait(lambda: not addon().previews._open and not addon().registrations._open)


def close_all() -> None:
    """Close all documents."""
    for name in list(App.listDocuments()):
        if name in App.listDocuments():
            App.closeDocument(name)
