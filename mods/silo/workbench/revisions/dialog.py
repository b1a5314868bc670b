# SPDX-License-Identifier: LGPL-2.1-or-later
"""*Open from Silo…*, *History* and *Project*: drawn from :mod:`silo.workbench.revisions.flow`. Not modal."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo.bom.errors import SiloError
from silo.workbench.colleagues.theirs import Choice, Theirs, choice_texts, more_text
from silo.workbench.freecad import host
from silo.workbench.gui import widgets
from silo.workbench.gui.choices import choice_box, fill_choices
from silo.workbench.gui.qt import QtCore, QtGui, QtWidgets, run_dialog
from silo.workbench.revisions.flow import ItemHistory, RevisionFlow
from silo.workbench.revisions.project import ProjectFlow, ProjectRow, ProjectView, file_in_project
from silo.workbench.revisions.pulled import left_alone, over_edits
from silo.workbench.tone import Tone
from silo.workbench.words import plain, spoken, tip, told_apart, translate

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
    """Write the cells of a revision: number, time, user, comment."""
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


def _fill_in(tree: Any, history: ItemHistory, *, newest: str = "") -> None:
    """Show the revisions, and choose the first row; ``newest``: the comment of an additional first row, with
    number 0.
    """
    rows = [(0, [translate("Silo", "newest"), "", "", newest], "")] if newest and history.revisions else []
    rows += [
        (revision.revision_number, revision_texts(revision), revision.comment)
        for revision in history.revisions
    ]
    for number, texts, hint in rows:
        if number == history.base:
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
        self._layout = widgets.lay_out(self, name, title, *size)
        self.finished.connect(self._end)
        self.news = widgets.label("", Tone.QUIET)
        self._all: Sequence[str] = ()
        self.more = widgets.link_button("", lambda: widgets.read(self, self.windowTitle(), self._all))
        self.more.setObjectName("more")
        self.more.hide()

    def _finish(self, *actions: Any) -> None:
        """Build the lower end of the window."""
        for action in actions:
            action.setEnabled(False)
        close = widgets.button(translate("Silo", "Close"), "close", self.reject)
        self._layout.addWidget(self.news)
        self._layout.addWidget(self.more)
        self._layout.addLayout(widgets.line(None, *actions, close))

    def _first(self, lines: Sequence[str], most: int) -> Sequence[str]:
        """Return the first lines, and offer a button that shows all of them."""
        self._all = lines
        self.more.setText(more_text(len(lines) - most))
        self.more.setVisible(len(lines) > most)
        return lines[:most]

    def _end(self, _result: int = 0) -> None:
        self._closed = True

    def _alive(self, call: Callable[[Any], None]) -> Callable[[Any], None]:
        """Wrap ``call`` so that it does nothing after the window is closed."""
        return lambda result: None if self._closed else call(result)

    def say(self, text: str, tone: Tone = Tone.QUIET) -> None:
        """Show a line of news."""
        self.news.setText(spoken(text))
        widgets.paint(self.news, tone)

    def fail(self, error: SiloError) -> None:
        """Show what went wrong."""
        self.say(str(error), Tone.ERROR)

    def fetch(self, part_number: str, revision: int | None, folder: Path) -> None:
        """Fetch the files into a folder, then open the item's; report what was left alone, and ask about
        edits.
        """
        self.say(translate("Silo", "Fetching…"))
        self._first((), 0)

        def done(pulled: Pulled) -> None:
            self._flow.open(str(pulled.top))
            if self._closed:
                return
            news = self._first(left_alone(pulled), MOST_NEWS)
            self.say("\n".join(news) or translate("Silo", "Opened."), Tone.WARNING if news else Tone.QUIET)
            if edited := over_edits(pulled):
                for theirs, choice in ask_choices(self, edited):
                    self._flow.choose(theirs.path, theirs, choice)

        self._flow.pull(part_number, revision, folder, done=done, failed=self._alive(self.fail))


class OpenDialog(_Window):
    """Search as you type, choose an item and a revision, open it with all that it links to."""

    def __init__(self, flow: RevisionFlow, parent: Any, folder: str) -> None:
        super().__init__(flow, parent, "SiloOpen", translate("Silo", "Open from Silo"), (820, 520))
        self.words = widgets.field("words", translate("Silo", "Part number, name or description"), clear=True)
        self._layout.addWidget(self.words)
        self._layout.addLayout(self._make_middle(), 1)
        self._layout.addLayout(self._make_folder(folder))
        self.open_button = widgets.button(translate("Silo", "Open"), "open", self._open)
        self._item = ""
        self._newest: Callable[[], None] = lambda: None
        text = translate("Silo", "Fetch newer revisions from Silo")
        self.newest = widgets.link_button(text, lambda: self._newest())
        self.newest.hide()
        self._layout.addWidget(self.newest)
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
        self.folder = widgets.field("folder")
        self.folder.setText(folder)
        text = widgets.label(translate("Silo", "Project folder:"), wrap=False)
        return widgets.line(text, self.folder, widgets.button("…", "choose", self._choose_folder))

    def _choose_folder(self) -> None:
        folder = ask_folder(self, self.folder.text())
        if folder:
            self.folder.setText(folder)

    def _search(self) -> None:
        self._asked += 1
        mine = self._asked
        self.say(translate("Silo", "Loading…"))

        def done(items: list[Item]) -> None:
            if mine == self._asked:  # what was typed meanwhile has its own answer
                self._fill(items)

        self._flow.search(self.words.text().strip(), self._alive(done), self._alive(self.fail))

    def _fill(self, items: Sequence[Item]) -> None:
        chosen = self._number()
        self.items.clear()
        for item in items:
            row = QtWidgets.QTreeWidgetItem([plain(item.part_number, 60), plain(item.name, 120)])
            row.setToolTip(1, tip(item.description))
            row.setData(0, _DATA, item.part_number)
            self.items.addTopLevelItem(row)
        self.items.resizeColumnToContents(0)
        self.say("" if items else translate("Silo", "Nothing found."))
        numbers = [item.part_number for item in items]
        if items:  # what a user has chosen meanwhile stays chosen
            place = numbers.index(chosen) if chosen in numbers else 0
            self.items.setCurrentItem(self.items.topLevelItem(place))

    def _chosen(self) -> None:
        self.revisions.clear()
        self.picture.hide()
        self.open_button.setEnabled(False)
        number = self._number()
        if not number:
            return

        def done(history: ItemHistory) -> None:
            if self._number() == number:
                self._show(history)

        self._flow.details(number, self._alive(done), self._alive(self.fail))

    def _number(self) -> str:
        row = self.items.currentItem()
        return str(row.data(0, _DATA)) if row is not None else ""

    def _show(self, history: ItemHistory) -> None:
        self._item = history.item.id
        self.newest.hide()
        _fill_in(self.revisions, history, newest=translate("Silo", "with the newest linked files"))
        picture = QtGui.QPixmap()
        if history.picture and picture.loadFromData(history.picture):
            self.picture.setPixmap(picture.scaledToHeight(PICTURE))
            self.picture.show()
        if not history.revisions:
            self.say(translate("Silo", "It has no file in Silo."))
        self.open_button.setEnabled(bool(history.revisions))

    def _open(self) -> None:
        row, folder, number = self.revisions.currentItem(), self.folder.text().strip(), self._number()
        if row is None or not number:
            return
        if not folder:
            self.say(translate("Silo", "Choose the project folder first."), Tone.WARNING)
            return
        here = "" if row.data(0, _DATA) else file_in_project(folder, self._item)
        if here:
            self._flow.open(here)
            self.say(translate("Silo", "It is in the project already, and is open: {path}", path=here))
            self._newest = lambda: self.fetch(number, None, Path(folder).expanduser())
            self.newest.setVisible(True)
            return
        self.fetch(number, row.data(0, _DATA) or None, Path(folder).expanduser())


class HistoryDialog(_Window):
    """The revisions of a document: who, when, comment, what changed in the BOM; any of them as a copy."""

    def __init__(self, flow: RevisionFlow, parent: Any, path: str) -> None:
        title = translate("Silo", "History of {name}", name=plain(os.path.basename(path), 80))
        super().__init__(flow, parent, "SiloHistory", title, (680, 460))
        self._path = path
        self._known: ItemHistory | None = None
        self.revisions = _revisions_table()
        self.revisions.currentItemChanged.connect(lambda _now, _before: self._chosen())
        self._layout.addWidget(self.revisions, 1)
        self.change = widgets.label("")
        self.change.setObjectName("change")
        self._layout.addWidget(self.change)
        text = translate("Silo", "Get This Revision as a Copy…")
        self.get_button = widgets.button(text, "get", self._get)
        tip = translate("Silo", "Show the revision as a ghost beside yours; once more removes it")
        self.compare_button = widgets.button(
            translate("Silo", "Compare in 3D"), "compare", self._compare, tip
        )
        self._finish(self.compare_button, self.get_button)
        self.say(translate("Silo", "Asking Silo…"))

    def fill(self, history: ItemHistory) -> None:
        """Show the revisions."""
        if self._closed:
            return
        self._known = history
        self.say("" if history.revisions else translate("Silo", "It has no file in Silo."))
        _fill_in(self.revisions, history)

    def _number(self) -> int:
        row = self.revisions.currentItem()
        return int(row.data(0, _DATA)) if row is not None else 0

    def _chosen(self) -> None:
        number = self._number()
        self.get_button.setEnabled(bool(number))
        self.compare_button.setEnabled(bool(number))
        if self._known is None or not number:
            return
        numbers = [revision.revision_number for revision in self._known.revisions]
        older = next((part_number for part_number in numbers if part_number < number), None)
        self.change.setText(translate("Silo", "Comparing…"))
        self._first((), 0)

        def done(lines: list[str]) -> None:
            if self._number() == number:
                text = plain(", ".join(self._first(lines, MOST_CHANGES)), 1000)
                sentence = translate("Silo", "BOM: {changes}", changes=text)
                self.change.setText(sentence if text else translate("Silo", "No change of the BOM."))

        def failed(error: SiloError) -> None:
            self.change.setText(spoken(error))

        item = self._known.item
        self._flow.bom_change(
            item.part_number, self._path, older, number, self._alive(done), self._alive(failed)
        )

    def _compare(self) -> None:
        if self._known is not None:
            alive, number = self._alive, self._known.item.part_number
            self._flow.compare(self._path, number, self._number(), alive(self.say), alive(self.fail))

    def _get(self) -> None:
        if self._known is None:
            return
        number, item = self._number(), self._known.item
        folder = ask_folder(self, os.path.dirname(os.path.dirname(self._path)))
        if folder:
            name = f"{plain(item.part_number, 60).replace('/', '_')}-r{number}"
            self.fetch(item.part_number, number, Path(folder) / name)


def ask_choices(parent: Any, files: Sequence[Theirs]) -> list[tuple[Theirs, Choice]]:
    """Ask what to do about new versions over local edits; no file is touched without an answer."""
    window = QtWidgets.QDialog(parent)
    layout = widgets.lay_out(
        window, "SiloChoices", translate("Silo", "Edited here, and newer in Silo"), 620, 260, modal=True
    )
    tree = widgets.tree(
        "files", (translate("Silo", "File"), translate("Silo", "In Silo"), translate("Silo", "What to do"))
    )
    boxes = []
    for theirs in files:
        item = QtWidgets.QTreeWidgetItem([plain(os.path.basename(theirs.path), 80), theirs.headline])
        item.setToolTip(0, tip(theirs.path))
        tree.addTopLevelItem(item)
        boxes.append(choice_box(None, choice_texts()))
        tree.setItemWidget(item, 2, boxes[-1])
    for column in range(2):
        tree.resizeColumnToContents(column)
    layout.addWidget(tree)
    layout.addLayout(
        widgets.line(None, widgets.button(translate("Silo", "Do It"), "do", window.accept, default=True))
    )
    done = run_dialog(window)
    chosen = [Choice(box.currentData()) for box in boxes]
    window.deleteLater()
    pairs = zip(files, chosen, strict=True)
    return [(theirs, choice) for theirs, choice in pairs if done and choice is not Choice.LEAVE]


class ProjectPane(QtWidgets.QWidget):  # type: ignore[misc]  # PySide has no types
    """All files of the project folder, with how they stand to Silo."""

    def __init__(self, flow: ProjectFlow) -> None:
        super().__init__()
        self._flow = flow
        layout = QtWidgets.QVBoxLayout(self)
        self.root = choice_box(None, {}, name="root")
        self.root.activated.connect(lambda _number: self._choose(str(self.root.currentData() or "")))
        self.root.setSizePolicy(QtWidgets.QSizePolicy.Policy.Ignored, QtWidgets.QSizePolicy.Policy.Preferred)
        browse = widgets.button("…", "choose", self._browse, translate("Silo", "Choose the project's folder"))
        refresh = widgets.button(translate("Silo", "Refresh"), "refresh", self.refresh)
        line = widgets.line(self.root, browse, refresh)
        line.setStretch(0, 1)
        layout.addLayout(line)
        self.words = widgets.field("words", translate("Silo", "Search"), clear=True)
        self.words.textChanged.connect(lambda _text: self._draw())
        self.only_left = QtWidgets.QCheckBox(translate("Silo", "Different from Silo"))
        self.only_left.toggled.connect(lambda _on: self._draw())
        layout.addLayout(widgets.line(self.words, self.only_left))
        self.news = widgets.label("", Tone.QUIET)
        layout.addWidget(self.news)
        self.files = widgets.tree("files", (translate("Silo", "File"), translate("Silo", "State")))
        self.files.itemDoubleClicked.connect(lambda _item, _column: self._open())
        self.files.currentItemChanged.connect(lambda _now, _before: self._enable())
        layout.addWidget(self.files, 1)
        self.comment = widgets.field("comment", translate("Silo", "Comment"))
        self.decide_button = widgets.button(translate("Silo", "Decide…"), "decide", self._decide)
        self.commit = widgets.button(translate("Silo", "Commit All"), "commit", self._commit)
        layout.addWidget(self.comment)
        layout.addLayout(widgets.line(self.decide_button, None, self.commit))
        self.refresh()

    def refresh(self) -> None:
        """Look at the folder and at Silo again."""
        roots = self._flow.roots()
        if self._flow.view.root:
            roots = list(dict.fromkeys((self._flow.view.root, *roots)))
        fill_choices(self.root, told_apart(roots))
        self.root.setToolTip(tip(roots[0]) if roots else "")
        self._draw()
        if roots:
            self.news.setText(translate("Silo", "Looking at the files…"))
            self._flow.look(roots[0], lambda _view: self._draw(), self._fail)
        else:
            text = translate(
                "Silo",
                "Choose the project's folder: it is remembered, and marked as a project.",
            )
            self.news.setText(text)

    def _fail(self, error: SiloError) -> None:
        self.news.setText(spoken(error))
        widgets.paint(self.news, Tone.ERROR)

    def _choose(self, root: str) -> None:
        if root:
            self._flow.choose(root)
            self._flow.view = ProjectView()
            self.refresh()

    def _browse(self) -> None:
        self._choose(ask_folder(self, str(self.root.currentData() or "")))

    def _draw(self) -> None:
        view, chosen = self._flow.view, self._row()
        self.files.clear()
        for row in view.shown(self.words.text(), only_left=self.only_left.isChecked()):
            item = QtWidgets.QTreeWidgetItem([row.place, row.words()])
            item.setToolTip(1, tip(row.words()))
            item.setForeground(1, widgets.brush(row.tone, self.files))
            item.setData(0, _DATA, row)
            self.files.addTopLevelItem(item)
            if chosen is not None and chosen.place == row.place:
                self.files.setCurrentItem(item)
        self.files.resizeColumnToContents(0)
        if view.root:
            notes = [*map(spoken, view.notes)]
            self.news.setText("\n".join((view.heading(), *notes[:MOST_NEWS])))
            self.news.setToolTip(tip("; ".join(notes)))
            widgets.paint(self.news, Tone.WARNING if view.notes else Tone.QUIET)
        mark_in_tree({row.path: (row.words(), row.tone) for row in view.rows})
        self._enable()

    def _row(self) -> ProjectRow | None:
        item = self.files.currentItem()
        return item.data(0, _DATA) if item is not None else None

    def _enable(self) -> None:
        row, view = self._row(), self._flow.view
        self.decide_button.setEnabled(row is not None and row.theirs is not None)
        self.commit.setEnabled(
            any(not project_row.is_fine and project_row.theirs is None for project_row in view.rows)
        )

    def _open(self) -> None:
        if (row := self._row()) is not None:
            self._flow.open(row)

    def _decide(self) -> None:
        row = self._row()
        if row is not None and row.theirs is not None:
            for _, choice in ask_choices(self, [row.theirs]):
                self._flow.decide(row, choice)

    def _commit(self) -> None:
        self._flow.commit_all(self.comment.text().strip())
        self.comment.clear()


def mark_in_tree(states: Mapping[str, tuple[str, Tone]]) -> None:
    """Show the state of files at their documents in FreeCAD's tree. Only the entry gets a colour and a tool
    tip, so that no document changes.
    """
    documents = host.documents_by_path()
    open_now = {str(doc.Label) for doc in documents.values()}
    labels = {str(doc.Label): states[path] for path, doc in documents.items() if path in states}
    for tree in host.main_window().findChildren(QtWidgets.QTreeWidget):
        if tree.metaObject().className() != "Gui::TreeWidget":
            continue
        items = [tree.topLevelItem(number) for number in range(tree.topLevelItemCount())]
        if not {item.text(0) for item in items} & open_now:  # below an entry for the application
            items = [item.child(number) for item in items for number in range(item.childCount())]
        for item in items:
            words, tone = labels.get(item.text(0), ("", Tone.PLAIN))
            if words:
                item.setToolTip(0, tip(translate("Silo", "Silo: {state}", state=words)))
                item.setForeground(0, widgets.brush(tone, tree))


def ask_folder(parent: Any, start: str) -> str:
    """Let a user choose a folder; "" if they choose none."""
    title = translate("Silo", "Choose a folder")
    return str(QtWidgets.QFileDialog.getExistingDirectory(parent, title, start))
