# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which objects of an assembly count on their own, and how often each is shown.

Every object of the tree counts once, however many lists name it. What a link group, an array or a compound
shows is counted through that; what lies in something suppressed or excluded is left out with it.

The way to what is being read may lead back into itself, or not end (:class:`Way`).
"""

from __future__ import annotations

from collections.abc import Callable, Set
from typing import Any, TypeVar

from silo.bom.document import object_name
from silo.bom.errors import DocumentError
from silo.bom.identity import identity_of, own_identity
from silo.bom.walk.arrays import elements, left_out_by
from silo.bom.walk.counts import Key, KeyOf, Leaves, Member
from silo.bom.walk.kinds import COMPONENTS, INLINE, REPEATERS, Kind, flattened, kind_of, sources
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


_COUNTABLE = COMPONENTS | REPEATERS | {Kind.ELEMENT, Kind.STANDARD}
# What may have an identity of its own and is a component then.
DECLARABLE = REPEATERS | {Kind.LOCAL, Kind.FOREIGN, Kind.CONTAINER, Kind.LINK_GROUP}


class Members:
    """The members of one assembly.

    declared
        the objects of the assembly's own file that a person declared components.
    shown
        what arrays and compounds show, wherever they lie.
    features
        geometry that may consume others; whoever has looked at it clears the list.
    array_left_out
        True where a Draft array is suppressed or excluded.
    """

    def __init__(
        self, container: Any, key: KeyOf, notes: Notes, way: Way, declare: Set[str] = frozenset()
    ) -> None:
        self._declare = declare
        self._key = key
        self._notes = notes
        self._way = way
        self._identity = (identity_of(container) or "").lower()
        self._groups: dict[Key, Leaves] = {}
        self._inside: tuple[Any, list[Member]] | None = None
        self.declared: set[Key] = set()
        self.shown: set[Key] = set()
        self.features: list[Any] = []
        self.array_left_out = False

    def inside(self, container: Any) -> list[Member]:
        """All that lies in a container within its own file; looked through once for each in turn."""
        if self._inside is None or self._inside[0] is not container:
            self._inside = (container, list(flattened(container, self._key, self.is_closed)))
        return self._inside[1]

    def leaves(self, container: Any) -> Leaves:
        """The objects that lie in a container and are counted on their own, and how often each is shown."""
        found = self.inside(container)
        self.features += [obj for _, obj, kind in found if kind is Kind.LOCAL]
        left_out = self.left_out(found)
        covered = left_out | self._repeated(found, left_out) | self._grouped(found, left_out)
        leaves: Leaves = {}
        for key, obj, kind in found:
            if key in covered or key in self.shown:
                continue
            if kind in _COUNTABLE or (kind in DECLARABLE and self.is_declared(obj)):
                leaves[key] = (obj, kind, 1)
            elif kind is Kind.LINK_GROUP:
                for inner, (shown, its_kind, times) in self._group(key, obj).items():
                    before = leaves[inner][2] if inner in leaves else 0
                    leaves[inner] = (shown, its_kind, before + times)
        return leaves

    def _group(self, key: Key, group: Any) -> Leaves:
        """What a link group shows; looked at once, however many groups show that."""
        if (known := self._groups.get(key)) is None:
            known = self._way.guarded(key, group, lambda: self.leaves(group)) or {}
            self._groups[key] = known
        return known

    def is_closed(self, obj: Any, kind: Kind) -> bool:
        """True for an inline container that a person declared a component of its own."""
        return kind in DECLARABLE and self.is_declared(obj)

    def is_declared(self, obj: Any) -> bool:
        """True for an object with an identity of its own."""
        # The assembly's own identity on something in it means the assembly itself.
        identity = own_identity(obj)
        if object_name(obj) not in self._declare and (not identity or identity.lower() == self._identity):
            return False
        self.declared.add(self._key(obj))
        return True

    def left_out(self, found: list[Member]) -> set[Key]:
        """What is left out, with what it holds; links are asked when followed."""
        marked = [member for member in found if member[2] not in COMPONENTS and left_out_by(member[1])]
        inside: set[Key] = set()
        for key, obj, kind in marked:
            if kind in INLINE and key not in inside:
                inside.update(inner for inner, _, _ in flattened(obj, self._key))
            elif kind is Kind.COMPOUND:
                inside.update(self._key(source) for source in sources(obj))
        for key, obj, kind in marked:
            # What goes with its container needs no word of its own, nor does what is nothing to buy.
            if key not in inside and (kind in _COUNTABLE or kind in INLINE or self.is_declared(obj)):
                self.report_left_out(obj)
                self.array_left_out |= kind is Kind.DRAFT_ARRAY
        return inside.union(key for key, _, _ in marked)

    def report_left_out(self, obj: Any) -> bool:
        """True for an object that is left out; says so."""
        mark = left_out_by(obj)
        if mark == "Suppressed":
            self._notes.suppressed(obj)
        elif mark:
            self._notes.excluded(obj)
        return bool(mark)

    def _repeated(self, found: list[Member], left_out: set[Key]) -> set[Key]:
        """The originals of Draft arrays (their first element), the members of compounds, array elements."""
        covered: set[Key] = set()
        loose = {key for key, _, kind in found if kind is Kind.ELEMENT}
        for key, obj, kind in found:
            if key in left_out:
                continue
            if kind is Kind.LINK and loose:
                covered |= loose.intersection(map(self._key, elements(obj)))
            if kind is not Kind.DRAFT_ARRAY and kind is not Kind.COMPOUND:
                continue
            for base in sources(obj):
                of_base = kind_of(base)
                if of_base is Kind.LOCAL and not self.is_declared(base):
                    continue
                self.shown.add(self._key(base))
                if of_base in INLINE:
                    covered.update(inner for inner, _, _ in flattened(base, self._key, self.is_closed))
        return covered

    def _grouped(self, found: list[Member], left_out: set[Key]) -> set[Key]:
        """What link groups hold: counted through them, once per group."""
        covered: set[Key] = set()
        for key, group, kind in found:
            if kind is Kind.LINK_GROUP and key not in left_out and key not in covered:
                covered.update(inner for inner, _, _ in flattened(group, self._key))
        return covered
