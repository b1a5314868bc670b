# SPDX-License-Identifier: LGPL-2.1-or-later
"""Locks of files, held and asked for: ``fcntl`` on POSIX, ``msvcrt`` on Windows."""

from __future__ import annotations

import errno
import hashlib
import importlib
import os
import re
import stat
import struct
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO

from silo.platform.system import NAME

_LOCKED_BYTE = 1 << 30
# What disks answer that have no locks: some network disks, as they are mounted.
_NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP)


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


def hold_lock_here(path: str | os.PathLike[str]) -> BinaryIO | None:
    """Lock a file as :func:`hold_lock` does. If its disk has no locks, a file of this computer stands for it:
    other programs of this computer see that lock, and other computers do not.
    """
    try:
        return hold_lock(path)
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            raise
    return hold_lock(stand_in(path))


def has_locks(path: str | os.PathLike[str]) -> bool:
    """Return False if the disk of a file has no locks. Raises OSError for anything else."""
    try:
        lock = hold_lock(path)
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            raise
        return False
    if lock is not None:
        lock.close()
    return True


def stand_in(path: str | os.PathLike[str]) -> Path:
    """Return the file on this computer's own disk that is locked in place of one whose disk has no locks."""
    user = os.getuid() if hasattr(os, "getuid") else 0
    folder = Path(tempfile.gettempdir(), f"silo-locks-{user}")
    folder.mkdir(mode=0o700, exist_ok=True)
    state = os.lstat(folder)
    if not stat.S_ISDIR(state.st_mode) or (hasattr(os, "getuid") and state.st_uid != user):
        raise OSError(errno.EACCES, os.strerror(errno.EACCES), str(folder))
    name = hashlib.sha256(os.fsencode(os.path.realpath(path))).hexdigest()[:32]
    return folder / f"{name}.lock"


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
