# SPDX-License-Identifier: LGPL-2.1-or-later
"""The system's keyring, where it works."""

from __future__ import annotations

import pytest

from silo.bom.errors import ConfigError
from silo.workbench.settings.keyring import SERVICE, Keyring

URL = "https://silo.example.com"


class Backend:
    """A keyring's back end, as the ``keyring`` package has them."""

    name = "Secret Service"
    priority: float = 5


class FailKeyring(Backend):
    """What ``keyring`` uses where there is nothing; its name says it."""

    priority = 0


class PlaintextKeyring(Backend):
    """Keeps tokens where everybody can read them."""


class Module:
    """The ``keyring`` package."""

    def __init__(self, backend: Backend | None = None, *, broken: bool = False) -> None:
        self.backend, self.broken = backend or Backend(), broken
        self.kept: dict[tuple[str, str], str] = {}

    def get_keyring(self) -> Backend:
        if self.broken:
            raise RuntimeError("no session bus")
        return self.backend

    def get_password(self, service: str, user: str) -> str | None:
        return self.kept.get((service, user))

    def set_password(self, service: str, user: str, password: str) -> None:
        self.kept[service, user] = password

    def delete_password(self, service: str, user: str) -> None:
        del self.kept[service, user]


def test_a_token_is_kept_per_server() -> None:
    """However its address is written."""
    module = Module()
    keyring = Keyring(module)
    keyring.set(URL + "/", "silo_1")
    assert keyring.get(URL.upper()) == "silo_1"
    assert keyring.get("https://other.example.com") == ""
    assert module.kept == {(SERVICE, URL): "silo_1"}


def test_an_empty_token_removes_the_kept_one() -> None:
    """And removing what is not there is harmless."""
    keyring = Keyring(Module())
    keyring.set(URL, "silo_1")
    keyring.set(URL, "")
    keyring.set(URL, "")
    assert keyring.get(URL) == ""


@pytest.mark.parametrize(
    "module",
    [Module(FailKeyring()), Module(PlaintextKeyring()), Module(broken=True)],
    ids=["fail", "plain", "bus"],
)
def test_a_keyring_that_does_not_work_keeps_nothing(module: Module) -> None:
    """It has no name, gives nothing, and says so when it is asked to keep something."""
    keyring = Keyring(module)
    assert keyring.name() == ""
    assert keyring.get(URL) == ""
    with pytest.raises(ConfigError, match="no keyring"):
        keyring.set(URL, "silo_1")


def test_a_keyring_that_refuses_is_reported() -> None:
    """A locked keyring's own words reach the person."""

    class Locked(Module):
        def set_password(self, service: str, user: str, password: str) -> None:
            raise RuntimeError("locked")

    with pytest.raises(ConfigError, match="the keyring did not keep the token: locked"):
        Keyring(Locked()).set(URL, "silo_1")


def test_a_working_keyring_has_a_name() -> None:
    """The preference page shows it."""
    assert Keyring(Module()).name() == "Secret Service"
