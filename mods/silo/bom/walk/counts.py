# SPDX-License-Identifier: LGPL-2.1-or-later
"""What reading one assembly gives: components with their numbers, and what stands for a lost one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from silo.bom.walk.kinds import Kind

Key = tuple[str, str]
KeyOf = Callable[[Any], Key]
# Objects that count on their own: key → the object, its kind, how often it is shown.
Leaves = dict[Key, tuple[Any, Kind, int]]


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


@dataclass(frozen=True, slots=True)
class Count:
    """Instances of one component that one object of the tree stands for.

    shown
        the object that a person sees in the tree.
    target
        the component: a document object, or :class:`Lost`.
    link
        True where that object is itself an ``App::Link`` to the component.
    array
        True where that link is an array.
    """

    shown: Any
    target: Any
    quantity: int
    link: bool
    array: bool


@dataclass(slots=True)
class Contents:
    """One assembly as it stands in its file.

    local
        geometry that is modelled in the assembly's own file.
    holds_components
        True also where its components are all broken, suppressed or excluded.
    """

    counts: list[Count] = field(default_factory=list)
    local: list[Any] = field(default_factory=list)
    holds_components: bool = False


Member = tuple[Key, Any, Kind]

# What one instance of an object brings: the components, and how many of each.
Worth = dict[Key, tuple[Any, int]]


def add(total: Worth, more: Worth, times: int = 1) -> None:
    """Add what some objects bring, several times."""
    for key, (target, count) in more.items():
        before = total[key][1] if key in total else 0
        if times:
            total[key] = (target if key not in total else total[key][0], before + count * times)
