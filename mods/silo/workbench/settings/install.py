# SPDX-License-Identifier: LGPL-2.1-or-later
"""The add-on where FreeCAD's Python lacks packages: a workbench with one button that installs them."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from silo.workbench.commands import INSTALL, Command
from silo.workbench.freecad import host
from silo.workbench.gui import widgets
from silo.workbench.gui.dock import Dock
from silo.workbench.gui.qt import QtCore, QtWidgets, Relay
from silo.workbench.packages import missing_packages, packages_hint
from silo.workbench.pane.dock import NAME
from silo.workbench.tone import Tone
from silo.workbench.words import QT_TRANSLATE_NOOP, spoken, translate, visible

# The one window; FreeCAD holds no reference to it.
_open: list[Any] = []


def stub_commands(missing: Sequence[str]) -> dict[str, Command]:
    """Make the one command that works without packages."""

    return {
        INSTALL: Command(
            text=QT_TRANSLATE_NOOP("Silo_InstallPackages", "Install What Silo Needs…"),
            tip=QT_TRANSLATE_NOOP("Silo_InstallPackages", "Install the Python packages that Silo needs"),
            icon="silo",
            run=lambda: show_install(missing),
        )
    }


def show_install(missing: Sequence[str]) -> None:
    """Open the window that installs packages."""
    window = InstallWindow(missing, host.main_window(), install)
    _open[:] = [window]
    window.show()


class InstallDock(Dock):
    """The pane while packages are missing: which, and the button that installs them."""

    def __init__(self, window: Any, missing: Sequence[str]) -> None:
        super().__init__(window, NAME, translate("Silo", "Database Activity"))
        self._missing = missing
        self.show()

    def make(self) -> Any:
        """Make the widget with the sentence and its button."""
        content = QtWidgets.QWidget()
        layout = QtWidgets.QVBoxLayout(content)
        text = translate("Silo", "Silo cannot start yet: FreeCAD's Python lacks {names}.")
        layout.addWidget(widgets.label(text.replace("{names}", ", ".join(self._missing)), Tone.WARNING))
        text = translate("Silo", "Install What Silo Needs…")
        layout.addWidget(widgets.button(text, "mend", lambda: show_install(self._missing)))
        layout.addStretch(1)
        return content


def install() -> str:
    """Install the packages for this FreeCAD, and return their folder. Raises SiloError. Worker."""
    from silo.freecads.addon import ask_freecad, install_packages

    return install_packages(ask_freecad(host.program(), Path(host.user_data_folder())))


class InstallWindow(QtWidgets.QDialog):  # type: ignore[misc]  # PySide has no types
    """Says what is missing, installs it, and says how that went.

    install
        does the work in a thread of its own; returns the folder, raises with the reason.
    """

    def __init__(self, missing: Sequence[str], parent: Any, install: Callable[[], str]) -> None:
        super().__init__(parent)
        self._install = install
        self._relay = Relay()
        title = translate("Silo", "Install what Silo needs")
        layout = widgets.lay_out(self, "SiloInstall", title, 460, 120)
        # The work may end after the window is closed; then it comes back and says how that went.
        self.setAttribute(QtCore.Qt.WidgetAttribute.WA_DeleteOnClose, False)
        text = translate(
            "Silo",
            "Silo needs these Python packages: {names}.\nThey are installed in {folder}.",
            names=", ".join(missing),
            folder=host.packages_folder(),
        )
        self.text = widgets.label(text)
        self.bar = QtWidgets.QProgressBar()
        self.bar.setRange(0, 0)
        self.bar.hide()
        self.button = widgets.button(translate("Silo", "Install"), "install", self.begin, default=True)
        close = widgets.button(translate("Silo", "Close"), "close", self.close)
        layout.addWidget(self.text)
        layout.addWidget(self.bar)
        layout.addLayout(widgets.line(None, self.button, close))

    def begin(self) -> None:
        """Install in a thread; the window stays usable, and may be closed."""
        self.button.setEnabled(False)
        self.bar.show()
        self.text.setText(translate("Silo", "Installing. This takes a minute or two…"))
        threading.Thread(target=self._work, name="silo-install", daemon=True).start()

    def _work(self) -> None:
        try:
            text, done = self._install(), True
        except Exception as error:  # noqa: BLE001  # a user wants to read it, whatever it is
            text, done = str(error) or type(error).__name__, False
        self._relay.post(lambda: self._ended(text, done=done))

    def _ended(self, text: str, *, done: bool) -> None:
        self.bar.hide()
        self.show()
        if done:
            self.text.setText(
                translate(
                    "Silo", "The packages are in {folder}. Start FreeCAD again to use Silo.", folder=text
                )
            )
            self.button.hide()
            return
        self.button.setEnabled(True)
        self.button.setText(translate("Silo", "Try again"))
        by_hand = packages_hint(missing_packages(), host.packages_folder(), sys.version_info[:2])
        self.text.setText(
            visible(translate("Silo", "They could not be installed: {reason}", reason=spoken(text)), 1500)
            + "\n\n"
            + spoken(by_hand)
        )
