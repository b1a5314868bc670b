# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files as Windows has them, for tests on Linux: ``pytest -p windows_files``.

- A file that this process has open can be neither replaced, renamed nor deleted (a sharing violation).
- A virus scanner looks at every new file: the first try to replace or delete it fails, the next one works.
- There is no ``fcntl`` and no ``resource``, but the locks of ``msvcrt``; ``os`` lacks what only POSIX has.

What Windows does beyond that (paths, modes, processes) is not simulated.
"""

from __future__ import annotations

import os
import sys
import types
from collections.abc import Callable
from typing import Any

_POSIX_ONLY = ("fchmod", "fchown", "killpg", "setsid")
_HIDDEN = ("fcntl", "resource")
# Libraries may do as they like, those of the tests and those that we call.
_OURS = (os.sep + "silo" + os.sep, os.sep + "silo_server" + os.sep)


class SharingViolation(PermissionError):
    """ERROR_SHARING_VIOLATION: another program, or this one, has the file open."""

    winerror = 32

    def __init__(self, path: str) -> None:
        super().__init__(13, "The process cannot access the file because it is being used", path)


_scanned: set[tuple[int, int]] = set()


def _open_here(path: str) -> bool:
    try:
        wanted = os.stat(path, follow_symlinks=False)
    except OSError:
        return False
    for name in os.listdir("/proc/self/fd"):
        try:
            found = os.stat(f"/proc/self/fd/{name}")
        except OSError:
            continue
        if os.path.samestat(found, wanted):
            return True
    return False


def _by_us(depth: int = 3) -> bool:
    frame: Any = sys._getframe(depth)
    while frame is not None:
        name = frame.f_code.co_filename
        if any(part in name for part in _OURS):
            return True
        if os.sep + "tests" + os.sep in name or os.sep + "site-packages" + os.sep in name:
            return False
        frame = frame.f_back
    return False


def _check(path: Any) -> None:
    text = os.fspath(path)
    if not isinstance(text, str) or not os.path.isfile(text) or not _by_us():
        return
    status = os.stat(text)
    key = (status.st_dev, status.st_ino)
    first, _ = key not in _scanned, _scanned.add(key)
    if first or _open_here(text):
        raise SharingViolation(text)


def _guarded(act: Callable[..., Any], places: int) -> Callable[..., Any]:
    def guarded(*words: Any, **options: Any) -> Any:
        if not options:  # a path below an open folder is not looked at
            for path in words[:places]:
                _check(path)
        return act(*words, **options)

    return guarded


def _lend_locks() -> None:
    """``msvcrt`` with its locks, as far as they are used: one holder, also within a process."""
    import fcntl

    def locking(descriptor: int, mode: int, _bytes: int) -> None:
        how = fcntl.LOCK_UN if mode == msvcrt.LK_UNLCK else fcntl.LOCK_EX | fcntl.LOCK_NB
        try:
            fcntl.flock(descriptor, how)
        except BlockingIOError:
            raise PermissionError(13, "Permission denied") from None

    msvcrt: Any = types.ModuleType("msvcrt")
    msvcrt.LK_UNLCK, msvcrt.LK_NBLCK, msvcrt.locking = 0, 2, locking
    sys.modules["msvcrt"] = msvcrt


def pytest_configure() -> None:
    """Put it in place before our modules are imported."""
    _lend_locks()
    for name in _HIDDEN:
        sys.modules[name] = None  # type: ignore[assignment]
    for name in _POSIX_ONLY:
        if hasattr(os, name):
            delattr(os, name)
    for name, places in (("replace", 2), ("rename", 2), ("unlink", 1), ("remove", 1)):
        setattr(os, name, _guarded(getattr(os, name), places))
