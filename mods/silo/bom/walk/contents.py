# SPDX-License-Identifier: LGPL-2.1-or-later
"""What one assembly holds itself: which components, how often, seen from its own file (spec bom-sync §1).

The rules of this module:

* links inside inline parts, inline assemblies, link groups and folders count in the assembly that holds them,
  each object once, however many lists name it;
* what lies in something suppressed or excluded is left out with it;
* a Draft array counts its original, which is not counted again beside it;
* a link to a link group of the same file is one more instance of all that the group bundles; any other link
  into the same file is construction geometry;
* a broken link brings a :class:`Lost` component with its quantity, and a finding that blocks;
* what a damaged file does not tell is a finding that blocks; the rest is counted.

Nothing here depends on where the assembly is used, so each is read once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from silo.bom.document import derived, label_of, own, same_document
from silo.bom.errors import DocumentError
from silo.bom.findings import FindingCode
from silo.bom.walk.copies import stale_copies
from silo.bom.walk.kinds import COMPONENTS, INLINE, Kind, flattened, is_container, kind_of, no_component
from silo.bom.walk.notes import Notes
from silo.bom.walk.targets import (
    Inspect,
    Target,
    first_of,
    is_assembly_link,
    is_excluded,
    is_link,
    resolve_target,
)

Key = tuple[str, str]
KeyOf = Callable[[Any], Key]

# Groups that link to groups: a file does not need many of these, an attack does.
_MAX_NESTING = 32

# A link without a target, and one that leads back to itself, stand for no component.
_NO_COMPONENT_LOST = (FindingCode.UNSET_LINK, FindingCode.CYCLE)

_COUNTABLE = COMPONENTS | {Kind.DRAFT_ARRAY}
_REPEATABLE = _COUNTABLE | INLINE
_WIDER = _REPEATABLE - COMPONENTS


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
    """

    shown: Any
    target: Any
    quantity: int
    link: bool


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


_Member = tuple[Key, Any, Kind]

# What one instance of an object brings: the components, and how many of each.
_Worth = dict[Key, tuple[Any, int]]


def _add(total: _Worth, more: _Worth, times: int = 1) -> None:
    for key, (target, count) in more.items():
        before = total[key][1] if key in total else 0
        total[key] = (target, before + count * times)


def _left_out_by(obj: Any) -> str:
    """The object's own property that leaves it out; "" where none does."""
    if own(obj, "Suppressed") is True:
        return "Suppressed"
    return "SiloBomExclude" if is_excluded(obj) else ""


class Reader:
    """Reads the contents of assemblies, and tells a notebook what it met."""

    def __init__(self, notes: Notes, key: KeyOf, inspect: Inspect | None) -> None:
        self.notes = notes
        self.key = key
        self._inspect = inspect
        self._known: dict[Key, Contents] = {}
        self._not_components: dict[Key, str] = {}
        self._bundles: dict[Key, bool] = {}

    def contents(self, container: Any) -> Contents:
        """What an assembly holds; read once however often it is used."""
        key = self.key(container)
        if key not in self._known:
            self.notes.reading = key[0]
            self._known[key] = self._read(container)
        return self._known[key]

    def _read(self, container: Any) -> Contents:
        try:
            return _Reading(self, container).of(container)
        except DocumentError as error:
            self.notes.unreadable(container, error)
            return Contents(holds_components=True)

    def resolve(self, link: Any) -> Target:
        """The end of a link."""
        return resolve_target(link, self._inspect)

    def no_component(self, key: Key, target: Any) -> str:
        """What the target is instead of a component; "" where it may be one."""
        if key not in self._not_components:
            self._not_components[key] = no_component(target)
        return self._not_components[key]

    def holds_components(self, container: Any) -> bool:
        """True where a container holds links to other files."""
        key = self.key(container)
        if key not in self._bundles:
            self._bundles[key] = is_container(container) and any(
                kind in COMPONENTS
                and (end := self.resolve(obj).obj) is not None
                and not same_document(end.Document, container.Document)
                for _, obj, kind in flattened(container, self.key)
            )
        return self._bundles[key]


