# SPDX-License-Identifier: LGPL-2.1-or-later
"""Names in STEP files (which are none, which have lost characters), and which STEP files a folder has."""

from __future__ import annotations

import os
import re
import unicodedata
from collections.abc import Iterator
from pathlib import Path, PurePosixPath, PureWindowsPath

from silo.inertia.model import GeometryCode, GeometryProblem

_GENERIC = re.compile(r"(?:(?:SOLID|COMPOUND|COMPSOLID|SHELL|FACE|WIRE|EDGE|VERTEX)(?:_?\d+)?|=>\[[\d:]*\])?")
_SUFFIXES = (".step", ".stp", ".p21")
MAX_ENTRIES = 20_000
"""Folder entries looked at; a home directory given by mistake must not be searched through."""


def is_generic(name: str) -> bool:
    """True for the names that the kernel makes up: ``SOLID``, ``COMPOUND``, ``=>[0:1:1:14]``, none at all."""
    return _GENERIC.fullmatch(name.strip()) is not None


def lost_characters(name: str) -> list[GeometryProblem]:
    """Exporters put "?" or U+FFFD for what their character set lacks ("Peça" → "Pe?a"); no BOM has that."""
    if "?" not in name and "\ufffd" not in name:
        return []
    words = f"characters of its name were lost in the export: '{name}'"
    return [GeometryProblem(GeometryCode.NAME, words)]


def clean(name: str) -> str:
    """The name without control characters and outer blanks; what it says is kept, mojibake as well."""
    return "".join(c for c in name if unicodedata.category(c)[0] != "C" or c == "\ufffd").strip()


def file_key(name: str) -> str:
    """How a product's name is compared with a file's: NFC, case folded, outer blanks gone."""
    return unicodedata.normalize("NFC", name).strip().casefold()


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
