# SPDX-License-Identifier: LGPL-2.1-or-later
"""Hashing and checking passwords, as argon2id.

Each hash takes much memory, so that only a few are made at the same time. The time of an answer does not show
whether a user exists.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import cache
from typing import Any

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError

from silo.bom.errors import ConfigError, RejectedError
from silo.bom.message import message
from silo.bom.numbers import whole_number
from silo_server.db.turnstile import Turnstile

MIN_PASSWORD = 10

MAX_PASSWORD = 200

# Each hash holds its memory for as long as it takes.
_HASHING = Turnstile(places=2, waiting=64, seconds=20, who="log-ins")


# [MiB] The default is that of RFC 9106; below the least a stolen database is guessed too fast (OWASP).
PASSWORD_MEMORY, LEAST_PASSWORD_MEMORY, MOST_PASSWORD_MEMORY = 64, 12, 4096


def password_memory(environ: Mapping[str, str]) -> int:
    """Read ``SILO_PASSWORD_MEMORY``: the memory [MiB] that the hash of a password takes, for each process.

    A small machine takes less: two logins at a time each need so much. ConfigError for an unusable number.
    """
    text = environ.get("SILO_PASSWORD_MEMORY", "").strip() or str(PASSWORD_MEMORY)
    memory = whole_number(text, 6)
    if memory is None or not LEAST_PASSWORD_MEMORY <= memory <= MOST_PASSWORD_MEMORY:
        raise ConfigError(
            message(
                "SILO_PASSWORD_MEMORY: wanted {least} to {most} MiB, got {text}",
                least=LEAST_PASSWORD_MEMORY,
                most=MOST_PASSWORD_MEMORY,
                text=repr(text),
            )
        )
    return memory


@cache
def _hasher() -> PasswordHasher:
    return PasswordHasher(memory_cost=password_memory(os.environ) * 1024)


@cache
def _decoy() -> str:
    # Verified if there is no such user, so that the time of the answer gives nothing away.
    with _HASHING.enter():
        return _hasher().hash("a password that nobody has")


def password_fits(claimed: Any, password: str) -> bool:
    """Check if the password is that of an active user; takes as long for an unknown name.

    claimed
        the row of :func:`row_of` for the name that somebody gave.

    Do not call it inside a transaction: a hash takes long, and much memory. BusyError if too many wait.
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
            message(
                "password: wanted {least} to {most} characters, got {length}",
                least=MIN_PASSWORD,
                most=MAX_PASSWORD,
                length=len(password),
            )
        )
    with _HASHING.enter():
        return _hasher().hash(password)
