# SPDX-License-Identifier: LGPL-2.1-or-later
"""Logins of programs, by RFC 8628: a program asks, a user types its short code on a page, the program gets
a token.

* The server makes both codes: the long one stays with the program, the short one is typed by the user.
* A login waits for ten minutes, and is used once.
* The token may read and write, whatever else its user may, and lives for 90 days.
* The token's credential stands below that of the user who allowed it, from that moment: what ends the user's
  credentials ends a login that the program has not fetched yet.
"""

from __future__ import annotations

import secrets
from dataclasses import dataclass
from datetime import timedelta
from enum import StrEnum

from sqlalchemy import delete, func, insert, select, update

from silo.bom.errors import BusyError, NotFoundError, RejectedError
from silo.bom.message import message
from silo_server.actors import Actor, Role, Scope
from silo_server.db.database import Database
from silo_server.db.tables import device_logins, users
from silo_server.db.transaction import Tx
from silo_server.services.access.credentials import Kind, new_credential
from silo_server.services.access.tokens import (
    PREFIX,
    add_token,
    check_may_change,
    secret_hash,
)
from silo_server.services.audit import note
from silo_server.services.field_checks import text_problem
from silo_server.times import stamp

# What a user has time for: to open the page, to log in there, to type the code.
WAITS_SECONDS = 600
# How often a program asks if it was let in.
INTERVAL_SECONDS = 2
# A program that was let in by its user asks again after so many days.
PROGRAM_DAYS = 90
# Strangers ask too: so many logins wait for one address, and in all.
MOST_FOR_AN_ADDRESS, MOST = 50, 2000
# Letters that make no words and look like no others (RFC 8628, 6.1).
LETTERS, CODE_LENGTH = "BCDFGHJKLMNPQRSTVWXZ", 8
NAME_LENGTH = 60


class Answer(StrEnum):
    """What a program is answered that has no token yet, in the words of RFC 8628, 3.5."""

    PENDING = "authorization_pending"
    SLOW_DOWN = "slow_down"
    REFUSED = "access_denied"
    ENDED = "expired_token"


@dataclass(frozen=True, slots=True)
class Codes:
    """What a program gets when it asks: ``device_code`` is its secret, ``user_code`` is shown."""

    device_code: str
    user_code: str


@dataclass(frozen=True, slots=True)
class DeviceLogin:
    """A login that waits for a user's answer. ``program`` and ``machine`` are the program's own words."""

    user_code: str
    program: str
    machine: str
    address: str
    asked_at: str


def begin(db: Database, program: str, machine: str, address: str) -> Codes:
    """Let a program ask for a login. BusyError if too many wait; RejectedError for an unusable name."""
    for name, value in (("client_id", program), ("machine", machine)):
        if problem := text_problem(value, NAME_LENGTH):
            raise RejectedError(message("{name}: {problem}", name=name, problem=problem))
    if not program.strip():
        raise RejectedError(message("client_id: wanted the name of the program, got none"))
    with db.write(Actor(program.strip(), Role.VIEWER, address=address), even_when_read_only=True) as tx:
        tx.lock("device_logins")
        tx.conn.execute(delete(device_logins).where(device_logins.c.expires_at <= tx.stamp))
        waiting = select(func.count()).select_from(device_logins)
        here = waiting.where(device_logins.c.address == address)
        if tx.conn.scalar(here) >= MOST_FOR_AN_ADDRESS or tx.conn.scalar(waiting) >= MOST:  # type: ignore[operator]
            raise BusyError(
                message(
                    "too many programs wait to be let in; try again in {minutes} minutes",
                    minutes=WAITS_SECONDS // 60,
                )
            )
        device_code = secrets.token_urlsafe(32)
        taken = set(tx.conn.scalars(select(device_logins.c.user_code)))
        user_code = next(code for code in iter(_user_code, "") if code not in taken)
        tx.conn.execute(
            insert(device_logins).values(
                device_hash=secret_hash(device_code),
                user_code=user_code,
                program=program.strip(),
                machine=machine.strip(),
                address=address,
                asked_at=tx.stamp,
                expires_at=stamp(tx.at + timedelta(seconds=WAITS_SECONDS)),
                refused=False,
            )
        )
    return Codes(device_code, shown_code(user_code))


