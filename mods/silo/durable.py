# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files that are replaced whole or not at all, or are for their owner only. Standard library only."""

from __future__ import annotations

import json
import os
import stat
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

from silo.platform import patiently, sync_folder

__all__ = [
    "Stamp",
    "private_file",
    "private_folder",
    "read_memory",
    "remove_patiently",
    "replace_patiently",
    "replacing",
    "stamp_of",
    "sync_folder",
    "write_memory",
]

Stamp = tuple[int, int, int]
"""What changes when a file is written: its time in ns, its size, its number on the disk."""


@contextmanager
def replacing(path: Path | str, *, mode: int | None = None) -> Iterator[BinaryIO]:
    """Write the new content of a file: at any moment ``path`` has all of the old content or all of the new.

    The new file can be read by its owner only, unless ``mode`` says otherwise. Where writing fails or the
    block raises, the old content stays and nothing lies beside it. Raises OSError.
    """
    target = Path(path)
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


def read_memory(path: Path) -> dict[str, Any]:
    """What a small JSON file remembers; {} where it is not there, damaged, or no JSON object.

    For files whose loss costs a repeated question and never an answer.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return data if isinstance(data, dict) else {}


def write_memory(path: Path, content: Mapping[str, Any]) -> OSError | None:
    """Write what :func:`read_memory` reads, for its owner only. The error where that is not possible."""
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with replacing(path) as file:
            file.write(json.dumps(content, indent=1, sort_keys=True).encode())
    except OSError as error:
        return error
    return None


def replace_patiently(source: Path | str, target: Path | str) -> None:
    """``os.replace``, which on Windows waits for a program that has the target open. Raises OSError."""
    patiently(lambda: os.replace(source, target))


def remove_patiently(path: Path | str) -> None:
    """Delete a file, which on Windows waits for a program that has it open; none there is fine. OSError."""
    patiently(lambda: Path(path).unlink(missing_ok=True))


def private_folder(path: Path | str) -> None:
    """Make a folder for its owner only, and close one that is there to others. Raises OSError."""
    os.makedirs(path, mode=0o700, exist_ok=True)
    _close_to_others(path)


def private_file(path: Path | str) -> None:
    """Make a file for its owner only, or close the one that is there to others. Raises OSError."""
    os.close(os.open(path, os.O_RDWR | os.O_CREAT, 0o600))
    _close_to_others(path)


def stamp_of(path: Path | str | int) -> Stamp | None:
    """The stamp of a file, by its path or as an open one; None where there is no file."""
    try:
        status = os.stat(path)
    except OSError:
        return None
    return (status.st_mtime_ns, status.st_size, status.st_ino)


def _close_to_others(path: Path | str) -> None:
    mode = stat.S_IMODE(os.stat(path).st_mode)
    if mode & 0o077:
        with suppress(OSError):  # another user's, who has opened it to us
            os.chmod(path, mode & ~0o077)
