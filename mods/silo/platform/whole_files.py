# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files that are replaced whole or not at all, or are for their owner only."""

from __future__ import annotations

import errno
import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from silo.platform.file_swap import patiently
from silo.platform.system import WINDOWS


def sync_folder(folder: str | os.PathLike[str]) -> None:
    """Put the names in a folder on disk, since a rename is on disk only with its folder. Raises OSError.

    Some shares and FUSE disks cannot do that for a folder. That is no error, since nothing more can be done.
    """
    if WINDOWS:  # it neither needs nor allows that
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP, errno.ENOSYS, errno.EBADF):
            raise
    finally:
        os.close(handle)


def scratch_folder(prefix: str, parent: Path | str | None = None) -> tempfile.TemporaryDirectory[str]:
    """Make a temporary folder, as a context manager of its path; below ``parent``, or where the system has
    them.

    A file in it that another program still has open (Windows) stays, and is no error.
    """
    return tempfile.TemporaryDirectory(prefix=prefix, dir=parent, ignore_cleanup_errors=True)


def nearest_folder(path: Path) -> Path:
    """Return the path, or the nearest folder above it that exists."""
    while not path.exists() and path != path.parent:
        path = path.parent
    return path


@contextmanager
def replacing(path: Path | str, *, mode: int | None = None) -> Iterator[BinaryIO]:
    """Write the new content of a file: at any moment ``path`` has all of the old content or all of the new.

    The new file can be read by its owner only, unless ``mode`` says otherwise. If writing fails or the block
    raises, the old content stays, and no other file remains beside it. A pipe or a device, such as /dev/null,
    is written into and never replaced. Raises OSError.
    """
    target = Path(path)
    if _is_special(target):
        with open(target, "wb") as file:
            yield file
        return
    # Beside the target, so that the rename at the end stays within one file system.
    handle, temporary = tempfile.mkstemp(prefix=f".{target.name[:50]}.", suffix=".part", dir=target.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        if mode is not None:
            os.chmod(temporary, mode)
        replace_patiently(temporary, target)
    except BaseException:
        with suppress(OSError):  # the first error is the one to report
            remove_patiently(temporary)
        raise
    sync_folder(target.parent)


def _is_special(path: Path) -> bool:
    """Return True for a pipe, a device or a socket: what is there, and is neither a file nor a folder."""
    try:
        mode = path.stat().st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def replace_patiently(source: Path | str, target: Path | str) -> None:
    """Replace a file; on Windows wait for a program that has the target open. Raises OSError."""
    patiently(lambda: os.replace(source, target))


def remove_patiently(path: Path | str) -> None:
    """Delete a file; on Windows wait for a program that has it open. No file is fine. Raises OSError."""
    patiently(lambda: Path(path).unlink(missing_ok=True))


def private_folder(path: Path | str) -> None:
    """Make a folder that only its owner can read, or close an existing one to others. Raises OSError."""
    os.makedirs(path, mode=0o700, exist_ok=True)
    _close_to_others(path)


def private_file(path: Path | str) -> None:
    """Make a file that only its owner can read, or close an existing one to others. Raises OSError."""
    os.close(os.open(path, os.O_RDWR | os.O_CREAT, 0o600))
    _close_to_others(path)


def _close_to_others(path: Path | str) -> None:
    mode = stat.S_IMODE(os.stat(path).st_mode)
    if mode & 0o077:
        with suppress(OSError):  # another user's, who has opened it to us
            os.chmod(path, mode & ~0o077)
