# SPDX-License-Identifier: LGPL-2.1-or-later
"""The last sync of each assembly: when, from which file, what it left out, and what each line is in CAD.

One row per assembly, written by the merge in its own transaction. An incomplete BOM must never look like a
complete one, and an assembly that was never synced must not look like a part.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from sqlalchemy import delete, insert, select, update

from silo.bom.left_out import Reason, in_words, remembered
from silo.bom.message import joined, message
from silo_server.db.rows import one_of
from silo_server.db.tables import bom_last_syncs
from silo_server.db.transaction import Tx
from silo_server.fields import from_row
from silo_server.services.bom.held import HeldBom, forget_held, held_of
from silo_server.services.bom.merge_request import MergeRequestIn
from silo_server.times import wire_time
from silo_server.user_json import dumps
from silo_server.values import Item


@dataclass(frozen=True, slots=True)
class LastSync:
    """What is known of an assembly's last sync. ``at`` None: it was never synced.

    left_out
        what the assembly holds and the BOM does not: the fields of :class:`silo.bom.left_out.LeftOut`.
    refused_at
        when the server refused a later merge, None if it did not; ``refusal`` says why.
    held
        a later BOM waits on the designer's computer (:mod:`silo_server.services.bom.held`).
    """

    at: str | None = None
    username: str = ""
    document_file: str | None = None
    left_out: Sequence[Mapping[str, Any]] = ()
    refused_at: str | None = None
    refusal: str = ""
    components: Mapping[int, Sequence[Mapping[str, str]]] = field(default_factory=dict)
    folder: str = ""
    held: HeldBom | None = None

    @property
    def gaps(self) -> list[dict[str, Any]]:
        """List everything that is not in the BOM, including a merge that was refused or is held."""
        gaps = self.own_gaps
        if self.held is not None:
            gaps.append(self.held.as_gap())
        return gaps

    @property
    def own_gaps(self) -> list[dict[str, Any]]:
        """List what the last merge left out, and that it was refused."""
        gaps = [dict(part) for part in self.left_out]
        if self.refused_at:
            gaps.append({"reason": Reason.REFUSED.value, "message": self.refusal})
        return gaps

    @property
    def held_gaps(self) -> Sequence[Mapping[str, Any]]:
        """List what holds a later BOM back."""
        return () if self.held is None else self.held.left_out

    @property
    def words(self) -> str:
        """Count the gaps in words: ``2 missing, 1 unregistered``; "" if there are none."""
        return in_words(self.own_gaps)

    @property
    def incomplete(self) -> str:
        """Say that the BOM lacks something, and what; "" if it does not."""
        words = [message("incomplete: {words}", words=self.words)] if self.words else []
        words += [self.held.words] if self.held is not None else []
        return joined(", ", words) if words else ""

    def to_wire(self) -> dict[str, Any]:
        """Return the last sync as the API sends it."""
        held = {} if self.held is None else {"held": self.held.to_wire()}
        return {"at": wire_time(self.at), "left_out": self.gaps, **held}


NEVER = LastSync()


def last_sync(tx: Tx, parent: Item) -> LastSync:
    """Return the last sync of one assembly; :data:`NEVER` if there was none."""
    return last_syncs(tx, [parent.id]).get(parent.id, NEVER)


def last_syncs(tx: Tx, parent_ids: Collection[int]) -> dict[int, LastSync]:
    """Read the last syncs of these assemblies; those that were never synced (nor refused) are absent."""
    rows = tx.conn.execute(select(bom_last_syncs).where(one_of(tx, bom_last_syncs.c.parent_id, parent_ids)))
    syncs = {row.parent_id: _read(row) for row in rows}
    for parent_id, held in held_of(tx, parent_ids).items():
        syncs[parent_id] = replace(syncs.get(parent_id, NEVER), held=held)
    return syncs


def _read(row: Any) -> LastSync:
    return from_row(
        LastSync,
        row,
        left_out=json.loads(row.left_out),
        held=None,
        refusal=row.refusal or "",
        components={int(child): components for child, components in json.loads(row.components).items()},
        folder=row.folder or "",
    )


def record_merge(
    tx: Tx,
    parent: Item,
    request: MergeRequestIn,
    children: Mapping[str, int],
    before: LastSync,
    kept: Sequence[str],
) -> None:
    """Record a merge. ``children``: part number → item id; ``kept``: the lines of missing components."""
    ids = {number.casefold(): str(child) for number, child in children.items()}
    entries = [
        {"child_part_number": ids[entry.key], "components": entry.components} for entry in request.entries
    ]
    components_before = {str(child): list(parts) for child, parts in before.components.items()}
    components = remembered(components_before, entries, [str(children[number]) for number in kept])
    tx.conn.execute(delete(bom_last_syncs).where(bom_last_syncs.c.parent_id == parent.id))
    forget_held(tx, parent)
    row = {
        "at": tx.stamp,
        "document_file": request.document_file,
        "folder": request.document_folder or before.folder or None,
        "left_out": dumps([dict(part) for part in request.left_out]),
        "components": dumps(components),
    }
    _insert(tx, parent, row)


def record_refusal(tx: Tx, parent: Item, message: str) -> None:
    """Record that a merge was refused; the last good merge stays known. No event announces it."""
    written = {"refused_at": tx.stamp, "refusal": message}
    updated = tx.conn.execute(
        update(bom_last_syncs).where(bom_last_syncs.c.parent_id == parent.id).values(**written)
    )
    if not updated.rowcount:
        _insert(tx, parent, {"left_out": "[]", "components": "{}", **written})
    tx.touched.add(parent.uuid)


def _insert(tx: Tx, parent: Item, row: Mapping[str, Any]) -> None:
    who = {"parent_id": parent.id, "username": tx.actor.username}
    tx.conn.execute(insert(bom_last_syncs).values(**who, **row))


def in_sentences(gaps: Sequence[Mapping[str, Any]]) -> list[str]:
    """Describe what was left out, each gap in a sentence."""
    return [_sentence(gap) for gap in gaps]


def _sentence(gap: Mapping[str, Any]) -> str:
    name, count = gap.get("name") or gap.get("object") or "", gap.get("quantity")
    who = f"{count} × {name}" if count else str(name)
    where = f" ({gap['file']})" if gap.get("file") else ""
    why = gap.get("message", "")
    texts: dict[str, str] = {
        Reason.MISSING: message(
            "{part}{where}: the file is missing or cannot be read", part=who, where=where
        ),
        Reason.UNREGISTERED: message("{part}{where}: no part number yet", part=who, where=where),
        Reason.BROKEN: why,
        Reason.HELD: message("a later BOM is {state}", state=why),
        Reason.REFUSED: message("a later sync was refused: {problem}", problem=why),
    }
    return texts.get(gap["reason"]) or f"{gap['reason']}: {who}{where} {why}".rstrip()
