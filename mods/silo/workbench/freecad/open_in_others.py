# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which files another FreeCAD of this user has open: what we save, that one would overwrite later.

FreeCAD (0.20 to 1.1) keeps a folder ``<program>_Doc_<Uid>_<hash>_<number>`` in its cache for each open
document, the hash being the first six digits of the SHA-1 of the file's path, and holds a lock on
``<program>_<number>.lock`` while it runs (App/Document.cpp, Gui/Application.cpp; seen in all three). Where
the platform cannot say whether a lock is held, nothing is known and nothing is said.
"""

from __future__ import annotations

import hashlib
import os
import re

from silo.platform import is_locked

_FOLDER = re.compile(r"(?P<program>.+)_Doc_[0-9a-fA-F-]{36}_(?P<hash>[0-9a-f]{6})_(?P<number>\d+)")


class OpenInOthers:
    """What other FreeCADs have open now.

    own_folder
        the cache folder of a document that is open here (``Document.TransientDir``). Our own lock must not
        even be looked at, since closing the file would give the lock up; without this, nothing is said.
    """

    def __init__(self, own_folder: str) -> None:
        self._hashes: frozenset[str] = frozenset()
        cache, name = os.path.split(own_folder.rstrip("/\\"))
        own = _FOLDER.fullmatch(name)
        if own is not None:
            self._hashes = _open_in_others(cache, own["number"])

    def has(self, *paths: str) -> bool:
        """True where a file, by any of these spellings, is open in another FreeCAD."""
        return any(_hash(path) in self._hashes for path in paths if path)


def _hash(path: str) -> str:
    return hashlib.sha1(os.fsencode(path), usedforsecurity=False).hexdigest()[:6]


def _open_in_others(cache: str, own: str) -> frozenset[str]:
    try:
        names = os.listdir(cache)
    except OSError:
        return frozenset()
    found = [match for name in names if (match := _FOLDER.fullmatch(name)) and match["number"] != own]
    locks = {f"{match['program']}_{match['number']}.lock" for match in found}
    alive = {lock for lock in locks if is_locked(os.path.join(cache, lock))}
    # A folder whose lock is free is what a FreeCAD that crashed has left behind.
    return frozenset(m["hash"] for m in found if f"{m['program']}_{m['number']}.lock" in alive)
