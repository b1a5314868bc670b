# SPDX-License-Identifier: LGPL-2.1-or-later
"""What to order for N pieces of a product, draft or released, and what was ordered already.

The parts are those of the one flat list (:func:`silo_server.services.product.flat.flatten`), where a bought
assembly counts as a part. What is open comes from the kept summary, or from the release. Bought parts
have an offer in whole packs (:mod:`silo_server.services.suppliers`), made parts a material, a mass and
their files. Each part has its cost (:mod:`silo_server.services.product.cost`), so that the list costs what
the product costs; what is paid for whole packs stands beside it. Nothing is left out: what is called
neither made nor bought is listed as such.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from decimal import ROUND_CEILING, Decimal
from typing import NamedTuple

from sqlalchemy import false, insert, or_, select, update

from silo.bom.errors import ConflictError, NotFoundError, RejectedError, counted, listed
from silo.bom.message import Message, counted_message, joined, message
from silo.bom.quantities import decimal_text, exact_product, exact_sum, plain
from silo.bom.units import converted, unit_of
from silo.file_kind import ATTACHMENT_KINDS, MODEL
from silo_server.db.rows import one_of
from silo_server.db.tables import document_items, documents, items, orders, revisions
from silo_server.db.transaction import Tx
from silo_server.fields import from_row
from silo_server.services import audit
from silo_server.services.items import get_item
from silo_server.services.product.amounts import UNIT_OPEN
from silo_server.services.product.cost import PartCost, added_up, bought_whole, in_base, part_cost
from silo_server.services.product.export import Export, Row, View
from silo_server.services.product.flat import FlatRow, flatten
from silo_server.services.product.frozen import frozen_product
from silo_server.services.product.graph import Graph, load_graph
from silo_server.services.product.parts import RolledItem, parts_of, positive_number
from silo_server.services.product.summary import Summary
from silo_server.services.product.summary_read import summary_of
from silo_server.services.releases import Release, get_release, newest_release
from silo_server.services.suppliers import SupplierOffer, rates_of
from silo_server.times import wire_time
from silo_server.values import Item

MOST_PIECES = 1_000_000
MOST_SPARES = 1000
MOST_LISTED = 1000
BOUGHT, MADE, UNSAID = "bought", "made", "unsaid"


class OrderRequest(NamedTuple):
    """What an order list is for.

    spares
        percent more of each part, in whole pieces.
    release
        the label of a revision; "" for the product as it is now.
    rest
        without what was ordered already.
    """

    pieces: int = 1
    spares: Decimal = Decimal(0)
    release: str = ""
    rest: bool = False


@dataclass(frozen=True, slots=True)
class Recorded:
    """What was ordered of an item for a product, by whom and when; ``ended_at``: it was taken back."""

    id: int
    product_id: int
    item_id: int
    at: str
    username: str
    quantity: str
    unit: str | None
    supplier: str
    number: str
    price: str | None
    currency: str | None
    note: str
    ended_at: str | None
    ended_by: str | None


class PartFile(NamedTuple):
    """The newest revision of a file of a part: its model, or an attachment of a kind."""

    name: str
    path: str
    kind: str = MODEL


class OrderRow(NamedTuple):
    """A part of the list.

    total, needed
        what N pieces hold of it, and with spares, in whole pieces, without what was ordered if that is asked.
    ordered
        what was ordered of it for this product.
    kind
        ``bought``, ``made`` or ``unsaid``.
    cost
        of what is needed, before it is rounded to whole pieces or packs.
    """

    item_id: int
    item: RolledItem
    unit: str | None
    total: Decimal
    needed: Decimal
    ordered: Decimal
    doubts: Sequence[str]
    kind: str
    cost: PartCost
    no_rate: bool = False
    files: Sequence[PartFile] = ()

    @property
    def offer(self) -> SupplierOffer | None:
        """Return what its supplier sells, in whole packs; None if no supplier is known."""
        return self.cost.offer

    @property
    def supplier(self) -> str:
        """Return the name of the supplier; "" if none is known."""
        return self.offer.of.supplier if self.offer else ""

    @property
    def mass(self) -> float | None:
        """Read the mass of one piece [kg]; None if the part states none."""
        return positive_number(self.item.properties, "mass_kg")

    @property
    def remarks(self) -> list[str]:
        """List what a purchaser must know about the part, in words."""
        remarks = list(self.doubts)
        if self.item.archived_at:
            remarks.append(message("archived"))
        if self.kind == BOUGHT and self.offer is None:
            remarks.append(message("no supplier"))
        elif self.offer is not None and self.needed:
            of = self.offer.of
            if self.offer.price is None:
                least = of.prices[0][0] if of.prices else None
                remarks.append(
                    message("no price")
                    if least is None
                    else message("no price below {least}", least=decimal_text(least))
                )
            if self.offer.cheaper is not None:
                more, cost = self.offer.cheaper
                remarks.append(
                    message(
                        "{quantity} would cost less: {cost} {currency}",
                        quantity=decimal_text(more),
                        cost=decimal_text(cost),
                        currency=of.currency,
                    )
                )
        if self.no_rate and self.needed:
            remarks.append(message("no rate for {currency}", currency=self.cost.currency))
        return remarks


@dataclass(frozen=True, slots=True)
class OrderList:
    """What to order for N pieces of a product. ``warnings`` stand on top.

    costs
        of all parts, per currency, without the ``unpriced`` ones, whose cost is not known; ``total``: in the
        site's own currency, without the parts of a currency ``without_rate``.
    order_costs
        what is paid for the bought parts with a supplier's price, in whole packs, per currency.
    lead_time
        the longest of the chosen supplier parts [days]; ``no_lead_time`` how many state none.
    """

    product: Item
    asked: OrderRequest
    state: str
    warnings: Sequence[str]
    rows: Sequence[OrderRow]
    costs: Mapping[str, Decimal]
    total: Decimal
    currency: str
    order_costs: Mapping[str, Decimal]
    unpriced: int
    without_rate: int
    lead_time: int | None
    no_lead_time: int

    @property
    def counts(self) -> dict[str, int]:
        """Count the parts by kind: bought, made, and those that were called neither."""
        return {BOUGHT: 0, MADE: 0, UNSAID: 0} | Counter(row.kind for row in self.rows)

    @property
    def by_supplier(self) -> list[OrderRow]:
        """Sort the rows for people: bought parts by supplier, those without one, made parts, the others."""

        def place(row: OrderRow) -> tuple[object, ...]:
            return (BOUGHT, MADE, UNSAID).index(row.kind), not row.supplier, row.supplier.casefold()

        return sorted(self.rows, key=place)


def order_list(tx: Tx, part_number: str, asked: OrderRequest) -> OrderList:
    """Make the order list. Raises NotFoundError, CycleError, ConflictError, TooLargeError."""
    product = get_item(tx, part_number, include_archived=bool(asked.release))
    release = get_release(tx, product, asked.release) if asked.release else None
    if release:
        frozen = frozen_product(tx, product, release)
        graph, parts, summary = frozen.graph, frozen.parts, None
        ids = _ids_of(tx, frozen.items)
    else:
        graph, summary = load_graph(tx, product, bare=True), summary_of(tx, product)
        parts = parts_of(tx, graph)
        ids = {item_id: item_id for item_id in parts}
    closed = bought_whole(graph, parts)
    done, rates, none = _ordered(tx, product), rates_of(tx), dict[str | None, Decimal]()
    rows = [
        _row(
            row,
            parts[row.line.child_id],
            asked,
            done.get(ids.get(row.line.child_id), none),
            rates,
        )
        for row in flatten(graph, closed)
    ]
    made = {ids[row.item_id] for row in rows if row.kind != BOUGHT and row.item_id in ids}
    if files := _files(tx, made, release) if made else {}:
        rows = [row._replace(files=files.get(ids.get(row.item_id, 0), ())) for row in rows]
    rows.sort(key=lambda row: row.item.part_number.casefold())
    return _summed(product, asked, rows, rates, *_state(tx, product, release, summary, graph))


def _row(
    flat_row: FlatRow,
    part: RolledItem,
    asked: OrderRequest,
    ordered: Mapping[str | None, Decimal],
    rates: Mapping[str, Decimal],
) -> OrderRow:
    own = unit_of(flat_row.unit)
    amounts = [converted(amount, unit_of(unit, flat_row.unit), own) for unit, amount in ordered.items()]
    done = exact_sum(amount for amount in amounts if amount is not None)
    kind = BOUGHT if part.is_bought else MADE if part.sourcing_type == "manufactured" else UNSAID
    total = exact_product((flat_row.total, asked.pieces))
    needed = exact_product((total, 1 + asked.spares / 100)) if asked.spares else total
    if asked.rest:
        needed = max(Decimal(0), exact_sum((needed, -done)))
    cost = part_cost(part, needed, rates)
    if own.counts_pieces:
        needed = needed.to_integral_value(ROUND_CEILING)
    no_rate = cost.currency is not None and cost.currency not in rates
    doubts = flat_row.doubts(asked.pieces)
    doubts += [
        message("ordered in another unit: {quantity} {unit}", quantity=decimal_text(amount), unit=unit)
        for (unit, amount), same in zip(ordered.items(), amounts, strict=True)
        if same is None
    ]
    item_id, unit = flat_row.line.child_id, flat_row.unit
    return OrderRow(item_id, part, unit, total, needed, done, doubts, kind, cost, no_rate)


def _state(
    tx: Tx, product: Item, release: Release | None, summary: Summary | None, graph: Graph
) -> tuple[str, list[str]]:
    """Describe what the list is of, and what a reader must know first."""
    if release is not None:
        state = message(
            "Revision {label}, {status}, frozen at {frozen_at}",
            label=release.label,
            status=Message(release.status),
            frozen_at=wire_time(release.frozen_at),
        )
        warnings: list[str] = (
            []
            if release.status == "released"
            else [
                message(
                    "Revision {label} is {status}, not released",
                    label=release.label,
                    status=Message(release.status),
                )
            ]
        )
        if release.status == "released" and release.override:
            warnings.append(message("Released in spite of what was open: {reason}", reason=release.override))
        return state, warnings + [
            message("Open when it was frozen: {problem}", problem=block) for block in release.blocks[:20]
        ]
    assert summary is not None  # a draft has one
    newest = newest_release(tx, product)
    instead = message("; revision {label} is released", label=newest.label) if newest else ""
    warnings = [message("This is the draft, not a released revision{instead}", instead=instead)]
    if summary.open:
        lines = [
            message("{part_number}: {words}", part_number=number, words=words)
            for number, words in summary.open_boms()
        ]
        boms = message(
            "{boms} with something open: {part_numbers}",
            boms=counted(len(lines), "BOM"),
            part_numbers=listed(lines, 20),
        )
        asked = counted_message(summary.questions, "{n} question open", "{n} questions open")
        warnings.append(joined(", ", (asked, boms)) if summary.questions else boms)
    if not graph.lines:
        warnings.append(
            message("{part_number} has no BOM, so there is nothing to order", part_number=product.part_number)
        )
    return message("Draft"), warnings


def _summed(
    product: Item,
    asked: OrderRequest,
    rows: Sequence[OrderRow],
    rates: Mapping[str, Decimal],
    state: str,
    warnings: Sequence[str],
) -> OrderList:
    wanted = [row for row in rows if row.needed]
    bought = [row for row in wanted if row.kind == BOUGHT]
    offers = [row.offer for row in bought if row.offer]
    paid: dict[str, list[Decimal]] = {}
    for offer in offers:
        if offer.cost is not None:
            paid.setdefault(offer.of.currency, []).append(offer.cost)
    costs = added_up(row.cost for row in wanted)
    unpriced = [row for row in rows if UNIT_OPEN in row.doubts or (row.needed and row.cost.price is None)]
    stated = [offer.of.lead_time_days for offer in offers if offer.of.lead_time_days is not None]
    return OrderList(
        product,
        asked,
        state,
        warnings,
        rows,
        costs,
        in_base(costs, rates),
        next(iter(rates)),
        {currency: exact_sum(of_it) for currency, of_it in paid.items()},
        len(unpriced),
        sum(row.no_rate for row in wanted),
        max(stated, default=None),
        len(bought) - len(stated),
    )


def _ids_of(tx: Tx, items_by_id: Mapping[int, Item]) -> dict[int, int]:
    """Find the internal ids of frozen items, by their number in the frozen product."""
    query = select(items.c.uuid, items.c.id).where(
        one_of(tx, items.c.uuid, {part.uuid for part in items_by_id.values()})
    )
    there = dict(tx.conn.execute(query).all())
    return {number: there[item.uuid] for number, item in items_by_id.items() if item.uuid in there}


def _files(tx: Tx, item_ids: Collection[int], release: Release | None) -> dict[int, list[PartFile]]:
    """Find the attachments of each item and the models that it is in: the drawing first, the model last.

    Revisions are never changed, so those until a product was frozen are those of its release.
    """
    held = select(document_items.c.document_id, document_items.c.item_id)
    pairs = tx.conn.execute(held.where(one_of(tx, document_items.c.item_id, item_ids))).all()
    holders: dict[int, set[int]] = {}
    for document_id, item_id in pairs:
        holders.setdefault(document_id, set()).add(item_id)
    row, doc = revisions.c, documents.c
    kept_until = "" if release is None else release.frozen_at
    there = or_(doc.removed_at.is_(None), (doc.removed_at > kept_until) if kept_until else false())
    query = (
        select(
            row.item_id,
            row.document_id,
            row.revision_number,
            row.file_name,
            row.kind,
            doc.uuid,
            doc.attached_to,
            items.c.part_number,
        )
        .join(documents, doc.id == row.document_id)
        .join(items, items.c.id == row.item_id, isouter=True)
        .where(
            or_(
                (row.kind == MODEL)
                & or_(one_of(tx, row.item_id, item_ids), one_of(tx, row.document_id, holders)),
                one_of(tx, doc.attached_to, item_ids) & there,
            )
        )
        .order_by(row.revision_number)
    )
    if release is not None:
        query = query.where(row.created_at <= release.frozen_at)
    files: dict[int, dict[int, PartFile]] = {}
    for of, document_id, number, name, kind, uuid, attached_to, part_number in tx.conn.execute(query):
        at = f"items/{part_number}" if part_number else f"documents/{uuid}"
        for item_id in holders.get(document_id, set()) | ({of, attached_to} & set(item_ids)):
            files.setdefault(item_id, {})[document_id] = PartFile(name, f"{at}/file/{number}", kind)
    order = (*ATTACHMENT_KINDS, MODEL)
    return {
        item_id: sorted(found.values(), key=lambda file: (order.index(file.kind), file))
        for item_id, found in files.items()
    }


# --- What was ordered ---


class NewOrder(NamedTuple):
    """What somebody ordered of an item; ``number``: the supplier's."""

    part_number: str
    quantity: Decimal
    unit: str | None = None
    supplier: str = ""
    number: str = ""
    price: Decimal | None = None
    currency: str | None = None


