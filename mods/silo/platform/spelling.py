# SPDX-License-Identifier: LGPL-2.1-or-later
"""One path per file: without symlinks, each name as its folder lists it.

Windows and macOS find ``Part.FCStd`` under ``part.fcstd`` too, and macOS finds a name in any Unicode normal
form. Two spellings are one file there, and must be one component and one item. Such a disk is recognised by
asking it, not by the platform: Linux mounts such disks, and macOS can have case-sensitive ones."""

from __future__ import annotations

import os
import stat
import string
import unicodedata
from typing import NamedTuple

_LISTED_AT_MOST = 50_000

# Disks differ in what is another case of ß or µ, never of A to Z.
_OTHER_CASE = str.maketrans(string.ascii_letters, string.ascii_letters.swapcase())


class Spelt(NamedTuple):
    """A path. ``plain`` is its real path in the spelling asked for, ``path`` in that of the folders."""

    path: str
    plain: str
    there: bool


class Spelling:
    """Finds the one path of a file; remembers folders for one session."""

    def __init__(self) -> None:
        self._folders: dict[str, tuple[str, str]] = {}
        self._canonical: dict[str, str] = {}
        self._exact: set[str] = set()  # folders that find a name only in its own spelling
        self._listings: dict[str, dict[str, list[tuple[str, int]]]] = {}

    def real(self, path: str) -> str:
        """Return ``os.path.realpath`` with each name as its folder lists it; also for paths where
        nothing is.
        """
        return self.look(os.path.abspath(path)).path

    def look(self, path: str) -> Spelt:
        """Do the same for an absolute path; also return the path before respelling, and if anything is
        there.
        """
        folder, name = os.path.split(path)
        if not name:
            real = os.path.realpath(path)
            return Spelt(self._as_listed(real), real, os.path.lexists(real))
        if folder not in self._folders:
            plain = os.path.realpath(folder)
            self._folders[folder] = plain, self._as_listed(plain)
        plain, real_folder = self._folders[folder]
        candidate = os.path.join(real_folder, name)
        try:
            status = os.lstat(candidate)
        except (OSError, ValueError):
            return Spelt(candidate, os.path.join(plain, name), False)
        if stat.S_ISLNK(status.st_mode):
            target = os.path.realpath(candidate)
            return Spelt(self._as_listed(target), target, os.path.lexists(target))
        listed = self._listed(real_folder, name, status)
        return Spelt(os.path.join(real_folder, listed), os.path.join(plain, name), True)

    def is_plain(self, path: str) -> bool:
        """Return True if this path, which exists and is no symlink, is its own only spelling."""
        folder, _, name = path.rpartition(os.sep)
        if name.isascii() and folder in self._exact and self._folders.get(folder) == (folder, folder):
            return True
        return self.look(path).path == path

    def _as_listed(self, real: str) -> str:
        """Spell each name in a path without symlinks as its folder lists it."""
        text = self._canonical.get(real)
        if text is None:
            folder, name = os.path.split(real)
            if not name or folder == real:
                text = real
            else:
                parent = self._as_listed(folder)
                try:
                    name = self._listed(parent, name, os.lstat(os.path.join(parent, name)))
                except (OSError, ValueError):
                    pass  # nothing is there, so nothing lists it
                text = os.path.join(parent, name)
            self._canonical[real] = text
        return text

    def _listed(self, folder: str, name: str, status: os.stat_result) -> str:
        if name.isascii() and folder in self._exact:
            return name
        cases = (name.translate(_OTHER_CASE), name.swapcase())
        spellings = {*cases, *(unicodedata.normalize(form, name) for form in ("NFC", "NFD"))} - {name}
        # Not compared by number: some network disks number each spelling of a file otherwise, or its entry in
        # a listing, and a disk may still answer with the number of a file that was deleted a moment ago.
        if not any(os.path.lexists(os.path.join(folder, other)) for other in spellings):
            if name.isascii() and spellings:
                self._exact.add(folder)
            return name
        listed = self._listing(folder).get(folded(name), [])
        if not listed or any(other == name for other, _ in listed):  # both may be files of their own
            return name
        # Windows distinguishes normal forms, so several may be there: the number decides where it can.
        return next((other for other, number in listed if number == status.st_ino), listed[0][0])

    def _listing(self, folder: str) -> dict[str, list[tuple[str, int]]]:
        """List names and inode numbers of a folder's entries, by :func:`folded` name."""
        listing = self._listings.get(folder)
        if listing is None:
            listing = self._listings[folder] = {}
            try:
                with os.scandir(folder) as entries:
                    for _, item in zip(range(_LISTED_AT_MOST), entries, strict=False):
                        listing.setdefault(folded(item.name), []).append((item.name, item.inode()))
            except OSError:
                pass  # a folder that cannot be listed shows nothing; names stay as they were given
        return listing


def one_path(path: str) -> str:
    """Do what :meth:`Spelling.real` does, for a single path."""
    return Spelling().real(path)


def folded(name: str) -> str:
    """Return a text that is equal for names that differ only in case or normal form."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFD", name).casefold())
