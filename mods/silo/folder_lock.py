# SPDX-License-Identifier: LGPL-2.1-or-later
"""Whose turn a folder is: a lock that other processes and computers see."""

from __future__ import annotations

import errno
import getpass
import hashlib
import os
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from silo.bom.errors import InputError
from silo.bom.message import message
from silo.bom.system_refusals import why_refused
from silo.platform.locks import hold_lock, shows_locks, stand_in
from silo.platform.spelling import one_path
from silo.platform.user_folders import cache_folder

_TRIES = 100  # of a lock whose file was deleted by its last holder


@contextmanager
def folder_lock(
    folder: str,
    name: str,
    doing: str,
    patience: float = 0.0,
    tell: Callable[[str], object] = lambda _text: None,
) -> Iterator[str]:
    """Hold a folder alone; yields why other computers do not see that, "" if they do.

    The lock is a file in the folder, if its disk supports locks, otherwise in the user's cache, and otherwise
    on this computer's own disk. It ends with its process, however that ends; a file that a killed process
    left holds no lock.

    name, doing
        the lock's file; what is done to the folder ("synced"), for the message to another process.
    tell
        gets that message after 5 seconds, then each minute.

    Raises InputError with the name of the holder, after ``patience`` seconds.
    """
    path, problem = os.path.join(one_path(folder), name), ""
    try:
        held = _held(path, folder, doing, patience, tell)
        with suppress(OSError):
            os.chmod(path, 0o666)  # the next one may be another user
        if not shows_locks(path):
            problem = message("its disk shows locks to this computer alone")
    except FileNotFoundError:  # no such folder: no other program is in it
        yield problem
        return
    except OSError as error:
        problem = why_refused(error)
        inner = cache_folder() / "locks" / f"{hashlib.sha256(os.fsencode(path)).hexdigest()[:32]}.lock"
        try:
            try:
                inner.parent.mkdir(parents=True, exist_ok=True)
                path = str(inner)
                held = _held(path, folder, doing, patience, tell)
            except OSError:  # the cache is on such a disk too
                path = str(stand_in(path))
                held = _held(path, folder, doing, patience, tell)
        except OSError:  # nowhere to lock at all
            yield problem
            return
    with held:
        held.truncate(0)
        held.write(f"{_who()} since {time.strftime('%Y-%m-%d %H:%M:%S')}\n".encode())
        held.flush()
        with suppress(OSError):  # NFS keeps it here otherwise
            os.fsync(held.fileno())
        try:
            yield problem
        finally:
            removed = _remove(path)  # before the lock ends: see _held
    if not removed:  # Windows deletes no file that is open
        _remove(path)


def _remove(path: str) -> bool:
    """Remove a file. Returns False if it stays; it holds no lock then, so no program waits for it."""
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
        user = message("an unnamed user")
    return message(
        "process {getpid} of {user} on {gethostname}",
        getpid=os.getpid(),
        user=user,
        gethostname=socket.gethostname(),
    )


def _held(path: str, folder: str, doing: str, patience: float, tell: Callable[[str], object]) -> BinaryIO:
    """Lock the file and return it. Raises InputError if another process has it, OSError if it cannot be
    locked.
    """
    if os.path.islink(path):  # somebody else's file may be behind it
        raise OSError(errno.ELOOP, message("{path} is a symbolic link", path=path))
    now, deleted = time.monotonic(), 0
    until, due = now + patience, now + 5
    while deleted < _TRIES:
        if (held := hold_lock(path)) is not None:
            # Its last holder may have deleted the file while we waited for the lock.
            with suppress(OSError):
                if os.path.samestat(os.fstat(held.fileno()), os.lstat(path)):
                    return held
            held.close()
            deleted += 1
        elif (now := time.monotonic()) >= min(until, due):
            try:
                who = Path(path).read_text(encoding="utf-8", errors="replace").strip()
            except OSError:  # the holder has just ended
                who = ""
            text = message(
                "{folder} is being {doing} by {who}. Wait for it, or stop it.",
                folder=folder,
                doing=doing,
                who=who or message("another process"),
            )
            if now >= until:
                raise InputError(text)
            tell(text)
            due = now + 60
        time.sleep(0.02 if patience else 0)
    raise OSError(errno.ESTALE, message("its disk returns a different file each time"))
