# SPDX-License-Identifier: LGPL-2.1-or-later
"""From Silo UUIDs to part numbers (spec bom-sync §2), in as few requests as the server allows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol

from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.bom.identity import walk_entries
from silo.bom.model import BomEntry
from silo.bom.naming import display_name


class ItemLookup(Protocol):
    """What is needed of a client.

    ``get_items_by_uuid(uuids)`` is used where the client has it; it gives a mapping UUID → item (or None), or
    the items found, each naming its UUID as ``id``, ``uuid`` or ``silo_uuid``.
    """

    def get_item_by_uuid(self, uuid: str, /) -> Mapping[str, Any] | None: ...


Known = Mapping[str, Mapping[str, Any] | None]

_UUID_KEYS = ("id", "uuid", "silo_uuid")


def look_up(uuids: Iterable[str], api_client: ItemLookup) -> Known:
    """The items of these UUIDs, each asked for once; None (or absent) where the server has none."""
    wanted = list(dict.fromkeys(uuids))
    batch = getattr(api_client, "get_items_by_uuid", None)
    if callable(batch) and wanted:
        found = _by_uuid(batch(wanted))
        return {uuid: found.get(uuid) or found.get(uuid.lower()) for uuid in wanted}
    return {uuid: api_client.get_item_by_uuid(uuid) for uuid in wanted}


def _by_uuid(answer: Any) -> Known:
    if isinstance(answer, Mapping):
        return answer
    items = [item for item in answer or () if item is not None]
    return {str(item[key]): item for item in items for key in _UUID_KEYS if item.get(key)}


def resolve_part_numbers(
    entries: Sequence[BomEntry], api_client: ItemLookup
) -> tuple[list[BomEntry], list[BomEntry]]:
    """Give each entry its part number and name.

    Returns (resolved, unresolved): resolved entries in order, with resolved children, several with one part
    number summed into one line; unresolved components of every level, each once. An unresolved sub-assembly
    keeps its (resolved) children. Missing components stay in place without a number: nobody can look up what
    they are, and they are not there to be registered.
    """
    known = look_up((e.silo_uuid for e in walk_entries(entries) if e.silo_uuid), api_client)
    return resolve_with(entries, known)


def resolve_with(entries: Sequence[BomEntry], known: Known) -> tuple[list[BomEntry], list[BomEntry]]:
    """:func:`resolve_part_numbers` against items fetched before; pure."""
    missing: dict[tuple[str, str], BomEntry] = {}
    done: dict[int, tuple[BomEntry, bool]] = {}

    def one(entry: BomEntry) -> tuple[BomEntry, bool]:
        # Nested assemblies share their values; each distinct value is resolved once.
        if (before := done.get(id(entry))) is not None:
            return before
        if entry.missing:
            done[id(entry)] = (entry, True)
            return done[id(entry)]
        item = known.get(entry.silo_uuid) if entry.silo_uuid else None
        number = item.get("part_number") if item is not None else None
        name = (item.get("name") or item.get("description") or number) if item is not None else None
        if not number:
            missing.setdefault(entry.key, entry)
        told = replace(
            entry,
            part_number=number or None,
            name=name,
            children=tuple(several(entry.children)),
            unregistered=tuple(child for child, found in map(one, entry.children) if not found),
        )
        done[id(entry)] = (told, bool(number))
        return done[id(entry)]

    def several(group: Iterable[BomEntry]) -> list[BomEntry]:
        return merge_lines(entry for entry, found in map(one, group) if found)

    resolved = several(entries)
    unresolved = [one(entry)[0] for entry in missing.values()]
    return resolved, unresolved


def numbered_findings(findings: Iterable[Finding], known: Known) -> tuple[Finding, ...]:
    """The findings, those about an identity with the part number that people know it by."""
    numbers = {
        uuid: str(item["part_number"]) for uuid, item in known.items() if item and item.get("part_number")
    }
    return tuple(
        replace(finding, message=_numbered(finding.message, numbers))
        if finding.code in (FindingCode.COPIED_IDENTITY, FindingCode.SHARED_IDENTITY)
        else finding
        for finding in findings
    )


def _numbered(message: str, numbers: Mapping[str, str]) -> str:
    for uuid, number in numbers.items():
        for spelt in (uuid, uuid.lower()):
            message = message.replace(f"Silo identity {spelt}:", f"Silo identity, that of {number}:")
    return message


def merge_lines(entries: Iterable[BomEntry]) -> list[BomEntry]:
    """Entries of one parent with one part number become one line with the summed quantity.

    Entries without a number stay apart.
    """
    lines: dict[str | tuple[str, str], BomEntry] = {}
    for entry in entries:
        name = entry.part_number or entry.key
        before = lines.get(name)
        if before is None:
            lines[name] = entry
            continue
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
        )
    return list(lines.values())


def consolidation_message(entry: BomEntry) -> str:
    """The spec's console warning (§6), with the count of individual links."""
    who = entry.part_number or display_name(entry) or entry.object_name or entry.doc_path
    count = entry.individual_links
    if count > 1:
        what = f"{count} individual links"
    elif count == 1:
        what = "1 individual link beside a link array"
    else:
        what = f"{entry.link_objects} link arrays" if entry.link_objects > 1 else "several links"
    advice = "Consider using a link array (ElementCount) for cleaner assembly management."
    return f"[Silo BOM] {who} has {what}. {advice}"


def consolidation_findings(entries: Iterable[BomEntry]) -> tuple[Finding, ...]:
    """The consolidation warnings of a tree: for each assembly once, those of the top first.

    ``where`` names the component and, below the top, the assembly that links it several times.
    """
    direct = tuple(entries)
    findings = [_consolidation(entry) for entry in direct if entry.consolidation_warning]
    findings += [
        _consolidation(entry, assembly)
        for assembly in walk_entries(direct)
        for entry in assembly.children
        if entry.consolidation_warning
    ]
    return tuple(findings)


def _consolidation(entry: BomEntry, assembly: BomEntry | None = None) -> Finding:
    places = [Place(part.doc_path, part.object_name) for part in (entry, assembly) if part is not None]
    return Finding(FindingCode.CONSOLIDATION, Severity.WARNING, consolidation_message(entry), tuple(places))


def unregistered_findings(unresolved: Iterable[BomEntry]) -> tuple[Finding, ...]:
    """Components without a Silo part number: left out of the BOM, never in silence."""
    return tuple(
        Finding(
            FindingCode.UNREGISTERED,
            Severity.WARNING,
            f"{display_name(entry) or entry.object_name} has no Silo part number and is left out of the BOM "
            "until it is registered.",
            (Place(entry.doc_path, entry.object_name),),
        )
        for entry in unresolved
    )