def waiting_login(tx: Tx, typed: str) -> DeviceLogin:
    """Find the login whose code a user typed; NotFoundError if none waits under it."""
    row = tx.conn.execute(
        select(device_logins).where(
            device_logins.c.user_code == plain_code(typed),
            device_logins.c.expires_at > tx.stamp,
            device_logins.c.user_id.is_(None),
            ~device_logins.c.refused,
        )
    ).one_or_none()
    if row is None:
        raise NotFoundError(
            message(
                "no program waits under this code: it was mistyped, was used, or is older than {minutes} "
                "minutes; begin again in the program",
                minutes=WAITS_SECONDS // 60,
            )
        )
    return DeviceLogin(shown_code(row.user_code), row.program, row.machine, row.address, row.asked_at)


def allow(tx: Tx, typed: str) -> DeviceLogin:
    """Let a program in, in the caller's name. NotFoundError if none waits under the code."""
    actor = tx.actor
    check_may_change(actor)
    login = waiting_login(tx, typed)
    expires = stamp(tx.at + timedelta(days=PROGRAM_DAYS))
    if actor.expires_at is not None:
        expires = min(expires, actor.expires_at)
    credential = new_credential(tx, Kind.TOKEN, actor.own_id, _token_name(login), actor.credential_id)
    answer = {"user_id": actor.own_id, "credential_id": credential, "token_expires_at": expires}
    _answer(tx, login, answer)
    note(tx, "program.allowed", _token_name(login))
    return login


def refuse(tx: Tx, typed: str) -> DeviceLogin:
    """Send a program away. NotFoundError if none waits under the code."""
    login = waiting_login(tx, typed)
    _answer(tx, login, {"refused": True})
    note(tx, "program.refused", _token_name(login))
    return login


def fetch(db: Database, device_code: str, address: str) -> str | Answer:
    """Return the secret of the token of a program that was let in, once; else why there is none."""
    of_this = device_logins.c.device_hash == secret_hash(device_code)
    with db.write(Actor("program", Role.VIEWER, address=address), even_when_read_only=True) as tx:
        row = tx.conn.execute(select(device_logins).where(of_this).with_for_update()).one_or_none()
        if row is None or row.expires_at <= tx.stamp:
            return Answer.ENDED
        if row.refused:
            tx.conn.execute(delete(device_logins).where(of_this))
            return Answer.REFUSED
        if row.user_id is None:
            soon = row.polled_at is not None and row.polled_at > stamp(
                tx.at - timedelta(seconds=INTERVAL_SECONDS / 2)
            )
            tx.conn.execute(update(device_logins).where(of_this).values(polled_at=tx.stamp))
            return Answer.SLOW_DOWN if soon else Answer.PENDING
        tx.conn.execute(delete(device_logins).where(of_this))
        if not tx.conn.scalar(select(users.c.active).where(users.c.id == row.user_id)):
            return Answer.REFUSED
        secret = PREFIX + secrets.token_hex(20)
        login = DeviceLogin(row.user_code, row.program, row.machine, row.address, row.asked_at)
        add_token(
            tx,
            row.user_id,
            _token_name(login),
            secret,
            credential=row.credential_id,
            scope=Scope.WRITE,
            expires=row.token_expires_at,
        )
        return secret


def plain_code(typed: str) -> str:
    """Return the letters of a code as it was typed: in any case, with or without the hyphen."""
    return "".join(letter for letter in typed.upper() if letter in LETTERS)


def shown_code(code: str) -> str:
    """Write a code as it is shown: BCDF-GHJK."""
    return f"{code[: CODE_LENGTH // 2]}-{code[CODE_LENGTH // 2 :]}"


def _user_code() -> str:
    return "".join(secrets.choice(LETTERS) for _ in range(CODE_LENGTH))


def _token_name(login: DeviceLogin) -> str:
    return f"{login.program} ({login.machine})" if login.machine else login.program


def _answer(tx: Tx, login: DeviceLogin, answer: dict[str, object]) -> None:
    # Two users who type one code at once: the first answer counts.
    answered = tx.conn.execute(
        update(device_logins)
        .where(
            device_logins.c.user_code == plain_code(login.user_code),
            device_logins.c.user_id.is_(None),
            ~device_logins.c.refused,
        )
        .values(**answer)
    )
    if answered.rowcount != 1:
        waiting_login(tx, login.user_code)
