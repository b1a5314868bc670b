# SPDX-License-Identifier: LGPL-2.1-or-later
"""A program is let in as RFC 8628 has it: it gets a code, a user types it, the program gets a token once."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from hunting import kinds
from server_testing import Databases

from silo.bom.errors import BusyError, ForbiddenError, NotFoundError, RejectedError
from silo_server.actors import Actor, Role, Scope
from silo_server.db.database import Database
from silo_server.run import prepare
from silo_server.services.access.credentials import end_below
from silo_server.services.access.device_logins import (
    MOST_FOR_AN_ADDRESS,
    WAITS_SECONDS,
    Answer,
    Codes,
    allow,
    begin,
    fetch,
    refuse,
    waiting_login,
)
from silo_server.services.access.passwords import password_memory
from silo_server.services.access.sessions import actor_by_session, begin_session
from silo_server.services.access.tokens import actor_by_token, list_tokens
from silo_server.services.access.users import change_user, create_user
from silo_server.settings import Settings

DESK = "10.0.0.1"


class Door:
    """A server's door, with a clock that the test moves on, and a user who is logged in."""

    def __init__(self, url: str, folder: Path) -> None:
        self.now = datetime(2026, 11, 22, tzinfo=UTC)
        self.db = Database(Settings(database_url=url, files_dir=folder), lambda: self.now)
        prepare(self.db)
        with self.db.write() as tx:
            user = create_user(tx, "chief", Role.ADMIN)
            session = begin_session(tx, user.id, user.username)
        actor = actor_by_session(self.db, session.secret, DESK)
        assert actor is not None
        self.chief = actor

    def later(self, seconds: float) -> None:
        self.now += timedelta(seconds=seconds)

    def ask(self, program: str = "FreeCAD", machine: str = "desk", address: str = DESK) -> Codes:
        return begin(self.db, program, machine, address)

    def fetch(self, codes: Codes) -> str:
        return fetch(self.db, codes.device_code, DESK)


@pytest.fixture(params=kinds("sqlite", "postgres"))
def door(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Door]:
    databases = Databases(tmp_path)
    made = Door(databases.new(request.param), tmp_path / "files")
    yield made
    made.db.close()
    databases.close()


def test_a_program_gets_its_token_once(door: Door) -> None:
    """The code is typed in any spelling; the token may write and not more, whoever allowed it."""
    codes = door.ask()
    assert door.fetch(codes) == Answer.PENDING
    with door.db.read(door.chief) as tx:
        seen = waiting_login(tx, codes.user_code.lower().replace("-", " "))
    assert (seen.program, seen.machine, seen.address) == ("FreeCAD", "desk", DESK)
    with door.db.write(door.chief) as tx:
        allow(tx, f" {codes.user_code} ")
    secret = door.fetch(codes)
    actor = actor_by_token(door.db, secret, DESK)
    assert actor is not None
    assert (actor.username, actor.scope, actor.role) == ("chief", Scope.WRITE, Role.EDITOR)
    assert door.fetch(codes) == Answer.ENDED
    with door.db.read(door.chief) as tx:
        (token,) = [token for token in list_tokens(tx) if token.name == "FreeCAD (desk)"]
    assert token.parent is not None
    assert token.parent.credential_id == door.chief.credential_id
    assert token.expires_at is not None


def test_a_code_is_good_for_one_answer(door: Door) -> None:
    """Allowed, it waits for nobody; refused neither."""
    first, second = door.ask(), door.ask()
    with door.db.write(door.chief) as tx:
        allow(tx, first.user_code)
        refuse(tx, second.user_code)
        for codes in (first, second):
            with pytest.raises(NotFoundError):
                allow(tx, codes.user_code)
    assert door.fetch(second) == Answer.REFUSED
    assert door.fetch(second) == Answer.ENDED


def test_a_login_waits_for_ten_minutes(door: Door) -> None:
    """Neither can it be allowed then, nor fetched if it was allowed before."""
    late, fetched_late = door.ask(), door.ask()
    door.later(WAITS_SECONDS - 1)
    with door.db.write(door.chief) as tx:
        allow(tx, fetched_late.user_code)
    door.later(2)
    with door.db.write(door.chief) as tx, pytest.raises(NotFoundError):
        allow(tx, late.user_code)
    assert door.fetch(late) == Answer.ENDED
    assert door.fetch(fetched_late) == Answer.ENDED


def test_a_program_that_asks_too_often_is_slowed_down(door: Door) -> None:
    """By the words of the RFC."""
    codes = door.ask()
    assert door.fetch(codes) == Answer.PENDING
    assert door.fetch(codes) == Answer.SLOW_DOWN
    door.later(60)
    assert door.fetch(codes) == Answer.PENDING


def test_what_ends_the_user_ends_what_the_user_allowed(door: Door) -> None:
    """A leak of the session, and a password that was changed: a program that comes later gets nothing."""
    codes = door.ask()
    with door.db.write(door.chief) as tx:
        allow(tx, codes.user_code)
        assert door.chief.credential_id is not None
        end_below(tx, [door.chief.credential_id])
    assert door.fetch(codes) == Answer.ENDED
    codes = door.ask()
    with door.db.write(door.chief) as tx:
        allow(tx, codes.user_code)
        change_user(tx, "chief", password="a new password")
    assert door.fetch(codes) == Answer.ENDED


def test_a_token_that_may_only_read_lets_nobody_in(door: Door) -> None:
    """It would make a token that may do more."""
    codes = door.ask()
    reader = Actor("chief", Role.VIEWER, door.chief.user_id, scope=Scope.READ, auth_source="token")
    with door.db.write(reader) as tx, pytest.raises(ForbiddenError):
        allow(tx, codes.user_code)
    assert door.fetch(codes) == Answer.PENDING


def test_strangers_cannot_fill_the_table(door: Door) -> None:
    """Each address has so many places; they are free again when the codes are too old."""
    for _ in range(MOST_FOR_AN_ADDRESS):
        door.ask()
    with pytest.raises(BusyError):
        door.ask()
    door.ask(address="10.0.0.2")
    door.later(WAITS_SECONDS + 1)
    door.ask()


@pytest.mark.parametrize(
    ("program", "machine"), [("", "desk"), ("  ", ""), ("x" * 61, ""), ("x", "y" * 61), ("a\x00b", "")]
)
def test_a_name_that_cannot_be_shown_is_refused(door: Door, program: str, machine: str) -> None:
    with pytest.raises(RejectedError):
        door.ask(program, machine)


def test_the_memory_of_a_password_has_bounds() -> None:
    """A hash that takes too little is guessed too fast."""
    assert password_memory({}) == 64
    assert password_memory({"SILO_PASSWORD_MEMORY": "19"}) == 19
    for wrong in ("11", "0", "-1", "many", "1e9", "99999"):
        with pytest.raises(Exception, match="SILO_PASSWORD_MEMORY: wanted 12 to 4096 MiB"):
            password_memory({"SILO_PASSWORD_MEMORY": wrong})
