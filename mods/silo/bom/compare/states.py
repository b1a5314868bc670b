# SPDX-License-Identifier: LGPL-2.1-or-later
"""States of the same assemblies, and which component of one state is which of another.

A component is the same in both states where its identity is the same, or, where one of them has no identity
of its own, where file and object are the same. An identity that several components of one state share (a
copied file) proves nothing; then file and object decide.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

from silo.bom.entry import BomEntry
from silo.bom.key import Key

T = TypeVar("T")


def first_state(*states: T | None) -> T:
    """Return the first state that is not None; one of them never is."""
    return next(state for state in states if state is not None)


@dataclass(frozen=True, slots=True)
class ComparedAssembly:
    """An assembly and its lines, quantities per one assembly. Paths are relative to the compared folder."""

    head: BomEntry
    lines: tuple[BomEntry, ...] = ()


class ComponentMatch:
    """Which component of the old state is which of the new one."""

    def __init__(self, old: Sequence[ComparedAssembly], new: Sequence[ComparedAssembly]) -> None:
        was, now = _components_of(old), _components_of(new)
        by_id_old, by_id_new = _by_identity(was), _by_identity(now)
        self._new_key: dict[Key, Key] = {}
        taken = set()
        for uuid, key in by_id_old.items():
            if uuid in by_id_new:
                self._new_key[key] = by_id_new[uuid]
                taken.add(by_id_new[uuid])
        for key, entry in was.items():
            if key in self._new_key or key not in now or key in taken:
                continue
            # Two identities that differ are two parts, though the second took the first one's place.
            unlike = entry.silo_uuid in by_id_old and now[key].silo_uuid in by_id_new
            if not unlike:
                self._new_key[key] = key

    def of_old(self, entry: BomEntry) -> Key:
        """Return the new key of an old component; a key that no new component has if the old one is gone."""
        return self._new_key.get(entry.key, ("\0gone", "\0".join(entry.key)))


def _components_of(assemblies: Iterable[ComparedAssembly]) -> dict[Key, BomEntry]:
    return {entry.key: entry for assembly in assemblies for entry in (assembly.head, *assembly.lines)}


def _by_identity(components: Mapping[Key, BomEntry]) -> dict[str, Key]:
    times = Counter(entry.silo_uuid for entry in components.values())
    return {
        entry.silo_uuid: key
        for key, entry in components.items()
        if entry.silo_uuid is not None and times[entry.silo_uuid] == 1
    }
