# SPDX-License-Identifier: LGPL-2.1-or-later
"""The sign in FreeCAD's tree at a document whose BOM is held: a red corner of its icon, and why as a tip.

FreeCAD has no way to mark a document in its tree, so its widget is asked by name; where that has changed, no
sign is shown and nothing else is lost.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Any

from silo.workbench.gui.qt import QtCore, QtGui, QtWidgets

_RED = "#d02030"
_TEXT = QtCore.Qt.ItemDataRole.DisplayRole
_TIP = QtCore.Qt.ItemDataRole.ToolTipRole
_ICON = QtCore.Qt.ItemDataRole.DecorationRole


class TreeSign:
    """One for FreeCAD's window."""

    def __init__(self, window: Any) -> None:
        self._window = window
        self._marked: dict[str, str] = {}

    def draw(self, why: Mapping[str, str], labels: Collection[str]) -> None:
        """Mark the documents of these labels, each with its reason; all others lose their mark.

        labels
            those of all open documents.
        """
        if not why and not self._marked:
            return
        for model, index in self._documents(labels):
            label = str(model.data(index, _TEXT))
            if label in why:
                model.setData(index, why[label], _TIP)
                model.setData(index, with_corner(self._plain_icon()), _ICON)
            elif label in self._marked:
                model.setData(index, "", _TIP)
                model.setData(index, self._plain_icon(), _ICON)
        self._marked = dict(why)

    def _documents(self, labels: Collection[str]) -> Iterator[tuple[Any, Any]]:
        # By the model: PySide's own objects for the items of a tree that C++ made do not live long enough.
        for tree in self._window.findChildren(QtWidgets.QTreeWidget):
            if tree.metaObject().className() != "Gui::TreeWidget":
                continue
            model = tree.model()
            for top in (model.index(row, 0) for row in range(model.rowCount())):
                if str(model.data(top, _TEXT)) in labels:
                    yield model, top
                else:  # before 1.1 all documents are below one root
                    yield from ((model, model.index(row, 0, top)) for row in range(model.rowCount(top)))

    @staticmethod
    def _plain_icon() -> Any:
        return QtGui.QIcon(":/icons/Document.svg")


def with_corner(icon: Any, size: int = 32) -> Any:
    """Return an icon with a red point in its lower corner."""
    pixmap = icon.pixmap(size, size)
    if pixmap.isNull():
        pixmap = QtGui.QPixmap(size, size)
        pixmap.fill(QtGui.QColor(0, 0, 0, 0))
    painter = QtGui.QPainter(pixmap)
    painter.setRenderHint(QtGui.QPainter.RenderHint.Antialiasing)
    painter.setBrush(QtGui.QColor(_RED))
    painter.setPen(QtGui.QColor("white"))
    width = pixmap.width()
    point = width // 2
    painter.drawEllipse(width - point - 1, pixmap.height() - point - 1, point, point)
    painter.end()
    return QtGui.QIcon(pixmap)
