# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside two FreeCADs at once: Alice and Bob have the same assemblies open; each takes a part out of each.

Alice commits first. Bob then meets her commits: ``Left`` he leaves out, ``OnTop`` he commits on top, for
``Taken`` he takes hers, ``Copied`` lies in a copy of the project folder and has an edit that was only saved,
``Held`` he sends before he knows of hers, and chooses in the pane.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from inside import (
    FOLDER,
    VAULT,
    App,
    Gui,
    QtCore,
    QtGui,
    QtWidgets,
    assembly,
    boxes,
    button_texts,
    dialog,
    labels,
    part,
    picture,
    press,
    ready,
    register,
    run,
    settled,
    tell,
    wait,
)
from themes import contrast

from silo.workbench.activity.box import Action, Do

SHARED = Path(os.environ["SILO_TEST_SHARED"])
NAMES = ("Left", "OnTop", "Taken", "Copied", "Held")


def say(what: str) -> None:
    (SHARED / what).touch()


def until(what: str) -> None:
    wait((SHARED / what).exists)


def remove(doc: Any, name: str) -> None:
    """Take a link out of an assembly."""
    doc.removeObject(name)
    doc.recompute()


def commit(doc: Any, comment: str, choice: str | None = None) -> dict[str, Any]:
    """Commit by the command; what the dialog shows once it has looked at Silo. Choice "": press Cancel."""
    seen: dict[str, Any] = {}

    def answer(found: Any) -> None:
        if choice is not None:
            wait(lambda: any(one.revision for one in found._theirs.values()))
            item = found.files.topLevelItem(0)
            seen["title"] = found.windowTitle()
            seen["row"] = [item.text(0), item.text(1), item.checkState(0) == 0 or str(item.checkState(0))]
            seen["details"] = [item.child(n).text(1) for n in range(item.childCount())]
            seen["can_commit"] = found.commit.isEnabled()
            picture(found, f"commit {choice or 'cancelled'}")
        found.comment.setPlainText(comment)
        if choice == "":
            seen["all"] = all_lines(found)
            found.reject()
            return
        if choice is not None:
            box = found.files.itemWidget(item, 2)
            box.setCurrentIndex(box.findData(choice))
        found.commit.click()

    App.setActiveDocument(doc.Name)
    with dialog("SiloCommitDialog", answer):
        Gui.runCommand("Origin_Commit")
    wait(settled)
    return seen


def all_lines(found: Any) -> list[list[str]]:
    """What the dialog shows of a long difference: at first, and when the rest is asked for."""
    ((number, theirs),) = found._theirs.items()
    found.show_theirs({theirs.path: replace(theirs, lines=theirs.lines[:1] * 30)})
    item = found.files.topLevelItem(number)
    first = [item.child(n).text(1) for n in range(item.childCount())]
    return [first, read(lambda: press(found, "… and 18 more lines"))]


def read(show: Callable[[], None]) -> list[str]:
    """The lines of the window that scrolls."""
    lines: list[str] = []

    def answer(found: Any) -> None:
        picture(found, "read")
        lines.extend(found.findChild(QtWidgets.QPlainTextEdit).toPlainText().splitlines())
        press(found, "Close")

    with dialog("SiloRead", answer):
        show()
    return lines


def found_open(folder: str, name: str) -> Any:
    """The open document of this name below a folder of this name."""
    docs = App.listDocuments().values()
    return next((d for d in docs if folder in d.FileName and d.FileName.endswith(f"{name}.FCStd")), None)


def alice() -> None:
    one = ready(comments=True)
    bolt, plate = part("Bolt"), part("Plate")
    tops = {name: assembly(name, ("Bolts", bolt, 4), ("Plate", plate, 0)).Document for name in NAMES}
    tell(numbers=register(bolt.Document, plate.Document, *tops.values()))
    for doc in (bolt.Document, plate.Document, *tops.values()):
        commit(doc, "first")
    wait(lambda: not one.session.shown.waiting)
    say("ready")
    until("opened")
    for doc in tops.values():
        remove(doc, "Plate")
        commit(doc, "without the plate")
    wait(lambda: not one.session.shown.waiting and settled())
    tell(boxes=len(boxes("BOM Updated")))
    say("committed")


