# SPDX-License-Identifier: LGPL-2.1-or-later
"""One job at a time on a vault.

The lock is a file in the vault itself while a job runs, so that jobs of other users and machines see it, as
far as the file system carries locks. Where nothing can be written there, or it carries none, the lock lies in
the user's cache, and the job's report says what that cannot prevent. The lock ends with its process, however
that ends; a file that a killed job left behind holds nothing.
"""

from __future__ import annotations

import errno
import getpass
import hashlib
import os
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from silo.bom.errors import InputError
from silo.folders import cache_folder
from silo.platform import hold_lock

NAME = ".silo-sync.lock"
_TRIES = 5


@contextmanager
def only_job(folder: str) -> Iterator[str]:
    """Keep a second job away from a folder; gives what the lock cannot prevent, "" for nothing.

    Raises InputError with the name of the first one.
    """
    real = Path(os.path.realpath(folder))
    try:
        held, path, doubt = _held(real / NAME, folder), real / NAME, ""
        with suppress(OSError):
            os.chmod(path, 0o666)  # the next job may be another user's
    except OSError as error:
        doubt = (
            f"{folder} cannot be locked ({error.strerror or error}): a job of another user or machine is not "
            "noticed. Two jobs at once cost requests; the BOMs are right all the same."
        )
        name = hashlib.sha256(os.fsencode(real)).hexdigest()[:32]
        path = cache_folder() / "jobs" / f"{name}.lock"
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            held = _held(path, folder)
        except OSError:  # nowhere to lock at all
            yield doubt
            return
    with held:
        held.truncate(0)
        held.write(f"{_who()} since {time.strftime('%Y-%m-%d %H:%M:%S')}\n".encode())
        held.flush()
        with suppress(OSError):  # NFS keeps it here otherwise
            os.fsync(held.fileno())
        try:
            yield doubt
        finally:
            removed = _remove(path)  # before the lock ends: see _held
    if not removed:  # Windows deletes no file that is open
        _remove(path)


def _remove(path: Path) -> bool:
    """Whether it is gone. One that stays holds nothing, so nobody waits for it."""
    try:
        os.unlink(path)
    except FileNotFoundError:
        pass
    except OSError:
        return False
    return True


def _who() -> str:
    try:
        user = getpass.getuser()
    except (OSError, KeyError):  # a container without a user of this number
        user = "an unnamed user"
    return f"process {os.getpid()} of {user} on {socket.gethostname()}"


def _held(path: Path, folder: str) -> BinaryIO:
    """The locked file. Raises InputError where another job has it, OSError where it cannot be locked."""
    if path.is_symlink():  # somebody else's file may be behind it
        raise OSError(errno.ELOOP, f"{path} is a symbolic link")
    for _ in range(_TRIES):
        held = hold_lock(path)
        if held is None:
            who = path.read_text(encoding="utf-8", errors="replace").strip() if path.exists() else ""
            raise InputError(
                f"{folder} is being synced by {who or 'another process'}. Wait for it, or stop it."
            )
        # The job before may have deleted the file while we waited for the lock.
        with suppress(OSError):
            if os.path.samestat(os.fstat(held.fileno()), path.lstat()):
                return held
        held.close()
    raise InputError(f"{folder} is being synced by several processes. Wait for them, or stop them.")
