# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the preference page asks of keyring and server, and the words for where settings come from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from silo.bom.errors import ConfigError
from silo.workbench.settings.server import Known, Origin, Server, choose_server
from silo.workbench.settings.tokens import Keyring
from silo.workbench.words import plain, translate


def look(known: Known, keyring: Keyring) -> tuple[Server, str]:
    """The server in use, and the keyring's name ("" for none). Worker: a keyring may take its time."""
    from silo.workbench.session.online import file_server

    return choose_server(known, keyring, file_server=file_server()), keyring.name()


def keep_token(keyring: Keyring, url: str, token: str) -> None:
    """Put a token into the keyring. Worker."""
    if not url:
        raise ConfigError(translate("Silo", "Enter the server's address too: a token belongs to its server."))
    keyring.set(url, token)


def test(wanted: Known, known: Known, keyring: Keyring) -> str:
    """Ask the server who we are; the answer in words, or the error that explains what is wrong. Worker.

    wanted, known
        what is entered on the page, and what was saved before.
    """
    from silo.api.client import SiloClient
    from silo.workbench.session.online import file_server

    entered = replace(known, url=wanted.url or known.url, verify=wanted.verify)
    server = choose_server(entered, keyring, file_server=file_server())
    if not server.configured:
        raise ConfigError(translate("Silo", "Enter the address of the server first."))
    with SiloClient(server.url, wanted.token or server.token or None, verify=server.verify) as client:
        user, state = client.whoami(), client.ready()
    text = translate("Silo", "Connected as {user} ({role}); the server is in {mode} mode.")
    name = user.display_name or user.username
    return (
        text.replace("{user}", plain(name, 60))
        .replace("{role}", plain(user.role, 30) or "?")
        .replace("{mode}", plain(state.mode, 30))
    )


def in_use(server: Server, env: Mapping[str, str]) -> str:
    """Which server and token are in use, and where they come from."""
    if not server.configured:
        return translate("Silo", "No server is set up. To try it out, run: silo-mod serve")
    where = translate("Silo", "In use: {url} ({from}).").replace("{url}", plain(server.url, 100))
    text = where.replace("{from}", _url_words()[server.url_from])
    text += " " + _token_words()[server.token_from]
    if env.get("SILO_SSL_VERIFY", "").strip():
        text += " " + translate("Silo", "SILO_SSL_VERIFY decides about the certificate.")
    return text


def _url_words() -> dict[Origin, str]:
    return {
        Origin.ENVIRONMENT: translate("Silo", "from the environment variable SILO_API_URL"),
        Origin.PREFERENCES: translate("Silo", "from this page"),
        Origin.FILE: translate("Silo", "from the configuration file of silo-mod"),
        Origin.NONE: "",
        Origin.KEYRING: "",
    }


def _token_words() -> dict[Origin, str]:
    return {
        Origin.ENVIRONMENT: translate("Silo", "Token: from the environment variable SILO_API_TOKEN."),
        Origin.KEYRING: translate("Silo", "Token: from the system's keyring."),
        Origin.PREFERENCES: translate("Silo", "Token: from FreeCAD's preferences, a plain file."),
        Origin.FILE: translate("Silo", "Token: from the configuration file of silo-mod."),
        Origin.NONE: translate("Silo", "Token: none."),
    }