def record(
    tx: Tx, part_number: str, ordered: Sequence[NewOrder], note: str = ""
) -> list[tuple[Recorded, str]]:
    """Record what was ordered for a product. Returns as :func:`list_recorded`; RejectedError for nothing."""
    if not ordered:
        raise RejectedError(
            message("wanted at least one part with a quantity above 0, got none; nothing was recorded")
        )
    product = get_item(tx, part_number, include_archived=True)
    made = []
    for order in ordered:
        row = {
            **order._asdict(),
            "product_id": product.id,
            "item_id": get_item(tx, order.part_number, include_archived=True).id,
            "at": tx.stamp,
            "username": tx.actor.username,
            "quantity": decimal_text(order.quantity),
            "price": None if order.price is None else decimal_text(order.price),
            "currency": None if order.price is None else order.currency,
            "note": note,
        }
        del row["part_number"]
        made.append(tx.conn.execute(insert(orders).values(row).returning(orders.c.id)).scalar_one())
    audit.note(tx, "order.recorded", product.part_number, f"{counted(len(made), 'part')}: {note}"[:500])
    return list_recorded(tx, made)


def take_back(tx: Tx, part_number: str, order_id: int) -> Recorded:
    """Record that an order was not placed after all; it stays in the list. NotFoundError, ConflictError."""
    recorded = list_recorded(tx, [order_id], get_item(tx, part_number, include_archived=True))
    if not recorded:
        raise NotFoundError(
            message("there is no order {order} for {part_number}", order=order_id, part_number=part_number)
        )
    if recorded[0][0].ended_at:
        raise ConflictError(
            message(
                "order {order} was taken back at {time} already",
                order=order_id,
                time=recorded[0][0].ended_at[:16],
            )
        )
    ended = {"ended_at": tx.stamp, "ended_by": tx.actor.username}
    tx.conn.execute(update(orders).where(orders.c.id == order_id).values(ended))
    audit.note(tx, "order.taken_back", recorded[0][1], f"order {order_id}")
    return list_recorded(tx, [order_id])[0][0]


