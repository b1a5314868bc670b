# SPDX-License-Identifier: LGPL-2.1-or-later
"""The sign in FreeCAD's tree at a document whose BOM is held: a red corner of its icon, and why as a tip.

FreeCAD has no way to mark a document in its tree, so its widget is asked by name; where that has changed, no
sign is shown and nothing else is lost.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from silo.workbench.gui.qt import QtGui, QtWidgets

_RED = "#d02030"


class TreeSign:
    """One for FreeCAD's window."""

    def __init__(self, window: Any) -> None:
        self._window = window
        self._marked: dict[str, str] = {}

    def draw(self, why: Mapping[str, str]) -> None:
        """Mark the documents of these labels, each with its reason; all others lose their mark."""
        if not why and not self._marked:
            return
        for item in self._documents():
            label = item.text(0)
            if label in why:
                item.setToolTip(0, why[label])
                item.setIcon(0, with_corner(self._plain_icon()))
            elif label in self._marked:
                item.setToolTip(0, "")
                item.setIcon(0, self._plain_icon())
        self._marked = dict(why)

    def _documents(self) -> Iterator[Any]:
        for tree in self._window.findChildren(QtWidgets.QTreeWidget):
            if tree.metaObject().className() != "Gui::TreeWidget":
                continue
            for at in range(tree.topLevelItemCount()):
                top = tree.topLevelItem(at)
                yield from (top.child(row) for row in range(top.childCount()))

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