def bob() -> None:
    one = ready(comments=True)
    until("ready")
    for file in SHARED.glob("vault/*.FCStd"):
        shutil.copy2(file, VAULT)
    folders = {name: VAULT if name == "Copied" else SHARED / "vault" for name in NAMES}
    docs = {name: App.openDocument(str(folders[name] / f"{name}.FCStd")) for name in NAMES}
    copied = docs["Copied"]
    copied.Comment = "saved, and not committed"
    copied.save()
    say("opened")
    until("committed")
    wait(lambda: sum(newer.revision == 2 for newer in one.session.shown.newer.values()) == len(NAMES))
    one.dock.show_and_raise()
    wait(lambda: any("since you opened it" in text for text in labels(one.dock)))
    tell(pane=[text for text in labels(one.dock) if "since you opened it" in text])
    for doc in docs.values():
        remove(doc, "Bolts")
    mine = {name: doc.FileName for name, doc in docs.items()}
    tell(left=commit(docs["Left"], "mine", ""))
    tell(on_top=commit(docs["OnTop"], "mine", "on top"))
    tell(taken=commit(docs["Taken"], "mine", "take"))
    wait(lambda: boxes("Took"))
    taken = next(doc for doc in App.listDocuments().values() if doc.FileName == mine["Taken"])
    tell(has=sorted(obj.Name for obj in taken.getObject("Assembly").Group))
    tell(linked=[obj.LinkedObject is not None for obj in taken.getObject("Assembly").Group])
    tell(copied=commit(copied, "mine", "open"))
    theirs = wait(lambda: found_open("revisions", "Copied"))
    group = theirs.getObject("Assembly").Group
    tell(beside=[[obj.Name, obj.LinkedObject is not None] for obj in group])
    tell(both=sorted(obj.Name for obj in copied.getObject("Assembly").Group))
    held(one, docs["Held"])
    # Once more after the answer: mine is what the next commit is made from.
    docs["OnTop"].Comment = "next"
    commit(docs["OnTop"], "next")
    wait(lambda: not one.session.shown.waiting)
    tell(waiting=[str(entry.reason) for entry in one.session.shown.waiting])
    windows(one, docs["OnTop"])


def held(one: Any, doc: Any) -> None:
    """The commit is on its way before anybody has looked at Silo; the pane has the dialog's choices."""
    from silo.workbench.commit.plan import plan

    path = doc.FileName
    one.commits.run(plan(doc, one.desk.documents).rows, "mine")
    wait(lambda: [entry for entry in one.session.shown.waiting if entry.newer] and settled())
    wait(lambda: "Take theirs" in button_texts(one.dock))
    said = wait(
        lambda: [text.text() for text in one.dock.findChildren(QtWidgets.QLabel) if "by them" in text.text()]
    )
    wait(lambda: not cut(one.dock))
    tell(held_difference=said)
    picture(one.dock, "held")
    (entry,) = one.session.shown.waiting
    tell(held_all=read(lambda: one.buttons.act(Action(Do.DETAILS, "", target=str(entry.id)))))
    tell(held=[entry.reason for entry in one.session.shown.waiting], held_buttons=button_texts(one.dock))
    many(one, entry)
    press(one.dock, "Open theirs beside mine")
    beside = wait(lambda: found_open("revisions", "Held"))
    tell(held_beside=sorted(obj.Name for obj in beside.getObject("Assembly").Group))
    press(one.dock, "Take theirs")
    wait(lambda: not one.session.shown.waiting and settled())
    (taken,) = (doc for doc in App.listDocuments().values() if doc.FileName == path)
    tell(held_has=sorted(obj.Name for obj in taken.getObject("Assembly").Group))


def many(one: Any, entry: Any) -> None:
    """Eight such commits in a low window: no line is cut, and each can be decided."""
    shown = one.session.shown
    (theirs,) = shown.theirs.values()
    waiting = tuple(replace(entry, id=number) for number in range(100, 108))
    long = replace(theirs, lines=theirs.lines * 8)
    crowd = replace(shown, waiting=waiting, theirs={held.id: long for held in waiting})
    one.dock.setFloating(True)
    one.dock.resize(320, 400)

    def seen(texts: Callable[[list[str]], bool]) -> bool:
        # News of the session may draw over it at any moment; drawn again, it costs nothing where it stands.
        one.dock.update_shown(crowd)
        return texts(button_texts(one.dock)) and not cut(one.dock)

    wait(lambda: seen(lambda found: "… and 4 more" in found))
    picture(one.dock, "many held")
    tell(held_height=one.dock.height(), held_cut=cut(one.dock))

    def all_seen() -> bool:
        if seen(lambda found: "… and 4 more" in found):
            press(one.dock, "… and 4 more")
        return seen(lambda found: found.count("Discard") == 8)

    wait(all_seen)
    one.dock.update_shown(one.session.shown)
    one.dock.setFloating(False)
    wait(lambda: button_texts(one.dock).count("Discard") == 1)


