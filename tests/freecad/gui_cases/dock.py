# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: the dock is moved, FreeCAD is closed; the next FreeCAD has it there."""

from __future__ import annotations

import os
import sys

sys.path.insert(0, os.environ["SILO_TEST_CASES"])

from inside import Gui, QtCore, QtWidgets, addon, tell, wait

LEFT = QtCore.Qt.DockWidgetArea.LeftDockWidgetArea


def look() -> None:
    window = Gui.getMainWindow()
    docks = window.findChildren(QtWidgets.QDockWidget, "Database Activity")
    dock = addon().dock
    tell(
        docks=len(docks),
        title=dock.windowTitle(),
        visible=dock.isVisible(),
        left=window.dockWidgetArea(dock) == LEFT,
    )
    if not os.environ.get("SILO_TEST_SECOND"):
        window.addDockWidget(LEFT, dock)
        dock.show_and_raise()
        wait(dock.isVisible)
    # Only a normal end writes down where the docks are.
    window.close()


QtCore.QTimer.singleShot(1500, look)
