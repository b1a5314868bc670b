# SPDX-License-Identifier: LGPL-2.1-or-later
"""``doctor --server``: each fault of an installation that the server itself tells of, one at a time.

``tests/server/test_deploy.py`` plants the faults that are seen from outside, behind nginx.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest

from silo.api.wire import SystemState
from silo.bom.errors import ForbiddenError, SiloError
from silo.cli.setup.site_checks import CLAIMED, site

NOW = datetime(2026, 3, 1, 12, tzinfo=UTC)
ADDRESS = "https://silo.invalid"
OUTSIDE = {"TLS", "port 80", "HSTS"}


def stamp(days: float = 0) -> str:
    return (NOW - timedelta(days=days)).isoformat()


GOOD: dict[str, Any] = {
    "at": stamp(),
    "request": {"scheme": "https", "address": "10.1.2.3", "forwarded_for": f"{CLAIMED}, 10.1.2.3"},
    "public_url": ADDRESS,
    "secure_cookies": True,
    "open_secrets": [],
    "free_bytes": 50 << 30,
    "database_bytes": 1 << 30,
    "backup": {"at": stamp(1), "target": "/backups/1", "same_disk": False},
    "restore_tried": {"at": stamp(6), "made_at": stamp(7)},
    "warnings": [],
}


@dataclass
class Told:
    """A server that tells this of itself."""

    state: dict[str, Any]
    base_url: str = ADDRESS
    local: bool = False

    def system(self, forwarded_for: str) -> SystemState:
        assert forwarded_for == CLAIMED
        return SystemState.model_validate(self.state)


def faults(told: Any) -> dict[str, str]:
    found = site(told, True, now=lambda: NOW)
    return {name: str(value) for name, value in found.items() if isinstance(value, SiloError)}


def seen(**request: str) -> dict[str, Any]:
    return {"request": {**GOOD["request"], **request}}


def test_a_good_installation_has_no_fault_but_that_nothing_answers_here() -> None:
    """A name that does not exist is no success of what is looked at from outside."""
    wrong = faults(Told(GOOD))
    assert wrong.keys() == OUTSIDE
    assert all("cannot be looked at" in words for words in wrong.values())


@pytest.mark.parametrize(
    ("name", "planted", "words"),
    [
        ("proxy", {"request": None}, "older than this program"),
        ("proxy", seen(address=CLAIMED), "believes each caller's X-Forwarded-For"),
        ("proxy", seen(forwarded_for=CLAIMED), "does not add the caller"),
        ("proxy", seen(forwarded_for=""), "does not add the caller"),
        ("proxy", seen(scheme="http"), "reached by http: let the proxy send X-Forwarded-Proto"),
        ("proxy", {"public_url": "http://127.0.0.1:8080"}, f"set SILO_PUBLIC_URL to {ADDRESS}"),
        ("cookies", {"secure_cookies": False}, "SILO_SECURE_COOKIES"),
        ("clock", {"at": stamp(-0.01)}, "864 seconds apart"),
        ("backup", {"backup": None}, "there is none"),
        ("backup", {"backup": {**GOOD["backup"], "at": stamp(2.1)}}, "silo-backup.service does not run"),
        ("backup", {"backup": {**GOOD["backup"], "same_disk": True}}, "one broken disk takes both"),
        ("backup", {"backup": {"at": stamp(1)}}, "one broken disk takes both"),
        ("test restore", {"restore_tried": None}, "no backup was ever restored"),
        ("test restore", {"restore_tried": {"at": stamp(8.1)}}, "silo-restore-test.service"),
        ("disk", {"free_bytes": 1 << 29}, "0.5 GB free, wanted 1.1"),
        ("disk", {"free_bytes": 2 << 30, "database_bytes": 3 << 30}, "2.1 GB free, wanted 3.2"),
        ("disk", {"free_bytes": None}, "cannot say"),
        ("secrets", {"open_secrets": ["admin_password"]}, "SILO_ADMIN_PASSWORD is still set"),
        ("secrets", {"open_secrets": ["database_password"]}, "can be guessed"),
        ("secrets", {"open_secrets": ["readable: /srv/silo"]}, "can read /srv/silo; chmod"),
        ("secrets", {"open_secrets": None}, "older than this program"),
        ("start", {"warnings": ["The clock is behind."]}, "The clock is behind."),
    ],
)
def test_each_fault_is_one_sentence(name: str, planted: dict[str, Any], words: str) -> None:
    wrong = faults(Told({**GOOD, **planted}))
    assert wrong.keys() == OUTSIDE | {name}
    assert words in wrong[name]


def test_what_was_not_asked_is_no_success() -> None:
    """Without an administrator's token."""

    class Refusing(Told):
        def system(self, forwarded_for: str) -> SystemState:
            raise ForbiddenError("vera is viewer, this needs admin")

    wrong = faults(Refusing(GOOD))
    assert {"proxy", "cookies", "clock", "backup", "test restore", "disk", "secrets", "start"} <= wrong.keys()
    assert "only an administrator's token" in wrong["backup"]


def test_a_server_of_this_machine_alone_is_not_called_well_set_up() -> None:
    found = site(Told(GOOD, "http://127.0.0.1:8080", local=True), True)  # type: ignore[arg-type]
    assert list(found) == ["network"]
    assert "is not checked" in str(found["network"])
