# SPDX-License-Identifier: LGPL-2.1-or-later
"""The add-on's preferences: one table of names and defaults; an unknown name is an error.

They live in FreeCAD's parameter group ``BaseApp/Preferences/Mod/KindredSilo``, under the names that the
Kindred workbench uses where it has the same setting, so an existing set-up is found.

The server is looked for in the environment, then in the preferences, then in the configuration file of the
command line. A token belongs to the server it was given for and is sent to no other.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Protocol

from silo.bom.errors import ConfigError

GROUP = "User parameter:BaseApp/Preferences/Mod/KindredSilo"

HOLD, ALLOW = "hold", "allow"

DEFAULTS: Mapping[str, str | bool] = {
    "ApiUrl": "",
    "ApiToken": "",
    "SslVerify": True,
    "SslCertPath": "",
    "Schema": "kindred-rd",
    # The BOM sync after a commit; the file revision is uploaded in any case.
    "SyncBom": True,
    # HOLD: a BOM with a broken link waits until the link is mended. ALLOW: it is synced without it.
    "MissingLinks": HOLD,
    "AskComment": True,
    "AskRegister": True,
    "LiveActivity": True,
    "ShowEverywhere": True,
}


class Parameters(Protocol):
    """FreeCAD's ``ParamGet(…)`` object, as far as it is needed here."""

    def GetString(self, name: str, default: str = "", /) -> str: ...

    def SetString(self, name: str, value: str, /) -> None: ...

    def GetBool(self, name: str, default: bool = False, /) -> bool: ...

    def SetBool(self, name: str, value: bool, /) -> None: ...


class Preferences:
    """Typed access to the parameter group."""

    def __init__(self, group: Parameters) -> None:
        self._group = group

    def text(self, name: str) -> str:
        """A text setting."""
        return self._group.GetString(name, str(_default(name, str)))

    def flag(self, name: str) -> bool:
        """A yes/no setting."""
        return self._group.GetBool(name, bool(_default(name, bool)))

    def set(self, name: str, value: str | bool) -> None:
        """Change a setting."""
        _default(name, type(value))
        if isinstance(value, bool):
            self._group.SetBool(name, value)
        else:
            self._group.SetString(name, value)


def _default(name: str, kind: type) -> str | bool:
    default = DEFAULTS.get(name)
    if default is None or type(default) is not kind:
        raise KeyError(f"{name}: no such preference of this kind; there are {', '.join(DEFAULTS)}")
    return default


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
    token: str = ""
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
    word = env.get("SILO_SSL_VERIFY", "").strip().lower()
    if not word:
        return otherwise
    if word in ("1", "true", "yes", "on"):
        return True
    if word in ("0", "false", "no", "off"):
        return False
    raise ConfigError(f"SILO_SSL_VERIFY: wanted true or false, got {word!r}")


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
