# SPDX-License-Identifier: LGPL-2.1-or-later
"""The last sync of each assembly: when, from which file, what it left out, and what each line is in CAD.

One row per assembly, written by the merge in its own transaction. An incomplete BOM must never look like a
complete one, and an assembly that was never synced must not look like a part.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from sqlalchemy import delete, insert, select, update

from silo.bom.left_out import Reason, in_words, remembered
from silo_server.clock import wire
from silo_server.db.bulk import one_of
from silo_server.db.engine import Tx
from silo_server.db.tables import bom_last_syncs, bom_lines
from silo_server.json_values import dumps
from silo_server.services.bom.merge_json import MergeOrder
from silo_server.services.bom.tree import Graph
from silo_server.values import Item, from_row


@dataclass(frozen=True, slots=True)
class LastSync:
    """What is known of an assembly's last sync. ``at`` None: it was never synced.

    left_out
        what the assembly holds and the BOM does not: the fields of :class:`silo.bom.left_out.LeftOut`.
    refused_at
        when the server refused a later merge, None where it did not; ``refusal`` says why.
    """

    at: str | None = None
    username: str = ""
    document_file: str | None = None
    left_out: Sequence[Mapping[str, Any]] = ()
    refused_at: str | None = None
    refusal: str = ""
    components: Mapping[int, Sequence[Mapping[str, str]]] = field(default_factory=dict)
    folder: str = ""

    @property
    def gaps(self) -> list[dict[str, Any]]:
        """Everything that is not in the BOM, a refused merge too."""
        gaps = [dict(one) for one in self.left_out]
        if self.refused_at:
            gaps.append({"reason": Reason.REFUSED.value, "message": self.refusal})
        return gaps

    @property
    def words(self) -> str:
        """``2 missing, 1 unregistered``; "" where nothing was left out."""
        return in_words(self.gaps)

    def to_wire(self) -> dict[str, Any]:
        """As the API sends it."""
        return {"at": wire(self.at), "left_out": self.gaps}


NEVER = LastSync()


def last_sync(tx: Tx, parent: Item) -> LastSync:
    """The last sync of one assembly."""
    return last_syncs(tx, [parent.id]).get(parent.id, NEVER)


def last_syncs(tx: Tx, parent_ids: Collection[int]) -> dict[int, LastSync]:
    """The last syncs of all these assemblies; those that were never synced (nor refused) are absent."""
    rows = tx.conn.execute(select(bom_last_syncs).where(one_of(tx, bom_last_syncs.c.parent_id, parent_ids)))
    return {row.parent_id: _read(row) for row in rows}


def _read(row: Any) -> LastSync:
    return from_row(
        LastSync,
        row,
        left_out=json.loads(row.left_out),
        refusal=row.refusal or "",
        components={int(child): known for child, known in json.loads(row.components).items()},
        folder=row.folder or "",
    )


def remember(
    tx: Tx,
    parent: Item,
    order: MergeOrder,
    children: Mapping[str, int],
    before: LastSync,
    kept: Sequence[str],
) -> None:
    """Write down a merge. ``children``: part number → item id; ``kept``: the lines of missing components."""
    ids = {number.casefold(): str(child) for number, child in children.items()}
    entries = [
        {"child_part_number": ids[entry.key], "components": entry.components} for entry in order.entries
    ]
    known = {str(child): list(components) for child, components in before.components.items()}
    components = remembered(known, entries, [str(children[number]) for number in kept])
    tx.conn.execute(delete(bom_last_syncs).where(bom_last_syncs.c.parent_id == parent.id))
    row = {
        "at": tx.stamp,
        "document_file": order.document_file,
        "folder": order.document_folder or before.folder or None,
        "left_out": dumps([dict(one) for one in order.left_out]),
        "components": dumps(components),
    }
    _insert(tx, parent, row)


def remember_refusal(tx: Tx, parent: Item, message: str) -> None:
    """Write down that a merge was refused; what the last good one said stays."""
    written = {"refused_at": tx.stamp, "refusal": message}
    known = tx.conn.execute(
        update(bom_last_syncs).where(bom_last_syncs.c.parent_id == parent.id).values(**written)
    )
    if not known.rowcount:
        _insert(tx, parent, {"left_out": "[]", "components": "{}", **written})


def _insert(tx: Tx, parent: Item, row: Mapping[str, Any]) -> None:
    who = {"parent_id": parent.id, "username": tx.actor.username}
    tx.conn.execute(insert(bom_last_syncs).values(**who, **row))


def in_sentences(gaps: Sequence[Mapping[str, Any]]) -> list[str]:
    """What was left out, each in a sentence."""
    return [_sentence(gap) for gap in gaps]


def _sentence(gap: Mapping[str, Any]) -> str:
    name, count = gap.get("name") or gap.get("object") or "", gap.get("quantity")
    who = f"{count} × {name}" if count else str(name)
    where = f" ({gap['file']})" if gap.get("file") else ""
    known = {
        Reason.MISSING: f"{who}{where}: the file is missing or cannot be read",
        Reason.UNREGISTERED: f"{who}{where}: no part number yet",
        Reason.BROKEN: str(gap.get("message", "")),
        Reason.REFUSED: f"a later sync was refused: {gap.get('message', '')}",
    }
    return known.get(gap["reason"], f"{gap['reason']}: {who}{where} {gap.get('message', '')}").rstrip()


def marks(tx: Tx, graph: Graph) -> dict[int, str]:
    """Item id → ``incomplete: 2 missing`` or ``never synced``, for all assemblies of a tree that need it."""
    ids = {graph.root.id} if graph.root.item_type == "assembly" else set()
    ids |= graph.lines.keys()
    for lines in graph.lines.values():
        ids |= {line.child_id for line in lines if line.child_item_type == "assembly"}
    known = last_syncs(tx, ids)
    never = [one for one in ids if known.get(one, NEVER).at is None]
    # Not all of the tree may be loaded, so the lines are asked for.
    made_by_hand = set(
        tx.conn.scalars(select(bom_lines.c.parent_id).where(one_of(tx, bom_lines.c.parent_id, never)))
    )
    found: dict[int, str] = {}
    for one in ids:
        last = known.get(one, NEVER)
        if last.gaps:
            found[one] = f"incomplete: {last.words}"
        elif last.at is None and one not in made_by_hand:
            found[one] = "never synced"
    return found
