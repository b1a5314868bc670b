# SPDX-License-Identifier: LGPL-2.1-or-later
"""What colleagues have committed since this FreeCAD runs, as the server announces it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Newer:
    """A commit that the server announced. ``at``: seconds of :func:`time.monotonic`."""

    part_number: str
    revision: int
    who: str
    at: float


class Colleagues:
    """Keeps colleagues' commits apart from our own, which the server announces as well: before our upload has
    its answer, or after.

    newer
        UUID of an item → the newest commit of it by somebody else.
    """

    def __init__(self) -> None:
        self.newer: Mapping[str, Newer] = {}
        self._mine: dict[str, int] = {}
        self._going: set[str] = set()
        self._unsure: dict[str, Newer] = {}

    def sending(self, identity: str) -> None:
        """Note that a commit of this item is on its way to the server."""
        self._going.add(identity.lower())

    def forget_own(self) -> None:
        """Forget which revisions are ours: the server counts again after a restore."""
        self._mine.clear()

    def gone(self, seen: Mapping[str, Newer], identities: Iterable[str]) -> None:
        """Note that the server has nothing newer of these items; what was announced after ``seen`` stays."""
        stale = {
            identity
            for identity in map(str.lower, identities)
            if self.newer.get(identity) is seen.get(identity)
        }
        self.newer = {key: newer for key, newer in self.newer.items() if key not in stale}

    def heard(self, identity: str, newer: Newer) -> None:
        """Note that the server announced a commit."""
        if newer.revision <= self._mine.get(identity, 0):
            return  # Ours, or one that ours was made from or sent on top of.
        if identity in self._going:
            self._unsure[identity] = newer
        else:
            self.newer = {**self.newer, identity: newer}

    def arrived(self, identity: str, revision: int) -> None:
        """Note that the server has our commit of an item, as this revision."""
        identity = identity.lower()
        self._mine[identity] = max(revision, self._mine.get(identity, 0))
        newer = self.newer.get(identity)
        if newer is not None and newer.revision <= revision:
            self.newer = {key: later for key, later in self.newer.items() if key != identity}

    def sent(self, still_going: Iterable[str]) -> None:
        """Note that a run of sending has ended. If a commit that was announced meanwhile is not ours, it is a
        colleague's. Commits of ``still_going`` are still on their way.
        """
        unsure, self._unsure, self._going = self._unsure, {}, set()
        for identity, newer in unsure.items():
            self.heard(identity, newer)
        self._going = {identity.lower() for identity in still_going}
