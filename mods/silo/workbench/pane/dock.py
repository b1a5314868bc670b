# SPDX-License-Identifier: LGPL-2.1-or-later
"""The Database Activity dock. It is there from FreeCAD's start, or its place would not be restored; its
content (:mod:`silo.workbench.pane.boxes`) is made when somebody first looks at it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from silo.workbench.gui.qt import QtCore, QtWidgets
from silo.workbench.words import translate

if TYPE_CHECKING:
    from silo.workbench.pane.activity import Action
    from silo.workbench.pane.boxes import Pane
    from silo.workbench.session.session import Shown

NAME = "Database Activity"

# Pixels.
NARROW, WIDTH = 260, 320


class ActivityDock(QtWidgets.QDockWidget):  # type: ignore[misc]  # PySide has no types
    """The dock. FreeCAD restores place and visibility by its object name, so that must never change.

    on_action
        gets every button that is pressed.
    """

    def __init__(self, window: Any, on_action: Callable[[Action], None]) -> None:
        super().__init__(translate("Silo", "Database Activity"), window)
        self.setObjectName(NAME)
        self._on_action = on_action
        self._pane: Pane | None = None
        self._shown: Shown | None = None
        window.addDockWidget(QtCore.Qt.DockWidgetArea.RightDockWidgetArea, self)
        self.hide()
        self.visibilityChanged.connect(self._visible)

    def show_and_raise(self) -> None:
        """Show the dock, also where it is a tab behind another one."""
        self.show()
        self.raise_()

    def update_shown(self, shown: Shown) -> None:
        """Draw a new state; while nobody looks, only remember it."""
        self._shown = shown
        if self._pane is not None and self.isVisible():
            self._pane.draw(shown)

    def _visible(self, visible: bool) -> None:
        if not visible:
            return
        if self._pane is None:
            from silo.workbench.pane.boxes import Pane

            self._pane = Pane(self._on_action)
            self.setWidget(self._pane)
            if self.width() < NARROW:
                # Never placed by the user so far: wide enough to read, narrow enough to work beside.
                self.parent().resizeDocks([self], [WIDTH], QtCore.Qt.Orientation.Horizontal)
        if self._shown is not None:
            self._pane.draw(self._shown)
