# SPDX-License-Identifier: LGPL-2.1-or-later
"""A look at an assembly that believes no role: what it shows and no line counts and no finding names.

Asked for each assembly of a walk, from its file alone:

* a link counts or is named, whatever its eye icon says, unless it is hidden and something else shows it;
* geometry that the view shows counts or is named; hidden geometry is used by something, or named;
* in a file without a view, geometry that a feature takes needs no name;
* nothing counts at its own place that is hidden there and that something else shows or takes, nor what an
  array or a compound shows there, what lies in something that counts, or what counted links are made into.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Set
from typing import Any

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
    used: dict[tuple[str, ...], set[str]] = {}
    inside = _elements(tree)
    for key, (obj, kind) in tree.members.items():
        name = key[1]
        if (kind not in COMPONENTS and kind not in _GEOMETRY) or name in counted or name in inside:
            continue
        around = [upper[1] for upper in tree.around(key)]
        if not tree.times(key) or any(upper in counted for upper in around):
            continue
        if is_named(name) or any(map(is_named, around)):
            continue
        users = _SHOWN_BY if kind in COMPONENTS else _TAKEN_BY
        if users not in used:
            used[users] = _used_by(tree, obj.Document, users, but_features=kind in COMPONENTS)
        is_used = not used[users].isdisjoint((name, *around))
        if is_used and not (tree.visible(key) and (kind in COMPONENTS or has_view())):
            continue
        if kind in COMPONENTS or has_solid(obj):
            yield obj


def counted_twice(tree: Tree, counted: Set[str], has_view: Callable[[], bool]) -> Iterator[Any]:
    """Yield each object that counts at its own place, though something else shows or takes it there."""
    covered: set[str] | None = None
    used: dict[tuple[str, ...], set[str]] = {}
    for key, (obj, kind) in tree.members.items():
        if key[1] not in counted or (kind not in COMPONENTS and kind not in _GEOMETRY):
            continue
        if covered is None:
            covered = {
                object_name(source)
                for other, of in tree.members.values()
                if of in _COVERING and object_name(other) in counted
                for source in sources(other)
            }
        if key[1] in covered or any(upper[1] in counted for upper in tree.around(key)):
            yield obj
            continue
        if kind is Kind.LOCAL and _is_made_of(obj, tree, counted, has_view):
            yield obj
            continue
        if tree.visible(key) or is_said_to_count(obj):
            continue
        users = _SHOWN_BY if kind in COMPONENTS else _TAKEN_BY
        if users not in used:
            used[users] = _used_by(tree, obj.Document, users, but_features=kind in COMPONENTS)
        if key[1] in used[users]:
            yield obj


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
        inner = own(user, "Group") or () if getattr(user, "TypeId", "") == "PartDesign::Body" else ()
        for obj in (user, *inner):
            for name in names:
                value = own(obj, name)
                several = value if isinstance(value, list | tuple) else (value,)
                found.update(object_name(end) for one in several if hasattr(end := first_of(one), "Document"))
    return found
