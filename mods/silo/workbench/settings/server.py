# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which server, which token, and who said so.

The server is looked for in the environment, then in the preferences, then in the configuration file of the
command line. A token belongs to the server it was given for and is sent to no other.

The system's keyring as a place for API tokens, where there is one that works.

``keyring`` is not among the add-on's dependencies: it is used where the user has it. Its first use may ask
the desktop to unlock something, so all of this belongs in a worker thread.

What the preference page asks of keyring and server, and the words for where settings come from.
"""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Protocol

from silo.bom.errors import AuthError, ConfigError
from silo.workbench.settings import Preferences
from silo.workbench.words import plain, translate

if TYPE_CHECKING:
    from silo.api.client import BrowserLogin

SERVICE = "silo-mod"

# Back ends that refuse everything, or that keep a token where everybody can read it.
_USELESS = ("fail", "null", "plaintext", "chainer_empty")


class Keyring:
    """Tokens by server address. A keyring that does not work holds nothing."""

    def __init__(self, module: Any = None) -> None:
        self._module = module

    def name(self) -> str:
        """Return the name of the keyring; "" if there is none that can be trusted."""
        module = self._load()
        if module is None:
            return ""
        try:
            backend = module.get_keyring()
            usable = float(getattr(backend, "priority", 0)) > 0
        except Exception:  # noqa: BLE001  # back ends raise what they like; without one there is the preference
            return ""
        kind = f"{type(backend).__module__}.{type(backend).__name__}".lower()
        if not usable or any(word in kind for word in _USELESS):
            return ""
        return str(getattr(backend, "name", "") or type(backend).__name__)

    def get(self, url: str) -> str:
        """Read the token that is kept for a server; "" if there is none."""
        if not self.name():
            return ""
        try:
            return str(self._load().get_password(SERVICE, _key(url)) or "").strip()
        except Exception:  # noqa: BLE001  # a locked or broken keyring is no reason to stop
            return ""

    def set(self, url: str, token: str) -> None:
        """Keep a token; "" removes it. :class:`ConfigError` if the keyring refuses it."""
        if not self.name():
            raise ConfigError("this system has no keyring that could keep the token")
        module = self._load()
        try:
            if token:
                module.set_password(SERVICE, _key(url), token)
            elif module.get_password(SERVICE, _key(url)) is not None:
                module.delete_password(SERVICE, _key(url))
        except Exception as error:  # translated for the person who pressed the button
            raise ConfigError(f"the keyring did not keep the token: {error}") from error

    def _load(self) -> Any:
        if self._module is None and importlib.util.find_spec("keyring") is not None:
            import keyring

            self._module = keyring
        return self._module


def _key(url: str) -> str:
    return url.strip().rstrip("/").lower()


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


def is_let_in(login: BrowserLogin, wanted: ServerPreferences, preferences: ServerPreferences) -> bool:
    """Return True if the user has let FreeCAD in. Worker."""
    from silo.api.client import SiloClient

    with SiloClient(wanted.url or preferences.url, login.token, verify=wanted.verify) as client:
        try:
            client.whoami()
        except AuthError:
            return False
    return True


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
