# SPDX-License-Identifier: LGPL-2.1-or-later
"""A whole product as records that never change, and a record as a product again.

What differs between two records, or a record and the product as it is now.

A record per item: its data, files, mass, cost and lines, where a line names the record of its child. Records
lie under the SHA-256 of their text, as the objects of git do; a part in a hundred products is stored once.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from itertools import count
from typing import Any, NamedTuple

from sqlalchemy import select

from silo.api.wire import ItemTexts
from silo.bom.message import Message, message
from silo.bom.quantities import plain
from silo.file_kind import KIND_WORDS, MODEL
from silo_server.db.rows import one_of
from silo_server.db.tables import document_items, document_links, documents, revisions
from silo_server.db.transaction import Tx
from silo_server.services.attachments import Attachment, attachments_of
from silo_server.services.bom.differences import compare
from silo_server.services.bom.history import NamedItem, PastLine
from silo_server.services.bom.line_state import state_to_json, stored_state
from silo_server.services.items import by_ids
from silo_server.services.product.changes import (
    PastChange,
    data_differs,
    in_order,
    line_happened,
    what_changed,
)
from silo_server.services.product.cost import PartCost, at_prices, part_cost
from silo_server.services.product.graph import Graph, load_graph, order_of
from silo_server.services.product.moments import moment
from silo_server.services.product.parts import RolledItem, some_parts, with_supplier
from silo_server.services.product.summary import OpenBom, Summary
from silo_server.services.product.summary_read import summaries
from silo_server.services.product.worth import MassAndCost
from silo_server.services.releases import FrozenProduct, Release, find_release, item_of, read_records
from silo_server.services.suppliers import rates_of
from silo_server.user_json import dumps
from silo_server.values import Item, Line, bought


class ProductContent(NamedTuple):
    """A product to be shown or exported: its lines over all levels, its parts, what one of each is worth."""

    graph: Graph
    parts: Mapping[int, RolledItem]
    worths: Mapping[int, MassAndCost]
    open: Mapping[int, OpenBom] = {}
    items: Mapping[int, Item] = {}


def freeze(tx: Tx, item: Item) -> FrozenProduct:
    """Read a product as it is now. Raises CycleError, TooLargeError.

    ``tx`` must be a read: on PostgreSQL, a write sees what others commit between its statements.
    """
    graph = load_graph(tx, item)
    order = order_of(graph)
    ids = graph.names().keys()
    items = by_ids(tx, ids)
    worths = summaries(tx, ids)
    prices = _own_prices(tx, worths)
    files, beside = _files(tx, items), attachments_of(tx, ids)
    without_file = [part for part in items.values() if not files[part.id]]
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
        below = (component.child_id for component in graph.components(item_id))
        # A file may lie in the product without a link that leads to it, if a user uploaded it.
        files[item_id] = {**files[item_id], **{k: v for child in below for k, v in files[child].items()}}
        written = [files[item_id][document] for document in sorted(files[item_id])]
        worth = at_prices(worths[item_id].as_part, prices[item_id])
        text = dumps(_record(items[item_id], worth, written, beside.get(item_id, ()), lines))
        hashes[item_id] = hashlib.sha256(text.encode()).hexdigest()
        records[hashes[item_id]] = text
    blocks: list[str] = [
        message("{part_number}: {words}", part_number=bom.part_number, words=bom.words)
        for bom in worths[item.id].open.values()
    ]
    blocks += [
        message("{part_number}: no file", part_number=part.part_number)
        for part in without_file
        if _is_modelled(part)
    ]
    blocks += [
        message("{part_number}: no {kind}", part_number=part.part_number, kind=Message(KIND_WORDS[kind]))
        for part in filter(_is_modelled, items.values())
        for kind in tx.settings.release_kinds
        if kind not in {attachment.kind for attachment in beside.get(part.id, ())}
    ]
    return FrozenProduct(hashes[item.id], records, sorted(blocks), tx.stamp)


def _own_prices(tx: Tx, summaries_by_item: Mapping[int, Summary]) -> dict[int, Mapping[int, PartCost]]:
    """Find the graded prices of each item for one piece of it."""
    graded = {item_id: summary.as_part.graded for item_id, summary in summaries_by_item.items()}
    parts = some_parts(tx, {part_id for held in graded.values() for part_id in held})
    rates = rates_of(tx) if parts else {}
    return {
        item_id: {part_id: part_cost(parts[part_id], amount, rates) for part_id, amount in held.items()}
        for item_id, held in graded.items()
    }


def _is_modelled(item: Item) -> bool:
    """Report whether the site makes an item itself, and so needs its model and its drawings."""
    return item.item_type in ("part", "assembly") and not item.is_bought


def _record(
    item: Item,
    worth: MassAndCost,
    files: Sequence[Mapping[str, Any]],
    beside: Sequence[Attachment],
    lines: Sequence[Mapping[str, Any]],
) -> dict[str, Any]:
    attached = [
        {
            "document": attachment.id,
            "revision": attachment.revision_number,
            "kind": attachment.kind,
            "file_name": attachment.file_name,
            "sha256": attachment.file_checksum,
            "size": attachment.file_size,
        }
        for attachment in beside
    ]
    return {
        "item": item.uuid,
        "part_number": item.part_number,
        "name": item.name,
        "description": item.description,
        "item_type": item.item_type,
        "category": item.category,
        **{name: value for name, value in item.texts.items() if name != "unit" or value},
        "properties": dict(item.properties),
        # Only if there are any: so older records keep their hash.
        **({"supplier_parts": item.supplier_parts} if item.supplier_parts else {}),
        "revision": item.current_revision,
        "thumbnail": item.thumbnail_key,
        "mass_kg": None if worth.mass is None else str(worth.mass),
        "mass_whole": worth.mass_whole,
        "costs": {currency: str(cost) for currency, cost in sorted(worth.costs.items())},
        "cost_whole": worth.cost_whole,
        "files": files,
        **({"attachments": attached} if attached else {}),
        "lines": lines,
    }


def frozen_files(tx: Tx, record: str) -> tuple[list[Mapping[str, Any]], list[Mapping[str, Any]]]:
    """Read the models of a frozen product, and the attachments of all its items, each with its part number.

    Before files had kinds, the newest file of an item was frozen as its model, whatever it was: the kind of
    that revision decides. Raises TooLargeError.
    """
    records = read_records(tx, record)
    numbers = {made["item"]: made["part_number"] for made in records.values()}
    files: Sequence[Mapping[str, Any]] = records[record]["files"]
    query = (
        select(documents.c.uuid, revisions.c.revision_number, revisions.c.kind)
        .join(revisions, revisions.c.document_id == documents.c.id)
        .where(one_of(tx, documents.c.uuid, {file["document"] for file in files}))
        .where(revisions.c.kind != MODEL)
    )
    others = {(uuid, number): kind for uuid, number, kind in tx.conn.execute(query)}
    models: list[Mapping[str, Any]] = []
    beside: list[Mapping[str, Any]] = []
    for file in files:
        kind = others.get((file["document"], file["revision"]))
        if kind is None:
            models.append(file)
        else:
            beside.append({**file, "kind": kind, "part_number": numbers.get(file["document"], "")})
    beside += [
        {**attached, "part_number": made["part_number"]}
        for made in records.values()
        for attached in made.get("attachments", ())
    ]
    return models, sorted(beside, key=lambda each: (each["part_number"], each["kind"], each["file_name"]))


def _files(tx: Tx, items: Mapping[int, Item]) -> dict[int, dict[str, dict[str, Any]]]:
    """Find by item and document the newest files that the item is in, and all files that these link to."""
    row = document_items.c
    query = select(row.item_id, row.document_id).where(one_of(tx, row.item_id, items.keys()))
    holding: dict[int, set[int]] = {item_id: set() for item_id in items}
    for item_id, document_id in tx.conn.execute(query):
        holding[item_id].add(document_id)
    targets: dict[int, set[int]] = {}
    level = set[int]().union(*holding.values())
    link = document_links.c
    while level:
        targets |= {part_id: set() for part_id in level}
        pairs = select(link.document_id, documents.c.id).join(documents, documents.c.uuid == link.target)
        for source, target in tx.conn.execute(pairs.where(one_of(tx, link.document_id, level))):
            targets[source].add(target)
        level = set[int]().union(*(targets[part_id] for part_id in level)) - targets.keys()
    newest = (
        select(documents.c.id, documents.c.uuid, revisions)
        .join(revisions, revisions.c.document_id == documents.c.id)
        .where(revisions.c.revision_number == documents.c.current_revision)
        .where(one_of(tx, documents.c.id, targets.keys()))
    )
    written = {
        newest_row[0]: {
            "document": newest_row.uuid,
            "revision": newest_row.revision_number,
            "file_name": newest_row.file_name,
            "file_path": newest_row.file_path,
            "sha256": newest_row.file_checksum,
            "size": newest_row.file_size,
        }
        for newest_row in tx.conn.execute(newest)
    }
    reached: dict[int, dict[str, dict[str, Any]]] = {}
    for item_id, own in holding.items():
        seen, level = set(own), set(own)
        while level:
            level = set[int]().union(*(targets[part_id] for part_id in level)) - seen
            seen |= level
        reached[item_id] = {
            written[part_id]["document"]: written[part_id] for part_id in seen if part_id in written
        }
    return reached


def frozen_product(tx: Tx, item: Item, release: Release) -> ProductContent:
    """Read a product as it was frozen, to be shown or exported. Raises TooLargeError."""
    records = read_records(tx, release.record)
    ids = {record: number for number, record in enumerate(records, start=1)}
    who = (release.frozen_at, release.created_by)
    frozen = {ids[record]: item_of(made, ids[record], *who) for record, made in records.items()}
    others = count(len(ids) + 1)
    lines: dict[int, list[Line]] = {}
    parts = {ids[record]: _part(made) for record, made in records.items()}
    worths = {ids[record]: _worth_of(made) for record, made in records.items()}
    for record, made in records.items():
        for place, written in enumerate(made["lines"]):
            child = ids.get(written["child"]) or next(others)
            if child not in frozen:  # no component: only its number was frozen
                named = {"part_number": written["part_number"], "item": written["item"]}
                frozen[child] = item_of(named, child, *who)
                parts[child], worths[child] = _part(named), MassAndCost(None, False, {}, False)
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
                    of.texts.get("unit"),
                    stored_state(dumps(written["state"])),
                )
            )
    return ProductContent(Graph(frozen[ids[release.record]], lines), parts, worths, items=frozen)


def _part(made: Mapping[str, Any]) -> RolledItem:
    texts = (made["part_number"], made.get("name", ""), made.get("description", ""))
    sourcing, listed = made.get("sourcing_type"), made.get("supplier_parts", ())
    properties = with_supplier(made.get("properties", {}), listed)
    is_bought = bought(sourcing, properties.get("supplier"))
    return RolledItem(
        *texts,
        properties,
        made.get("thumbnail"),
        is_bought,
        sourcing_type=sourcing,
        supplier_parts=listed,
        unit=made.get("unit"),
    )


def _worth_of(made: Mapping[str, Any]) -> MassAndCost:
    mass = None if made["mass_kg"] is None else Decimal(made["mass_kg"])
    costs = {currency: Decimal(cost) for currency, cost in made["costs"].items()}
    return MassAndCost(mass, made["mass_whole"], costs, made["cost_whole"])


class Changes(NamedTuple):
    """What changed in a product from one time to another. In frozen revisions it is unknown who did it."""

    first: str
    last: str
    found: Sequence[PastChange]


def changes_of(tx: Tx, item: Item, since: str, until: str = "") -> Changes:
    """Find what changed in a product between two points, over all levels, from the older to the newer.

    since, until
        a day, a time, a revision of the item (``r3``), or the label of a frozen revision; until "": now.

    Two frozen revisions, or one and now, are compared as they are, however old. Raises as :func:`moment`,
    TooLargeError.
    """
    points = [find_release(tx, item, since), find_release(tx, item, until) if until else None]
    ends = [
        release.frozen_at if release else moment(tx, item, text, end=last) if text else tx.stamp
        for release, text, last in zip(points, (since, until), (False, True), strict=True)
    ]
    if points[0] and (points[1] or not until):
        sides = [
            read_records(tx, point.record).values()
            if point
            else map(json.loads, freeze(tx, item).records.values())
            for point in points
        ]
        before, after = ({made["item"]: made for made in side} for side in sides)
        if ends[0] > ends[1]:
            before, after = after, before
        return Changes(min(ends), max(ends), in_order(_differences(item.uuid, before, after)))
    return Changes(min(ends), max(ends), what_changed(tx, item, *ends))


_DATA = ("name", "description", "item_type", "category", *ItemTexts.model_fields)
Records = Mapping[str, Mapping[str, Any]]


def _differences(root: str, before: Records, after: Records) -> Iterator[PastChange]:
    """Yield the differences of two products, each given as records by the UUID of their item."""
    sides = (before, after)
    owned = [_own_files(side) for side in sides]
    for uuid in before.keys() & after.keys():
        old, new = before[uuid], after[uuid]
        number, name = new["part_number"], new["name"]
        for line in compare(*(_past(made, side) for made, side in zip((old, new), sides, strict=True))):
            if line.status != "unchanged":
                yield line_happened(number, line, "", "")
        data = [{**made["properties"], **{name: made.get(name) for name in _DATA}} for made in (old, new)]
        if uuid == root:
            data = [of | _in_all(made) for of, made in zip(data, (old, new), strict=True)]
        if differences := data_differs(*data):
            yield PastChange("data", "", number, name, *differences, "", "")
        files = [{line["document"]: line for line in side.get(uuid, ())} for side in owned]
        for document in files[0].keys() | files[1].keys():
            pair = [side.get(document) for side in files]
            if len({line and line["sha256"] for line in pair}) > 1:
                then, now = (
                    f"{line['file_name']}, revision {line['revision']}" if line else "" for line in pair
                )
                yield PastChange("file", "", number, name, then, now, "", "")


def _in_all(made: Mapping[str, Any]) -> dict[str, float]:
    costs = {f"cost in all [{currency}]": cost for currency, cost in made["costs"].items()}
    costs["mass in all [kg]"] = made["mass_kg"]
    return {name: plain(Decimal(value)) for name, value in costs.items() if value is not None}


def _past(made: Mapping[str, Any], side: Records) -> list[PastLine]:
    """Return the lines of a record; part and relation name a line, as a BOM has each pair once."""
    lines = []
    for place, line in enumerate(made["lines"]):
        of = side[line["item"]] if line["child"] else line
        child = NamedItem(0, of["part_number"], of.get("name", ""), None)
        key = f"{line['item']} {line['state'].get('rel_type')}"
        lines.append(PastLine(key, child, place, stored_state(dumps(line["state"]))))
    return lines


def _own_files(side: Records) -> dict[str, list[Mapping[str, Any]]]:
    """Find for each item the files that do not come from a part in it."""
    files = {}
    for uuid, made in side.items():
        below = {
            file["document"]
            for line in made["lines"]
            if line["child"]
            for file in side[line["item"]]["files"]
        }
        own = [file for file in made["files"] if file["document"] not in below]
        files[uuid] = [*own, *made.get("attachments", ())]
    return files
