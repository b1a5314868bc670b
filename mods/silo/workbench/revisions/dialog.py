# SPDX-License-Identifier: LGPL-2.1-or-later
"""*Open from Silo…* and *History*: two windows over :mod:`silo.workbench.revisions.flow`. Not modal."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo.bom.errors import SiloError
from silo.workbench.commit.flow import more_text
from silo.workbench.gui import widgets
from silo.workbench.gui.qt import QtCore, QtGui, QtWidgets
from silo.workbench.pane.activity import Tone
from silo.workbench.revisions.flow import Known, RevisionFlow, left_alone
from silo.workbench.words import plain, tip, translate

if TYPE_CHECKING:
    from silo.api.wire import Item, Revision
    from silo.vault.pull import Pulled

# Milliseconds after the last key.
TYPING_MS = 250
PICTURE = 128
# Lines of what is left alone, and changes of a BOM; a button shows all of them.
MOST_NEWS, MOST_CHANGES = 4, 12
_DATA = QtCore.Qt.ItemDataRole.UserRole


def revision_texts(revision: Revision) -> list[str]:
    """Number, time, who, comment."""
    when = revision.created_at.astimezone().strftime("%Y-%m-%d %H:%M") if revision.created_at else ""
    return [
        str(revision.revision_number),
        when,
        plain(revision.created_by or "", 40),
        plain(revision.comment),
    ]


def _revisions_table() -> Any:
    headings = (
        translate("Silo", "Revision"),
        translate("Silo", "When"),
        translate("Silo", "Who"),
        translate("Silo", "Comment"),
    )
    return widgets.tree("revisions", headings)


def _fill_in(tree: Any, known: Known, *, newest: str = "") -> None:
    """Show the revisions and choose the first row; ``newest``: the comment of one above them, number 0."""
    rows = [(0, [translate("Silo", "newest"), "", "", newest], "")] if newest and known.revisions else []
    rows += [(one.revision_number, revision_texts(one), one.comment) for one in known.revisions]
    for number, texts, hint in rows:
        if number == known.base:
            texts[0] += " ← " + translate("Silo", "yours")
        row = QtWidgets.QTreeWidgetItem(texts)
        row.setToolTip(3, tip(hint))
        row.setData(0, _DATA, number)
        tree.addTopLevelItem(row)
    for column in range(3):
        tree.resizeColumnToContents(column)
    tree.setCurrentItem(tree.topLevelItem(0))


class _Window(QtWidgets.QDialog):  # type: ignore[misc]  # PySide has no types
    """What both have: a line of news below, and fetching into a folder. ``layout``: for the content."""

    def __init__(self, flow: RevisionFlow, parent: Any, name: str, title: str, size: tuple[int, int]) -> None:
        super().__init__(parent)
        self._flow = flow
        self._closed = False
        self._again: Callable[[], None] = lambda: None
        self._layout = widgets.lay_out(self, name, title, *size)
        self.finished.connect(self._end)
        self.news = widgets.label("", Tone.QUIET)
        self._all: Sequence[str] = ()
        self.more = widgets.link_button("", lambda: widgets.read(self, self.windowTitle(), self._all))
        self.more.setObjectName("more")
        self.more.hide()

    def _finish(self, action: Any) -> None:
        """The lower end of the window. Replacing edited files takes a press of its own."""
        self.replace = widgets.button(
            translate("Silo", "Replace edited files (copies are kept)"), "replace", lambda: self._again()
        )
        self.replace.hide()
        action.setEnabled(False)
        close = widgets.button(translate("Silo", "Close"), "close", self.reject)
        self._layout.addWidget(self.news)
        self._layout.addWidget(self.more)
        self._layout.addLayout(widgets.line(self.replace, None, action, close))

    def _first(self, lines: Sequence[str], most: int) -> Sequence[str]:
        """The first lines; a button shows all of them."""
        self._all = lines
        self.more.setText(more_text(len(lines) - most))
        self.more.setVisible(len(lines) > most)
        return lines[:most]

    def _end(self, _result: int = 0) -> None:
        self._closed = True

    def _alive(self, call: Callable[[Any], None]) -> Callable[[Any], None]:
        """An answer that comes after the window was closed is nobody's."""
        return lambda found: None if self._closed else call(found)

    def say(self, text: str, tone: Tone = Tone.QUIET) -> None:
        """The line of news."""
        self.news.setText(text)
        widgets.paint(self.news, tone)

    def fail(self, error: SiloError) -> None:
        """What went wrong."""
        self.say(str(error), Tone.ERROR)

    def fetch(self, part_number: str, revision: int | None, folder: Path, *, overwrite: bool = False) -> None:
        """Fetch into a folder, then open it; what was left alone is said, with the way to replace it."""
        self.say(translate("Silo", "Fetching…"))
        self._first((), 0)

        def done(pulled: Pulled) -> None:
            self._flow.open(str(pulled.top))
            if self._closed:
                return
            told = self._first(left_alone(pulled), MOST_NEWS)
            self.say("\n".join(told) or translate("Silo", "Opened."), Tone.WARNING if told else Tone.QUIET)
            self._offer(part_number, revision, folder, pulled)

        self._flow.pull(
            part_number, revision, folder, overwrite=overwrite, done=done, failed=self._alive(self.fail)
        )

    def _offer(self, part_number: str, revision: int | None, folder: Path, pulled: Pulled) -> None:
        self.replace.setVisible(any(one.state.value == "edited" for one in pulled.files))
        self._again = lambda: self.fetch(part_number, revision, folder, overwrite=True)


