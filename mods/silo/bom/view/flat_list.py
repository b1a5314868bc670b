# SPDX-License-Identifier: LGPL-2.1-or-later
"""The flat list: each component of an assembly once, with its total."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from silo.bom.entry import BomEntry, Extraction, walk_entries
from silo.bom.items.naming import display_name
from silo.bom.view.folders import base_folder
from silo.bom.walk.document import relative

# A CAD model counts pieces.
PIECES = "pcs"


def flat_counts(entries: Iterable[BomEntry]) -> dict[tuple[str, str], int]:
    """Count the instances of each component in the whole assembly, sub-assemblies included."""
    below: dict[int, dict[tuple[str, str], int]] = {}

    def total(group: Iterable[BomEntry]) -> dict[tuple[str, str], int]:
        counts: dict[tuple[str, str], int] = {}
        for entry in group:
            # Nested assemblies share their values; each distinct one is counted once.
            if id(entry) not in below:
                counted = below[id(entry)] = {entry.key: 0, **total(entry.children)}
                counted[entry.key] += 1
            for key, count in below[id(entry)].items():
                counts[key] = counts.get(key, 0) + count * entry.quantity
        return counts

    return total(entries)


def flat_lines(entries: Iterable[BomEntry]) -> list[tuple[BomEntry, int]]:
    """Return each component once, with the number of its instances in the whole assembly."""
    direct = tuple(entries)
    bom_entries = {entry.key: entry for entry in walk_entries(direct)}
    return [(bom_entries[key], count) for key, count in flat_counts(direct).items()]


def flat_json(extraction: Extraction) -> list[dict[str, Any]]:
    """Return each component once, with its total, as JSON values: what a purchaser orders from.

    ``part_number`` and ``name`` as far as they are known, ``quantity`` multiplied down the tree, ``unit``,
    the ``standard`` or the file (``doc_path``, ``object``), if it is ``missing``, and of a variant its values
    (``variant``).
    """
    base = base_folder(extraction)
    return [
        {
            "part_number": entry.part_number,
            "name": entry.name or display_name(replace(entry, variant="")) or entry.object_name,
            "quantity": count,
            "unit": PIECES,
            "standard": entry.standard,
            "doc_path": relative(entry.doc_path, base),
            "object": entry.object_name,
            "missing": entry.missing,
            **({"variant": entry.variant} if entry.variant else {}),
        }
        for entry, count in flat_lines(extraction.entries)
    ]
