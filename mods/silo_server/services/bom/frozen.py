# SPDX-License-Identifier: LGPL-2.1-or-later
"""A whole product as records that never change, and a record as a product again.

A record per item: its data, files, mass, cost and lines, where a line names the record of its child. Records
lie under the SHA-256 of their text, as the objects of git do; a part in a hundred products is stored once.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from decimal import Decimal
from itertools import count
from typing import Any, NamedTuple

from sqlalchemy import select

from silo.api.wire import ItemTexts
from silo_server.db.engine import Tx, one_of
from silo_server.db.tables import document_items, document_links, documents, revisions
from silo_server.services.bom.lines import state_to_json, stored_state
from silo_server.services.bom.summary import OpenBom, Summary, Worth, summaries
from silo_server.services.bom.tree import Graph, Part, load_graph, order_of
from silo_server.services.items import by_ids
from silo_server.services.releases import Frozen, Release, is_bought, read_records
from silo_server.values import Item, Line, dumps


class Product(NamedTuple):
    """A product to be shown or exported: its lines over all levels, its parts, what one of each is worth."""

    graph: Graph
    parts: Mapping[int, Part]
    worths: Mapping[int, Worth]
    open: Mapping[int, OpenBom] = {}


def freeze(tx: Tx, item: Item) -> Frozen:
    """Read a product as it is now. Raises CycleError, TooLargeError.

    ``tx`` must be a read: on PostgreSQL, a write sees what others commit between its statements.
    """
    graph = load_graph(tx, item)
    order = order_of(graph)
    ids = graph.names().keys()
    known = by_ids(tx, ids)
    worths = summaries(tx, ids)
    files = _files(tx, known)
    without_file = [one for one in known.values() if not files[one.id]]
    hashes: dict[int, str] = {}
    records: dict[str, str] = {}
    # Children come before their parents; an item that is no assembly comes first.
    for item_id in [*sorted(ids - set(order)), *reversed(order)]:
        lines = [
            {
                "id": line.id,
                "child": hashes[line.child_id] if line.state.rel_type == "component" else None,
                "part_number": line.child_part_number,
                "item": line.child_uuid,
                "state": state_to_json(line.state),
            }
            for line in graph.lines.get(item_id, ())
        ]
        below = (one.child_id for one in graph.components(item_id))
        # A file may lie in the product without a link that leads to it, if a person uploaded it.
        files[item_id] = {**files[item_id], **{k: v for child in below for k, v in files[child].items()}}
        written = [files[item_id][document] for document in sorted(files[item_id])]
        text = dumps(_record(known[item_id], worths[item_id], written, lines))
        hashes[item_id] = hashlib.sha256(text.encode()).hexdigest()
        records[hashes[item_id]] = text
    blocks = [f"{one.part_number}: {one.words}" for one in worths[item.id].open.values()]
    blocks += [
        f"{one.part_number}: no file"
        for one in without_file
        if one.item_type in ("part", "assembly") and not is_bought(one.texts)
    ]
    return Frozen(hashes[item.id], records, sorted(blocks), tx.stamp)


def _record(
    item: Item, summary: Summary, files: Sequence[Mapping[str, Any]], lines: Sequence[Mapping[str, Any]]
) -> dict[str, Any]:
    worth = summary.as_part
    return {
        "item": item.uuid,
        "part_number": item.part_number,
        "name": item.name,
        "description": item.description,
        "item_type": item.item_type,
        "category": item.category,
        **item.texts,
        "properties": dict(item.properties),
        "revision": item.current_revision,
        "thumbnail": item.thumbnail_key,
        "mass_kg": None if worth.mass is None else str(worth.mass),
        "mass_whole": worth.mass_whole,
        "costs": {currency: str(cost) for currency, cost in sorted(worth.costs.items())},
        "cost_whole": worth.cost_whole,
        "files": files,
        "lines": lines,
    }


def _files(tx: Tx, known: Mapping[int, Item]) -> dict[int, dict[str, dict[str, Any]]]:
    """By item and document: the newest files that the item is in, and all that these link to."""
    row = document_items.c
    query = select(row.item_id, row.document_id).where(one_of(tx, row.item_id, known.keys()))
    holding: dict[int, set[int]] = {item_id: set() for item_id in known}
    for item_id, document_id in tx.conn.execute(query):
        holding[item_id].add(document_id)
    targets: dict[int, set[int]] = {}
    level = set[int]().union(*holding.values())
    link = document_links.c
    while level:
        targets |= {one: set() for one in level}
        pairs = select(link.document_id, documents.c.id).join(documents, documents.c.uuid == link.target)
        for source, target in tx.conn.execute(pairs.where(one_of(tx, link.document_id, level))):
            targets[source].add(target)
        level = set[int]().union(*(targets[one] for one in level)) - targets.keys()
    newest = (
        select(documents.c.id, documents.c.uuid, revisions)
        .join(revisions, revisions.c.document_id == documents.c.id)
        .where(revisions.c.revision_number == documents.c.current_revision)
        .where(one_of(tx, documents.c.id, targets.keys()))
    )
    written = {
        found[0]: {
            "document": found.uuid,
            "revision": found.revision_number,
            "file_name": found.file_name,
            "file_path": found.file_path,
            "sha256": found.file_checksum,
            "size": found.file_size,
        }
        for found in tx.conn.execute(newest)
    }
    reached: dict[int, dict[str, dict[str, Any]]] = {}
    for item_id, own in holding.items():
        seen, level = set(own), set(own)
        while level:
            level = set[int]().union(*(targets[one] for one in level)) - seen
            seen |= level
        reached[item_id] = {written[one]["document"]: written[one] for one in seen if one in written}
    return reached


def frozen_product(tx: Tx, item: Item, release: Release) -> Product:
    """Return a revision as it was frozen, to be shown by whatever shows a product."""
    records = read_records(tx, release.record)
    ids = {record: number for number, record in enumerate(records, start=1)}
    frozen = {ids[record]: _item(ids[record], made, release) for record, made in records.items()}
    others = count(len(ids) + 1)
    lines: dict[int, list[Line]] = {}
    parts = {ids[record]: _part(made) for record, made in records.items()}
    worths = {ids[record]: _worth(made) for record, made in records.items()}
    for record, made in records.items():
        for place, written in enumerate(made["lines"]):
            child = ids.get(written["child"]) or next(others)
            if child not in frozen:  # no component: nothing of it was frozen but its number
                named = {"part_number": written["part_number"], "item": written["item"]}
                frozen[child] = _item(child, named, release)
                parts[child], worths[child] = _part(named), Worth(None, False, {}, False)
            of = frozen[child]
            lines.setdefault(ids[record], []).append(
                Line(
                    written["id"],
                    ids[record],
                    child,
                    place,
                    of.part_number,
                    of.uuid,
                    of.name,
                    of.description,
                    of.item_type,
                    of.current_revision,
                    False,
                    stored_state(dumps(written["state"])),
                )
            )
    return Product(Graph(frozen[ids[release.record]], lines), parts, worths)


def _item(number: int, made: Mapping[str, Any], release: Release) -> Item:
    return Item(
        id=number,
        uuid=made["item"],
        part_number=made["part_number"],
        name=made.get("name", ""),
        description=made.get("description", ""),
        item_type=made.get("item_type", ""),
        schema=None,
        category=made.get("category"),
        texts={name: made.get(name) for name in ItemTexts.model_fields},
        thumbnail_key=made.get("thumbnail"),
        properties=made.get("properties", {}),
        current_revision=made.get("revision", 0),
        bom_version=0,
        version=0,
        created_at=release.frozen_at,
        created_by=release.created_by,
        updated_at=release.frozen_at,
        updated_by=release.created_by,
        archived_at=None,
    )


def _part(made: Mapping[str, Any]) -> Part:
    texts = (made["part_number"], made.get("name", ""), made.get("description", ""))
    return Part(*texts, made.get("properties", {}), made.get("thumbnail"))


def _worth(made: Mapping[str, Any]) -> Worth:
    mass = None if made["mass_kg"] is None else Decimal(made["mass_kg"])
    costs = {currency: Decimal(cost) for currency, cost in made["costs"].items()}
    return Worth(mass, made["mass_whole"], costs, made["cost_whole"])
