# SPDX-License-Identifier: LGPL-2.1-or-later
"""The Database Activity dock (spec bom-sync §6). It draws :mod:`silo.workbench.activity` and decides nothing."""

from __future__ import annotations

from typing import Any

from silo.workbench.qt import QtCore, QtWidgets
from silo.workbench.words import translate

NAME = "Database Activity"


class ActivityDock(QtWidgets.QDockWidget):  # type: ignore[misc]  # PySide has no types
    """The dock. FreeCAD restores place and visibility by its object name, so that must never change."""

    def __init__(self, window: Any) -> None:
        super().__init__(translate("Silo", NAME), window)
        self.setObjectName(NAME)
        window.addDockWidget(QtCore.Qt.DockWidgetArea.RightDockWidgetArea, self)
        self.hide()

    def show_and_raise(self) -> None:
        """Show the dock, also where it is a tab behind another one."""
        self.show()
        self.raise_()
