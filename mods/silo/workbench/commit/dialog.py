# SPDX-License-Identifier: LGPL-2.1-or-later
"""The commit dialog: what changed, and which files go along."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from silo.workbench.colleagues.theirs import Choice, Theirs, choice_texts, line_texts, more_text
from silo.workbench.commit.desk import CommitAnswer
from silo.workbench.commit.plan import CommitPlan, DocumentRow, DocumentState
from silo.workbench.gui import widgets
from silo.workbench.gui.choices import choice_box
from silo.workbench.gui.qt import QShortcut, QtCore, QtGui, QtWidgets
from silo.workbench.tone import Tone
from silo.workbench.words import counted, plain, tip, told_apart, translate

_CHOICE = 2
# Lines of a BOM difference; the rest is one press away, and the other files stay in sight.
_MOST_LINES = 12


class CommitDialog(QtWidgets.QDialog):  # type: ignore[misc]  # PySide has no types
    """Asks for a comment, and shows what will be saved and in which order."""

    def __init__(self, plan: CommitPlan, parent: Any, *, note: str = "", comment: str = "") -> None:
        super().__init__(parent)
        self._plan = plan
        self._theirs: dict[int, Theirs] = {}
        self._choices: dict[int, Any] = {}
        title = translate("Silo", "Commit to Silo")
        layout = widgets.lay_out(self, "SiloCommitDialog", title, 520, 380, modal=True)
        layout.addWidget(widgets.label(translate("Silo", "What changed?")))
        self.comment = QtWidgets.QPlainTextEdit()
        self.comment.setObjectName("comment")
        self.comment.setPlaceholderText(translate("Silo", "A comment for this revision (may stay empty)"))
        self.comment.setTabChangesFocus(True)
        self.comment.setMaximumHeight(5 * self.comment.fontMetrics().lineSpacing())
        self.comment.setPlainText(comment)
        layout.addWidget(self.comment)
        self._head = widgets.label(self._heading(), wrap=True)
        layout.addWidget(self._head)
        self.files = self._make_files()
        layout.addWidget(self.files, 1)
        if len(plan.rows) > 1:
            layout.addLayout(self._make_selecting())
        self.register = QtWidgets.QCheckBox(
            translate("Silo", "Register it in Silo as well: it has no part number yet")
        )
        self.register.setObjectName("register")
        self.register.setChecked(plan.unregistered)
        self.register.setVisible(plan.unregistered)
        layout.addWidget(self.register)
        if note:
            layout.addWidget(widgets.label(note, Tone.QUIET))
        self._looking = widgets.label(
            translate("Silo", "Looking for what colleagues committed since…"), Tone.QUIET
        )
        self._looking.setVisible(not note)
        layout.addWidget(self._looking)
        layout.addWidget(self._make_buttons())
        self.shortcuts = [QShortcut(QtGui.QKeySequence(keys), self) for keys in ("Ctrl+Return", "Ctrl+Enter")]
        for shortcut in self.shortcuts:
            shortcut.activated.connect(self.commit.click)
        self.comment.setFocus()

    def _heading(self) -> str:
        edited = sum(row.state is not DocumentState.RECOMPUTED for row in self._plan.rows[:-1])
        recomputed = len(self._plan.rows) - 1 - edited
        lines = [translate("Silo", "This file will be committed:")]
        if edited:
            text = translate(
                "Silo",
                "This file will be committed after {n} file below it with unsaved edits:",
            )
            many = translate(
                "Silo",
                "This file will be committed after {n} files below it with unsaved edits, the lowest first:",
            )
            lines = [counted(edited, text, many)]
        if recomputed:
            text = translate("Silo", "{n} more file was only recomputed; check it to commit it anyway.")
            many = translate("Silo", "{n} more files were only recomputed; check them to commit them anyway.")
            lines.append(counted(recomputed, text, many))
        return "\n".join(lines)

    def _make_files(self) -> Any:
        tree = widgets.tree("files", (translate("Silo", "File"), translate("Silo", "State"), ""))
        tree.setColumnHidden(_CHOICE, True)
        tree.setWordWrap(True)
        tree.itemChanged.connect(lambda _item, _column: self._update_commit())
        tree.setSelectionMode(QtWidgets.QAbstractItemView.SelectionMode.NoSelection)
        names = told_apart(row.path for row in self._plan.rows)
        for number, row in enumerate(self._plan.rows):
            item = QtWidgets.QTreeWidgetItem([plain(names[row.path] or row.label, 80), row.note])
            item.setToolTip(0, tip(row.path))
            item.setToolTip(1, tip(row.note))
            item.setData(0, QtCore.Qt.ItemDataRole.UserRole, number)
            self._mark(item, row, tree)
            tree.addTopLevelItem(item)
        # The state has the rest of the width: a long name must not push it out of sight.
        tree.header().setStretchLastSection(False)
        tree.header().setSectionResizeMode(1, QtWidgets.QHeaderView.ResizeMode.Stretch)
        self._fit(tree, 0)
        return tree

    def _make_selecting(self) -> Any:
        """Make the row of buttons that choose several files at once."""
        parts = [widgets.label(translate("Silo", "Select:"), wrap=False)]
        for name, text, wanted in (
            ("edited", translate("Silo", "edited"), lambda row: row.wanted),
            ("all", translate("Silo", "all"), lambda row: row.can_commit),
            ("none", translate("Silo", "none"), lambda row: False),
            ("this", translate("Silo", "only this file"), lambda row: row.is_top),
        ):
            button = widgets.link_button(text, partial(self.select, wanted))
            button.setObjectName(name)
            parts.append(button)
        return widgets.line(*parts, None)

    def select(self, wanted: Callable[[DocumentRow], bool]) -> None:
        """Check the files that are wanted and can be committed."""
        for number, row in enumerate(self._plan.rows):
            if number not in self._theirs:
                self._check(self.files.topLevelItem(number), row.can_commit and wanted(row))

    def _check(self, item: Any, on: bool) -> None:
        item.setCheckState(0, QtCore.Qt.CheckState.Checked if on else QtCore.Qt.CheckState.Unchecked)

    def _mark(self, item: Any, row: DocumentRow, tree: Any) -> None:
        self._check(item, row.wanted)
        if not row.can_commit:
            item.setFlags(item.flags() & ~QtCore.Qt.ItemFlag.ItemIsUserCheckable)
            item.setForeground(1, widgets.brush(Tone.WARNING, tree))
        if row.is_top:
            widgets.embolden(item)

    def _make_buttons(self) -> Any:
        box = QtWidgets.QDialogButtonBox()
        role = QtWidgets.QDialogButtonBox.ButtonRole
        self.commit = box.addButton(translate("Silo", "Commit"), role.AcceptRole)
        self.commit.setObjectName("commit")
        self.commit.setDefault(True)
        self.commit.setToolTip(translate("Silo", "Ctrl+Return"))
        self._update_commit()
        box.addButton(translate("Silo", "Cancel"), role.RejectRole)
        box.accepted.connect(self.accept)
        box.rejected.connect(self.reject)
        return box

    def text(self) -> str:
        """Return the comment."""
        return str(self.comment.toPlainText()).strip()

    def _fit(self, tree: Any, column: int) -> None:
        """Make a column as wide as its texts, but not wider than about thirty letters; tool tips have the
        rest.
        """
        tree.resizeColumnToContents(column)
        most = 32 * tree.fontMetrics().averageCharWidth()
        tree.setColumnWidth(column, min(tree.columnWidth(column) + 8, most))

    # -- what colleagues did ----------------------------------------------------------------------------

    def show_theirs(self, theirs_by_identity: Mapping[str, Theirs]) -> None:
        """Show what colleagues committed since. Called when Silo was looked at, perhaps never."""
        self._looking.hide()
        for number, row in enumerate(self._plan.rows):
            theirs = theirs_by_identity.get(row.path)
            if theirs is not None and row.can_commit and self._theirs.get(number) != theirs:
                self._theirs[number] = theirs
                self._show_one(self.files.topLevelItem(number), number, theirs)
        if self._theirs:
            self._tell_who()
            text = translate(
                "Silo", "Files that somebody else has changed are left out, unless you choose otherwise:"
            )
            self._head.setText(text)
            self.files.setColumnHidden(_CHOICE, False)
            self.files.setRootIsDecorated(True)
            for column in (0, _CHOICE):
                self._fit(self.files, column)
            self.resize(max(self.width(), 860), max(self.height(), 460))
        self._update_commit()

    def _show_one(self, item: Any, number: int, theirs: Theirs) -> None:
        item.takeChildren()
        item.setText(1, theirs.headline)
        item.setToolTip(1, tip(theirs.headline))
        item.setForeground(1, widgets.brush(Tone.WARNING, self.files))
        self._check(item, False)
        item.setFlags(item.flags() & ~QtCore.Qt.ItemFlag.ItemIsUserCheckable)
        for text, hint in self._details(theirs):
            child = QtWidgets.QTreeWidgetItem(["", text])
            child.setToolTip(1, tip(hint))
            item.addChild(child)
        if (left := len(theirs.lines) - _MOST_LINES) > 0:
            child = QtWidgets.QTreeWidgetItem()
            item.addChild(child)
            more = widgets.link_button(more_text(left), partial(self._show_all, number))
            more.setObjectName(f"more{number}")
            self.files.setItemWidget(child, 1, more)
        item.setExpanded(True)
        box = choice_box(None, choice_texts(), name=f"choice{number}")
        box.currentIndexChanged.connect(lambda _index: self._chose(number, box))
        self._choices[number] = box
        self.files.setItemWidget(item, _CHOICE, box)

    def _show_all(self, number: int) -> None:
        theirs = self._theirs[number]
        widgets.read(self, theirs.headline, line_texts(theirs))

    def _details(self, theirs: Theirs) -> list[tuple[str, str]]:
        """Write the lines below a file, each with its tool tip."""
        lines = []
        if theirs.revision:
            when = time.strftime("%Y-%m-%d %H:%M", time.localtime(theirs.when)) if theirs.when else ""
            comment = plain(theirs.comment, 160) or translate("Silo", "(no comment)")
            lines.append((" · ".join(filter(None, (when, comment))), theirs.comment))
        return lines + [(text, text) for text in line_texts(theirs, _MOST_LINES)]

    def _chose(self, number: int, box: Any) -> None:
        self._check(self.files.topLevelItem(number), Choice(box.currentData()) is Choice.ON_TOP)
        self._update_commit()

    def _tell_who(self) -> None:
        names = sorted({plain(their.who, 40) for their in self._theirs.values() if their.who})
        who = ", ".join(names) or translate("Silo", "Somebody")
        text = translate("Silo", "Commit to Silo – {who} committed since you opened")
        if not any(their.revision for their in self._theirs.values()):
            text = translate("Silo", "Commit to Silo – changed on disk since you opened")
        self.setWindowTitle(text.replace("{who}", who))

    def _update_commit(self) -> None:
        if not hasattr(self, "commit"):
            return
        rows, chosen = self.chosen(), self.choices()
        self.commit.setEnabled(bool(rows or chosen))
        only = translate("Silo", "Do it") if chosen and not rows else translate("Silo", "Commit")
        self.commit.setText(only)

    def answer(self) -> CommitAnswer:
        """Return what the person has chosen in the dialog."""
        chosen = self.chosen()
        registering = self.register.isChecked() and any(row.is_top for row in chosen)
        return CommitAnswer(chosen, self.text(), registering, self.choices())

    def choices(self) -> tuple[tuple[DocumentRow, Theirs, Choice], ...]:
        """Return what to do with colleagues' files besides committing."""
        return tuple(
            (self._plan.rows[number], self._theirs[number], choice)
            for number, box in self._choices.items()
            if (choice := Choice(box.currentData())) in (Choice.OPEN, Choice.TAKE)
        )

    def chosen(self) -> tuple[DocumentRow, ...]:
        """Return the documents to commit, in order."""
        rows = []
        for number in range(self.files.topLevelItemCount()):
            item = self.files.topLevelItem(number)
            if item.checkState(0) == QtCore.Qt.CheckState.Checked:
                row = self._plan.rows[item.data(0, QtCore.Qt.ItemDataRole.UserRole)]
                newer = self._theirs[number].newer if number in self._theirs else None
                rows.append(replace(row, on_top=newer) if newer else row)
        return tuple(rows)
