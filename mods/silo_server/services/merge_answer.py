# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a merge tells: the answer and the event, in exactly the spec's JSON (bom-sync §5)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import quote

from silo.bom.merge import summary
from silo.bom.model import BomDiff, QuantityChange
from silo_server.clock import spec_time
from silo_server.db.engine import Tx
from silo_server.values import Item, number

UNREFERENCED = "Present in server BOM but not in assembly"
# An event goes to every listener: beyond this many unchanged lines it only says how many there are.
EVENT_UNCHANGED_LINES = 500


def resolve_url(part_number: str) -> str:
    """Where a person decides on what a merge left open."""
    return f"/items/{quote(part_number, safe='')}/bom"


def answer_of(
    parent: Item, diff: BomDiff, sync_id: str | None, left_out: Sequence[Mapping[str, Any]] = ()
) -> dict[str, Any]:
    """The answer to a merge: the spec's keys; ``sync_id`` and ``left_out`` only where there are such."""
    answer: dict[str, Any] = {
        "status": "merged",
        "diff": {
            "added": [_pair(c.part_number, c.quantity) for c in diff.added],
            "removed": [_pair(c.part_number, c.quantity) for c in diff.removed],
            "quantity_changed": [
                {
                    "part_number": c.part_number,
                    "old_quantity": number(c.remote_quantity),
                    "new_quantity": number(c.local_quantity),
                }
                for c in diff.quantity_changed
            ],
            "unchanged": [_pair(c.part_number, c.quantity) for c in diff.unchanged],
        },
        "warnings": [
            {"type": "unreferenced", "part_number": c.part_number, "message": UNREFERENCED}
            for c in diff.removed
        ]
        + [_conflict_warning(c) for c in diff.conflicts],
        "resolve_url": resolve_url(parent.part_number),
    }
    if sync_id:
        answer["sync_id"] = sync_id
    if left_out:
        answer["left_out"] = [dict(one) for one in left_out]
    return answer


def _pair(part_number: str, quantity: float | None) -> dict[str, Any]:
    return {"part_number": part_number, "quantity": number(quantity)}


def _conflict_warning(conflict: QuantityChange) -> dict[str, Any]:
    cad, ours = number(conflict.local_quantity), number(conflict.remote_quantity)
    return {
        "type": "conflict",
        "part_number": conflict.part_number,
        "message": f"The assembly has {cad}, Silo has {ours} (set by a person); a person decides",
        "assembly_quantity": cad,
        "server_quantity": ours,
    }


def event_of(tx: Tx, parent: Item, diff: BomDiff, answer: Mapping[str, Any]) -> dict[str, Any]:
    """The spec's event; ``warnings`` only where there is a conflict, which the diff does not say."""
    told = dict(answer["diff"])
    if len(told["unchanged"]) > EVENT_UNCHANGED_LINES:
        told["unchanged_count"] = len(told["unchanged"])
        told["unchanged"] = []
    event: dict[str, Any] = {
        "type": "bom_merge",
        "item": parent.part_number,
        "user": tx.actor.username,
        "timestamp": spec_time(tx.stamp),
        "summary": summary(diff),
        "diff": told,
        "resolve_url": answer["resolve_url"],
    }
    if "sync_id" in answer:
        event["sync_id"] = answer["sync_id"]
    if "left_out" in answer:
        event["left_out"] = answer["left_out"][:EVENT_UNCHANGED_LINES]
    if diff.conflicts:
        event["warnings"] = answer["warnings"]
    return event
