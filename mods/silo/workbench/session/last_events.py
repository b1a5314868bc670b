# SPDX-License-Identifier: LGPL-2.1-or-later
"""The last event seen of each server, kept on disk."""

from __future__ import annotations

from pathlib import Path
from time import monotonic

from silo.platform.memory_file import read_memory, write_memory

SAVE_EVERY_S = 10.0


class LastIds:
    """The last event seen of each server, so that what happened while FreeCAD was closed is shown too."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._known = {url: str(event_id) for url, event_id in read_memory(path).items()}
        self._saved = dict(self._known)
        self._due = 0.0

    def get(self, url: str) -> str | None:
        """Return the id from which to resume; None for a server that we never listened to."""
        return self._known.get(url)

    def set(self, url: str, event_id: str) -> None:
        """Remember an event; after a crash, colleagues' events of the last :data:`SAVE_EVERY_S` may be
        repeated.
        """
        self._known[url] = event_id
        if monotonic() >= self._due:
            self.save()

    def save(self) -> None:
        """Write what is new to disk. A lost write costs repeated events, so the disk is not synced here."""
        self._due = monotonic() + SAVE_EVERY_S
        if self._known == self._saved:
            return
        written = dict(self._known)
        if write_memory(self._path, written) is None:
            self._saved = written
