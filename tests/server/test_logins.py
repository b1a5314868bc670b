# SPDX-License-Identifier: LGPL-2.1-or-later
"""How often somebody may try to log in: guesses wait ever longer, the right password gets in."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from hunting import kinds
from server_testing import Databases
from sqlalchemy import func, select

from silo.bom.errors import AuthError, BusyError, ConfigError
from silo_server.actors import Role
from silo_server.db.database import Database
from silo_server.db.tables import api_tokens, login_attempts, users
from silo_server.errors import TooManyAttemptsError
from silo_server.housekeeping import tidy
from silo_server.run import prepare
from silo_server.services.access.configured_token import check_configured_secret
from silo_server.services.access.passwords import _HASHING, _decoy
from silo_server.services.access.sessions import log_in
from silo_server.services.access.tokens import (
    actor_by_token,
    create_token,
    list_tokens,
    revoke_token,
)
from silo_server.services.access.users import change_user, create_user, row_of
from silo_server.services.file_store import FileStore
from silo_server.services.items import NewItem, create_item
from silo_server.settings import Settings

RIGHT, WRONG = "the right password", "a wrong password"
OFFICE, HOME, STRANGER = "10.0.0.1", "10.0.0.2", "10.6.6.6"


class Door:
    """A server's door, with a clock that the test moves on."""

    def __init__(self, url: str, folder: Path) -> None:
        self.now = datetime(2026, 11, 22, tzinfo=UTC)
        self.db = Database(Settings(database_url=url, files_dir=folder), lambda: self.now)
        prepare(self.db)
        with self.db.write() as tx:
            hashed = create_user(tx, "u0", Role.VIEWER, password=RIGHT)
            assert hashed.has_password
            for number in range(1, 40):
                create_user(tx, f"u{number}", Role.VIEWER)
            stored = row_of(tx, "u0").password_hash
            tx.conn.execute(users.update().values(password_hash=stored))

    def knock(self, name: str, address: str, password: str = WRONG) -> str:
        """in, wrong, or the seconds to wait."""
        try:
            log_in(self.db, name, password, address)
        except AuthError:
            return "wrong"
        except TooManyAttemptsError as error:
            return f"wait {error.retry_after}"
        return "in"

    def later(self, seconds: float) -> None:
        self.now += timedelta(seconds=seconds)


# Guesses that come at once are counted by locks, which differ.
@pytest.fixture(params=kinds("sqlite", "postgres"))
def door(request: pytest.FixtureRequest, databases: Databases, tmp_path: Path) -> Iterator[Door]:
    made = Door(databases.new(request.param), tmp_path)
    yield made
    made.db.close()


def test_guesses_of_one_name_from_one_address_wait_ever_longer(door: Door) -> None:
    """Five are free; then 8 s, 64 s, and as long as failures count; not for others, nor elsewhere."""
    said = [door.knock("u1", STRANGER) for _ in range(6)]
    assert said == ["wrong"] * 5 + ["wait 8"]
    assert door.knock("u1", STRANGER, RIGHT) == "wait 8"
    assert door.knock("u1", HOME, RIGHT) == "in"
    assert door.knock("u2", STRANGER, RIGHT) == "in"
    door.later(8)
    assert [door.knock("u1", STRANGER) for _ in range(2)] == ["wrong", "wait 64"]
    door.later(64)
    assert [door.knock("u1", STRANGER) for _ in range(2)] == ["wrong", "wait 300"]
    door.later(301)
    assert [door.knock("u1", STRANGER) for _ in range(2)] == ["wrong", "wrong"]  # the others are too old
    assert door.knock("u1", STRANGER, RIGHT) == "in"


def test_many_wrong_names_hold_back_newcomers_of_their_address_and_nobody_else(door: Door) -> None:
    """An office whose people have logged in before goes on working."""
    assert door.knock("u1", OFFICE, RIGHT) == "in"
    said = [door.knock(f"nobody-{number}", OFFICE) for number in range(21)]
    assert said == ["wrong"] * 20 + ["wait 8"]
    assert door.knock("u1", OFFICE, RIGHT) == "in"
    assert door.knock("u2", OFFICE, RIGHT) == "wait 8"
    assert door.knock("u2", HOME, RIGHT) == "in"
    door.later(8)
    assert door.knock("u2", OFFICE, RIGHT) == "in"


def test_guesses_of_one_name_from_many_addresses_do_not_keep_its_owner_out(door: Door) -> None:
    """They wait themselves, wherever they come from next."""
    assert door.knock("u1", HOME, RIGHT) == "in"
    for number in range(100):
        assert door.knock("u1", f"10.7.0.{number}") == "wrong"
    assert door.knock("u1", "10.8.0.1") == "wait 8"
    assert door.knock("u1", HOME, RIGHT) == "in"
    assert door.knock("u2", "10.8.0.1", RIGHT) == "in"


def test_a_success_gives_the_failures_back(door: Door) -> None:
    """Somebody who mistypes often is not held back for what was settled."""
    for _ in range(3):
        assert [door.knock("u1", HOME) for _ in range(4)] == ["wrong"] * 4
        assert door.knock("u1", HOME, RIGHT) == "in"


