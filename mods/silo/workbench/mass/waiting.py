# SPDX-License-Identifier: LGPL-2.1-or-later
"""The progress window with Cancel while an assembly is measured."""

from __future__ import annotations

import time

from silo.bom.errors import CancelledError
from silo.bom.message import message
from silo.workbench.freecad import host
from silo.workbench.gui.qt import QtCore, QtWidgets
from silo.workbench.words import translate

# The window is drawn this often while shapes are measured.
BREATH_S = 0.05

# Small assemblies are measured before anybody could read a progress window.
PATIENCE_MS = 500


class WaitingWindow:
    """A progress window with Cancel; :meth:`report` raises CancelledError once it was pressed."""

    def __init__(self, name: str) -> None:
        self._part = ""
        self._last = 0.0
        self._window = QtWidgets.QProgressDialog(host.main_window())
        self._window.setObjectName("SiloMeasuring")
        self._window.setWindowTitle(translate("Silo", "Measuring {name}", name=name))
        self._window.setWindowModality(QtCore.Qt.WindowModality.ApplicationModal)
        self._window.setMinimumDuration(PATIENCE_MS)
        self._window.setRange(0, 0)
        self._window.setLabelText(translate("Silo", "Reading the assembly…"))

    def __enter__(self) -> WaitingWindow:
        self._window.setValue(0)
        return self

    def __exit__(self, *_: object) -> None:
        self._window.reset()
        self._window.deleteLater()

    def report(self, stage: str, done: int, total: int) -> None:
        """Report each part and each face, and let the window draw now and then."""
        if stage == "measuring":
            self._part = translate("Silo", "Part {n} of {total}", n=done, total=total)
            self._window.setRange(0, total)
            self._window.setValue(done - 1)
        now = time.monotonic()
        if now - self._last < BREATH_S:
            return
        self._last = now
        if stage == "measuring faces" and total > 200:
            faces = translate("Silo", "face {n} of {total}", n=done, total=total)
            self._window.setLabelText(f"{self._part}, {faces}")
        elif self._part:
            self._window.setLabelText(self._part)
        QtWidgets.QApplication.processEvents()
        if self._window.wasCanceled():
            raise CancelledError(message("measuring was cancelled"))
