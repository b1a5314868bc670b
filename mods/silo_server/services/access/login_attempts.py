# SPDX-License-Identifier: LGPL-2.1-or-later
"""The attempts to log in, and how long the next one has to wait.

An attempt is counted before its password is checked, so that attempts at the same time count as well.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from datetime import datetime, timedelta

from sqlalchemy import ColumnElement, delete, func, insert, select, update

from silo.bom.message import message
from silo_server.db.tables import login_attempts
from silo_server.db.transaction import Tx
from silo_server.errors import TooManyAttemptsError
from silo_server.times import stamp

# What an attempt to log in came to. PROVED is remembered for months, as a place that a name logs in from.
PENDING, FAILED, PROVED = "pending", "failed", "proved"


def check_rate(tx: Tx, username: str, address: str) -> None:
    """Raise TooManyAttemptsError if the next try has to wait, longer after each failure.

    One name from one address waits soon. All names from one address, and one name from all addresses, wait
    only if this name has never logged in from this address: so a stranger keeps no user out.
    """
    window, allowed = tx.settings.login_window_seconds, tx.settings.login_failures
    name = login_attempts.c.username_key == username.casefold()[:64]
    place = login_attempts.c.address == address[:64]
    _check_limit(tx, name & place, (PENDING, FAILED), allowed, window)
    proved = select(login_attempts.c.id).where(name, place, login_attempts.c.outcome == PROVED).limit(1)
    if tx.conn.scalar(proved) is None:
        # Those under way are not counted here: many people behind one address may come at once.
        _check_limit(tx, place, (FAILED,), allowed * 4, window)
        _check_limit(tx, name, (FAILED,), allowed * 20, window)


def _check_limit(
    tx: Tx, which: ColumnElement[bool], outcomes: Sequence[str], allowed: int, window: float
) -> None:
    since = stamp(tx.at - timedelta(seconds=window))
    counted = (which, login_attempts.c.outcome.in_(outcomes), login_attempts.c.at > since)
    count, newest = tx.conn.execute(select(func.count(), func.max(login_attempts.c.at)).where(*counted)).one()
    if count < allowed:
        return
    delay = min(window, 8.0 ** min(1 + count - allowed, 9))
    wait = math.ceil(delay - (tx.at - datetime.fromisoformat(newest)).total_seconds())
    if wait > 0:
        raise TooManyAttemptsError(
            message("too many failed logins; try again in {seconds} seconds", seconds=wait), wait
        )


def reserve_attempt(tx: Tx, username: str, address: str) -> int:
    """Record an attempt whose outcome is not known yet; return its id."""
    reserved = {"username_key": username.casefold()[:64], "address": address[:64], "outcome": PENDING}
    attempt: int = tx.conn.execute(
        insert(login_attempts).values(**reserved, at=tx.stamp).returning(login_attempts.c.id)
    ).scalar_one()
    return attempt


def settle_attempt(tx: Tx, attempt: int, outcome: str | None) -> None:
    """Write down the outcome of an attempt. A right password deletes the failed attempts before it."""
    own = tx.conn.execute(select(login_attempts).where(login_attempts.c.id == attempt)).one_or_none()
    if own is None:
        return  # housekeeping deleted it, after a very long wait
    same = (login_attempts.c.username_key == own.username_key) & (login_attempts.c.address == own.address)
    if outcome is None:
        tx.conn.execute(delete(login_attempts).where(login_attempts.c.id == attempt))
        return
    if outcome == PROVED:
        gone = (login_attempts.c.id != attempt) & (login_attempts.c.outcome != PENDING)
        tx.conn.execute(delete(login_attempts).where(same, gone))
    tx.conn.execute(
        update(login_attempts).where(login_attempts.c.id == attempt).values(outcome=outcome, at=tx.stamp)
    )