def test_thirty_people_behind_one_address_at_once(door: Door) -> None:
    """All of them get in."""
    gate = threading.Barrier(30)

    def come(number: int) -> str:
        gate.wait()
        return door.knock(f"u{number}", OFFICE, RIGHT)

    with ThreadPoolExecutor(30) as pool:
        assert set(pool.map(come, range(30))) == {"in"}


def test_five_impatient_clicks_lock_nobody_out(door: Door) -> None:
    """They all get in, and so does the next one."""
    with ThreadPoolExecutor(5) as pool:
        assert set(pool.map(lambda _: door.knock("u1", HOME, RIGHT), range(5))) == {"in"}
    assert door.knock("u1", HOME, RIGHT) == "in"


def test_guesses_at_the_same_time_are_counted_before_they_are_looked_at(door: Door) -> None:
    """Not more than five of twenty are looked at."""
    gate = threading.Barrier(20)

    def guess(_: int) -> str:
        gate.wait()
        return door.knock("u1", STRANGER)

    with ThreadPoolExecutor(20) as pool:
        said = list(pool.map(guess, range(20)))
    assert said.count("wrong") == 5


def test_who_was_sent_away_has_not_failed(door: Door) -> None:
    """A server that is too busy to look at a password counts nothing."""
    _decoy()
    with _HASHING.enter(), _HASHING.enter():
        _HASHING._seconds, patience = 0.01, _HASHING._seconds
        try:
            for _ in range(10):
                with pytest.raises(BusyError):
                    log_in(door.db, "u1", RIGHT, HOME)
        finally:
            _HASHING._seconds = patience
    assert door.knock("u1", HOME, RIGHT) == "in"


def test_places_are_remembered_for_months_and_failures_are_not(door: Door, tmp_path: Path) -> None:
    """Housekeeping keeps what tells an owner from a stranger."""

    def kept() -> int:
        tidy(door.db, FileStore(tmp_path))
        with door.db.read() as tx:
            return tx.conn.scalar(select(func.count()).select_from(login_attempts)) or 0

    door.knock("u1", HOME, RIGHT)
    door.knock("u1", STRANGER)
    assert kept() == 2
    door.later(3001)
    assert kept() == 1
    door.later(91 * 86400)
    assert kept() == 0


FIRST, SECOND = "silo_" + "1" * 40, "silo_" + "2" * 40


def test_a_new_secret_of_the_environment_replaces_its_predecessor(door: Door) -> None:
    """And a dead one is not announced as if it were good."""

    def works(secret: str) -> bool:
        return actor_by_token(door.db, secret, HOME) is not None

    with door.db.write() as tx:
        _, mine = create_token(tx, 1, "mine")
    for _ in range(2):  # each start gives the same
        assert prepare(door.db, FIRST).token == FIRST
        assert works(FIRST)
    again = prepare(door.db, SECOND)
    assert (again.token, again.warnings) == (SECOND, [])
    assert (works(FIRST), works(SECOND), works(mine)) == (False, True, True)
    old = prepare(door.db, FIRST)
    assert old.token is None
    assert "it was revoked on 2026-11-22" in old.warnings[0]
    assert (works(FIRST), works(SECOND)) == (False, True)
    with door.db.write() as tx:
        tx.conn.execute(api_tokens.update().values(expires_at=tx.stamp, revoked_at=None))
    assert "it ended on" in prepare(door.db, SECOND).warnings[0]
    with door.db.write() as tx:
        create_user(tx, "chief", Role.ADMIN)
        tx.conn.execute(api_tokens.update().values(expires_at=None))
        change_user(tx, "admin", active=False)
        tx.conn.execute(api_tokens.update().values(revoked_at=None))
    assert "its user is not active" in prepare(door.db, SECOND).warnings[0]
    with door.db.write() as tx:
        create_item(tx, NewItem(part_number="P-1"))
    door.later(-3600)
    assert any("The clock is behind" in warning for warning in prepare(door.db, SECOND).warnings)


def test_a_lock_out_keeps_when_a_token_was_revoked_before(door: Door) -> None:
    """The list of tokens says since when each of them lets nobody in."""
    with door.db.write() as tx:
        create_user(tx, "chief", Role.ADMIN)
        before, _ = [create_token(tx, 1, name)[0] for name in ("before", "now")]
        revoke_token(tx, before.id, None)
    door.later(60)
    with door.db.write() as tx:
        change_user(tx, "admin", active=False)
        ended = {token.name: token.revoked_at or "" for token in list_tokens(tx)}
    assert "" < ended["before"] < ended["now"]


@pytest.mark.parametrize(
    ("secret", "problem"),
    [
        ("x", "at least 20 characters, got 1"),
        ("silo_" + "a" * 14, "at least 20 characters, got 19"),
        ("silo_change-me-to-something-long", "a placeholder that others know"),
        ("SILO_CHANGEME_0123456789", "a placeholder"),
        ("your-token-0123456789abcdef", "a placeholder"),
        ("silo_ü" + "a" * 40, "visible ASCII"),
        ("silo_ " + "a" * 40, "visible ASCII"),
    ],
)
def test_a_secret_that_others_know_or_guess_is_refused(secret: str, problem: str) -> None:
    """With the command that makes a good one."""
    with pytest.raises(ConfigError, match=problem) as caught:
        check_configured_secret(secret)
    assert "openssl rand -hex 20" in str(caught.value)
    assert len(secret) == 1 or secret not in str(caught.value)
