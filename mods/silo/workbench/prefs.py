# SPDX-License-Identifier: LGPL-2.1-or-later
"""The page in FreeCAD's preferences."""

from __future__ import annotations

from silo.workbench.qt import QtWidgets
from silo.workbench.words import translate


class PreferencePage:
    """FreeCAD makes one each time the preferences are opened."""

    def __init__(self, _parent: object = None) -> None:
        self.form = QtWidgets.QWidget()
        self.form.setWindowTitle(translate("Silo", "Silo"))

    def loadSettings(self) -> None:
        """Show the settings as they are."""

    def saveSettings(self) -> None:
        """Keep what the user entered."""
