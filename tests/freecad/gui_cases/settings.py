# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: the preference page as a person fills it in; then FreeCAD again, to see what it kept."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

from inside import FOLDER, Gui, QtCore, QtWidgets, addon, run, tell, wait

LEFT = QtCore.Qt.DockWidgetArea.LeftDockWidgetArea
FLAGS = ("AskComment", "SyncBom", "AskRegister", "LiveActivity", "ShowEverywhere")


def on_page(act: Callable[[Any], None]) -> None:
    """Open the preferences at our page by its command, do something there, press OK."""
    met: list[Any] = []

    def look() -> None:
        window = QtWidgets.QApplication.activeModalWidget()
        fields = window.findChildren(QtWidgets.QLineEdit, "url") if window is not None else ()
        if not fields:
            QtCore.QTimer.singleShot(50, look)
            return
        try:
            page = fields[0]
            while page.parentWidget() is not None and page.windowTitle() != "Silo":
                page = page.parentWidget()
            act(page)
            met.append(True)
        except BaseException as problem:  # noqa: BLE001  # raised again below, in the story
            met.append(problem)
        box = window.findChild(QtWidgets.QDialogButtonBox)
        box.button(QtWidgets.QDialogButtonBox.StandardButton.Ok).click()

    QtCore.QTimer.singleShot(100, look)
    Gui.runCommand("Silo_Settings")
    wait(lambda: met)
    if met[0] is not True:
        raise met[0]


def field(page: Any, name: str) -> Any:
    return page.findChild(QtWidgets.QWidget, name)


def in_use(page: Any) -> str:
    """The line that says which server and token are in use; a worker finds it out."""
    label = field(page, "in_use")
    wait(label.text)
    return str(label.text())


def seen(page: Any) -> dict[str, Any]:
    one = addon()
    return {
        "in_use": in_use(page),
        "url": field(page, "url").text(),
        "token_shown": field(page, "token").text(),
        "places": [field(page, "place").itemText(n) for n in range(field(page, "place").count())],
        "schema": field(page, "schema").text(),
        "missing": field(page, "missing").currentData(),
        "verify": field(page, "verify").isChecked(),
        "flags": {name: field(page, name).isChecked() for name in FLAGS},
        "kept": {name: one.preferences.flag(name) for name in FLAGS},
        "kept_missing": one.preferences.text("MissingLinks"),
        "kept_token": one.preferences.text("ApiToken"),
    }


def test_connection(page: Any) -> str:
    field(page, "test").click()
    result = field(page, "result")
    wait(lambda: result.text() and result.text() != "Asking the server…")
    return str(result.text())


def fill_in(page: Any) -> None:
    tell(before=seen(page))
    page.grab().save(str(FOLDER / "settings.png"))
    field(page, "url").setText(os.environ["SILO_TEST_URL"])
    field(page, "token").setText("wrong")
    tell(refused=test_connection(page))
    field(page, "token").setText(os.environ["SILO_TEST_TOKEN"])
    tell(connected=test_connection(page))
    field(page, "schema").setText("kindred-rd")
    field(page, "missing").setCurrentIndex(1)
    field(page, "verify").setChecked(False)
    for name in FLAGS:
        field(page, name).setChecked(not field(page, name).isChecked())
    # Live events stay, or there is nothing to connect to.
    field(page, "LiveActivity").setChecked(True)


def first(one: Any) -> None:
    on_page(fill_in)
    wait(lambda: one.session.shown.connection == "online")
    tell(token_from=one.session.shown.server.token_from.value)
    # The dock is moved; only a normal end of FreeCAD writes down where the docks are.
    Gui.getMainWindow().addDockWidget(LEFT, one.dock)
    one.dock.show_and_raise()
    wait(one.dock.isVisible)


def second(one: Any) -> None:
    found: dict[str, Any] = {}
    on_page(lambda page: found.update(seen(page)))
    wait(lambda: one.session.shown.connection == "online")
    tell(after=found, token_from=one.session.shown.server.token_from.value)
    # The page looks at the environment whenever it opens.
    os.environ["SILO_API_URL"] = os.environ["SILO_TEST_URL"]
    os.environ["SILO_API_TOKEN"] = os.environ["SILO_TEST_TOKEN"]
    environment: dict[str, Any] = {}
    on_page(lambda page: environment.update(seen(page)))
    tell(environment=environment)


def dock() -> dict[str, Any]:
    """Hidden until it is first wanted."""
    window, one = Gui.getMainWindow(), addon().dock
    return {
        "docks": len(window.findChildren(QtWidgets.QDockWidget, "Database Activity")),
        "title": one.windowTitle(),
        "visible": one.isVisible(),
        "left": window.dockWidgetArea(one) == LEFT,
    }


class Loud(QtCore.QTranslator):  # type: ignore[misc]  # PySide has no types
    """A language whose words are English ones, shouted."""

    def translate(self, context: str, text: str, *_more: Any) -> str:
        return text.upper() if context == "Silo" else ""


def translated() -> None:
    """What the add-on says passes through Qt's translators, and is found under its context."""
    from silo.workbench import words

    loud = Loud()
    QtWidgets.QApplication.installTranslator(loud)
    tell(translated=words.translate("Silo", "Commit to Silo"))
    QtWidgets.QApplication.removeTranslator(loud)
    Gui.setLocale("German")
    tell(german=[words.translate("Silo", "Part number"), words.of_command("Origin_Commit", "Commit to Silo")])
    Gui.setLocale("English")


def story() -> None:
    tell(dock=dock())
    if os.environ.get("SILO_TEST_SECOND"):
        second(addon())
    else:
        first(addon())
        translated()
        Gui.getMainWindow().close()


run(story, closes=not os.environ.get("SILO_TEST_SECOND"))
