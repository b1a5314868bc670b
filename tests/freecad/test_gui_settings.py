# SPDX-License-Identifier: LGPL-2.1-or-later
"""The preference page: what is entered is kept, and the page says what is in use and where it comes from."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from freecad_cases.machines import MOSTLY_ENDS, MOSTLY_NEWEST
from gui_cases.window import TOKEN, Window, window

VERSIONS = MOSTLY_ENDS

pytestmark = [pytest.mark.freecad, pytest.mark.slow]

NO_ENVIRONMENT = {"SILO_API_URL": "", "SILO_API_TOKEN": ""}

# A keyring of the system, as the real package shows itself; it keeps what it is given in a file.
KEYRING = """
import json, os
PATH = os.path.join(os.environ["SILO_TEST_FOLDER"], "keyring.json")

class Safe:
    name, priority = "Test Safe", 5

def get_keyring():
    return Safe()

def _read():
    return json.load(open(PATH)) if os.path.exists(PATH) else {}

def get_password(service, name):
    return _read().get(service + " " + name)

def set_password(service, name, value):
    known = {**_read(), service + " " + name: value}
    with open(PATH, "w") as file:
        json.dump(known, file)

def delete_password(service, name):
    with open(PATH, "w") as file:
        json.dump({}, file)
"""


@pytest.fixture(name="page", scope="module")
def _page(freecad: Window) -> dict[str, Any]:
    entered = {"SILO_TEST_URL": freecad.server.url, "SILO_TEST_TOKEN": TOKEN}
    said = freecad.run("settings.py", env={**NO_ENVIRONMENT, **entered})
    again = freecad.run("settings.py", env={**NO_ENVIRONMENT, **entered, "SILO_TEST_SECOND": "1"})
    return {**said, "url": freecad.server.url, "again": again}


def test_without_a_server_it_says_how_to_get_one(page: dict[str, Any]) -> None:
    """And FreeCAD's own file is said to be a plain one."""
    assert page["before"]["in_use"] == "No server is set up. To try it out, run: silo-mod serve"
    assert page["before"]["places"] == ["FreeCAD's preferences (a plain file)"]


def test_the_connection_is_tested_with_what_is_entered(page: dict[str, Any]) -> None:
    """Before anything is saved."""
    assert "token" in page["refused"]
    assert page["connected"].startswith("Connected as ")
    assert page["connected"].endswith("the server is in normal mode.")


def test_ok_connects(page: dict[str, Any]) -> None:
    """No restart is needed."""
    assert page["token_from"] == "preferences"


def test_everything_is_there_after_a_restart(page: dict[str, Any]) -> None:
    """Each field; the token itself is never shown."""
    after, before = page["again"]["after"], page["before"]
    assert after["url"] == page["url"]
    assert after["token_shown"] == ""
    assert after["kept_token"] == TOKEN
    assert (after["missing"], after["kept_missing"]) == ("allow", "allow")
    assert (before["verify"], after["verify"]) == (True, False)
    changed = {name: not value for name, value in before["flags"].items()} | {"LiveActivity": True}
    assert after["flags"] == after["kept"] == changed
    assert (
        after["in_use"]
        == f"In use: {page['url']} (from this page). Token: from FreeCAD's preferences, a plain file."
    )


def test_the_environment_wins_and_the_page_says_so(page: dict[str, Any]) -> None:
    """The fields still show what is kept."""
    after = page["again"]["environment"]
    assert after["in_use"] == (
        f"In use: {page['url']} (from the environment variable SILO_API_URL). "
        "Token: from the environment variable SILO_API_TOKEN."
    )
    assert after["url"] == page["url"]


def test_texts_pass_through_qt_translators(page: dict[str, Any]) -> None:
    """FreeCAD loads ours for its language, and any other for the context "Silo"."""
    assert page["translated"] == "COMMIT TO SILO"
    assert page["german"] == ["Teilenummer", "In Silo einchecken"]


def test_the_dock_is_where_the_user_left_it(page: dict[str, Any]) -> None:
    """Hidden until it is first wanted; then FreeCAD keeps its place over a restart."""
    there = {"docks": 1, "title": "Database Activity"}
    assert page["dock"] == {**there, "visible": False, "left": False}
    assert page["again"]["dock"] == {**there, "visible": True, "left": True}


@pytest.mark.parametrize("version", MOSTLY_NEWEST)
def test_a_working_keyring_is_preferred(version: str, tmp_path: Path) -> None:
    """The token goes there, is read there, and is not written into FreeCAD's file."""
    with window(version, tmp_path) as freecad:
        # Each folder in Mod is on FreeCAD's path.
        safe = freecad.home / "Mod" / "AKeyring"
        safe.mkdir()
        (safe / "keyring.py").write_text(KEYRING)
        (safe / "Init.py").write_text("")
        entered = {"SILO_TEST_URL": freecad.server.url, "SILO_TEST_TOKEN": TOKEN}
        said = freecad.run("settings.py", env={**NO_ENVIRONMENT, **entered})
        kept = (freecad.home / "user.cfg").read_text()
    assert said["before"]["places"][0] == "the keyring of the system (Test Safe)"
    assert said["token_from"] == "keyring"
    assert TOKEN not in kept
