# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which server, which token, and who said so."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import pytest
from desk import Group

from silo.api.address import same_server
from silo.bom.errors import ConfigError
from silo.workbench.settings.preferences import DEFAULTS, Preferences
from silo.workbench.settings.server import (
    ServerChoice,
    ServerPreferences,
    SettingSource,
    choose_server,
    read_known,
)

HOME, OTHER = "https://silo.example.com", "https://other.example.com"


@dataclass
class Store:
    """A keyring with tokens by address."""

    tokens: dict[str, str]

    def get(self, url: str) -> str:
        return self.tokens.get(url, "")


EMPTY = Store({})


def test_every_preference_has_its_default() -> None:
    """An untouched FreeCAD behaves as the documentation says."""
    preferences = Preferences(Group())
    for name, default in DEFAULTS.items():
        read = preferences.flag if isinstance(default, bool) else preferences.text
        assert read(name) == default


def test_an_unknown_preference_is_an_error() -> None:
    """A misspelled name must not read as a default."""
    preferences = Preferences(Group())
    with pytest.raises(KeyError, match="ApiURL: no such preference"):
        preferences.text("ApiURL")
    with pytest.raises(KeyError, match="SslVerify"):
        preferences.text("SslVerify")
    with pytest.raises(KeyError):
        preferences.set("SyncBom", "yes")


def test_the_certificate_settings_are_one_value() -> None:
    """A file with authorities counts only while certificates are checked at all."""
    preferences = Preferences(Group())
    assert read_known(preferences).verify is True
    preferences.set("SslCertPath", " ca.pem ")
    assert read_known(preferences).verify == "ca.pem"
    preferences.set("SslVerify", False)
    assert read_known(preferences).verify is False


def test_nothing_set_up_is_no_error() -> None:
    """FreeCAD without a server is a normal thing."""
    assert choose_server(ServerPreferences(), EMPTY, {}) == ServerChoice()
    assert not choose_server(ServerPreferences(), EMPTY, {}).configured


ENVIRONMENT, KEYRING, PAGE = SettingSource.ENVIRONMENT, SettingSource.KEYRING, SettingSource.PREFERENCES
MINE = ServerPreferences(HOME, "mine")
# What is set in the environment and in the keyring, and what of it counts.
CASES: dict[str, tuple[dict[str, str], dict[str, str], ServerChoice]] = {
    "preferences alone": ({}, {}, ServerChoice(HOME, "mine", True, PAGE, PAGE)),
    "keyring before preference": ({}, {HOME: "kept"}, ServerChoice(HOME, "kept", True, PAGE, KEYRING)),
    "environment before keyring": (
        {"SILO_API_TOKEN": "here"},
        {HOME: "kept"},
        ServerChoice(HOME, "here", True, PAGE, ENVIRONMENT),
    ),
    "the other server's own token": (
        {"SILO_API_URL": OTHER},
        {HOME: "kept", OTHER: "other"},
        ServerChoice(OTHER, "other", True, ENVIRONMENT, KEYRING),
    ),
    "a token is sent to no other server": (
        {"SILO_API_URL": OTHER},
        {},
        ServerChoice(OTHER, "", True, ENVIRONMENT),
    ),
    "the same server, written otherwise": (
        {"SILO_API_URL": HOME + "/"},
        {},
        ServerChoice(HOME + "/", "mine", True, ENVIRONMENT, PAGE),
    ),
    "environment decides about certificates": (
        {"SILO_SSL_VERIFY": "false"},
        {},
        ServerChoice(HOME, "mine", False, PAGE, PAGE),
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_who_wins(case: str) -> None:
    """Environment, then keyring, then preference; a token belongs to its server."""
    env, tokens, wanted = CASES[case]
    assert choose_server(MINE, Store(tokens), env) == wanted


def test_the_configuration_file_comes_last() -> None:
    """What `silo-mod` uses is found, unless the preferences name another server."""
    file = SimpleNamespace(url=HOME, token="from-file", verify="ca.pem")
    assert choose_server(ServerPreferences(), EMPTY, {}, file) == ServerChoice(
        HOME, "from-file", "ca.pem", SettingSource.FILE, SettingSource.FILE
    )
    chosen = choose_server(ServerPreferences(OTHER), EMPTY, {}, file)
    assert (chosen.url, chosen.token) == (OTHER, "")


def test_a_certificate_setting_nobody_understands_is_reported() -> None:
    """Neither yes nor no must not mean "do not check"."""
    with pytest.raises(ConfigError, match=r"SILO_SSL_VERIFY: wanted true, false or .*; maybe is not a file"):
        choose_server(ServerPreferences(HOME), EMPTY, {"SILO_SSL_VERIFY": "maybe"})


def test_the_variable_may_name_a_file_with_authorities(tmp_path: Path) -> None:
    """As on the command line."""
    authorities = tmp_path / "ca.pem"
    authorities.write_text("")
    chosen = choose_server(ServerPreferences(HOME), EMPTY, {"SILO_SSL_VERIFY": str(authorities)})
    assert chosen.verify == str(authorities)


def test_a_token_is_never_shown() -> None:
    """Not in a log, not in a test's message."""
    assert "secret" not in repr(ServerChoice(HOME, "secret"))


def test_no_address_is_like_no_other() -> None:
    """Two empty settings are not one server."""
    assert not same_server("", "")
