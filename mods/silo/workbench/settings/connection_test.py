# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the preference page asks of keyring and server, and the words for where settings come from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from silo.bom.errors import ConfigError
from silo.workbench.settings.keyring import Keyring
from silo.workbench.settings.server import ServerChoice, ServerPreferences, SettingSource, choose_server
from silo.workbench.words import plain, translate

if TYPE_CHECKING:
    from silo.api.client import BrowserLogin


def look(preferences: ServerPreferences, keyring: Keyring) -> tuple[ServerChoice, str]:
    """Find the server in use, and the keyring's name ("" for none). Worker, since a keyring may take its
    time.
    """
    from silo.workbench.settings.command_line import file_server

    return choose_server(preferences, keyring, file_server=file_server()), keyring.name()


def keep_token(keyring: Keyring, url: str, token: str) -> None:
    """Put a token into the keyring. Worker."""
    if not url:
        raise ConfigError(translate("Silo", "Enter the server's address too: a token belongs to its server."))
    keyring.set(url, token)


def test(wanted: ServerPreferences, preferences: ServerPreferences, keyring: Keyring) -> str:
    """Ask the server who we are. Returns the answer in words, or raises the error that explains what is
    wrong. Worker.

    wanted, preferences
        the entries on the page, and what was saved before.
    """
    from silo.api.client import SiloClient
    from silo.workbench.settings.command_line import file_server

    entered = replace(preferences, url=wanted.url or preferences.url, verify=wanted.verify)
    server = choose_server(entered, keyring, file_server=file_server())
    if not server.configured:
        raise ConfigError(translate("Silo", "Enter the address of the server first."))
    with SiloClient(server.url, wanted.token or server.token or None, verify=server.verify) as client:
        user, state = client.whoami(), client.ready()
    name = user.display_name or user.username
    return translate(
        "Silo",
        "Connected as {user} ({role}); the server is in {mode} mode.",
        user=plain(name, 60),
        role=plain(user.role, 30) or "?",
        mode=plain(state.mode, 30),
    )


def begin_login(wanted: ServerPreferences, preferences: ServerPreferences) -> BrowserLogin:
    """Begin a login through the browser, and return its page. Worker."""
    from silo.api.client import SiloClient

    url = wanted.url or preferences.url
    if not url:
        raise ConfigError(translate("Silo", "Enter the address of the server first."))
    with SiloClient(url, None, verify=wanted.verify) as client:
        login = client.begin_login("FreeCAD")
    if login is None:
        text = translate("Silo", "This server has no page for a login. Make a token on its account page.")
        raise ConfigError(text)
    return login


def asked_again(
    login: BrowserLogin, wanted: ServerPreferences, preferences: ServerPreferences
) -> BrowserLogin:
    """Ask if the user has let FreeCAD in; the login has its token then. Worker."""
    from silo.api.client import SiloClient

    with SiloClient(wanted.url or preferences.url, None, verify=wanted.verify) as client:
        return client.asked_again(login)


def in_use(server: ServerChoice, env: Mapping[str, str]) -> str:
    """Say which server and token are in use, and where they come from."""
    if not server.configured:
        return translate("Silo", "No server is set up. To try it out, run: silo-mod serve")
    addresses = {
        SettingSource.ENVIRONMENT: translate("Silo", "from the environment variable SILO_API_URL"),
        SettingSource.PREFERENCES: translate("Silo", "from this page"),
        SettingSource.FILE: translate("Silo", "from the configuration file of silo-mod"),
    }
    tokens = {
        SettingSource.ENVIRONMENT: translate("Silo", "Token: from the environment variable SILO_API_TOKEN."),
        SettingSource.KEYRING: translate("Silo", "Token: from the system's keyring."),
        SettingSource.PREFERENCES: translate("Silo", "Token: from FreeCAD's preferences, a plain file."),
        SettingSource.FILE: translate("Silo", "Token: from the configuration file of silo-mod."),
        SettingSource.NONE: translate("Silo", "Token: none."),
    }
    where = translate("Silo", "In use: {url} ({from}).", url=plain(server.url, 100))
    text = f"{where.replace('{from}', addresses[server.url_from])} {tokens[server.token_from]}"
    if env.get("SILO_SSL_VERIFY", "").strip():
        text += " " + translate("Silo", "SILO_SSL_VERIFY decides about the certificate.")
    return text
