# SPDX-License-Identifier: LGPL-2.1-or-later
"""What arrays and compounds show in the very places of other objects, which count there once.

A hidden array or compound that does not count shows nothing: its visible originals are pieces themselves.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from silo.bom.key import Key
from silo.bom.walk.kinds import Kind, sources
from silo.bom.walk.tree import Tree, climbed


class Covering:
    """The objects of an assembly that its arrays and compounds show.

    gone
        what only excluded arrays and compounds show.
    """

    def __init__(self, key: Callable[[Any], Key]) -> None:
        self._key = key
        self._by: dict[Key, tuple[Key, ...]] = {}
        self.gone: set[Key] = set()

    def __bool__(self) -> bool:
        return bool(self._by)

    def look_at(self, tree: Tree, name: Key) -> None:
        """Note what an array or a compound of a tree shows."""
        obj, kind = tree.members[name]
        # The first instance of an array is at the place of its original.
        if kind is not Kind.COMPOUND and not (kind is Kind.DRAFT_ARRAY and tree.times(name)):
            return
        shown = map(self._key, sources(obj))
        if not tree.times(name):
            self.gone.update(shown)
            return
        for key in shown:
            self._by[key] = (*self._by.get(key, ()), name)

    def covers(self, tree: Tree, name: Key, shows: Callable[[Key], bool]) -> bool:
        """Return True if an array or a compound shows an object in the object's own place.

        shows
            says of a hidden array or compound if it shows the object anyway.
        """
        if not (by := self._by.get(name)):
            return False
        if not tree.visible(name):
            return True
        return any(
            key not in tree.members or tree.visible(key) or shows(key)
            for key in (*by, *(upper for key in by for upper in climbed(key, lambda k: self._by.get(k, ()))))
        )
