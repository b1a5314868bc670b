# SPDX-License-Identifier: LGPL-2.1-or-later
"""The commit dialog: what changed, and which files go along."""

from __future__ import annotations

import os
from typing import Any

from silo.workbench.commit.plan import Plan, Row
from silo.workbench.gui import widgets
from silo.workbench.gui.qt import QtCore, QtGui, QtWidgets
from silo.workbench.pane.activity import Tone
from silo.workbench.words import counted, plain, tip, translate


class CommitDialog(QtWidgets.QDialog):  # type: ignore[misc]  # PySide has no types
    """Asks for a comment, and shows what will be saved and in which order."""

    def __init__(self, plan: Plan, parent: Any, *, note: str = "") -> None:
        super().__init__(parent)
        self._plan = plan
        self.setObjectName("SiloCommitDialog")
        self.setWindowTitle(translate("Silo", "Commit to Silo"))
        self.resize(520, 380)
        layout = QtWidgets.QVBoxLayout(self)
        layout.setSpacing(8)
        layout.addWidget(widgets.label(translate("Silo", "What changed?")))
        self.comment = QtWidgets.QPlainTextEdit()
        self.comment.setObjectName("comment")
        self.comment.setPlaceholderText(translate("Silo", "A comment for this revision (may stay empty)"))
        self.comment.setTabChangesFocus(True)
        self.comment.setMaximumHeight(76)
        layout.addWidget(self.comment)
        layout.addWidget(widgets.label(self._heading(), wrap=True))
        self.files = self._make_files()
        layout.addWidget(self.files, 1)
        if note:
            layout.addWidget(widgets.label(note, Tone.QUIET))
        layout.addWidget(self._make_buttons())
        self.comment.setFocus()

    def _heading(self) -> str:
        below = len(self._plan.rows) - 1
        if not below:
            return translate("Silo", "This file is committed:")
        one = translate(
            "Silo", "This file is committed, and {n} file below it that has unsaved edits, that one first:"
        )
        many = translate(
            "Silo",
            "This file is committed, and {n} files below it that have unsaved edits, the lowest first:",
        )
        return counted(below, one, many)

    def _make_files(self) -> Any:
        tree = QtWidgets.QTreeWidget()
        tree.setObjectName("files")
        tree.setRootIsDecorated(False)
        tree.setHeaderLabels([translate("Silo", "File"), translate("Silo", "State")])
        tree.setSelectionMode(QtWidgets.QAbstractItemView.SelectionMode.NoSelection)
        for number, row in enumerate(self._plan.rows):
            item = QtWidgets.QTreeWidgetItem([plain(os.path.basename(row.path) or row.label, 80), row.note])
            item.setToolTip(0, tip(row.path))
            item.setToolTip(1, tip(row.note))
            item.setData(0, QtCore.Qt.ItemDataRole.UserRole, number)
            self._mark(item, row, tree)
            tree.addTopLevelItem(item)
        tree.header().setStretchLastSection(True)
        tree.resizeColumnToContents(0)
        return tree

    def _mark(self, item: Any, row: Row, tree: Any) -> None:
        checked = QtCore.Qt.CheckState.Checked if row.can_commit else QtCore.Qt.CheckState.Unchecked
        item.setCheckState(0, checked)
        if row.is_top or not row.can_commit:
            item.setFlags(item.flags() & ~QtCore.Qt.ItemFlag.ItemIsUserCheckable)
        if not row.can_commit:
            shade = widgets.colour(Tone.WARNING, tree)
            item.setForeground(1, QtGui.QBrush(QtGui.QColor(shade)))
        if row.is_top:
            font = item.font(0)
            font.setBold(True)
            item.setFont(0, font)

    def _make_buttons(self) -> Any:
        box = QtWidgets.QDialogButtonBox()
        role = QtWidgets.QDialogButtonBox.ButtonRole
        self.commit = box.addButton(translate("Silo", "Commit"), role.AcceptRole)
        self.commit.setObjectName("commit")
        self.commit.setDefault(True)
        self.commit.setEnabled(self._plan.top.can_commit)
        box.addButton(translate("Silo", "Cancel"), role.RejectRole)
        box.accepted.connect(self.accept)
        box.rejected.connect(self.reject)
        return box

    def text(self) -> str:
        """The comment."""
        return str(self.comment.toPlainText()).strip()

    def chosen(self) -> tuple[Row, ...]:
        """The documents to commit, in order."""
        rows = []
        for number in range(self.files.topLevelItemCount()):
            item = self.files.topLevelItem(number)
            if item.checkState(0) == QtCore.Qt.CheckState.Checked:
                rows.append(self._plan.rows[item.data(0, QtCore.Qt.ItemDataRole.UserRole)])
        return tuple(rows)
