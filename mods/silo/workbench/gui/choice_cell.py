# SPDX-License-Identifier: LGPL-2.1-or-later
"""A table cell with a choice: text with a small arrow, a list when one clicks on it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from silo.workbench.gui.qt import QtCore, QtGui, QtWidgets

# The cell's data that holds the key of what is chosen now.
KEY = QtCore.Qt.ItemDataRole.UserRole + 1


class ChoiceDelegate(QtWidgets.QStyledItemDelegate):  # type: ignore[misc]  # PySide has no types
    """Edits a cell by choosing; a newly chosen key is set as ``UserRole``, the text is what is shown.

    The cell holds the present key as :data:`KEY`, which need not be one that can be chosen.

    choices
        row → {key: text}.
    """

    def __init__(self, choices: Callable[[int], dict[str, str]], parent: Any) -> None:
        super().__init__(parent)
        self._choices = choices

    def createEditor(self, parent: Any, _option: Any, index: Any) -> Any:
        """A list of the choices, opened at once."""
        box = QtWidgets.QComboBox(parent)
        for key, text in self._choices(index.row()).items():
            box.addItem(text, key)
        box.activated.connect(lambda _number: self._chosen(box))
        QtCore.QTimer.singleShot(0, box.showPopup)
        return box

    def setEditorData(self, editor: Any, index: Any) -> None:
        """Begin with what is chosen now."""
        editor.setCurrentIndex(editor.findData(index.data(KEY)))

    def setModelData(self, editor: Any, model: Any, index: Any) -> None:
        """Take over the choice."""
        key = editor.currentData()
        if key is not None and key != index.data(KEY):
            model.setData(index, key, QtCore.Qt.ItemDataRole.UserRole)

    def paint(self, painter: Any, option: Any, index: Any) -> None:
        """The text, and an arrow where one can choose."""
        super().paint(painter, option, index)
        if not index.flags() & QtCore.Qt.ItemFlag.ItemIsEditable:
            return
        area = option.rect
        middle = area.center().y()
        right = area.right() - 6
        arrow = QtGui.QPolygon(
            [
                QtCore.QPoint(right - 8, middle - 2),
                QtCore.QPoint(right, middle - 2),
                QtCore.QPoint(right - 4, middle + 3),
            ]
        )
        painter.save()
        painter.setRenderHint(QtGui.QPainter.RenderHint.Antialiasing)
        painter.setPen(QtCore.Qt.PenStyle.NoPen)
        painter.setBrush(option.palette.color(QtGui.QPalette.ColorRole.Text))
        painter.drawPolygon(arrow)
        painter.restore()

    def _chosen(self, box: Any) -> None:
        self.commitData.emit(box)
        self.closeEditor.emit(box)
