# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is bought of an order list in the columns that a purchasing program imports.

``odoo``
    purchase orders with their lines: the vendor and the currency stand in the first row of each order, and
    are empty in the rows of its other lines, as Odoo's import of one-to-many fields wants them. A product is
    named ``[number] name``, as Odoo itself does.
``inventree``
    the lines of one purchase order: InvenTree counts packs, and the price is that of a pack. The headings are
    the names of its fields; ``part`` is the supplier's number (SKU).

Both are read without notes on top. A part that no order can hold is named in an error, never left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from enum import StrEnum
from itertools import groupby

from silo.bom.errors import RejectedError, listed
from silo.bom.message import message
from silo.bom.quantities import exact_product, plain
from silo_server.services.orders import BOUGHT, OrderList, OrderRow
from silo_server.services.product.export import Export, Row, View
from silo_server.services.suppliers import SupplierOffer


class OrderLayout(StrEnum):
    """Whose columns an export has: ours, or those of a program that takes the order."""

    OWN = "silo"
    ODOO = "odoo"
    INVENTREE = "inventree"


_ODOO = (
    *("Vendor", "Currency", "Order Lines/Product", "Order Lines/Description", "Order Lines/Quantity"),
    "Order Lines/Unit Price",
)
_INVENTREE = ("part", "quantity", "purchase_price", "purchase_price_currency", "reference", "notes")


def export_for(order: OrderList, layout: OrderLayout, supplier: str | None = None) -> Export:
    """Export what is bought, or what one supplier sells of it. RejectedError names what has no supplier."""
    wanted = [row for row in order.rows if row.kind == BOUGHT and row.needed]
    lacking = [row.item.part_number for row in wanted if row.offer is None]
    if lacking and supplier is None:
        raise RejectedError(
            message(
                "no supplier is known of {parts}, so no order can hold them; add a supplier, or export the "
                "parts of one supplier",
                parts=listed(lacking, 20),
            )
        )
    offers = [(row, row.offer) for row in wanted if row.offer and supplier in (None, row.supplier)]
    offers.sort(key=lambda pair: (pair[1].of.supplier.casefold(), pair[1].of.supplier, pair[1].of.currency))
    if layout is OrderLayout.INVENTREE:
        sellers = {offer.of.supplier for _row, offer in offers}
        if len(sellers) > 1:
            raise RejectedError(
                message(
                    "InvenTree takes the order of one supplier at a time, and these parts are from {count}; "
                    "name one of them with supplier=",
                    count=len(sellers),
                )
            )
        rows = map(_inventree_row, offers)
        return Export(order.product, View.FLAT, rows, (), order.asked.pieces, _INVENTREE)
    return Export(order.product, View.FLAT, _odoo_rows(offers), (), order.asked.pieces, _ODOO)


def _odoo_rows(offers: Sequence[tuple[OrderRow, SupplierOffer]]) -> Iterator[Row]:
    for (vendor, currency), lines in groupby(offers, lambda pair: (pair[1].of.supplier, pair[1].of.currency)):
        head: Row = {"Vendor": vendor, "Currency": currency}
        for row, offer in lines:
            number = f" ({offer.of.number})" if offer.of.number else ""
            yield head | {
                "Order Lines/Product": f"[{row.item.part_number}] {row.item.name}".strip(),
                "Order Lines/Description": f"{row.item.name}{number}".strip(),
                "Order Lines/Quantity": plain(offer.amount),
                "Order Lines/Unit Price": plain(offer.price),
            }
            head = {}


def _inventree_row(pair: tuple[OrderRow, SupplierOffer]) -> Row:
    row, offer = pair
    of = offer.of
    return {
        "part": of.number or row.item.part_number,
        "quantity": plain(offer.amount / of.pack_size),
        "purchase_price": None if offer.price is None else plain(exact_product((offer.price, of.pack_size))),
        "purchase_price_currency": of.currency,
        "reference": row.item.part_number,
        "notes": "; ".join(row.remarks) or None,
    }
