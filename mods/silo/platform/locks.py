# SPDX-License-Identifier: LGPL-2.1-or-later
"""Locks of files, held and asked for: ``fcntl`` on POSIX, ``msvcrt`` on Windows."""

from __future__ import annotations

import errno
import importlib
import os
import re
import struct
from contextlib import suppress
from typing import Any, BinaryIO

from silo.platform.system import NAME

_LOCKED_BYTE = 1 << 30


def is_locked(path: str) -> bool | None:
    """Return True if another process holds a lock on a file; None if this is unknown.

    It takes the lock for a moment. Do not call it for a file that this process has locked: closing the file
    would end that lock.
    """
    try:
        with open(path, "r+b") as file:
            try:
                import fcntl
            except ImportError:
                return _is_locked_on_windows(file.fileno())
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False


def hold_lock(path: str | os.PathLike[str], *, shared: bool = False) -> BinaryIO | None:
    """Lock a file, and make it if it does not exist, for as long as the result stays open.

    shared
        others may hold the lock too, if they share it. Windows has no such lock, and needs none to guard an
        open file, which cannot be deleted there.

    Returns None if another process holds the lock. The lock ends with its process, however that ends. Raises
    OSError.
    """
    file = open(path, "a+b")  # noqa: SIM115
    try:
        try:
            import fcntl
        except ImportError:
            if not shared:
                modes: Any = importlib.import_module("msvcrt")
                file.seek(_LOCKED_BYTE)  # locks of Windows keep others from reading
                modes.locking(file.fileno(), modes.LK_NBLCK, 1)
            return file
        if not NAME.startswith("linux"):
            fcntl.flock(file, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
            return file
        # The kind of lock that servers of NFS and SMB take for their clients: flock(2) does not see those. Of
        # one byte where nothing is read: a lock keeps readers of SMB out.
        kind = fcntl.F_RDLCK if shared else fcntl.F_WRLCK
        wanted = struct.pack("@hhqqi4x", kind, os.SEEK_SET, _LOCKED_BYTE, 1, 0)
        fcntl.fcntl(file, fcntl.F_OFD_SETLK, wanted)
        return file
    except OSError as error:
        file.close()
        if isinstance(error, BlockingIOError | PermissionError) or error.errno in (
            errno.EDEADLK,
            errno.EACCES,
        ):
            return None
        raise


def shows_locks(path: str, mounts: str = "/proc/self/mountinfo") -> bool:
    """Return True if other computers that share the disk see a lock on it. FUSE and shared folders of virtual
    machines do not pass locks on, and report no error.

    mounts
        the system's list of what is mounted where (proc(5)); systems without that share locks.
    """
    kinds = {"/": ""}
    with (
        suppress(OSError, ValueError, IndexError),
        open(mounts, encoding="utf-8", errors="surrogateescape") as file,
    ):
        for line in file:
            words = line.split()
            place = re.sub(r"\\(\d{3})", lambda match: chr(int(match[1], 8)), words[4])
            kinds[place] = words[words.index("-") + 1]
    real = os.path.realpath(path)
    place = max((kind for kind in kinds if kind == "/" or f"{real}/".startswith(f"{kind}/")), key=len)
    return not (kinds[place].startswith("fuse.") or kinds[place] in ("9p", "vboxsf", "virtiofs"))


def _is_locked_on_windows(descriptor: int) -> bool | None:
    try:
        import msvcrt
    except ImportError:
        return None
    modes: Any = msvcrt  # its functions are known to type checkers on Windows only
    try:
        modes.locking(descriptor, modes.LK_NBLCK, 1)
    except OSError:
        return True
    modes.locking(descriptor, modes.LK_UNLCK, 1)
    return False