class OpenDialog(_Window):
    """Search as you type, choose an item and a revision, open it with all that it links to."""

    def __init__(self, flow: RevisionFlow, parent: Any, folder: str) -> None:
        super().__init__(flow, parent, "SiloOpen", translate("Silo", "Open from Silo"), (820, 520))
        self.words = QtWidgets.QLineEdit()
        self.words.setObjectName("words")
        self.words.setPlaceholderText(translate("Silo", "Part number, name or description"))
        self.words.setClearButtonEnabled(True)
        self._layout.addWidget(self.words)
        self._layout.addLayout(self._make_middle(), 1)
        self._layout.addLayout(self._make_folder(folder))
        self.open_button = widgets.button(translate("Silo", "Open"), "open", self._open)
        self._finish(self.open_button)
        self._asked = 0
        self._typing = QtCore.QTimer(self)
        self._typing.setSingleShot(True)
        self._typing.setInterval(TYPING_MS)
        self._typing.timeout.connect(self._search)
        self.words.textChanged.connect(lambda _text: self._typing.start())
        if flow.recent:  # shown at once; the server's answer takes their place
            self._fill(flow.recent)
        self._search()

    def _make_middle(self) -> Any:
        layout = QtWidgets.QHBoxLayout()
        self.items = widgets.tree("items", (translate("Silo", "Part number"), translate("Silo", "Name")))
        self.items.currentItemChanged.connect(lambda _now, _before: self._chosen())
        layout.addWidget(self.items, 3)
        right = QtWidgets.QVBoxLayout()
        self.picture = QtWidgets.QLabel()
        self.picture.setFixedHeight(PICTURE)
        self.picture.hide()
        right.addWidget(self.picture)
        self.revisions = _revisions_table()
        self.revisions.itemDoubleClicked.connect(lambda _item, _column: self._open())
        right.addWidget(self.revisions, 1)
        layout.addLayout(right, 4)
        return layout

    def _make_folder(self, folder: str) -> Any:
        self.folder = QtWidgets.QLineEdit(folder)
        self.folder.setObjectName("folder")
        text = widgets.label(translate("Silo", "Project folder:"), wrap=False)
        return widgets.line(text, self.folder, widgets.button("…", "choose", self._choose_folder))

    def _choose_folder(self) -> None:
        found = ask_folder(self, self.folder.text())
        if found:
            self.folder.setText(found)

    def _search(self) -> None:
        self._asked += 1
        mine = self._asked
        self.say(translate("Silo", "Loading…"))

        def done(found: list[Item]) -> None:
            if mine == self._asked:  # what was typed meanwhile has its own answer
                self._fill(found)

        self._flow.search(self.words.text().strip(), self._alive(done), self._alive(self.fail))

    def _fill(self, found: Sequence[Item]) -> None:
        chosen = self._number()
        self.items.clear()
        for item in found:
            row = QtWidgets.QTreeWidgetItem([plain(item.part_number, 60), plain(item.name, 120)])
            row.setToolTip(1, tip(item.description))
            row.setData(0, _DATA, item.part_number)
            self.items.addTopLevelItem(row)
        self.items.resizeColumnToContents(0)
        self.say("" if found else translate("Silo", "Nothing found."))
        numbers = [item.part_number for item in found]
        if found:  # what a person has chosen meanwhile stays chosen
            place = numbers.index(chosen) if chosen in numbers else 0
            self.items.setCurrentItem(self.items.topLevelItem(place))

    def _chosen(self) -> None:
        self.revisions.clear()
        self.picture.hide()
        self.open_button.setEnabled(False)
        number = self._number()
        if not number:
            return

        def done(known: Known) -> None:
            if self._number() == number:
                self._show(known)

        self._flow.details(number, self._alive(done), self._alive(self.fail))

    def _number(self) -> str:
        row = self.items.currentItem()
        return str(row.data(0, _DATA)) if row is not None else ""

    def _show(self, known: Known) -> None:
        _fill_in(self.revisions, known, newest=translate("Silo", "with the newest of all that it links to"))
        picture = QtGui.QPixmap()
        if known.picture and picture.loadFromData(known.picture):
            self.picture.setPixmap(picture.scaledToHeight(PICTURE))
            self.picture.show()
        if not known.revisions:
            self.say(translate("Silo", "It has no file in Silo."))
        self.open_button.setEnabled(bool(known.revisions))

    def _open(self) -> None:
        row, folder = self.revisions.currentItem(), self.folder.text().strip()
        if row is None or not self._number():
            return
        if not folder:
            self.say(translate("Silo", "Choose the project folder first."), Tone.WARNING)
            return
        self.fetch(self._number(), row.data(0, _DATA) or None, Path(folder).expanduser())


