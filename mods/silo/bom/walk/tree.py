# SPDX-License-Identifier: LGPL-2.1-or-later
"""The tree of a container: what lies in it, at any depth, and in what."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator
from typing import Any, TypeVar

from silo.bom.key import Key
from silo.bom.walk.arrays import left_out_by
from silo.bom.walk.document import object_name, own
from silo.bom.walk.kinds import INLINE, Kind, kind_of, members

T = TypeVar("T", bound=Hashable)

KeyOf = Callable[[Any], Key]

# FreeCAD keeps the changed copies of copy-on-change links in a hidden group of this name.
COPIES = "CopyOnChangeGroup"


def climbed(start: T, above: Callable[[T], Iterable[T]]) -> Iterator[T]:
    """Yield everything above ``start``, at any distance, each once, the nearest first."""
    seen, further = {start}, [start]
    for key in further:
        for upper in above(key):
            if upper not in seen:
                seen.add(upper)
                further.append(upper)
                yield upper


def is_switched_on(obj: Any) -> bool:
    """Return True if the object's own ``Visibility`` hides neither it nor its contents.

    A plain folder hides nothing: FreeCAD's window hides each object in it, and each object remembers that.
    """
    return own(obj, "Visibility") is not False or kind_of(obj) is Kind.FOLDER


class Tree:
    """All that lies in a container at any depth within its own file, each object once.

    holders
        the containers that an object lies in: one, or each of the link groups that show it. FreeCAD lists
        what lies in a folder in the part around the folder as well; the innermost is meant.
    """

    def __init__(self, container: Any, key: KeyOf, closed: Callable[[Any, Kind], bool]) -> None:
        self.top = key(container)
        self.members: dict[Key, tuple[Any, Kind]] = {}
        self.holders: dict[Key, tuple[Key, ...]] = {}
        self._times: dict[Key, int] = {self.top: 1}
        self._visible: dict[Key, bool] = {self.top: True}
        self._in_top = (self.top,)
        several = []
        way = [(self._in_top, iter(members(container)))]
        open_now = {self.top}
        while way:
            holder, rest = way[-1]
            obj = next(rest, None)
            if obj is None:
                open_now.discard(way.pop()[0][0])
                continue
            name = key(obj)
            if (outers := self.holders.get(name)) is not None:
                if holder[0] not in outers and name not in open_now:
                    self.holders[name] = outers + holder
                    several.append(name)
                continue
            kind = kind_of(obj)
            if name in open_now or (kind is Kind.LINK_GROUP and object_name(obj).startswith(COPIES)):
                continue
            self.members[name] = (obj, kind)
            self.holders[name] = holder
            if kind in INLINE and not closed(obj, kind):
                open_now.add(name)
                way.append(((name,), iter(members(obj))))
        for name in several:
            self.holders[name] = self._innermost(self.holders[name])

    def _innermost(self, holders: tuple[Key, ...]) -> tuple[Key, ...]:
        groups = tuple(
            holder for holder in holders if holder != self.top and self.members[holder][1] is Kind.LINK_GROUP
        )
        if groups or len(holders) < 2:
            return groups or holders
        around = {upper for holder in holders for upper in self.above(holder)}
        return (min([holder for holder in holders if holder not in around] or holders),)

    def above(self, name: Key) -> list[Key]:
        """Return the containers around a member, the innermost first; only the first of several link
        groups.
        """
        if self.holders.get(name) == self._in_top:  # as most are
            return [self.top]
        return list(climbed(name, lambda key: self.holders.get(key, ())[:1]))

    def around(self, name: Key) -> list[Key]:
        """Return the containers around a member, without the top."""
        if self.holders.get(name) == self._in_top:
            return []
        return [key for key in self.above(name) if key != self.top]

    def times(self, name: Key) -> int:
        """Return how often the container shows a member; 0 if it, or a container around it, is left out."""
        return self._climbed(name, self._times, lambda obj, above: 0 if left_out_by(obj) else sum(above))

    def visible(self, name: Key) -> bool:
        """Return True if a member is visible and lies in visible containers."""
        return self._climbed(name, self._visible, lambda obj, above: is_switched_on(obj) and any(above))

    def _climbed(self, name: Key, reached: dict[Key, T], of: Callable[[Any, list[T]], T]) -> T:
        """Find a fact of a member that follows from the member and the containers around it, without
        recursion.
        """
        if name not in reached and self.holders[name] == self._in_top:
            reached[name] = of(self.members[name][0], [reached[self.top]])
        way = [name] if name not in reached else []
        while way:
            holders = self.holders[way[-1]] if way[-1] not in reached else ()
            if unknown := [holder for holder in holders if holder not in reached and holder not in way]:
                way.append(unknown[0])
            else:
                last = way.pop()
                if last not in reached:
                    above = [reached[holder] for holder in holders if holder in reached]
                    reached[last] = of(self.members[last][0], above)
        return reached[name]

    def paths(self, name: Key) -> Iterator[tuple[Any, ...]]:
        """Yield the containers around a member, outermost first, once for each way to it."""
        for holder in self.holders[name]:
            if holder == self.top:
                yield ()
                continue
            obj = self.members[holder][0]
            if not left_out_by(obj):
                for upper in self.paths(holder):
                    yield (*upper, obj)