def cut(widget: Any) -> list[str]:
    """The texts that need more height than they have."""
    found = [label for label in widget.findChildren(QtWidgets.QLabel) if label.isVisible() and label.text()]
    return [label.text() for label in found if label.height() < label.heightForWidth(label.width())]


def choose_folder(folder: Path) -> None:
    """Answer FreeCAD's dialog for a folder, once it is there."""
    found = QtWidgets.QApplication.activeModalWidget()
    if not isinstance(found, QtWidgets.QFileDialog):
        QtCore.QTimer.singleShot(50, lambda: choose_folder(folder))
        return
    found.setDirectory(str(folder))
    found.findChild(QtWidgets.QLineEdit).setText(str(folder))
    found.accept()


def windows(one: Any, doc: Any) -> None:
    """*History* of a document, then *Open from Silo* into an empty folder."""
    App.setActiveDocument(doc.Name)
    Gui.runCommand("Silo_History")
    history = one._window
    wait(lambda: history.revisions.topLevelItemCount() == 4)
    wait(lambda: history.change.text() == "No change of the BOM.")
    history.revisions.setCurrentItem(history.revisions.topLevelItem(1))
    wait(lambda: "Plate" in history.change.text())
    picture(history, "history")
    history._first([f"Bolt {number}" for number in range(20)], 12)
    tell(history_all=len(read(lambda: press(history, "… and 8 more lines"))))
    rows = [history.revisions.topLevelItem(n) for n in range(4)]
    tell(history=[[row.text(column) for column in (0, 3)] for row in rows], change=history.change.text())
    history.revisions.setCurrentItem(history.revisions.topLevelItem(3))
    copies = VAULT.parent / "copies"
    copies.mkdir()
    QtCore.QTimer.singleShot(50, lambda: choose_folder(copies))
    history.get_button.click()
    first = wait(lambda: found_open("copies", "OnTop"))
    group = first.getObject("Assembly").Group
    tell(
        got=sorted([obj.Name, obj.LinkedObject is not None] for obj in group),
        got_in=str(Path(first.FileName).relative_to(copies)),
    )
    history.reject()
    Gui.runCommand("Silo_Open")
    found = one._window
    found.words.setText("Taken")
    wait(lambda: found.items.topLevelItemCount() == 1 and found.revisions.topLevelItemCount() == 3)
    found.folder.setText(str(VAULT.parent / "empty"))
    found.revisions.setCurrentItem(found.revisions.topLevelItem(2))
    picture(found, "open")
    found.open_button.click()
    wait(lambda: found.news.text() == "Opened.")
    opened = wait(lambda: found_open("empty", "Taken"))
    group = opened.getObject("Assembly").Group
    tell(opened=sorted([obj.Name, obj.LinkedObject is not None] for obj in group))
    # An edit of it is left alone until the person answers.
    path = opened.FileName
    remove(opened, "Plate")
    opened.save()
    App.closeDocument(opened.Name)
    edited = Path(path).read_bytes()

    def take(window: Any) -> None:
        picture(window, "choices")
        tell(left_alone=found.news.text(), untouched=Path(path).read_bytes() == edited)
        (box,) = window.findChildren(QtWidgets.QComboBox)
        box.setCurrentIndex(box.findData("take"))
        window.findChild(QtWidgets.QPushButton, "do").click()

    def kept() -> int:
        return len(list(FOLDER.rglob("kept-aside/**/*Taken.FCStd")))

    before = kept(), len(boxes("Took "))
    with dialog("SiloChoices", take):
        found.open_button.click()
        wait(lambda: len(boxes("Took ")) > before[1])
    again = wait(lambda: found_open("empty", "Taken"))
    tell(
        replaced=sorted(obj.Name for obj in again.getObject("Assembly").Group),
        edit_kept=kept() > before[0],
    )
    # The newest lies in the project now, so it is opened and not fetched.
    found.revisions.setCurrentItem(found.revisions.topLevelItem(0))
    found.open_button.click()
    wait(lambda: "in the project already" in found.news.text())
    tell(opened_in_place=found.newest.isVisible())
    # The line has been grey, then in the colour of a warning, and is grey again.
    line = found.news.grab().toImage().convertToFormat(QtGui.QImage.Format.Format_RGB32)
    tell(news_contrast=contrast(line))
    found.reject()


run(alice if os.environ["SILO_TEST_ROLE"] == "alice" else bob)
