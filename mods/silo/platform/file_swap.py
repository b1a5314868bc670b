# SPDX-License-Identifier: LGPL-2.1-or-later
"""Replace a file in one step, as each platform does it: with its rights, and while another program looks."""

from __future__ import annotations

import ctypes
import errno
import os
import stat
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from silo.bom.message import message
from silo.platform.system import NAME, WINDOWS

# Another program has the file open: a virus scanner, an indexer, a colleague. ERROR_ACCESS_DENIED,
# ERROR_SHARING_VIOLATION, ERROR_LOCK_VIOLATION of Windows; POSIX has no such error.
_IN_USE = (5, 32, 33)

_IGNORE_MERGE_ERRORS = 0x2  # ReplaceFileW: do not fail if a right cannot be copied

_CANNOT_MERGE = 1175  # ERROR_UNABLE_TO_REMOVE_REPLACED

_COPYFILE_ACL, _COPYFILE_XATTR = 1, 4  # copyfile.h of macOS

_WAITS_S = (0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6)


def patiently(act: Callable[[], None], *, wait: Callable[[float], None] = time.sleep) -> None:
    """Do something to a file that another program may have open for a moment; tries for about 3 s.

    Only Windows refuses this, so it waits only after errors of Windows. Raises OSError as ``act`` does.
    """
    for seconds in _WAITS_S:
        try:
            act()
            return
        except OSError as error:
            if getattr(error, "winerror", None) not in _IN_USE:
                raise
        wait(seconds)
    act()


def copy_rights(source: str, copy: str, *, library: Any = None) -> None:
    """Copy owner, modes, access list and tags of a file to its copy, as far as the system allows it.

    library
        replaces the C library of macOS; None: use it on macOS only. On Windows, :func:`swap` keeps the
        rights.
    """
    status = os.stat(source)
    with suppress(OSError, AttributeError):  # only an administrator may give files away
        os.chown(copy, status.st_uid, status.st_gid)
    with suppress(OSError):  # FAT and some shares have no modes to keep
        os.chmod(copy, stat.S_IMODE(status.st_mode))
    library = library or (ctypes.CDLL("/usr/lib/libSystem.dylib") if NAME == "darwin" else None)
    if library is not None:
        # copyfile(3); Python offers neither access lists nor Finder tags there.
        library.copyfile(os.fsencode(source), os.fsencode(copy), None, _COPYFILE_ACL | _COPYFILE_XATTR)
    elif hasattr(os, "listxattr"):  # Linux keeps access lists there too
        names: list[str] = []
        with suppress(OSError):  # FUSE and CIFS may have no extended attributes
            names = os.listxattr(source)
        for name in names:
            with suppress(OSError):  # some belong to the system
                os.setxattr(copy, name, os.getxattr(source, name))


def swap(source: str, target: str, *, merge: Callable[[str, str], int] | None = None) -> None:
    """Put a new file in the place of an old one. Raises OSError.

    On Windows the file keeps the access list, streams and attributes that it had: ``merge`` replaces the call
    that does this, and returns an error number of Windows or 0.
    """
    merge = merge or (_replace_file if WINDOWS else None)
    code = merge(source, target) if merge is not None else _CANNOT_MERGE
    if code in _IN_USE:
        raise InUseError(code, target)
    if code:  # shares of other systems cannot merge the two
        os.replace(source, target)


def _replace_file(source: str, target: str) -> int:
    windows: Any = ctypes  # its loader is known to type checkers on Windows only
    kernel = windows.WinDLL("kernel32", use_last_error=True)
    done = kernel.ReplaceFileW(target, source, None, _IGNORE_MERGE_ERRORS, None, None)
    return 0 if done else int(windows.get_last_error())


class InUseError(PermissionError):
    """Another program has the file open; :func:`patiently` waits for it."""

    def __init__(self, code: int, path: str) -> None:
        super().__init__(errno.EACCES, message("another program has it open"), path)
        self.winerror = code
