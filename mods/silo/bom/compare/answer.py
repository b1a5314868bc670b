# SPDX-License-Identifier: LGPL-2.1-or-later
"""The answer to a merge as JSON values (spec bom-sync §5).

Its one writer: for the server, the fake, and a client that merges by single calls.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from silo.bom.compare.bom_diff import BomChange, BomDiff, QuantityChange
from silo.bom.items.part_address import part_page
from silo.bom.message import joined, message
from silo.bom.quantities import plain


def summary(diff: BomDiff) -> str:
    """Write the sentence of the spec's event: ``BOM updated: 1 added, 1 quantity changed, 1
    unreferenced``.
    """
    parts = [
        message("{count} added", count=len(diff.added)),
        message("{count} quantity changed", count=len(diff.quantity_changed)),
        message("{count} unreferenced", count=len(diff.removed)),
    ]
    if diff.conflicts:
        parts.append(message("{count} in conflict", count=len(diff.conflicts)))
    words = joined(", ", parts)
    return message("BOM updated: {words}", words=words)


def resolve_url(part_number: str) -> str:
    """Return the page where a reviewer decides about what a merge left open."""
    return part_page(part_number, "bom")


def answer_of(
    diff: BomDiff, part_number: str, sync_id: str | None = None, left_out: Sequence[Mapping[str, Any]] = ()
) -> dict[str, Any]:
    """Make the answer to a merge (spec §5), with ``sync_id`` and ``left_out`` only if they are not empty."""

    def lines(changes: Iterable[BomChange]) -> list[dict[str, Any]]:
        return [
            {"part_number": bom_change.part_number, "quantity": plain(bom_change.quantity)}
            for bom_change in changes
        ]

    unreferenced = [
        {
            "type": "unreferenced",
            "part_number": change.part_number,
            "message": message("Present in server BOM but not in assembly"),
        }
        for change in diff.removed
    ]
    answer: dict[str, Any] = {
        "status": "merged",
        "diff": {
            "added": lines(diff.added),
            "removed": lines(diff.removed),
            "quantity_changed": [
                {
                    "part_number": change.part_number,
                    "old_quantity": plain(change.remote_quantity),
                    "new_quantity": plain(change.local_quantity),
                }
                for change in diff.quantity_changed
            ],
            "unchanged": lines(diff.unchanged),
        },
        "warnings": unreferenced + [conflict_warning(change) for change in diff.conflicts],
        "resolve_url": resolve_url(part_number),
    }
    kept_answer = {"sync_id": sync_id, "left_out": [dict(part) for part in left_out]}
    return answer | {name: value for name, value in kept_answer.items() if value}


def conflict_warning(change: QuantityChange) -> dict[str, Any]:
    """Make the warning about a line whose quantity a user set, and which differs from the assembly's."""
    cad, ours = plain(change.local_quantity), plain(change.remote_quantity)
    kept = change.on_server(str(ours))
    return {
        "type": "conflict",
        "part_number": change.part_number,
        "message": message(
            "The assembly has {cad}, Silo has {kept} (set by a user); a reviewer decides", cad=cad, kept=kept
        ),
        "assembly_quantity": cad,
        "server_quantity": ours,
    }
