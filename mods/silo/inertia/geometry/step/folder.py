# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which STEP files lie in a folder, and what a file is called that some other system named."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path, PurePosixPath, PureWindowsPath

_SUFFIXES = (".step", ".stp", ".p21")
MAX_ENTRIES = 20_000
"""Folder entries looked at; a home directory given by mistake must not be searched through."""


def bare_stem(document: str) -> str:
    """The bare name in a path that some system wrote: the folder it names is never followed."""
    return PurePosixPath(PureWindowsPath(document).name).stem


def step_files(root: Path, depth: int) -> Iterator[Path]:
    """STEP files in a folder and ``depth`` levels below, links that leave it left out, in a fixed order."""
    seen = 0
    waiting = [(root, 0)]
    while waiting:
        folder, level = waiting.pop(0)
        try:
            entries = sorted(os.scandir(folder), key=lambda e: e.name)
        except OSError:
            continue
        for item in entries:
            seen += 1
            if seen > MAX_ENTRIES:
                return
            path = Path(item.path)
            if item.is_symlink() and not Path(os.path.realpath(path)).is_relative_to(root):
                continue
            if item.is_dir() and level < depth:
                waiting.append((path, level + 1))
            elif item.is_file() and path.suffix.lower() in _SUFFIXES:
                yield Path(os.path.realpath(path))