def list_recorded(
    tx: Tx, ids: Collection[int] | None = None, product: Item | None = None
) -> list[tuple[Recorded, str]]:
    """Read what was ordered, newest first, each with its part number: these, or those for a product."""
    query = select(orders, items.c.part_number).join(items, items.c.id == orders.c.item_id)
    if ids is not None:
        query = query.where(one_of(tx, orders.c.id, ids))
    if product is not None:
        query = query.where(orders.c.product_id == product.id)
    rows = tx.conn.execute(query.order_by(orders.c.id.desc()).limit(MOST_LISTED))
    return [(from_row(Recorded, row), row.part_number) for row in rows]


def _ordered(tx: Tx, product: Item) -> dict[int | None, dict[str | None, Decimal]]:
    """Add up what was ordered for a product: item → unit → quantity."""
    row = orders.c
    query = select(row.item_id, row.unit, row.quantity).where(
        row.product_id == product.id, row.ended_at.is_(None)
    )
    amounts: dict[int | None, dict[str | None, Decimal]] = {}
    for item_id, unit, quantity in tx.conn.execute(query):
        of_item = amounts.setdefault(item_id, {})
        of_item[unit] = exact_sum((of_item.get(unit, Decimal(0)), Decimal(quantity)))
    return amounts


# --- As a table ---

