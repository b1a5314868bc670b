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
    from silo.api.config import TOKEN, URL, first_of, same_server  # not before FreeCAD's window stands

    file_url, file_token = (file_server.url, file_server.token) if file_server is not None else (None, None)
    url, url_from = first_of(
        (Origin.ENVIRONMENT, env.get(URL)), (Origin.PREFERENCES, known.url), (Origin.FILE, file_url)
    )
    if url is None or url_from is None:
        return Server()
    verify = file_server.verify if url_from is Origin.FILE else _verify_from(env, known.verify)
    token, token_from = first_of(
        (Origin.ENVIRONMENT, env.get(TOKEN)),
        (Origin.KEYRING, lambda: store.get(url)),  # which may ask the user
        (Origin.PREFERENCES, lambda: known.token if same_server(url, known.url) else None),
        (Origin.FILE, lambda: file_token if same_server(url, file_url) else None),
    )
    return Server(url, token or "", verify, url_from, token_from or Origin.NONE)


def _verify_from(env: Mapping[str, str], otherwise: bool | str) -> bool | str:
    from silo.api.config import VERIFY, verify_of  # not before FreeCAD's window stands

    text = env.get(VERIFY, "").strip()
    return verify_of(VERIFY, text) if text else otherwise
