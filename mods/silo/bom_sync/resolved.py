# SPDX-License-Identifier: LGPL-2.1-or-later
"""An assembly with its direct children as the server knows them.

The server is asked once for the whole tree. Each sub-assembly is then such an assembly of its own.
"""

from __future__ import annotations

import os.path
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, cast

from silo.api.wire import LastSync, LeftOutPart
from silo.bom.compare.bom_diff import BomDiff
from silo.bom.compare.difference import diff_bom
from silo.bom.compare.merge import MergePlan, plan_merge
from silo.bom.consolidation import consolidation_findings
from silo.bom.entry import BomEntry, Extraction, walk_entries
from silo.bom.findings import Finding, FindingCode, Severity
from silo.bom.items.lookup import ItemLookup, Known, look_up
from silo.bom.items.resolve import numbered_findings, resolve_with, unregistered_findings
from silo.bom.left_out import LeftOut, components_of, left_out_of
from silo.bom.walk.document import relative
from silo.bom_sync.standard_items import find_items


class _Findings(tuple[Finding, ...]):
    """The findings of a whole tree, whose assemblies each ask for what blocks them."""

    @cached_property
    def _by_file(self) -> Mapping[str, list[int]]:
        """Return the numbers of each file's errors; under "" those of the loops, which block every
        assembly.
        """
        numbers: dict[str, list[int]] = {}
        for number, finding in enumerate(self):
            if finding.severity is Severity.ERROR:
                loop = finding.code in (FindingCode.CYCLE, FindingCode.TOO_DEEP)
                for path in [""] if loop else dict.fromkeys(place.doc_path for place in finding.where):
                    numbers.setdefault(path, []).append(number)
        return numbers

    def blocking(self, path: str) -> tuple[Finding, ...]:
        by_file = self._by_file
        return tuple(self[number] for number in sorted({*by_file.get("", ()), *by_file.get(path, ())}))


@dataclass(frozen=True)
class Resolved:
    """One assembly with its direct children as the server knows them."""

    assembly: BomEntry
    entries: tuple[BomEntry, ...]
    unresolved: tuple[BomEntry, ...]
    findings: tuple[Finding, ...]
    # UUID of an assembly → what the server remembers of its last sync; a server that does not is not in it.
    last_syncs: Mapping[str, Any] = field(default_factory=dict, compare=False, repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.findings, _Findings):
            object.__setattr__(self, "findings", _Findings(self.findings))

    @property
    def unregistered(self) -> tuple[BomEntry, ...]:
        """Return the components without an item, parts first; the assembly itself comes last."""
        head = () if self.assembly.part_number else (self.assembly,)
        return tuple(
            sorted((*self.unresolved, *head), key=lambda e: (e.is_assembly, e.is_standard, -e.level))
        )

    @property
    def folder(self) -> str:
        """Return the folder of the assembly's file; a merge names components relative to it."""
        return os.path.dirname(self.assembly.doc_path)

    @property
    def left_out(self) -> tuple[LeftOut, ...]:
        """Return everything that a sync of this assembly cannot send."""
        errors = (finding for finding in blocking(self))
        return left_out_of(self.entries, self.assembly.unregistered, errors, self.folder)

    def diff(self, lines: Iterable[Mapping[str, Any]]) -> BomDiff:
        """Compare CAD with these lines of the server."""
        return diff_bom(self.entries, lines, self._missing())

    def plan(self, lines: Iterable[Mapping[str, Any]]) -> MergePlan:
        """Plan a merge into these lines of the server."""
        return plan_merge(self.entries, lines, self._missing())

    def is_news(self, plan: MergePlan, lines: Iterable[Mapping[str, Any]] = ()) -> bool:
        """Return True if the server learns anything from a merge into these lines: also if only that the BOM
        is complete or incomplete now, or that a component has another file.
        """
        if plan.news:
            return True
        last = self.last_syncs.get(self.assembly.silo_uuid or "")
        if last is None:
            return False
        last_sync = LastSync.model_validate(last) if isinstance(last, Mapping) else last
        if last_sync.at is None or _texts(last_sync.left_out) != _texts(left_out_parts(self)):
            return True
        before = {line["child_part_number"]: _places(line.get("components") or ()) for line in lines}
        now: dict[str, set[tuple[str, str]]] = {}
        for entry in self.entries:
            if (number := entry.part_number or "") in before and not entry.missing:
                now.setdefault(number, set()).update(_places(components_of(entry, self.folder)))
        for change in plan.diff.kept:
            now.pop(change.part_number, None)
        return any(before[number] != places for number, places in now.items())

    def _missing(self) -> list[tuple[str, str]]:
        return [(relative(e.doc_path, self.folder), e.object_name) for e in self.entries if e.missing]