_BOUGHT = (
    *("Supplier", "Supplier's part number", "Part number", "Name", "For the product", "Ordered already"),
    *("Needed", "Quantity", "Unit", "Pack size", "Packs", "Price", "Cost", "Order cost", "Currency"),
    *("Cost from", "Lead time [days]", "Link", "Remarks"),
)
_MADE = (
    *("Part number", "Name", "Material", "Unit mass [kg]", "For the product", "Ordered already", "Needed"),
    *("Unit", "Price", "Cost", "Currency", "Cost from", "Files", "Remarks"),
)


def export_orders(order: OrderList, kind: str, supplier: str | None = None) -> Export:
    """Export the parts of a kind as a table; with ``supplier`` only those from this supplier."""
    rows = [row for row in order.rows if row.kind == kind and supplier in (None, row.supplier)]
    asked = order.asked
    what = f"For {asked.pieces} of {order.product.part_number} {order.product.name}".strip()
    spares = f", {decimal_text(asked.spares)} % spares" if asked.spares else ""
    rest = ", without what was ordered already" if asked.rest else ""
    notes = [f"{what}{spares}{rest}. {order.state}", *order.warnings]
    columns = _BOUGHT if kind == BOUGHT else _MADE
    return Export(order.product, View.FLAT, map(_cells, rows), notes, asked.pieces, columns)


def _cells(row: OrderRow) -> Row:
    item, offer = row.item, row.offer
    cells: Row = {
        "Part number": item.part_number,
        "Name": item.name,
        "Material": str(item.properties.get("material") or "") or None,
        "Unit mass [kg]": plain(row.mass),
        "For the product": plain(row.total),
        "Ordered already": plain(row.ordered) if row.ordered else None,
        "Needed": plain(row.needed),
        "Unit": row.unit,
        "Price": plain(row.cost.price),
        "Cost": plain(row.cost.cost),
        "Currency": row.cost.currency,
        "Cost from": row.cost.words,
        "Files": ", ".join(file.name for file in row.files) or "none",
        "Remarks": "; ".join(row.remarks) or None,
    }
    if offer is None:
        return cells
    return cells | {
        "Supplier": offer.of.supplier,
        "Supplier's part number": offer.of.number or None,
        "Quantity": plain(offer.amount),
        "Pack size": plain(offer.of.pack_size),
        "Packs": plain(offer.amount / offer.of.pack_size),
        "Order cost": plain(offer.cost),
        "Lead time [days]": offer.of.lead_time_days,
        "Link": offer.of.link or None,
    }
