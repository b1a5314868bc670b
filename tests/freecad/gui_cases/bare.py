# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside a FreeCAD whose Python lacks what the add-on needs: it starts, and one sentence says so."""

from __future__ import annotations

import os
import sys

sys.path.insert(0, os.environ["SILO_TEST_CASES"])

from inside import Gui, QtCore, QtWidgets, tell


def look() -> None:
    from silo.workbench.freecad import host

    texts = [w.toPlainText() for w in Gui.getMainWindow().findChildren(QtWidgets.QTextEdit)]
    tell(
        on_path=host.packages_folder() in [os.path.normpath(entry) for entry in sys.path],
        commands=[name for name in Gui.listCommands() if "Silo" in name or name == "Origin_Commit"],
        report=[
            line for text in texts for line in text.splitlines() if "Silo" in line or "Traceback" in line
        ],
    )
    os._exit(0)


QtCore.QTimer.singleShot(1500, look)
