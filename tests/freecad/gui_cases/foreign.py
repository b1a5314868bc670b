# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside a FreeCAD in which another add-on's package is called silo."""

from __future__ import annotations

from typing import Any

from inside import Gui, QtWidgets, labels, run, tell


def pane() -> Any:
    """The dock in the place of ours."""
    return Gui.getMainWindow().findChild(QtWidgets.QDockWidget, "Database Activity")


run(lambda: tell(pane=labels(pane())), ready=lambda: pane() is not None)
