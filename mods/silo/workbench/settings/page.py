# SPDX-License-Identifier: LGPL-2.1-or-later
"""The page in FreeCAD's preferences: server, token, TLS, and what a commit does."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from silo.workbench.gui import qt, widgets
from silo.workbench.gui.choices import choice_box
from silo.workbench.gui.qt import QtCore, QtWidgets
from silo.workbench.session.session import Session
from silo.workbench.settings.connection_test import asked_again, begin_login, in_use, keep_token, look, test
from silo.workbench.settings.keyring import Keyring
from silo.workbench.settings.preferences import ALLOW, HOLD, Preferences
from silo.workbench.settings.server import ServerChoice, ServerPreferences, read_known
from silo.workbench.tone import Tone
from silo.workbench.words import spoken, translate

if TYPE_CHECKING:
    from silo.api.client import BrowserLogin


# How often the server is asked if the user has let FreeCAD in.
KEYRING, PREFERENCE = "keyring", "preference"


class PreferencePage:
    """FreeCAD wants ``form``, ``loadSettings`` and ``saveSettings``.

    changed
        told after settings were saved that differ from those before.
    """

    def __init__(self, preferences: Preferences, session: Session, changed: Callable[[], None]) -> None:
        self._preferences, self._session, self._changed = preferences, session, changed
        self._keyring = Keyring()
        self.flags: dict[str, Any] = {}
        self._alive = True
        self._waiting = 0
        self.form = QtWidgets.QWidget()
        self._breath = QtCore.QTimer(self.form)
        self._breath.setInterval(15)
        self._breath.timeout.connect(_breathe)
        self.form.setWindowTitle(translate("Silo", "Silo"))
        self.form.destroyed.connect(lambda _obj=None: self._gone())
        layout = QtWidgets.QVBoxLayout(self.form)
        layout.addWidget(self._server_box())
        layout.addWidget(self._commit_box())
        layout.addWidget(self._window_box())
        layout.addStretch(1)

    # -- the form ---------------------------------------------------------------------------------------

    def _server_box(self) -> Any:
        box = QtWidgets.QGroupBox(translate("Silo", "Server"))
        layout = QtWidgets.QVBoxLayout(box)
        form = QtWidgets.QFormLayout()
        layout.addLayout(form)
        self.url = widgets.field("url", "https://silo.example.com")
        form.addRow(translate("Silo", "Address"), self.url)
        self.token = widgets.field("token")
        self.token.setEchoMode(QtWidgets.QLineEdit.EchoMode.Password)
        log_in = widgets.button(translate("Silo", "Log in…"), "log_in", self.log_in)
        form.addRow(translate("Silo", "API token"), widgets.line(self.token, log_in))
        places = {PREFERENCE: translate("Silo", "FreeCAD's preferences (a plain file)")}
        self.place = choice_box(None, places, name="place")
        form.addRow(translate("Silo", "Keep the token in"), self.place)
        self.verify = QtWidgets.QCheckBox(translate("Silo", "Check the server's certificate"))
        self.verify.setObjectName("verify")
        form.addRow("", self.verify)
        self.certificate = widgets.field("", translate("Silo", "the system's own, unless a file is given"))
        browse = widgets.button("…", "browse", self._browse)
        browse.setMaximumWidth(36)
        form.addRow(translate("Silo", "Certificate authorities"), widgets.line(self.certificate, browse))
        self.in_use = widgets.label("", Tone.QUIET)
        self.in_use.setObjectName("in_use")
        layout.addWidget(self.in_use)
        layout.addLayout(self._test_row())
        return box

    def _test_row(self) -> Any:
        self.result = widgets.label("")
        self.result.setObjectName("result")
        row = widgets.line(widgets.button(translate("Silo", "Test the connection"), "test", self.test))
        row.addWidget(self.result, 1)
        return row

    def _browse(self) -> None:
        title = translate("Silo", "Certificate authorities")
        chosen, _filter = QtWidgets.QFileDialog.getOpenFileName(self.form, title, self.certificate.text())
        if chosen:
            self.certificate.setText(chosen)

    def _commit_box(self) -> Any:
        box = QtWidgets.QGroupBox(translate("Silo", "Commit"))
        form = QtWidgets.QFormLayout(box)
        for name, text in (
            ("AskComment", translate("Silo", "Ask for a comment")),
            ("SyncBom", translate("Silo", "Sync the BOM of an assembly after its file is committed")),
            ("AskRegister", translate("Silo", "Then ask about components without a part number")),
            ("CountHardware", translate("Silo", "Count standard parts (screws, nuts, washers) in the BOM")),
        ):
            self._flag(form, name, text)
        ways = {
            HOLD: translate("Silo", "hold the BOM back until they are mended"),
            ALLOW: translate("Silo", "sync without them (they become unreferenced)"),
        }
        self.missing = choice_box(None, ways, name="missing")
        form.addRow(translate("Silo", "Where links are broken"), self.missing)
        self.schema = widgets.field("schema")
        form.addRow(translate("Silo", "Part number schema"), self.schema)
        return box

    def _window_box(self) -> Any:
        box = QtWidgets.QGroupBox(translate("Silo", "Window"))
        form = QtWidgets.QFormLayout(box)
        for name, text in (
            ("LiveActivity", translate("Silo", "Show events of Silo live")),
            ("ShowEverywhere", translate("Silo", "Commit in the File menu of every workbench")),
        ):
            self._flag(form, name, text)
        return box

    def _flag(self, form: Any, name: str, text: str) -> None:
        self.flags[name] = QtWidgets.QCheckBox(text)
        self.flags[name].setObjectName(name)
        form.addRow(self.flags[name])

    # -- FreeCAD's two calls ----------------------------------------------------------------------------

    def loadSettings(self) -> None:
        """Show the present settings."""
        self.url.setText(self._preferences.text("ApiUrl"))
        self.certificate.setText(self._preferences.text("SslCertPath"))
        self.schema.setText(self._preferences.text("Schema"))
        self.verify.setChecked(self._preferences.flag("SslVerify"))
        for name, box in self.flags.items():
            box.setChecked(self._preferences.flag(name))
        self.missing.setCurrentIndex(max(self.missing.findData(self._preferences.text("MissingLinks")), 0))
        self.token.setText("")
        preferences = read_known(self._preferences)
        self._ask(
            translate("Silo", "Reading the settings"),
            lambda: look(preferences, self._keyring),
            self._looked,
        )

    def _ask(self, title: str, work: Callable[[], Any], done: Callable[[Any], None]) -> None:
        def finished(call: Callable[[], None]) -> None:
            self._waiting -= 1
            if self._alive:
                if not self._waiting:
                    self._breath.stop()
                call()

        self._waiting += 1
        self._breath.start()
        self._session.aside(
            title,
            lambda _control: work(),
            done=lambda result: finished(lambda: done(result)),
            failed=lambda error: finished(lambda: self._tell(str(error), Tone.ERROR)),
        )

    def _looked(self, outcome: tuple[ServerChoice, str]) -> None:
        server, keyring = outcome
        self.in_use.setText(in_use(server, dict(os.environ)))
        if keyring and self.place.findData(KEYRING) < 0:
            text = translate("Silo", "the keyring of the system ({name})", name=keyring)
            self.place.insertItem(0, text, KEYRING)
            self.place.setCurrentIndex(0)
        kept = translate("Silo", "unchanged; enter another one to replace it")
        missing = translate("Silo", "none yet: make one on the server's page")
        self.token.setPlaceholderText(kept if server.token else missing)

    def saveSettings(self) -> None:
        """Save what the user entered; FreeCAD calls this for every page, changed or not."""
        before = self._all()
        self._preferences.set("ApiUrl", self.url.text().strip())
        self._preferences.set("SslCertPath", self.certificate.text().strip())
        self._preferences.set("Schema", self.schema.text().strip() or "kindred-rd")
        self._preferences.set("SslVerify", self.verify.isChecked())
        self._preferences.set("MissingLinks", self.missing.currentData())
        for name, box in self.flags.items():
            self._preferences.set(name, box.isChecked())
        token = self.token.text().strip()
        if token and self.place.currentData() == KEYRING:
            self._keep_in_keyring(token)
        elif token:
            self._preferences.set("ApiToken", token)
        if token or self._all() != before:
            self._changed()

    def _all(self) -> tuple[Any, ...]:
        texts = tuple(self._preferences.text(n) for n in ("ApiUrl", "SslCertPath", "Schema", "MissingLinks"))
        return (*texts, *(self._preferences.flag(name) for name in ("SslVerify", *self.flags)))

    def _keep_in_keyring(self, token: str) -> None:
        # The settings are taken over once more when the keyring has the token.
        self._preferences.set("ApiToken", "")
        url, keyring = self.url.text().strip(), self._keyring
        self._session.aside(
            translate("Silo", "Keeping the token"),
            lambda _control: keep_token(keyring, url, token),
            done=lambda _result: self._changed(),
            failed=lambda error: self._session.problem(error),
        )

    # -- testing ----------------------------------------------------------------------------------------

    def test(self) -> None:
        """Ask the server who we are, with the present entries."""
        self._tell(translate("Silo", "Asking the server…"), Tone.QUIET)
        wanted = self._entered()
        preferences, keyring = read_known(self._preferences), self._keyring
        self._ask(
            translate("Silo", "Testing the connection"),
            lambda: test(wanted, preferences, keyring),
            lambda text: self._tell(text, Tone.GOOD),
        )

    def log_in(self) -> None:
        """Get a token through the browser: the user lets FreeCAD in on the server's page."""
        wanted, preferences = self._entered(), read_known(self._preferences)
        self._tell(translate("Silo", "Asking the server…"), Tone.QUIET)

        def opened(login: BrowserLogin) -> None:
            self._tell(
                translate(
                    "Silo",
                    "Let FreeCAD in on the page that opens. It shows the code {code}.",
                    code=login.code,
                ),
                Tone.QUIET,
            )
            if not qt.open_url(login.page):
                self._tell(login.page, Tone.QUIET)
            ask_later(login)

        def ask_later(login: BrowserLogin) -> None:
            qt.later(round(1000 * login.interval_s), lambda: ask(login) if self._alive else None)

        def ask(login: BrowserLogin) -> None:
            title = translate("Silo", "Waiting for the browser")
            self._ask(title, lambda: asked_again(login, wanted, preferences), answered)

        def answered(login: BrowserLogin) -> None:
            if not login.token:
                ask_later(login)
                return
            self.token.setText(login.token)
            self._tell(translate("Silo", "You are logged in. Press OK to keep the token."), Tone.GOOD)

        title = translate("Silo", "Asking for the login page")
        self._ask(title, lambda: begin_login(wanted, preferences), opened)

    def _entered(self) -> ServerPreferences:
        certificate = self.certificate.text().strip()
        verify = (certificate or True) if self.verify.isChecked() else False
        return ServerPreferences(self.url.text().strip(), self.token.text().strip(), verify)

    def _tell(self, text: str, tone: Tone) -> None:
        self.result.setText(spoken(text))
        widgets.paint(self.result, tone)

    def _gone(self) -> None:
        self._alive = False


def _breathe() -> None:
    # FreeCAD's preference window, when a Python command opens it, keeps Python's lock for as long as it is
    # open (measured, 0.20 to 1.1), so no worker could continue; sleeping releases the lock.
    time.sleep(0.003)
