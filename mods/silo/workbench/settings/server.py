# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which server, which token, and who said so.

The server is looked for in the environment, then in the preferences, then in the configuration file of the
command line. A token belongs to the server it was given for and is sent to no other.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Protocol

from silo.workbench.settings.preferences import Preferences


class Origin(StrEnum):
    """Where a setting in use came from."""

    ENVIRONMENT = "environment"
    KEYRING = "keyring"
    PREFERENCES = "preferences"
    FILE = "file"
    NONE = "none"


@dataclass(frozen=True)
class Server:
    """The server in use, and where its address and token come from. ``url`` is "" where none is set up."""

    url: str = ""
    token: str = ""
    verify: bool | str = True
    url_from: Origin = Origin.NONE
    token_from: Origin = Origin.NONE

    def __repr__(self) -> str:
        return f"Server({self.url!r}, token={'set' if self.token else 'none'}, {self.token_from.value})"

    @property
    def configured(self) -> bool:
        """True where there is a server to talk to."""
        return bool(self.url)


class TokenStore(Protocol):
    """A safe place for tokens, such as the keyring of the system."""

    def get(self, url: str) -> str: ...


@dataclass(frozen=True)
class Known:
    """The preferences that choosing a server needs, read once in the GUI thread."""

    url: str = ""
    token: str = field(default="", repr=False)
    verify: bool | str = True


def read_known(preferences: Preferences) -> Known:
    """The server settings of the preference page."""
    certificate = preferences.text("SslCertPath").strip()
    verify: bool | str = certificate or True
    return Known(
        url=preferences.text("ApiUrl").strip(),
        token=preferences.text("ApiToken").strip(),
        verify=verify if preferences.flag("SslVerify") else False,
    )


def choose_server(
    known: Known,
    store: TokenStore,
    env: Mapping[str, str] = os.environ,
    file_server: Any = None,
) -> Server:
    """The server to use.

    file_server
        what :func:`silo.api.config.resolve_server` found in the configuration file (``url``, ``token``,
        ``verify``), or None.
    """
    url, url_from, verify = _choose_url(known, env, file_server)
    if not url:
        return Server()
    token, token_from = _choose_token(url, known, store, env, file_server)
    return Server(url, token, verify, url_from, token_from)


def _choose_url(known: Known, env: Mapping[str, str], file_server: Any) -> tuple[str, Origin, bool | str]:
    if url := env.get("SILO_API_URL", "").strip():
        return url, Origin.ENVIRONMENT, _verify_from(env, known.verify)
    if known.url:
        return known.url, Origin.PREFERENCES, _verify_from(env, known.verify)
    if file_server is not None and file_server.url:
        return file_server.url, Origin.FILE, file_server.verify
    return "", Origin.NONE, True


def _verify_from(env: Mapping[str, str], otherwise: bool | str) -> bool | str:
    from silo.api.config import VERIFY, verify_of  # not before FreeCAD's window stands

    text = env.get(VERIFY, "").strip()
    return verify_of(VERIFY, text) if text else otherwise


def _choose_token(
    url: str, known: Known, store: TokenStore, env: Mapping[str, str], file_server: Any
) -> tuple[str, Origin]:
    if token := env.get("SILO_API_TOKEN", "").strip():
        return token, Origin.ENVIRONMENT
    if token := store.get(url):
        return token, Origin.KEYRING
    if known.token and same_server(url, known.url):
        return known.token, Origin.PREFERENCES
    if file_server is not None and file_server.token and same_server(url, file_server.url):
        return file_server.token, Origin.FILE
    return "", Origin.NONE


def same_server(one: str, other: str) -> bool:
    """True where two addresses, as people write them, mean one server."""
    return bool(one) and one.strip().rstrip("/").lower() == other.strip().rstrip("/").lower()