class _Reading:
    """One assembly while it is being read."""

    def __init__(self, reader: Reader, container: Any) -> None:
        self._reader = reader
        self._notes = reader.notes
        self._key = reader.key
        self._document = container.Document
        self._path, _ = reader.key(container)
        self._worths: dict[Key, _Worth] = {}
        self._open: list[Key] = []
        self._links: set[Key] = set()
        self._local: dict[Key, Any] = {}
        self._holds_components = False

    def of(self, container: Any) -> Contents:
        counts = [
            Count(obj, target, quantity, link=key in self._links)
            for key, obj, kind in self._leaves(container)
            for target, quantity in self._worth(key, obj, kind).values()
        ]
        return Contents(counts, list(self._local.values()), self._holds_components or bool(counts))

    def _leaves(self, container: Any) -> list[_Member]:
        """The links and arrays that lie in a container and are counted on their own."""
        found = list(flattened(container, self._key))
        covered = self._left_out(found)
        covered |= self._repeated(found, covered)
        leaves = []
        for member in found:
            key, obj, kind = member
            if key in covered:
                continue
            if kind in _COUNTABLE:
                leaves.append(member)
            elif kind is Kind.LOCAL:
                self._local[key] = obj
            elif kind is Kind.FOREIGN:
                self._notes.foreign(obj)
        return leaves

    def _left_out(self, found: list[_Member]) -> set[Key]:
        """Containers and arrays that are left out, with what they hold; links are asked when followed."""
        marked = [member for member in found if member[2] in _WIDER and _left_out_by(member[1])]
        inside: set[Key] = set()
        for key, obj, kind in marked:
            if kind in INLINE and key not in inside:
                inside.update(inner for inner, _, _ in flattened(obj, self._key))
        for key, obj, kind in marked:
            if key not in inside:  # what goes with its container needs no word of its own
                self._tell_left_out(obj)
                self._holds_components |= kind not in INLINE
        return inside.union(key for key, _, _ in marked)

    def _tell_left_out(self, obj: Any) -> bool:
        mark = _left_out_by(obj)
        if mark == "Suppressed":
            self._notes.suppressed(obj)
        elif mark:
            self._notes.excluded(obj)
        return bool(mark)

    def _repeated(self, found: list[_Member], left_out: set[Key]) -> set[Key]:
        """The originals of Draft arrays: the array shows its original as the first element."""
        covered: set[Key] = set()
        for key, array, kind in found:
            if kind is not Kind.DRAFT_ARRAY or key in left_out:
                continue
            base = first_of(own(array, "Base"))
            if base is None or self._key(base) in covered or (of_base := kind_of(base)) not in _REPEATABLE:
                continue
            covered.add(self._key(base))
            if of_base in INLINE:
                covered.update(inner for inner, _, _ in flattened(base, self._key))
        return covered

    def _worth(self, key: Key, obj: Any, kind: Kind) -> _Worth:
        """What one object brings; each is looked at once, so groups of groups cost no more than they hold."""
        if (known := self._worths.get(key)) is not None:
            return known
        if key in self._open:
            self._notes.loop(obj)
            return {}
        if len(self._open) >= _MAX_NESTING:
            self._notes.too_deep(obj, _MAX_NESTING)
            return {}
        self._open.append(key)
        try:
            worth = self._worth_of(key, obj, kind)
        except DocumentError as error:
            # One damaged object must not hide the others; the finding blocks the BOM all the same.
            self._holds_components = True
            self._notes.unreadable(obj, error)
            worth = {}
        finally:
            self._open.pop()
        self._worths[key] = worth
        return worth

    def _worth_of(self, key: Key, obj: Any, kind: Kind) -> _Worth:
        worth: _Worth = {}
        if kind is Kind.DRAFT_ARRAY:
            worth = self._draft_array(key, obj)
        elif kind in COMPONENTS:
            worth = self._link(key, obj)
        elif kind in INLINE:
            for leaf in self._leaves(obj):
                _add(worth, self._worth(*leaf))
        return worth

    def _draft_array(self, key: Key, array: Any) -> _Worth:
        base, count = first_of(own(array, "Base")), own(array, "Count", 0)
        worth: _Worth = {}
        if base is not None and not self._tell_left_out(base):
            times = count if isinstance(count, int) and count > 0 else 1
            _add(worth, self._worth(self._key(base), base, kind_of(base)), times)
            if worth:
                self._notes.draft_array(array, base, times)
        if not worth:
            self._local[key] = array
        return worth

    def _link(self, key: Key, link: Any) -> _Worth:
        if self._tell_left_out(link):
            self._holds_components = True
            return {}
        target = self._reader.resolve(link)
        if target.obj is None:
            self._holds_components = True
            self._notes.broken(link, target.problem)
            return self._lost(link, target)
        if target.element:
            self._notes.sub_element(link, target.element)
        elif target.excluded:
            self._holds_components = True
            self._notes.excluded(link, target.obj)
        else:
            return self._whole_object(key, link, target)
        return {}

    def _lost(self, link: Any, target: Target) -> _Worth:
        """A broken link counts like any other where it says what it stood for; else its finding must do."""
        problem = target.problem
        if problem is None or not problem.file or problem.code in _NO_COMPONENT_LOST:
            return {}
        lost = Lost(problem.file, problem.obj, label_of(link))
        return {lost.key: (lost, target.instances)}

    def _whole_object(self, key: Key, link: Any, target: Target) -> _Worth:
        name = self._key(target.obj)
        # FreeCAD makes two documents of one file that it opened by two paths; the path tells.
        if same_document(target.obj.Document, self._document) or (self._path and name[0] == self._path):
            return self._in_document(link, target)
        if words := self._reader.no_component(name, target.obj):
            self._notes.no_component(link, target.obj, words)
            return {}
        if is_link(link):
            self._links.add(key)
        self._remarks(link, target)
        return {name: (target.obj, target.instances)}

    def _in_document(self, link: Any, target: Target) -> _Worth:
        if not derived(target.obj, "App::LinkGroup"):
            bundles = self._reader.holds_components(target.obj)
            self._notes.in_document(link, target.obj, holds_components=bundles)
            return {}
        worth: _Worth = {}
        _add(worth, self._worth(self._key(target.obj), target.obj, Kind.LINK_GROUP), target.instances)
        if worth and target.mirrored:
            self._notes.mirrored(link, target.obj)
        return worth

    def _remarks(self, link: Any, target: Target) -> None:
        if target.mirrored:
            self._notes.mirrored(link, target.obj)
        if target.variant:
            self._notes.variant(link, target.obj)
        if is_assembly_link(link):
            gone, new = stale_copies(link, target.obj, self._key)
            if gone or new:
                self._notes.stale(link, target.obj, gone, new)
