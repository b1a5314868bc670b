# SPDX-License-Identifier: LGPL-2.1-or-later
"""A choice from a list: as a box, and as a table cell with a small arrow and a list when it is clicked."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from silo.workbench.gui.qt import QtCore, QtGui, QtWidgets


def choice_box(parent: Any, choices: Mapping[str, str], *, search: bool = False, name: str = "") -> Any:
    """Make a list of choices, no longer than the screen; with ``search``, typed letters filter it."""
    box = QtWidgets.QComboBox(parent)
    box.setObjectName(name)
    box.setMaxVisibleItems(14)
    box.setStyleSheet("QComboBox { combobox-popup: 0; }")  # else some styles show all of them at once
    fill_choices(box, choices)
    if search:
        box.setEditable(True)
        box.setInsertPolicy(QtWidgets.QComboBox.InsertPolicy.NoInsert)
        box.completer().setFilterMode(QtCore.Qt.MatchFlag.MatchContains)
        box.completer().setCompletionMode(QtWidgets.QCompleter.CompletionMode.PopupCompletion)
    return box


def fill_choices(box: Any, choices: Mapping[str, str]) -> None:
    """Fill a list with these choices."""
    box.clear()
    for key, text in choices.items():
        box.addItem(text, key)


def chosen_key(box: Any) -> Any:
    """Return the key of the chosen or typed text; None if the letters fit several choices, or none."""
    typed = box.currentText()
    if not box.isEditable() or typed == box.itemText(box.currentIndex()):
        return box.currentData()
    texts = [box.itemText(number) for number in range(box.count())]
    fitting = [number for number, text in enumerate(texts) if typed and typed.casefold() in text.casefold()]
    return box.itemData(fitting[0]) if len(fitting) == 1 else None


# The cell's data that holds the key of what is chosen now.
KEY = QtCore.Qt.ItemDataRole.UserRole + 1


class ChoiceDelegate(QtWidgets.QStyledItemDelegate):  # type: ignore[misc]  # PySide has no types
    """Edits a cell by choosing; a newly chosen key is set as ``UserRole``, the text is what is shown.

    The cell holds the present key as :data:`KEY`, which need not be one that can be chosen.

    choices
        row → {key: text}.
    search
        typed letters filter the choices.
    """

    def __init__(
        self, choices: Callable[[int], dict[str, str]], parent: Any, *, search: bool = False
    ) -> None:
        super().__init__(parent)
        self._choices, self._search = choices, search

    def createEditor(self, parent: Any, _option: Any, index: Any) -> Any:
        """Make a list of the choices, and open it at once."""
        box = choice_box(parent, self._choices(index.row()), search=self._search)
        box.activated.connect(lambda _number: self._chosen(box))

        def show() -> None:
            if self._search:
                box.lineEdit().selectAll()
                box.completer().setCompletionPrefix("")
                box.completer().complete()
            else:
                box.showPopup()

        QtCore.QTimer.singleShot(0, show)
        return box

    def setEditorData(self, editor: Any, index: Any) -> None:
        """Begin with the present choice."""
        editor.setCurrentIndex(editor.findData(index.data(KEY)))

    def setModelData(self, editor: Any, model: Any, index: Any) -> None:
        """Take over the choice."""
        key = chosen_key(editor)
        if key is not None and key != index.data(KEY):
            model.setData(index, key, QtCore.Qt.ItemDataRole.UserRole)

    def paint(self, painter: Any, option: Any, index: Any) -> None:
        """Paint the text, and an arrow if a user can choose."""
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
