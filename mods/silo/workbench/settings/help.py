# SPDX-License-Identifier: LGPL-2.1-or-later
"""The add-on's page of the documentation, in a window: it needs no browser and no network."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from silo.workbench.gui import widgets
from silo.workbench.gui.qt import QtWidgets
from silo.workbench.words import translate

PAGE = Path(__file__).resolve().parents[4] / "docs" / "addon.md"


class HelpWindow(QtWidgets.QDialog):  # type: ignore[misc]  # PySide has no types
    """Not modal: one reads it beside the work."""

    def __init__(self, parent: Any) -> None:
        super().__init__(parent)
        layout = widgets.lay_out(self, "SiloHelp", translate("Silo", "Help on Silo"), 820, 700)
        self.page = QtWidgets.QTextBrowser()
        self.page.setOpenExternalLinks(True)
        self.page.setSearchPaths([str(PAGE.parent)])
        self.page.setMarkdown(_text())
        layout.addWidget(self.page)


def _text() -> str:
    try:
        return PAGE.read_text(encoding="utf-8")
    except OSError:
        return translate("Silo", "The documentation is not there: {path}", path=PAGE)
