# SPDX-License-Identifier: LGPL-2.1-or-later
"""The walker: the components of an assembly, counted (spec bom-sync §1).

The rules of this module:

* a component is (target file, target object); labels never decide;
* links inside inline parts, inline assemblies, link groups and folders count in the assembly that holds them,
  each object once;
* a link whose target lies in the assembly's own document is construction geometry, not a component;
* hidden components count; suppressed and excluded ones do not, and are reported;
* whatever is not counted has a finding.

It walks live FreeCAD objects, objects read from FCStd files and the tests' fakes alike.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Any

from silo.bom.document import derived, label_of, object_name, own, same_document
from silo.bom.findings import Finding, FindingCode, Place
from silo.bom.identity import identity_findings, identity_of
from silo.bom.kinds import Kind, is_container, is_named_assembly, kind_of, members
from silo.bom.model import BomEntry, Extraction
from silo.bom.notes import Notes
from silo.bom.targets import Inspect, Target, is_array, is_assembly_link, is_link, resolve_target

# Real assemblies are some ten levels deep; deeper is an attack or a loop that no other guard saw.
MAX_LEVELS = 64

Canonical = Callable[[str], str]
Key = tuple[str, str]


def extract_bom_links(assembly_obj: Any, level: int = 1) -> list[BomEntry]:
    """The cross-document components of an assembly, with quantities per one parent (spec §1).

    ``level`` is given to the direct children; deeper ones count up from it. For the findings too, call
    :func:`extract`.
    """
    return list(extract(assembly_obj, level=level).entries)


def extract(
    assembly_obj: Any,
    *,
    level: int = 1,
    inspect: Inspect | None = None,
    canonical: Canonical | None = None,
) -> Extraction:
    """Walk an assembly.

    inspect
        tells why a live link has no target; links read from FCStd files know it themselves.
    canonical
        makes one path of the several that may name one file (``os.path.realpath`` for live documents).
    """
    walker = _Walker(inspect=inspect, canonical=canonical or (lambda path: path))
    top = assembly_obj
    if is_link(top) or is_assembly_link(top):
        top = resolve_target(top, inspect).obj or top
    entries = walker.assembly(top, level)
    head = replace(
        walker.entry_for(top, level - 1),
        quantity=1,
        children=(),
        is_assembly=True,
        silo_uuid=identity_of(top),
    )
    if not entries and not walker.notes.any_blocking():
        walker.notes.empty(head)
    walker.notes.container(top)
    findings = (*walker.notes.findings(), *identity_findings([replace(head, children=entries)]))
    return Extraction(assembly=head, entries=entries, findings=findings)


@dataclass(frozen=True, slots=True)
class _Count:
    """One object that was counted: what a person sees in the tree, what it stands for, how often."""

    counted: Any
    link: Any
    target: Any
    quantity: int


@dataclass
class _Level:
    """One assembly while it is being walked."""

    document: Any
    counts: list[_Count] = field(default_factory=list)
    local: list[Any] = field(default_factory=list)
    # The originals of Draft arrays: the array shows the original as its first element.
    repeated: set[Key] = field(default_factory=set)


@dataclass
class _Walker:
    inspect: Inspect | None
    canonical: Canonical
    notes: Notes = field(default_factory=Notes)
    _memo: dict[tuple[Key, int], tuple[BomEntry, ...]] = field(default_factory=dict)
    _stack: list[Key] = field(default_factory=list)

    def key(self, obj: Any) -> Key:
        return (self._path(obj), object_name(obj))

    def _path(self, obj: Any) -> str:
        path = getattr(getattr(obj, "Document", None), "FileName", "") or ""
        return self.canonical(path) if path else ""

    def entry_for(self, obj: Any, level: int) -> BomEntry:
        path, name = self.key(obj)
        return BomEntry(
            doc_path=path,
            silo_uuid=identity_of(obj),
            level=level,
            object_name=name,
            label=label_of(obj),
            document_label=getattr(obj.Document, "Label", "") or "",
            is_assembly=is_named_assembly(obj),
        )

    def assembly(self, container: Any, level: int) -> tuple[BomEntry, ...]:
        """The direct children of an assembly, walked once per nesting level at which it occurs."""
        key = self.key(container)
        if (known := self._memo.get((key, level))) is not None:
            return known
        self._stack.append(key)
        here = _Level(document=container.Document)
        self._container(container, here, times=1, seen=set())
        entries = tuple(self._entry(counts, level) for counts in self._by_target(here))
        if entries or is_named_assembly(container) or len(self._stack) == 1:
            self.notes.local_geometry(container, here.local)
        self._stack.pop()
        self._memo[(key, level)] = entries
        return entries

    def _by_target(self, here: _Level) -> Iterable[list[_Count]]:
        lines: dict[Key, list[_Count]] = {}
        for count in here.counts:
            if count.counted is not count.link or self.key(count.link) not in here.repeated:
                lines.setdefault(self.key(count.target), []).append(count)
        return lines.values()

    def _entry(self, counts: list[_Count], level: int) -> BomEntry:
        target = counts[0].target
        children: tuple[BomEntry, ...] = ()
        if is_container(target):
            if len(self._stack) >= MAX_LEVELS:
                self.notes.too_deep(target, MAX_LEVELS)
            else:
                children = self.assembly(target, level + 1)
        entry = self.entry_for(target, level)
        app_links = [count.counted for count in counts if is_link(count.counted)]
        return replace(
            entry,
            quantity=sum(count.quantity for count in counts),
            children=children,
            is_assembly=entry.is_assembly or bool(children),
            consolidation_warning=len(app_links) > 1,
            individual_links=sum(not is_array(link) for link in app_links),
            link_objects=len(app_links),
            instances=tuple(object_name(count.counted) for count in counts),
        )

    def _container(self, container: Any, here: _Level, times: int, seen: set[Key]) -> None:
        for obj in members(container):
            key = self.key(obj)
            if key in seen:
                continue
            seen.add(key)
            if not self._left_out(obj):
                self._member(obj, kind_of(obj), here, times, seen)

    def _left_out(self, obj: Any) -> bool:
        if own(obj, "Suppressed") is True:
            self.notes.suppressed(obj)
            return True
        if own(obj, "SiloBomExclude") is True:
            self.notes.excluded(obj)
            return True
        return False

    def _member(self, obj: Any, kind: Kind, here: _Level, times: int, seen: set[Key]) -> None:
        if kind is Kind.LINK or kind is Kind.ASSEMBLY_LINK:
            self._component(obj, obj, here, times)
        elif kind is Kind.DRAFT_ARRAY:
            self._draft_array(obj, here, times)
        elif kind in (Kind.LINK_GROUP, Kind.CONTAINER, Kind.FOLDER):
            if not object_name(obj).startswith("CopyOnChangeGroup"):
                self._container(obj, here, times, seen)
        elif kind is Kind.FOREIGN:
            self.notes.foreign(obj)
        elif kind is Kind.LOCAL:
            here.local.append(obj)

    def _draft_array(self, array: Any, here: _Level, times: int) -> None:
        base, count = getattr(array, "Base", None), own(array, "Count", 0)
        base = base[0] if isinstance(base, tuple) else base
        if base is None or kind_of(base) not in (Kind.LINK, Kind.ASSEMBLY_LINK):
            here.local.append(array)
            return
        instances = count if isinstance(count, int) and count > 0 else 1
        here.repeated.add(self.key(base))
        self.notes.draft_array(array, base, instances)
        self._component(base, array, here, times * instances)

    def _component(self, link: Any, counted: Any, here: _Level, times: int) -> None:
        """Count the target of ``link``; ``counted`` is the object that a person sees in the tree."""
        target = resolve_target(link, self.inspect)
        if target.obj is None:
            self.notes.broken(link, target.problem)
            return
        if target.element:
            self.notes.sub_element(link, target.element)
            return
        if same_document(target.obj.Document, here.document):
            self._in_document(link, target, here, times)
            return
        if own(target.obj, "SiloBomExclude") is True:
            self.notes.excluded(link, target.obj)
            return
        key = self.key(target.obj)
        if key in self._stack:
            self.notes.cycle(link, [*self._stack[self._stack.index(key) :], key])
            return
        self._remarks(link, target)
        here.counts.append(_Count(counted, link, target.obj, times * target.count))

    def _in_document(self, link: Any, target: Target, here: _Level, times: int) -> None:
        if derived(target.obj, "App::LinkGroup"):
            # One more instance of all that the group bundles, beside the group itself.
            self._container(target.obj, here, times * target.count, seen=set())
            return
        self.notes.in_document(link, target.obj, holds_components=_holds_links(target.obj))

    def _remarks(self, link: Any, target: Target) -> None:
        if target.mirrored:
            self.notes.mirrored(link, target.obj)
        if target.variant:
            self.notes.variant(link, target.obj)
        if is_assembly_link(link):
            gone, new = _stale_copies(link, target.obj)
            if gone or new:
                self.notes.stale(link, target.obj, gone, new)


def _holds_links(obj: Any) -> bool:
    return is_container(obj) and any(
        kind_of(m) in (Kind.LINK, Kind.ASSEMBLY_LINK)
        and (end := resolve_target(m).obj) is not None
        and not same_document(end.Document, obj.Document)
        for m in members(obj)
    )


def _component_names(container: Any) -> set[str]:
    return {
        object_name(m)
        for m in getattr(container, "Group", None) or ()
        if kind_of(m) in (Kind.LINK, Kind.ASSEMBLY_LINK)
    }


def _stale_copies(link: Any, assembly: Any) -> tuple[list[str], list[str]]:
    """What an AssemblyLink's copies still show though it is gone, and what they lack (facts §1.4)."""
    source = getattr(link, "LinkedObject", None)
    real = source if is_assembly_link(source) else assembly
    copies: Iterable[Any] = getattr(link, "Group", None) or ()
    gone: list[str] = []
    copied: set[str] = set()
    for copy in copies:
        if kind_of(copy) not in (Kind.LINK, Kind.ASSEMBLY_LINK):
            continue
        original = getattr(copy, "LinkedObject", None)
        original = original[0] if isinstance(original, tuple) else original
        if original is None:
            gone.append(label_of(copy))
        else:
            copied.add(object_name(original))
    if not copied and not gone:  # never recomputed: nothing is shown, so nothing is wrong
        return [], []
    names = _component_names(real)
    return sorted([*gone, *(copied - names)]), sorted(names - copied)


__all__ = ["Extraction", "Finding", "FindingCode", "Place", "extract", "extract_bom_links"]
