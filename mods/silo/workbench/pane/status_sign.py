# SPDX-License-Identifier: LGPL-2.1-or-later
"""The sign in FreeCAD's status bar that something of Silo needs an answer; a press opens the pane."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from silo.workbench.gui import widgets
from silo.workbench.gui.qt import QtCore, QtWidgets
from silo.workbench.session.state import PaneState
from silo.workbench.tone import Tone
from silo.workbench.words import counted, translate

# [lines] of a tool tip, at most
_MOST = 12


def sign_text(shown: PaneState) -> str:
    """Say what needs an answer, shortly; "" if nothing does."""
    other = sum(kind == "commit" for kind, _key in shown.questions())
    texts = [
        counted(n, one, many)
        for n, one, many in (
            (len(shown.held), translate("Silo", "{n} BOM held"), translate("Silo", "{n} BOMs held")),
            (other, translate("Silo", "{n} commit asks"), translate("Silo", "{n} commits ask")),
        )
        if n
    ]
    return f"Silo: {', '.join(texts)}" if texts else ""


class StatusSign(QtWidgets.QToolButton):  # type: ignore[misc]  # PySide has no types
    """One in the window's status bar; hidden while nothing needs an answer."""

    def __init__(self, window: Any, on_press: Callable[[], None]) -> None:
        super().__init__(window)
        self.setObjectName("SiloStatusSign")
        self.setAutoRaise(True)
        self.setToolButtonStyle(QtCore.Qt.ToolButtonStyle.ToolButtonTextOnly)
        self.clicked.connect(lambda _checked=False: on_press())
        self.hide()
        window.statusBar().addPermanentWidget(self)

    def draw(self, shown: PaneState) -> None:
        """Show how many BOMs are held, and how many questions are open beside them."""
        text = sign_text(shown)
        self.setText(f"⚠ {text}")
        self.setToolTip("\n".join(held.sentence for held in shown.held[:_MOST]))
        self.setStyleSheet(f"QToolButton {{ color: {widgets.colour(Tone.ERROR, self)}; }}")
        self.setVisible(bool(text))
