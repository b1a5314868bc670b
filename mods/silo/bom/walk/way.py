# SPDX-License-Identifier: LGPL-2.1-or-later
"""The way from an assembly to what is being read: whether it leads back into itself, or does not end."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from silo.bom.errors import DocumentError
from silo.bom.walk.counts import Key
from silo.bom.walk.notes import Notes

T = TypeVar("T")

# Groups that link to groups: a file does not need many of these, an attack does.
_MAX_NESTING = 32


class Way:
    """What was entered and not yet left, the assembly first.

    rings
        the ways that led back into themselves: what lies on each.
    damaged
        True where an object on the way could not be read.
    """

    def __init__(self, notes: Notes) -> None:
        self._notes = notes
        self.open: dict[Key, Any] = {}
        self.rings: list[dict[Key, Any]] = []
        self.damaged = False

    def guarded(self, key: Key, obj: Any, look: Callable[[], dict[Key, T]]) -> dict[Key, T] | None:
        """Look at what an object shows, unless that leads back to where it came from."""
        if key in self.open:
            ring = list(self.open)[list(self.open).index(key) :]
            self.rings.append({one: self.open[one] for one in ring})
            return None
        if len(self.open) > _MAX_NESTING:
            self._notes.too_deep(obj, _MAX_NESTING)
            return None
        self.open[key] = obj
        try:
            return look()
        except DocumentError as error:
            # One damaged object must not hide the others; the finding blocks the BOM all the same.
            self.damaged = True
            self._notes.unreadable(obj, error)
            return {}
        finally:
            del self.open[key]
