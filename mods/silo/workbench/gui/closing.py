# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD is about to close: what must be done before its documents are gone, and the wait for the disk."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from silo.workbench.gui.qt import QtCore, QtWidgets
from silo.workbench.words import translate

# A bar that is visible only for a moment would flicker.
PATIENCE_S = 0.3

STEP_S = 0.05


class CloseWatch(QtCore.QObject):  # type: ignore[misc]  # PySide has no types
    """Calls ``before`` when a window is asked to close, before it does anything about it."""

    def __init__(self, window: Any, before: Callable[[], None]) -> None:
        super().__init__(window)
        self._before = before
        window.installEventFilter(self)

    def eventFilter(self, _watched: Any, event: Any) -> bool:
        """Pass each event on."""
        if event.type() == QtCore.QEvent.Type.Close:
            self._before()
        return False


def wait_for_disk(left: Callable[[float], int]) -> None:
    """Wait until nothing remains; after a moment with a bar, and a button to close anyway.

    left
        waits at most so many seconds, and returns how many files are still to be written.
    """
    most = left(PATIENCE_S)
    if not most:
        return
    window = QtWidgets.QProgressDialog()
    window.setObjectName("SiloClosing")
    window.setWindowTitle(translate("Silo", "Silo"))
    window.setLabelText(
        translate(
            "Silo",
            "Your commits are being copied to the outbox. They are sent when FreeCAD is started the next "
            "time.\n"
            "Commits that are not copied by then may have to be committed again.",
        )
    )
    window.setCancelButtonText(translate("Silo", "Close without waiting"))
    window.setMinimumDuration(0)
    window.setRange(0, most)
    window.show()
    while (count := left(STEP_S)) and not window.wasCanceled():
        window.setRange(0, max(most, count))
        window.setValue(max(0, most - count))
        QtWidgets.QApplication.processEvents()
    window.hide()
    window.deleteLater()
