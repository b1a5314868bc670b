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
from typing import TYPE_CHECKING, Any, Protocol

from silo.workbench.settings.preferences import Preferences

if TYPE_CHECKING:
    pass


class SettingSource(StrEnum):
    """Where a setting in use came from."""

    ENVIRONMENT = "environment"
    KEYRING = "keyring"
    PREFERENCES = "preferences"
    FILE = "file"
    NONE = "none"


@dataclass(frozen=True)
class ServerChoice:
    """The server in use, and where its address and token come from. ``url`` is "" where none is set up."""

    url: str = ""
    token: str = ""
    verify: bool | str = True
    url_from: SettingSource = SettingSource.NONE
    token_from: SettingSource = SettingSource.NONE

    def __repr__(self) -> str:
        return f"Server({self.url!r}, token={'set' if self.token else 'none'}, {self.token_from.value})"

    @property
    def configured(self) -> bool:
        """Return True if a server is configured."""
        return bool(self.url)


class TokenStore(Protocol):
    """A safe place for tokens, such as the keyring of the system."""

    def get(self, url: str) -> str: ...


@dataclass(frozen=True)
class ServerPreferences:
    """The preferences that choosing a server needs, read once in the GUI thread."""

    url: str = ""
    token: str = field(default="", repr=False)
    verify: bool | str = True


def read_known(preferences: Preferences) -> ServerPreferences:
    """Read the server settings of the preference page."""
    certificate = preferences.text("SslCertPath").strip()
    verify: bool | str = certificate or True
    return ServerPreferences(
        url=preferences.text("ApiUrl").strip(),
        token=preferences.text("ApiToken").strip(),
        verify=verify if preferences.flag("SslVerify") else False,
    )


def choose_server(
    preferences: ServerPreferences,
    store: TokenStore,
    env: Mapping[str, str] = os.environ,
    file_server: Any = None,
) -> ServerChoice:
    """Choose the server to use.

    file_server
        what :func:`silo.api.config.resolve_server` found in the configuration file (``url``, ``token``,
        ``verify``), or None.
    """
    from silo.api.address import same_server
    from silo.api.config import TOKEN, URL, first_of

    file_url, file_token = (file_server.url, file_server.token) if file_server is not None else (None, None)
    url, url_from = first_of(
        (SettingSource.ENVIRONMENT, env.get(URL)),
        (SettingSource.PREFERENCES, preferences.url),
        (SettingSource.FILE, file_url),
    )
    if url is None or url_from is None:
        return ServerChoice()
    verify = file_server.verify if url_from is SettingSource.FILE else _verify_from(env, preferences.verify)
    token, token_from = first_of(
        (SettingSource.ENVIRONMENT, env.get(TOKEN)),
        (SettingSource.KEYRING, lambda: store.get(url)),  # which may ask the user
        (SettingSource.PREFERENCES, lambda: preferences.token if same_server(url, preferences.url) else None),
        (SettingSource.FILE, lambda: file_token if same_server(url, file_url) else None),
    )
    return ServerChoice(url, token or "", verify, url_from, token_from or SettingSource.NONE)


def _verify_from(env: Mapping[str, str], otherwise: bool | str) -> bool | str:
    from silo.api.config import VERIFY, verify_of  # not before FreeCAD's window stands

    text = env.get(VERIFY, "").strip()
    return verify_of(VERIFY, text) if text else otherwise
