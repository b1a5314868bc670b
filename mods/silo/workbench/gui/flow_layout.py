# SPDX-License-Identifier: LGPL-2.1-or-later
"""A layout that puts widgets side by side and begins a new line where the width ends (Qt has none)."""

from __future__ import annotations

from typing import Any

from silo.workbench.gui.qt import QtCore, QtWidgets


class FlowLayout(QtWidgets.QLayout):  # type: ignore[misc]  # PySide has no types
    """Left to right, then down. ``gap`` is between neighbours and between lines, in pixels."""

    def __init__(self, gap: int = 8) -> None:
        super().__init__()
        self._items: list[Any] = []
        self._gap = gap
        self.setContentsMargins(0, 0, 0, 0)

    def addItem(self, item: Any) -> None:
        """Take the item that Qt passes on from :meth:`addWidget`."""
        self._items.append(item)

    def count(self) -> int:
        """Return the number of widgets."""
        return len(self._items)

    def itemAt(self, number: int) -> Any:
        """Return the widget's item with this number; None beyond the last."""
        return self._items[number] if 0 <= number < len(self._items) else None

    def takeAt(self, number: int) -> Any:
        """Remove an item and return it."""
        return self._items.pop(number) if 0 <= number < len(self._items) else None

    def hasHeightForWidth(self) -> bool:
        """Return True: a narrower layout is higher."""
        return True

    def heightForWidth(self, width: int) -> int:
        """Return the height that a width needs."""
        return self._place(QtCore.QRect(0, 0, width, 0), move=False)

    def setGeometry(self, area: Any) -> None:
        """Place the widgets."""
        super().setGeometry(area)
        self._place(area, move=True)

    def sizeHint(self) -> Any:
        """Return the smallest size, since the width comes from outside."""
        return self.minimumSize()

    def minimumSize(self) -> Any:
        """Return the size of the largest widget."""
        size = QtCore.QSize()
        for item in self._items:
            size = size.expandedTo(item.minimumSize())
        return size

    def _place(self, area: Any, *, move: bool) -> int:
        x, y, line = area.x(), area.y(), 0
        for item in self._items:
            hint = item.sizeHint()
            if x > area.x() and x + hint.width() > area.right() + 1:
                x, y, line = area.x(), y + line + self._gap // 2, 0
            if move:
                item.setGeometry(QtCore.QRect(QtCore.QPoint(x, y), hint))
            x += hint.width() + self._gap
            line = max(line, hint.height())
        return int(y + line - area.y())
