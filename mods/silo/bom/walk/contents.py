# SPDX-License-Identifier: LGPL-2.1-or-later
"""One assembly as it stands in its file, as values: what it shows, and the role of each object."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from silo.bom.key import Key
from silo.bom.walk.kinds import COMPONENTS, Kind, is_named_assembly
from silo.bom.walk.tree import Tree

# What one instance of an object brings: the components, and how many of each.
CountedObjects = dict[Key, tuple[Any, int]]


class ObjectRole(Enum):
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
    MODIFIED = "modified here"  # made of linked parts, which count
    REFERENCE = "reference"  # a hidden link that only supports other geometry
    HIDDEN = "hidden"  # geometry of this file that is hidden, and not asked for


@dataclass(frozen=True, slots=True)
class Lost:
    """What a broken link stands for: a component that cannot be read.

    ``file`` and ``name`` as the link records them, the file in full. ``label`` is for people.
    """

    file: str
    name: str
    label: str

    @property
    def key(self) -> Key:
        """Return the key that the component would have if it were there."""
        return (self.file, self.name)


@dataclass(slots=True, eq=False)
class Contribution:
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
    brings: CountedObjects
    shown_objects: tuple[tuple[Contribution, int], ...] = ()
    tree: Tree | None = None


@dataclass(frozen=True, slots=True)
class Count:
    """Instances of one component that one object of the tree stands for.

    shown
        that object, with what it shows.
    key
        what identifies the component within ``shown.brings``.
    link, array
        True if the object is itself an ``App::Link`` to a component of another file, and if that is an array.
    beside
        True if it lies beside the assembly, in the document itself.
    """

    shown: Contribution
    key: Key
    quantity: int
    link: bool = False
    array: bool = False
    beside: bool = False

    @property
    def target(self) -> Any:
        """Return the component: a document object, or :class:`Lost`."""
        return self.shown.brings[self.key][0]


@dataclass(frozen=True, slots=True, eq=False)
class Modified:
    """A feature over linked parts, and the keys of the objects in the assembly that it consumes."""

    feature: Any
    operands: frozenset[Key]


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
    hidden_counted, references
        what is hidden and counts, and hidden links that only support other geometry.
    modified
        features made of linked parts: their shapes are what is there, in place of those parts.
    """

    counts: list[Count] = field(default_factory=list)
    own: list[Count] = field(default_factory=list)
    roles: dict[Key, ObjectRole] = field(default_factory=dict)
    holds_components: bool = False
    is_part: bool = False
    hidden: list[Any] = field(default_factory=list)
    tree: Tree | None = None
    hidden_counted: list[Any] = field(default_factory=list)
    references: list[Any] = field(default_factory=list)
    modified: list[Modified] = field(default_factory=list)

    def is_assembly(self, container: Any) -> bool:
        """Return True if the parts of its own file that it shows are parts of an assembly; the bodies of a
        part are not.
        """
        if self.is_part:
            return False
        if self.holds_components or is_named_assembly(container):
            return True
        if getattr(container, "is_document_root", False):
            return True
        return any(count.shown.kind in COMPONENTS for count in self.own)


def add(total: CountedObjects, more: CountedObjects, times: int = 1) -> None:
    """Add what several objects bring, each so many times."""
    for key, (target, count) in more.items():
        before = total.get(key)
        if times:
            total[key] = (target, count * times) if before is None else (before[0], before[1] + count * times)
