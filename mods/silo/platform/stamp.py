# SPDX-License-Identifier: LGPL-2.1-or-later
"""The stamp of a file, by which a change is noticed without a read."""

from __future__ import annotations

import os
from pathlib import Path

Stamp = tuple[int, int, int]
"""What changes when a file is written: its time in ns, its size, its number on the disk."""


def stamp_of(path: Path | str | int) -> Stamp | None:
    """Return the stamp of a file, given by its path or its descriptor; None if there is no file."""
    try:
        status = os.stat(path)
    except OSError:
        return None
    return (status.st_mtime_ns, status.st_size, status.st_ino)