def _places(components: Iterable[Mapping[str, Any]]) -> set[tuple[str, str]]:
    return {(component.get("file") or "", component.get("object") or "") for component in components}


def left_out_parts(resolved: Resolved) -> list[LeftOutPart]:
    return [LeftOutPart.model_validate(out.as_dict()) for out in resolved.left_out]


def _texts(parts: Iterable[LeftOutPart]) -> list[str]:
    return sorted(part.model_dump_json(exclude_defaults=True) for part in parts)


def resolve(extraction: Extraction, api: ItemLookup) -> Resolved:
    """Give the assembly and all its components their part numbers, in one look-up for the whole tree."""
    uuids = [e.silo_uuid for e in walk_entries((extraction.assembly, *extraction.entries)) if e.silo_uuid]
    return resolve_known(extraction, known_items(uuids, extraction.entries, api))


def known_items(uuids: Iterable[str], entries: Iterable[BomEntry], api: ItemLookup) -> Known:
    """Look up the server's items of these identities, and those of the standard parts among the entries."""
    items = look_up(uuids, api)
    return {**items, **find_items(entries, items, api)}


def resolve_known(extraction: Extraction, items: Known) -> Resolved:
    """Do what :func:`resolve` does, with items that were fetched before; pure."""
    head = extraction.assembly
    entries, unresolved = resolve_with(extraction.entries, items)
    item = items.get(head.silo_uuid) if head.silo_uuid else None
    if item is not None:
        number = str(item["part_number"])
        head = replace(head, part_number=number, name=item.get("name") or item.get("description") or number)
    lacking = {entry.key for entry in unresolved}
    head = replace(head, unregistered=tuple(e for e in extraction.entries if e.key in lacking))
    return Resolved(
        assembly=head,
        entries=tuple(entries),
        unresolved=tuple(unresolved),
        findings=(
            *numbered_findings(extraction.findings, items),
            *consolidation_findings(entries),
            *unregistered_findings(unresolved),
        ),
        last_syncs={
            uuid: last for uuid, item in items.items() if item and (last := item.get("last_sync")) is not None
        },
    )


def names_of(resolved: Resolved, lines: Iterable[Mapping[str, Any]] = ()) -> dict[str, str]:
    """Return part number → name, of all resolved components and of the server's own lines; for display."""
    names = {
        line["child_part_number"]: line.get("child_description") or line.get("child_name") or ""
        for line in lines
    }
    entries = walk_entries((resolved.assembly, *resolved.entries, *resolved.unresolved))
    return names | {entry.part_number: entry.name or "" for entry in entries if entry.part_number}


def blocking(resolved: Resolved) -> tuple[Finding, ...]:
    """Return the findings that keep this assembly from being synced: those in its own file, and all loops."""
    return cast(_Findings, resolved.findings).blocking(resolved.assembly.doc_path)


def assemblies(resolved: Resolved) -> Iterator[Resolved]:
    """Yield the assembly and its sub-assemblies, each once, children before parents."""
    seen: set[tuple[str, str]] = set()

    def below(entries: Sequence[BomEntry]) -> Iterator[BomEntry]:
        for entry in entries:
            if entry.is_assembly and entry.key not in seen:
                seen.add(entry.key)
                yield from below(entry.children)
                # What a variant holds is not the BOM of its original, whose number it has.
                if not entry.variant or entry.is_own_item:
                    yield entry

    # Sub-assemblies without a number hang in `unresolved`; their own sub-assemblies are synced anyway.
    for entry in below((*resolved.unresolved, *resolved.entries)):
        yield replace(resolved, assembly=entry, entries=entry.children)
    yield resolved


def assemblies_of_file(resolved: Resolved) -> Iterator[Resolved]:
    """Yield the assembly, and before it the configured copies in its file that are items of their own: no
    other file has their contents.
    """
    for assembly in assemblies(resolved):
        entry = assembly.assembly
        if entry is resolved.assembly or (entry.variant and entry.copy[0] == resolved.assembly.doc_path):
            yield assembly
