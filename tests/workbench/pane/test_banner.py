# SPDX-License-Identifier: LGPL-2.1-or-later
"""The line at the top of the pane."""

from __future__ import annotations

import pytest

from silo.workbench.activity.box import Do
from silo.workbench.pane.banner import banner
from silo.workbench.session.state import PaneState
from silo.workbench.settings.server import ServerChoice

SERVER = ServerChoice("https://silo.example.com")


@pytest.mark.parametrize(
    ("kind", "words", "stands_out", "offers"),
    [
        ("online", "● Connected to silo.example.com", False, []),
        ("connecting", "Connecting to silo.example.com…", False, []),
        ("read-only", "silo.example.com is read-only now. Commits wait here", True, []),
        ("degraded", "silo.example.com works only in part.", True, []),
        (
            "offline",
            "No connection to silo.example.com. Commits wait here and are sent later.",
            True,
            [Do.RETRY],
        ),
        ("refused", "silo.example.com does not accept the token.", True, [Do.SETTINGS, Do.RETRY]),
        ("unsupported", "silo.example.com sends no live events", False, []),
        ("no-reader", "Live events need the package sseclient-py.", False, [Do.INSTALL, Do.RETRY]),
        ("stopped", "silo.example.com (live events are off)", False, []),
    ],
)
def test_each_state_in_words(kind: str, words: str, stands_out: bool, offers: list[Do]) -> None:
    """What is not as it should be stands out, and offers what a person can do about it."""
    told = banner(PaneState(server=SERVER, connection=kind))
    assert told.text.startswith(words)
    assert bool(told.ground) == bool(told.ink) == stands_out
    assert [action.do for action in told.actions] == offers


def test_the_three_grounds_differ() -> None:
    """Yellow, orange and red, as the Kindred workbench has them."""
    kinds = ("read-only", "degraded", "offline")
    assert len({banner(PaneState(server=SERVER, connection=kind)).ground for kind in kinds}) == len(kinds)


def test_without_a_server_the_settings_are_offered() -> None:
    """The first thing that a new user sees."""
    told = banner(PaneState())
    assert told.text == "No Silo server is set up yet."
    assert [action.do for action in told.actions] == [Do.SETTINGS]


def test_why_there_is_no_connection_is_reported_and_harmless() -> None:
    """The reason comes from outside."""
    told = banner(PaneState(server=SERVER, connection="offline", reason="\x1b[31mno\nroute " + "x" * 1000))
    reason = told.text.split("\n", 1)[1]
    assert reason.startswith("[31mno route xxx")
    assert len(reason) <= 300
    assert "\x1b" not in told.text


def test_a_package_that_cannot_be_imported_is_a_sentence_with_its_button() -> None:
    """Also while no server is set up."""
    told = banner(
        PaneState(connection="packages", reason="FreeCAD's Python cannot import the package pydantic: x")
    )
    assert "pydantic" in told.text
    assert [action.do for action in told.actions] == [Do.INSTALL, Do.RETRY]
