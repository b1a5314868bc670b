# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where FreeCAD's Python lacks packages, the add-on is a workbench with one button that installs them.

The add-on's page of the documentation, in a window: it needs no browser and no network.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from silo.workbench import dependencies
from silo.workbench.commands import INSTALL, Command
from silo.workbench.freecad import host
from silo.workbench.gui import widgets
from silo.workbench.gui.qt import QtCore, QtWidgets, Relay
from silo.workbench.words import QT_TRANSLATE_NOOP, translate, visible

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
        text = translate("Silo", "The documentation is not there: {path}")
        return text.replace("{path}", str(PAGE))


# The one window; FreeCAD holds no reference to it.
_open: list[Any] = []


def stub_commands(missing: Sequence[str]) -> dict[str, Command]:
    """The one command that works without packages."""

    def run() -> None:
        window = InstallWindow(missing, host.main_window(), install)
        _open[:] = [window]
        window.show()

    return {
        INSTALL: Command(
            text=QT_TRANSLATE_NOOP("Silo_InstallPackages", "Install What Silo Needs…"),
            tip=QT_TRANSLATE_NOOP("Silo_InstallPackages", "Install the Python packages that Silo needs"),
            icon="silo",
            run=run,
        )
    }


def install() -> str:
    """Install the packages for this FreeCAD, and return where they are. Raises SiloError. Worker."""
    from silo.freecads import ask_freecad, install_packages

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
            "Silo", "Silo needs these Python packages: {names}.\nThey are installed in {folder}."
        )
        text = text.replace("{names}", ", ".join(missing)).replace("{folder}", host.packages_folder())
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
        """Install, in a thread; the window stays usable, and may be closed."""
        self.button.setEnabled(False)
        self.bar.show()
        self.text.setText(translate("Silo", "Installing. This takes a minute or two…"))
        threading.Thread(target=self._work, name="silo-install", daemon=True).start()

    def _work(self) -> None:
        try:
            text, done = self._install(), True
        except Exception as error:  # noqa: BLE001  # a person wants to read it, whatever it is
            text, done = str(error) or type(error).__name__, False
        self._relay.post(lambda: self._ended(text, done=done))

    def _ended(self, text: str, *, done: bool) -> None:
        self.bar.hide()
        self.show()
        if done:
            told = translate("Silo", "The packages are in {folder}. Start FreeCAD again to use Silo.")
            self.text.setText(told.replace("{folder}", text))
            self.button.hide()
            return
        self.button.setEnabled(True)
        self.button.setText(translate("Silo", "Try again"))
        failed = translate("Silo", "They could not be installed: {reason}")
        by_hand = dependencies.sentence(dependencies.missing(), host.packages_folder(), sys.version_info[:2])
        self.text.setText(visible(failed.replace("{reason}", text), 1500) + "\n\n" + by_hand)
