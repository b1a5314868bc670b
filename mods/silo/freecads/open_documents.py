# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which files a running FreeCAD of this user has open: it would later overwrite what we write there.

FreeCAD (0.20 to 1.1) keeps a folder ``<program>_Doc_<Uid>_<hash>_<number>`` in its cache for each open
document, the hash being the first six digits of the SHA-1 of the file's path, and holds a lock on
``<program>_<number>.lock`` while it runs (App/Document.cpp, Gui/Application.cpp; seen in all three). Where
the platform cannot say whether a lock is held, nothing is known and nothing is reported; the same goes for a
FreeCAD of another user or machine. Standard library only.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterable
from pathlib import Path

from silo.freecads.places import cache_folders
from silo.platform.locks import is_locked

_FOLDER = re.compile(r"(?P<program>.+)_Doc_[0-9a-fA-F-]{36}_(?P<hash>[0-9a-f]{6})_(?P<number>\d+)")


class OpenInFreecad:
    """What the FreeCADs that use these cache folders have open now.

    but_not
        the number of a FreeCAD that does not count; by default this process, should it be one. Our own lock
        must not even be looked at, since closing the file would give the lock up.
    """

    def __init__(self, caches: Iterable[str | Path], but_not: str = str(os.getpid())) -> None:
        self._hashes = frozenset(digest for cache in caches for digest in _open_in(cache, but_not))

    def has(self, *paths: str) -> bool:
        """Return True if FreeCAD has the file open under one of these spellings."""
        return any(
            hashlib.sha1(os.fsencode(path), usedforsecurity=False).hexdigest()[:6] in self._hashes
            for path in paths
            if path
        )

    def has_file(self, path: str) -> bool:
        """Return True if FreeCAD has the file open under its given, its absolute or its real path.

        FreeCAD writes "/" on Windows too.
        """
        absolute = os.path.abspath(path)
        spellings = (path, absolute, os.path.realpath(path))
        return self.has(*spellings, *(spelt.replace("\\", "/") for spelt in spellings))


def open_in_any() -> OpenInFreecad:
    """Find what any FreeCAD of this user has open now."""
    return OpenInFreecad(cache_folders())


def open_in_others(own_folder: str) -> OpenInFreecad:
    """Find what FreeCADs other than this one have open now.

    own_folder
        the cache folder of a document that is open here (``Document.TransientDir``); without it, nothing is
        found.
    """
    cache, name = os.path.split(own_folder.rstrip("/\\"))
    own = _FOLDER.fullmatch(name)
    return OpenInFreecad((), "") if own is None else OpenInFreecad((cache,), own["number"])


def _open_in(cache: str | Path, but_not: str) -> frozenset[str]:
    try:
        names = os.listdir(cache)
    except OSError:
        return frozenset()
    matches = [match for name in names if (match := _FOLDER.fullmatch(name)) and match["number"] != but_not]
    locks = {f"{match['program']}_{match['number']}.lock" for match in matches}
    alive = {lock for lock in locks if is_locked(os.path.join(cache, lock))}
    # A folder whose lock is free is what a FreeCAD that crashed has left behind.
    return frozenset(m["hash"] for m in matches if f"{m['program']}_{m['number']}.lock" in alive)
