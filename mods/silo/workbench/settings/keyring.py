# SPDX-License-Identifier: LGPL-2.1-or-later
"""The system's keyring as a place for API tokens, where there is one that works.

``keyring`` is not among the add-on's dependencies: it is used where the user has it. Its first use may ask
the desktop to unlock something, so all of this belongs in a worker thread.
"""

from __future__ import annotations

import importlib.util
from typing import Any

from silo.bom.errors import ConfigError
from silo.bom.message import message

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
            raise ConfigError(message("this system has no keyring that could keep the token"))
        module = self._load()
        try:
            if token:
                module.set_password(SERVICE, _key(url), token)
            elif module.get_password(SERVICE, _key(url)) is not None:
                module.delete_password(SERVICE, _key(url))
        except Exception as error:  # translated for the person who pressed the button
            raise ConfigError(message("the keyring did not keep the token: {error}", error=error)) from error

    def _load(self) -> Any:
        if self._module is None and importlib.util.find_spec("keyring") is not None:
            import keyring

            self._module = keyring
        return self._module


def _key(url: str) -> str:
    return url.strip().rstrip("/").lower()
