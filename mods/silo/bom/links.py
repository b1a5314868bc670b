# SPDX-License-Identifier: LGPL-2.1-or-later
"""The walker: the components of an assembly, counted (spec bom-sync §1).

The rules of this module:

* a component is (target file, target object); labels never decide;
* quantities are per one parent; levels count up from the top;
* an assembly inside itself is cut where it closes the ring, and told as a cycle;
* whatever is not counted has a finding.

What one assembly holds is read by :mod:`silo.bom.contents`, each once; this module puts the levels together.
It walks live FreeCAD objects, objects read from FCStd files and the tests' fakes alike.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from silo.bom.contents import Count, Key, Reader
from silo.bom.document import label_of, object_name
from silo.bom.findings import Finding, FindingCode, Place
from silo.bom.identity import identity_findings, identity_of
from silo.bom.kinds import is_container, is_named_assembly
from silo.bom.model import BomEntry, Extraction
from silo.bom.notes import Notes
from silo.bom.roots import links_beside
from silo.bom.targets import Inspect, is_array, resolve_target

# Real assemblies are some ten levels deep; deeper is an attack or a loop that no other guard saw.
MAX_LEVELS = 64

Canonical = Callable[[str], str]


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
    walker = _Walker(inspect, canonical)
    top = assembly_obj
    entries: tuple[BomEntry, ...] = ()
    target = resolve_target(top, inspect)
    if target.obj is None:
        walker.notes.broken(top, target.problem)
    else:
        top = target.obj
        entries = walker.assembly(top, level)
    head = replace(walker.entry_for(top, level - 1), is_assembly=True)
    if not entries and not walker.notes.any_blocking():
        walker.notes.empty(head)
    walker.notes.container(top)
    walker.notes.beside(links_beside(top, inspect))
    findings = (*walker.notes.findings(), *identity_findings([replace(head, children=entries)]))
    return Extraction(assembly=head, entries=entries, findings=findings)


class _Walker:
    def __init__(self, inspect: Inspect | None, canonical: Canonical | None) -> None:
        self._canonical = canonical
        self._paths: dict[str, str] = {}
        self.notes = Notes(self._path)
        self._reader = Reader(self.notes, self.key, inspect)
        self._memo: dict[tuple[Key, int], tuple[BomEntry, ...]] = {}
        self._stack: list[Key] = []

    def key(self, obj: Any) -> Key:
        """What a component is: its file and its name in it."""
        return (self._path(obj), object_name(obj))

    def _path(self, obj: Any) -> str:
        path = getattr(getattr(obj, "Document", None), "FileName", "") or ""
        if not path or self._canonical is None:
            return path
        if path not in self._paths:
            self._paths[path] = self._canonical(path)
        return self._paths[path]

    def entry_for(self, obj: Any, level: int) -> BomEntry:
        path, name = self.key(obj)
        return BomEntry(
            doc_path=path,
            silo_uuid=identity_of(obj),
            level=level,
            object_name=name,
            label=label_of(obj),
            document_label=getattr(getattr(obj, "Document", None), "Label", "") or "",
            is_assembly=is_named_assembly(obj),
        )

    def assembly(self, container: Any, level: int) -> tuple[BomEntry, ...]:
        """The direct children of an assembly, put together once per nesting level at which it occurs."""
        key = self.key(container)
        if (known := self._memo.get((key, level))) is not None:
            return known
        self._stack.append(key)
        contents = self._reader.contents(container)
        lines = self._lines(contents.counts)
        # Below, assemblies are visited by name: where a tree contains itself, the cut must not depend on the
        # order of a Group.
        below = {name: self._below(lines[name][0].target, level + 1) for name in sorted(lines)}
        entries = tuple(self._entry(counts, level, below[name]) for name, counts in lines.items())
        if contents.holds_components or is_named_assembly(container) or len(self._stack) == 1:
            self.notes.local_geometry(container, contents.local)
        self._stack.pop()
        self._memo[(key, level)] = entries
        return entries

    def _lines(self, counts: list[Count]) -> dict[Key, list[Count]]:
        lines: dict[Key, list[Count]] = {}
        for count in counts:
            key = self.key(count.target)
            if key in self._stack:
                self.notes.cycle(count.shown, self._stack[self._stack.index(key) :])
            else:
                lines.setdefault(key, []).append(count)
        return lines

    def _below(self, target: Any, level: int) -> tuple[BomEntry, ...]:
        if not is_container(target):
            return ()
        if len(self._stack) >= MAX_LEVELS:
            self.notes.too_deep(target, MAX_LEVELS)
            return ()
        return self.assembly(target, level)

    def _entry(self, counts: list[Count], level: int, children: tuple[BomEntry, ...]) -> BomEntry:
        target = counts[0].target
        entry = self.entry_for(target, level)
        links = [count.shown for count in counts if count.link]
        return replace(
            entry,
            quantity=sum(count.quantity for count in counts),
            children=children,
            is_assembly=entry.is_assembly or self._is_assembly(target),
            consolidation_warning=len(links) > 1,
            individual_links=sum(not is_array(link) for link in links),
            link_objects=len(links),
            instances=tuple(object_name(count.shown) for count in counts),
        )

    def _is_assembly(self, target: Any) -> bool:
        return is_container(target) and self._reader.contents(target).holds_components


__all__ = ["Extraction", "Finding", "FindingCode", "Place", "extract", "extract_bom_links"]
