# SPDX-License-Identifier: LGPL-2.1-or-later
"""The JSON of ``silo-mod bom``: the tree of an assembly, written out in full, with its findings."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from silo.bom.entry import BomEntry, Extraction
from silo.bom.errors import InputError
from silo.bom.findings import Finding
from silo.bom.message import beside, message
from silo.bom.view.folders import base_folder, shorten
from silo.bom.walk.document import relative

# A line takes about 1 kB of memory on its way to JSON or to a terminal.
MOST_LINES = 500_000


def entry_json(entry: BomEntry, base: str) -> dict[str, Any]:
    """Return an entry with its children as JSON values; quantities per one parent."""
    return {
        "doc_path": relative(entry.doc_path, base),
        "object": entry.object_name,
        "label": entry.label,
        "silo_uuid": entry.silo_uuid,
        "part_number": entry.part_number,
        "name": entry.name,
        "standard": entry.standard,
        "quantity": entry.quantity,
        "missing": entry.missing,
        "level": entry.level,
        "consolidation_warning": entry.consolidation_warning,
        **({"variant": entry.variant} if entry.variant else {}),
        "children": [entry_json(child, base) for child in entry.children],
        **({"own": [entry_json(bom_entry, base) for bom_entry in entry.own]} if entry.own else {}),
    }


def finding_json(finding: Finding, base: str) -> dict[str, Any]:
    """Return a finding as JSON values; places are ``file`` and ``object``, files relative to the top file's
    folder.

    A broken link also has the ``file`` that it records, and the one that was probably meant, if there is one.
    A hidden object has a ``standing``: counts, not counted or reference.
    """
    files = {"file": finding.file, "did_you_mean": finding.did_you_mean}
    message = shorten(finding.message, base)
    return {
        "code": finding.code.value,
        "severity": finding.severity.value,
        "message": message,
        **beside(message),
        "where": [
            {
                "file": relative(place.doc_path, base),
                "object": place.obj,
                **({"standing": place.standing} if place.standing else {}),
            }
            for place in finding.where
        ],
        **{key: relative(path, base) for key, path in files.items() if path},
    }


def tree_size(entries: Iterable[BomEntry]) -> int:
    """Count the lines of the tree written out in full. Nested assemblies share values, so it may be huge."""
    sizes: dict[int, int] = {}

    def size(entry: BomEntry) -> int:
        if id(entry) not in sizes:
            sizes[id(entry)] = 1 + sum(map(size, entry.children))
        return sizes[id(entry)]

    return sum(map(size, entries))


def check_tree_size(extraction: Extraction, most: int = MOST_LINES) -> None:
    """Raise InputError if the tree has more lines than anybody could read, or memory could hold."""
    lines = tree_size(extraction.entries)
    if lines > most:
        raise InputError(
            message(
                "The BOM tree of {label} has {lines} lines, more than the {most} that can be shown. Use "
                "the flat list (--flat): each component once, with its total.",
                label=extraction.assembly.label,
                lines=f"{lines:,}",
                most=f"{most:,}",
            )
        )


def bom_json(extraction: Extraction, base: str = "") -> dict[str, Any]:
    """Return the whole BOM of an assembly as JSON values. Raises InputError if the tree is too large to be
    written out.

    Paths are relative to ``base``; without it, to the folder of the assembly's file.
    """
    check_tree_size(extraction)
    base = base or base_folder(extraction)
    head = extraction.assembly
    return {
        "assembly": {
            "doc_path": relative(head.doc_path, base),
            "object": head.object_name,
            "label": head.label,
            "silo_uuid": head.silo_uuid,
            "part_number": head.part_number,
            "name": head.name,
        },
        "entries": [entry_json(entry, base) for entry in extraction.entries],
        **({"own": [entry_json(bom_entry, base) for bom_entry in head.own]} if head.own else {}),
        "findings": [finding_json(finding, base) for finding in extraction.findings],
    }
