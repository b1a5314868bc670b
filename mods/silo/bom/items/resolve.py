# SPDX-License-Identifier: LGPL-2.1-or-later
"""Entries with the part numbers and names of their items (spec bom-sync §2).

Pure but for the look-up. Entries of one part number become one line; what has no number is listed apart.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from silo.bom.entry import BomEntry, walk_entries
from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.bom.items.lookup import ItemLookup, Known, look_up
from silo.bom.items.naming import display_name
from silo.bom.message import altered, message


def resolve_part_numbers(
    entries: Sequence[BomEntry], api_client: ItemLookup
) -> tuple[list[BomEntry], list[BomEntry]]:
    """Give each entry its part number and name.

    Returns (resolved, unresolved): resolved entries in order, with resolved children, and one line for each
    part number; unresolved components of every level, each once. An unresolved sub-assembly keeps its
    (resolved) children. Missing components stay in place without a number: they cannot be looked up, and they
    are not there to be registered.
    """
    items = look_up((e.silo_uuid for e in walk_entries(entries) if e.silo_uuid), api_client)
    return resolve_with(entries, items)


def resolve_with(entries: Sequence[BomEntry], items: Known) -> tuple[list[BomEntry], list[BomEntry]]:
    """Do what :func:`resolve_part_numbers` does, with items that were fetched before; pure."""
    missing: dict[tuple[str, str], BomEntry] = {}
    done: dict[int, tuple[BomEntry, bool]] = {}

    def one(entry: BomEntry) -> tuple[BomEntry, bool]:
        # Nested assemblies share their values; each distinct value is resolved once.
        if (before := done.get(id(entry))) is not None:
            return before
        if entry.missing:
            return done.setdefault(id(entry), (entry, True))
        item = items.get(entry.silo_uuid) if entry.silo_uuid else None
        number = item.get("part_number") if item is not None else None
        name = (item.get("name") or item.get("description") or number) if item is not None else None
        if not number:
            # A variant takes the number of its original, which is to be registered.
            is_for_original = entry.variant and not entry.is_own_item
            place = (entry.doc_path, entry.object_name) if is_for_original else entry.key
            if place not in missing or (missing[place].variant and not is_for_original):
                missing[place] = entry
        bom_entry = replace(
            entry,
            part_number=number or None,
            name=name,
            children=tuple(merged(entry.children)),
            unregistered=tuple(
                child for child, children_resolved in map(one, entry.children) if not children_resolved
            ),
        )
        return done.setdefault(id(entry), (bom_entry, bool(number)))

    def merged(group: Iterable[BomEntry]) -> list[BomEntry]:
        return merge_lines(entry for entry, group_resolved in map(one, group) if group_resolved)

    resolved = merged(entries)
    unresolved = [one(entry)[0] for entry in missing.values()]
    return resolved, unresolved


def numbered_findings(findings: Iterable[Finding], items: Known) -> tuple[Finding, ...]:
    """Put part numbers into the findings about identities, since people know an item by its number."""
    numbers = {uuid.lower(): str(item.get("part_number") or uuid) for uuid, item in items.items() if item}
    codes = (FindingCode.COPIED_IDENTITY, FindingCode.SHARED_IDENTITY)

    def numbered(value: str) -> str:
        return numbers.get(value.lower(), value)

    return tuple(
        replace(finding, message=altered(finding.message, numbered)) if finding.code in codes else finding
        for finding in findings
    )


def merge_lines(entries: Iterable[BomEntry]) -> list[BomEntry]:
    """Merge the entries of one parent with the same part number into one line, and sum their quantities.

    Entries without a number stay apart.
    """
    lines: dict[str | tuple[str, str], BomEntry] = {}
    for entry in entries:
        name = entry.part_number or entry.key
        before = lines.get(name)
        if before is None:
            lines[name] = entry
            continue
        if before.variant and not entry.variant:  # the line is that of the original
            before, entry = entry, before
        if before.variant and entry.variant not in before.variant.split("; "):
            before = replace(before, variant=f"{before.variant}; {entry.variant}")
        lines[name] = replace(
            before,
            also=(*before.also, entry.key, *entry.also),
            quantity=before.quantity + entry.quantity,
            is_assembly=before.is_assembly or entry.is_assembly,
            children=before.children or entry.children,
            consolidation_warning=before.consolidation_warning or entry.consolidation_warning,
            individual_links=before.individual_links + entry.individual_links,
            link_objects=before.link_objects + entry.link_objects,
            instances=before.instances + entry.instances,
            find_number=before.find_number or entry.find_number,
        )
    return list(lines.values())


def unregistered_findings(unresolved: Iterable[BomEntry]) -> tuple[Finding, ...]:
    """Make a finding for each component without a Silo part number: the BOM leaves it out, but says so."""
    return tuple(
        Finding(
            FindingCode.UNREGISTERED,
            Severity.WARNING,
            message(
                "{object_name} has no Silo part number and is left out of the BOM until it is registered.",
                object_name=display_name(_registered_as(entry)) or entry.object_name,
            ),
            (Place(entry.doc_path, entry.object_name),),
        )
        for entry in unresolved
    )


def _registered_as(entry: BomEntry) -> BomEntry:
    """Return what is to be registered for an entry: of a variant that is no item of its own, the original."""
    return replace(entry, variant="") if entry.variant and not entry.is_own_item else entry
