# SPDX-License-Identifier: LGPL-2.1-or-later
"""Hashing and checking passwords, as argon2id.

Each hash takes 64 MiB, so that only a few are made at the same time. The time of an answer does not show
whether a user exists.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError

from silo.bom.errors import RejectedError
from silo_server.db.turnstile import Turnstile

MIN_PASSWORD = 10

MAX_PASSWORD = 200

# Each hash takes 64 MiB for as long as it takes.
_HASHING = Turnstile(places=2, waiting=64, seconds=20, who="log-ins")


@cache
def _hasher() -> PasswordHasher:
    return PasswordHasher()


@cache
def _decoy() -> str:
    # Verified if there is no such user, so that the time of the answer gives nothing away.
    with _HASHING.enter():
        return _hasher().hash("a password that nobody has")


def password_fits(claimed: Any, password: str) -> bool:
    """Check if the password is that of an active user; takes as long for an unknown name.

    claimed
        the row of :func:`row_of` for the name that somebody gave.

    Do not call it inside a transaction: a hash takes long, and 64 MiB. BusyError if too many wait.
    """
    stored = claimed.password_hash if claimed is not None else None
    checked = stored or _decoy()  # before a place is taken: the decoy takes one of its own
    with _HASHING.enter():
        try:
            _hasher().verify(checked, password[:MAX_PASSWORD])
        except (VerificationError, InvalidHashError):
            return False
    return bool(stored and claimed.active)


def hash_password(password: str) -> str:
    """Hash a password with argon2id; RejectedError if it is too short or absurdly long."""
    if not MIN_PASSWORD <= len(password) <= MAX_PASSWORD:
        raise RejectedError(
            f"password: wanted {MIN_PASSWORD} to {MAX_PASSWORD} characters, got {len(password)}"
        )
    with _HASHING.enter():
        return _hasher().hash(password)
