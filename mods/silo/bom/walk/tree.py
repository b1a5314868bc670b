# SPDX-License-Identifier: LGPL-2.1-or-later
"""What an assembly holds and shows, as values: roles, the tree, what each object brings, and through what."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, TypeVar

from silo.bom.document import object_name, own
from silo.bom.walk.kinds import COMPONENTS, INLINE, Kind, is_named_assembly, kind_of, left_out_by, members

T = TypeVar("T", bound=Hashable)
Key = tuple[str, str]
KeyOf = Callable[[Any], Key]
# What one instance of an object brings: the components, and how many of each.
Worth = dict[Key, tuple[Any, int]]

# FreeCAD keeps the changed copies of copy-on-change links in a hidden group of this name.
COPIES = "CopyOnChangeGroup"


class Role(Enum):
    """The one fate of an object, for the assembly that was chosen."""

    COMPONENT = "component"  # counts with what it brings
    HOLDER = "holder"  # a container of the assembly: what lies in it counts
    SOURCE = "source"  # shown only through others
    OPERAND = "operand"  # consumed by a feature
    SPARE = "spare"  # kept in a folder for later
    INSIDE = "inside"  # part of another component
    CONSTRUCTION = "construction"  # brings nothing
    LEFT_OUT = "left out"  # suppressed or excluded, itself or with what holds it
    LOOSE = "loose"  # beside the assembly


@dataclass(frozen=True, slots=True)
class Lost:
    """What a broken link stands for: a component that nobody can look at.

    ``file`` and ``name`` as the link records them, the file in full. ``label`` is for people.
    """

    file: str
    name: str
    label: str

    @property
    def key(self) -> Key:
        """The key that the component would have, were it there."""
        return (self.file, self.name)


@dataclass(slots=True, eq=False)
class Shown:
    """What one object brings, and through what.

    key
        of the object in its document.
    below
        what it shows within its own file, and how often each time that it is shown itself.
    tree
        of a container that something else shows: where in it ``below`` lies.
    """

    key: Key
    obj: Any
    kind: Kind
    worth: Worth
    below: tuple[tuple[Shown, int], ...] = ()
    tree: Tree | None = None


@dataclass(frozen=True, slots=True)
class Count:
    """Instances of one component that one object of the tree stands for.

    shown
        that object, with what it shows.
    key
        what identifies the component within ``shown.worth``.
    link, array
        True if the object is itself an ``App::Link`` to a component of another file, and if that is an array.
    beside
        True if it lies beside the assembly, in the document itself.
    """

    shown: Shown
    key: Key
    quantity: int
    link: bool = False
    array: bool = False
    beside: bool = False

    @property
    def target(self) -> Any:
        """The component: a document object, or :class:`Lost`."""
        return self.shown.worth[self.key][0]


@dataclass(slots=True)
class Contents:
    """One assembly as it stands in its file.

    own
        what it shows of its own file that is no item yet.
    roles
        of every object that lies in it, or that it shows.
    holds_components
        True also if its components are all broken, suppressed or excluded.
    is_part
        True for a document that is the one part which lies in it.
    hidden
        geometry of this file that is hidden beside what is shown, and not counted.
    """

    counts: list[Count] = field(default_factory=list)
    own: list[Count] = field(default_factory=list)
    roles: dict[Key, Role] = field(default_factory=dict)
    holds_components: bool = False
    is_part: bool = False
    hidden: list[Any] = field(default_factory=list)
    tree: Tree | None = None

    def is_assembly(self, container: Any) -> bool:
        """True if what it shows of its own file are parts of it: a part made of bodies has none."""
        if self.is_part:
            return False
        if self.holds_components or is_named_assembly(container):
            return True
        if getattr(container, "is_document_root", False):
            return True
        return any(one.shown.kind in COMPONENTS for one in self.own)


def add(total: Worth, more: Worth, times: int = 1) -> None:
    """Add what some objects bring, several times."""
    for key, (target, count) in more.items():
        before = total.get(key)
        if times:
            total[key] = (target, count * times) if before is None else (before[0], before[1] + count * times)


def climbed(start: T, above: Callable[[T], Iterable[T]]) -> Iterator[T]:
    """All that lies above something, at any distance, each once, the nearest first."""
    seen, further = {start}, [start]
    for one in further:
        for upper in above(one):
            if upper not in seen:
                seen.add(upper)
                further.append(upper)
                yield upper


def is_switched_on(obj: Any) -> bool:
    """True for what its own ``Visibility`` does not hide, nor what lies in it.

    A plain folder hides nothing: FreeCAD's window hides each object in it, and each object keeps that.
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
            if (known := self.holders.get(name)) is not None:
                if holder[0] not in known and name not in open_now:
                    self.holders[name] = known + holder
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
        groups = tuple(one for one in holders if one != self.top and self.members[one][1] is Kind.LINK_GROUP)
        if groups or len(holders) < 2:
            return groups or holders
        around = {upper for one in holders for upper in self.above(one)}
        return (min([one for one in holders if one not in around] or holders),)

    def above(self, name: Key) -> list[Key]:
        """The containers around a member, the innermost first; of several link groups the first."""
        if self.holders.get(name) == self._in_top:  # as most are
            return [self.top]
        return list(climbed(name, lambda one: self.holders.get(one, ())[:1]))

    def around(self, name: Key) -> list[Key]:
        """The containers around a member but for the top."""
        if self.holders.get(name) == self._in_top:
            return []
        return [one for one in self.above(name) if one != self.top]

    def times(self, name: Key) -> int:
        """How often the container shows a member; 0 for what is left out, or lies in what is."""
        return self._climbed(name, self._times, lambda obj, above: 0 if left_out_by(obj) else sum(above))

    def visible(self, name: Key) -> bool:
        """True for what is visible and lies in visible containers."""
        return self._climbed(name, self._visible, lambda obj, above: is_switched_on(obj) and any(above))

    def _climbed(self, name: Key, known: dict[Key, T], of: Callable[[Any, list[T]], T]) -> T:
        """A fact of a member that follows from the member and the containers around it; without recursion."""
        if name not in known and self.holders[name] == self._in_top:
            known[name] = of(self.members[name][0], [known[self.top]])
        way = [name] if name not in known else []
        while way:
            holders = self.holders[way[-1]] if way[-1] not in known else ()
            if unknown := [one for one in holders if one not in known and one not in way]:
                way.append(unknown[0])
            else:
                last = way.pop()
                if last not in known:
                    above = [known[one] for one in holders if one in known]
                    known[last] = of(self.members[last][0], above)
        return known[name]

    def paths(self, name: Key) -> Iterator[tuple[Any, ...]]:
        """The containers around a member, outermost first, once for each way to it."""
        for holder in self.holders[name]:
            if holder == self.top:
                yield ()
                continue
            obj = self.members[holder][0]
            if not left_out_by(obj):
                for upper in self.paths(holder):
                    yield (*upper, obj)


# --- the way to a component ---


def chains(count: Count, tree: Tree | None) -> Iterator[tuple[tuple[Any, int], ...]]:
    """Each way from the assembly to the component: the objects on it, and how often each shows the next."""
    starts: Iterable[tuple[Any, ...]] = [()]
    if tree is not None and not count.beside:
        starts = tree.paths(count.shown.key)
    for holders in starts:
        for rest in _below(count.shown, count.key):
            yield (*((holder, 1) for holder in holders), *rest)


def _below(node: Shown, wanted: Key) -> Iterator[tuple[tuple[Any, int], ...]]:
    within = [(inner, times) for inner, times in node.below if wanted in inner.worth]
    if not within or (node.kind is Kind.ASSEMBLY_LINK and wanted == next(iter(node.worth))):
        yield ((node.obj, node.worth[wanted][1]),)
        return
    for inner, times in within:
        paths = node.tree.paths(inner.key) if node.tree is not None else [()]
        for holders in paths:
            for rest in _below(inner, wanted):
                shown = 1 if node.tree is not None else times
                yield ((node.obj, shown), *((holder, 1) for holder in holders), *rest)