class HistoryDialog(_Window):
    """The revisions of a document: who, when, comment, what changed in the BOM; any of them as a copy."""

    def __init__(self, flow: RevisionFlow, parent: Any, path: str) -> None:
        title = translate("Silo", "History of {name}").replace("{name}", plain(os.path.basename(path), 80))
        super().__init__(flow, parent, "SiloHistory", title, (680, 460))
        self._path = path
        self._known: Known | None = None
        self.revisions = _revisions_table()
        self.revisions.currentItemChanged.connect(lambda _now, _before: self._chosen())
        self._layout.addWidget(self.revisions, 1)
        self.change = widgets.label("")
        self.change.setObjectName("change")
        self._layout.addWidget(self.change)
        text = translate("Silo", "Get This Revision as a Copy…")
        self.get_button = widgets.button(text, "get", self._get)
        self._finish(self.get_button)
        self.say(translate("Silo", "Asking Silo…"))

    def fill(self, known: Known) -> None:
        """Show the revisions."""
        if self._closed:
            return
        self._known = known
        self.say("" if known.revisions else translate("Silo", "It has no file in Silo."))
        _fill_in(self.revisions, known)

    def _number(self) -> int:
        row = self.revisions.currentItem()
        return int(row.data(0, _DATA)) if row is not None else 0

    def _chosen(self) -> None:
        number = self._number()
        self.get_button.setEnabled(bool(number))
        if self._known is None or not number:
            return
        numbers = [one.revision_number for one in self._known.revisions]
        older = next((one for one in numbers if one < number), None)
        self.change.setText(translate("Silo", "Comparing…"))
        self._first((), 0)

        def done(lines: list[str]) -> None:
            if self._number() == number:
                text = plain(", ".join(self._first(lines, MOST_CHANGES)), 1000)
                told = translate("Silo", "BOM: {changes}").replace("{changes}", text)
                self.change.setText(told if text else translate("Silo", "No change of the BOM."))

        def failed(error: SiloError) -> None:
            self.change.setText(str(error))

        item = self._known.item
        self._flow.bom_change(
            item.part_number, self._path, older, number, self._alive(done), self._alive(failed)
        )

    def _get(self) -> None:
        if self._known is None:
            return
        number, item = self._number(), self._known.item
        folder = ask_folder(self, os.path.dirname(os.path.dirname(self._path)))
        if folder:
            name = f"{plain(item.part_number, 60).replace('/', '_')}-r{number}"
            self.fetch(item.part_number, number, Path(folder) / name)


def ask_folder(parent: Any, start: str) -> str:
    """The folder that a person chose; "" where none was chosen."""
    title = translate("Silo", "Choose a folder")
    return str(QtWidgets.QFileDialog.getExistingDirectory(parent, title, start))
