# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside a FreeCAD whose Python lacks what the add-on needs: a workbench with one button installs it."""

from __future__ import annotations

import os
import sys
from typing import Any

from inside import Gui, QtWidgets, labels, run, tell, wait


def report() -> list[str]:
    """What the report view says of us."""
    texts = [w.toPlainText() for w in Gui.getMainWindow().findChildren(QtWidgets.QTextEdit)]
    return [line for text in texts for line in text.splitlines() if "Silo" in line or "Traceback" in line]


def look() -> None:
    from silo.workbench.freecad import host

    tell(
        on_path=host.packages_folder() in [os.path.normpath(entry) for entry in sys.path],
        report=report(),
    )
    pane = Gui.getMainWindow().findChild(QtWidgets.QDockWidget, "Database Activity")
    tell(pane=labels(pane), mends=[one.text() for one in pane.findChildren(QtWidgets.QPushButton)])
    Gui.activateWorkbench("SiloModWorkbench")
    bar = Gui.getMainWindow().findChild(QtWidgets.QToolBar, "Silo")
    tell(buttons=[action.text() for action in bar.actions()])
    Gui.runCommand("Silo_InstallPackages")
    window = next(w for w in QtWidgets.QApplication.topLevelWidgets() if w.objectName() == "SiloInstall")
    tell(before=labels(window))
    # FreeCAD's starter of some Debian releases empties this variable, so it is set only now.
    os.environ["PYTHONPATH"] = os.environ["SILO_TEST_PIP"]
    press(window)
    tell(failed=labels(window), again=window.button.text())
    os.environ["PIP_FIND_LINKS"] = os.environ["SILO_TEST_WHEELS"]
    press(window)
    tell(after=labels(window), button=window.button.isVisible())


def press(window: Any) -> None:
    window.button.click()
    tell(during=[window.bar.isVisible(), window.button.isEnabled()])
    # Whoever closes it meanwhile learns the end anyway.
    window.close()
    wait(lambda: window.isVisible() and not window.bar.isVisible())


run(look, ready=report)
