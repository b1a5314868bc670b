# SPDX-License-Identifier: LGPL-2.1-or-later
"""The STEP files in a folder, and the names under which products and files are compared."""

from __future__ import annotations

import os
import re
import unicodedata
from collections.abc import Iterator
from pathlib import Path, PurePosixPath, PureWindowsPath

_STEP_SUFFIXES = (".step", ".stp", ".p21")

MAX_ENTRIES = 20_000
"""Folder entries looked at; a home directory given by mistake must not be searched through."""


def file_key(name: str) -> str:
    """Return a name in the form in which products and files are compared: NFC, case folded, without outer
    blanks.
    """
    return unicodedata.normalize("NFC", name).strip().casefold()


_KIND = re.compile(r"[_.\s](?:prt|asm|part|assembly)(?:\.\d{1,4})?$")


def kindless(key: str) -> str:
    """Return a :func:`file_key` without the kind that some programs add: Pro/E's ``head_back_prt``,
    ``head_back.prt.3``.
    """
    return _KIND.sub("", key) or key


def bare_stem(document: str) -> str:
    """Return the bare name in a path from any system. Its folder is never opened."""
    return PurePosixPath(PureWindowsPath(document).name).stem


def step_files(root: Path, depth: int) -> Iterator[Path]:
    """Yield the STEP files in a folder and ``depth`` levels below, in a fixed order, without links that lead
    outside.
    """
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
            elif item.is_file() and path.suffix.lower() in _STEP_SUFFIXES:
                yield Path(os.path.realpath(path))
