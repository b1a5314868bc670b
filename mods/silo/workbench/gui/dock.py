# SPDX-License-Identifier: LGPL-2.1-or-later
"""A dock of FreeCAD's window, whose content is made when the user first looks at it.

It comes after FreeCAD's other add-ons, and gets its place back then.
"""

from __future__ import annotations

from typing import Any

from silo.workbench.gui.qt import QtCore, QtWidgets

# Pixels.
NARROW, WIDTH = 260, 320


class Dock(QtWidgets.QDockWidget):  # type: ignore[misc]  # PySide has no types
    """A dock whose content is made when somebody first looks at it.

    FreeCAD restores place and visibility by its object name, so that must never change.
    """

    def __init__(self, window: Any, name: str, title: str) -> None:
        super().__init__(title, window)
        self.setObjectName(name)
        self._content: Any = None
        window.addDockWidget(QtCore.Qt.DockWidgetArea.RightDockWidgetArea, self)
        self.hide()
        self.visibilityChanged.connect(self._visible)
        window.restoreDockWidget(self)

    def make(self) -> Any:
        """Make the content of the dock."""
        raise NotImplementedError

    def show_and_raise(self) -> None:
        """Show the dock, even if it is a tab behind another one."""
        self.show()
        self.raise_()

    def _visible(self, visible: bool) -> None:
        if visible and self._content is None:
            self._content = self.make()
            self.setWidget(self._content)
            if self.width() < NARROW:
                # If the user has never placed it: wide enough to read, narrow enough to work beside it.
                self.parent().resizeDocks([self], [WIDTH], QtCore.Qt.Orientation.Horizontal)
