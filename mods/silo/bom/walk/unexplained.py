# SPDX-License-Identifier: LGPL-2.1-or-later
"""A look at an assembly that believes no role: what it shows and no line counts and no finding names.

Asked for each assembly of a walk, from its file alone:

* a link counts or is named, whatever its eye icon says, unless it is hidden and something else shows it;
* geometry that the view shows counts or is named; hidden geometry is used by something, or named;
* in a file without a view, geometry that a feature takes needs no name;
* nothing counts at its own place that is hidden there and that something else shows or takes, nor what an
  array or a compound shows there, what lies in something that counts, or what counted links are made into;
* what is damaged is named where it was read, so nothing is asked of it here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Set
from contextlib import suppress
from typing import Any

from silo.bom.errors import DocumentError
from silo.bom.key import Key
from silo.bom.walk.document import first_of, object_name, own
from silo.bom.walk.kinds import COMPONENTS, REPEATERS, Kind, has_solid, sources
from silo.bom.walk.operands import Taking, operands
from silo.bom.walk.seen import is_said_to_count
from silo.bom.walk.survey import survey_of
from silo.bom.walk.tree import Tree

_GEOMETRY = REPEATERS | {Kind.LOCAL, Kind.STANDARD, Kind.FOREIGN}
_SHOWN_BY = ("LinkedObject", "LinkCopyOnChangeSource", "Base", "Links", "Objects", "Source")
_TAKEN_BY = (
    *_SHOWN_BY,
    "Tool",
    "Shapes",
    "Sections",
    "BaseFeature",
    "Faces",
    "Subtractions",
    "Sources",
    "Bodies",
)
# An array shows its original at the original's own place, a compound its members.
_COVERING = frozenset({Kind.DRAFT_ARRAY, Kind.COMPOUND})
_USERS = COMPONENTS | REPEATERS | {Kind.LOCAL, Kind.NOTHING}


def unexplained(
    tree: Tree, counted: Set[str], is_named: Callable[[str], bool], has_view: Callable[[], bool]
) -> Iterator[Any]:
    """Yield each object of an assembly that should count or be named, and is neither.

    counted
        the names of the objects that the lines of the assembly count.
    """
    yield from _Look(tree, counted, has_view).where(
        lambda look, key, obj, kind: look.is_unexplained(key, obj, kind, is_named)
    )


def counted_twice(tree: Tree, counted: Set[str], has_view: Callable[[], bool]) -> Iterator[Any]:
    """Yield each object that counts at its own place, though something else shows or takes it there."""
    yield from _Look(tree, counted, has_view).where(_Look.is_counted_twice)


class _Look:
    """One look at an assembly; what it finds out for one object it keeps for the others."""

    def __init__(self, tree: Tree, counted: Set[str], has_view: Callable[[], bool]) -> None:
        self._tree, self._counted, self._has_view = tree, counted, has_view
        self._inside = _elements(tree)
        self._used: dict[tuple[str, ...], set[str]] = {}
        self._covered: set[str] | None = None

    def where(self, is_wrong: Callable[[_Look, Key, Any, Kind], bool]) -> Iterator[Any]:
        """Yield the objects of which this holds."""
        for key, (obj, kind) in self._tree.members.items():
            if kind in COMPONENTS or kind in _GEOMETRY:
                try:
                    if is_wrong(self, key, obj, kind):
                        yield obj
                except DocumentError:  # the walk has reported it
                    continue

    def is_unexplained(self, key: Key, obj: Any, kind: Kind, is_named: Callable[[str], bool]) -> bool:
        """Return True if an object should count or be named, and is neither."""
        tree, name = self._tree, key[1]
        if name in self._counted or name in self._inside:
            return False
        around = [upper[1] for upper in tree.around(key)]
        if not tree.times(key) or any(upper in self._counted for upper in around):
            return False
        if is_named(name) or any(map(is_named, around)):
            return False
        is_used = not self._used_as(obj, kind).isdisjoint((name, *around))
        if is_used and not (tree.visible(key) and (kind in COMPONENTS or self._has_view())):
            return False
        return kind in COMPONENTS or has_solid(obj)

    def is_counted_twice(self, key: Key, obj: Any, kind: Kind) -> bool:
        """Return True if an object counts at its own place, though something else shows or takes it there."""
        tree, counted = self._tree, self._counted
        if key[1] not in counted:
            return False
        if self._covered is None:
            self._covered = {
                object_name(source)
                for other, of in tree.members.values()
                if of in _COVERING and object_name(other) in counted
                for source in sources(other)
            }
        if key[1] in self._covered or any(upper[1] in counted for upper in tree.around(key)):
            return True
        if kind is Kind.LOCAL and _is_made_of(obj, tree, counted, self._has_view):
            return True
        if tree.visible(key) or is_said_to_count(obj):
            return False
        return key[1] in self._used_as(obj, kind)

    def _used_as(self, obj: Any, kind: Kind) -> set[str]:
        users = _SHOWN_BY if kind in COMPONENTS else _TAKEN_BY
        if users not in self._used:
            self._used[users] = _used_by(self._tree, obj.Document, users, but_features=kind in COMPONENTS)
        return self._used[users]


def _is_made_of(feature: Any, tree: Tree, counted: Set[str], has_view: Callable[[], bool]) -> bool:
    """Return True if a feature is made of links that count at their own places."""
    places = {key[1]: key for key, (_, kind) in tree.members.items() if kind in COMPONENTS}
    taken = (object_name(operand.obj) for operand in operands(feature) if operand.how is Taking.SOLID)
    linked = [name for name in taken if name in places and name in counted]
    return any(not (tree.visible(places[name]) and has_view()) for name in linked)


def _elements(tree: Tree) -> set[str]:
    """Return the names of the elements of link arrays: the array counts them."""
    if not any(kind is Kind.ELEMENT for _, kind in tree.members.values()):
        return set()
    arrays = (obj for obj, kind in tree.members.values() if kind in COMPONENTS)
    return {object_name(element) for obj in arrays for element in own(obj, "ElementList") or ()}


def _used_by(tree: Tree, document: Any, names: Iterable[str], *, but_features: bool) -> set[str]:
    """Return the names of the objects that others of the document show or take.

    but_features
        True if what a cut or a fusion takes counts anyway, as links do.
    """
    kinds = _USERS - {Kind.LOCAL} if but_features else _USERS
    users = [obj for obj, _ in survey_of(document).of(kinds)]
    users = users or [obj for obj, kind in tree.members.values() if kind in kinds]
    found = set[str]()
    for user in users:
        with suppress(DocumentError):  # what is damaged uses nothing that can be read
            inner = own(user, "Group") or () if getattr(user, "TypeId", "") == "PartDesign::Body" else ()
            for obj in (user, *inner):
                found.update(map(object_name, _leads_to(obj, names)))
    return found


def _leads_to(obj: Any, names: Iterable[str]) -> Iterator[Any]:
    """Yield the objects to which these properties lead."""
    for name in names:
        value = own(obj, name)
        for one in value if isinstance(value, list | tuple) else (value,):
            if hasattr(end := first_of(one), "Document"):
                yield end
