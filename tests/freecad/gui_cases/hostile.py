# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: commit, preview and register what ``hostile_vault.py`` wrote, and look at every window."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import inside
from inside import (
    FOLDER,
    VAULT,
    App,
    Gui,
    QtCore,
    QtWidgets,
    boxes,
    dialog,
    labels,
    press,
    ready,
    run,
    settled,
    tell,
    wait,
)

# What only a live document can hold: FreeCAD writes it into files, and cannot read them any more.
CONTROL = "\x1b[31mred\x1b[0m\x1b]0;title\x07\x9b2J \x08\x0b\x0c <b>live</b>"
# Control characters, but the line end that a message may have; and what turns text around.
HIDDEN = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069\ufeff]")
MARKUP = re.compile("<[!?/a-zA-Z]")


def look(window: Any, name: str) -> dict[str, Any]:
    """What a person can see of a window, and a picture of it."""
    QtWidgets.QApplication.processEvents()
    window.grab().save(str(FOLDER / f"{name}.png"))
    parts = window.findChildren(QtWidgets.QWidget)
    texts = [window.windowTitle(), *(text for one in parts for text in texts_of(one))]
    tips = [tip for one in parts for tip in tips_of(one)]
    # Our own tool tips are markup, with nothing but text in it.
    inner = [tip.replace("<qt>", "", 1).replace("</qt>", "", 1) for tip in tips]
    return {
        "parts": len(parts),
        "texts": len(texts),
        "longest": max(map(len, texts)),
        "drawn_as_markup": [label.text() for label in labels_of(parts) if not is_plain(label)],
        "tips_with_markup": sorted({tip for tip in inner if MARKUP.search(tip)})[:5],
        "hidden": sorted({text[:80] for text in (*texts, *tips) if HIDDEN.search(text)})[:5],
        "literal": any("<b>" in text or "<h1>" in text for text in texts),
    }


def labels_of(parts: list[Any]) -> list[Any]:
    return [one for one in parts if isinstance(one, QtWidgets.QLabel) and one.text()]


def is_plain(label: Any) -> bool:
    return bool(label.textFormat() == QtCore.Qt.TextFormat.PlainText)


def texts_of(one: Any) -> Iterator[str]:
    if isinstance(one, (QtWidgets.QLabel, QtWidgets.QAbstractButton, QtWidgets.QLineEdit)):
        yield one.text()
    elif isinstance(one, QtWidgets.QComboBox):
        yield from (one.itemText(number) for number in range(one.count()))
    else:
        yield from (item.text(*where) for item, where in cells(one))


def tips_of(one: Any) -> Iterator[str]:
    found = (one.toolTip(), *(item.toolTip(*where) for item, where in cells(one)))
    yield from filter(None, found)


def cells(view: Any) -> Iterator[tuple[Any, tuple[int, ...]]]:
    """The cells of a table or a tree; each with the arguments that its methods want."""
    if isinstance(view, QtWidgets.QTableWidget):
        for row in range(view.rowCount()):
            for column in range(view.columnCount()):
                if (item := view.item(row, column)) is not None:
                    yield item, ()
    elif isinstance(view, QtWidgets.QTreeWidget):
        stack = [view.topLevelItem(number) for number in range(view.topLevelItemCount())]
        while stack:
            item = stack.pop()
            yield from ((item, (column,)) for column in range(view.columnCount()))
            stack += [item.child(number) for number in range(item.childCount())]


def report_view() -> list[str]:
    """Our lines there."""
    texts = [view.toPlainText() for view in Gui.getMainWindow().findChildren(QtWidgets.QTextEdit)]
    return [line for text in texts for line in text.split("\n") if "Silo" in line]


def commit(one: Any) -> None:
    def answer(window: Any) -> None:
        tell(commit=look(window, "commit"))
        window.comment.setPlainText(CONTROL)
        window.commit.click()

    one.dock.show_and_raise()
    with dialog("SiloCommitDialog", answer):
        Gui.runCommand("Origin_Commit")
    # All 152 registered files are new in Silo, and go along.
    wait(lambda: boxes("BOM not synced") and settled(), seconds=400)
    wait(lambda: any("BOM not synced" in text for text in labels(one.dock)))
    tell(held_back=boxes("BOM not synced"), pane=look(one.dock, "pane"))


def preview(one: Any) -> None:
    press(one.dock, "Show")
    tell(shown=[obj.Name for obj in Gui.Selection.getSelection()])
    press(one.dock, "Show all…")
    window = inside.preview()
    tell(preview=look(window, "preview"))
    window.table.setCurrentItem(window.table.topLevelItem(0))
    window.show_button.click()
    tell(selected=len(Gui.Selection.getSelection()))
    window.missing.setChecked(True)
    window.sync_button.click()
    wait(lambda: boxes("BOM Updated") and settled(), seconds=400)
    wait(lambda: any("BOM Updated" in text for text in labels(one.dock)))
    window.close()
    tell(synced=boxes("BOM Updated"), pane_after=look(one.dock, "pane-after"))


def register(one: Any) -> None:
    window = inside.registering(App.ActiveDocument)
    tell(register=look(window, "register"))
    window.close()


def story() -> None:
    one = ready(comments=True)
    doc = App.openDocument(str(VAULT / "Top.FCStd"))
    App.setActiveDocument(doc.Name)
    # It is loaded in part only, so FreeCAD will not save it.
    App.getDocument("Half").getObject("Box").Label = CONTROL
    commit(one)
    preview(one)
    register(one)
    # What an exception says may come from a document as well.
    from silo.bom.errors import DocumentError

    one._bug(ValueError(CONTROL))
    one.session.problem(DocumentError("<b>there</b>", CONTROL))
    # The report view is filled by events.
    wait(lambda: sum("live" in line for line in report_view()) >= 2)
    tell(report=report_view())


run(story)
