# SPDX-License-Identifier: LGPL-2.1-or-later
"""Supplier parts, order lists, what was ordered, and the site's currency rates over HTTP."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from decimal import Decimal
from functools import partial
from typing import Annotated, Any

import anyio.to_thread
from fastapi import APIRouter, Depends, Path, Query
from pydantic import BeforeValidator, Field, WithJsonSchema
from starlette.responses import Response

from silo.bom.errors import RejectedError
from silo.bom.message import message
from silo.bom.numbers import LONGEST, read_number
from silo.bom.quantities import as_decimal, decimal_text
from silo.tables.price_rows import PRICES, PriceRows
from silo.tables.sheet import Layout
from silo_server.db.transaction import Tx
from silo_server.fields import to_wire
from silo_server.routes import openapi
from silo_server.routes.answers import READ_ERRORS, WRITE_ERRORS, etag_of, json_answer
from silo_server.routes.bom.imports import IMPORT_BODY, uploaded
from silo_server.routes.call import Admin, Call, Editor, Viewer
from silo_server.routes.known_parameters import refuse_unknown
from silo_server.routes.made_files import CSV, XLSX, content_of, file_of
from silo_server.routes.models import Brief, RequestBody, Short, Text
from silo_server.routes.requests import BoundedRoute, ExpectedVersion
from silo_server.services import orders, suppliers
from silo_server.services.items import get_item
from silo_server.services.order_layouts import OrderLayout, export_for
from silo_server.services.orders import NewOrder, OrderRequest, OrderRow, Recorded
from silo_server.services.product.export import Export
from silo_server.services.product.export_files import to_csv, to_xlsx
from silo_server.services.table_layouts import remembered_layout

router = APIRouter(
    route_class=BoundedRoute,
    prefix="/api",
    tags=["orders"],
    responses=READ_ERRORS,
    dependencies=[Depends(refuse_unknown())],
)


def _exact(value: object) -> object:
    if isinstance(value, str):
        reading = read_number(value, points_are_decimal=True)
        if reading.value is None:
            raise ValueError(reading.problem)
        return reading.value
    if isinstance(value, Decimal):  # of a page, which reads numbers as its reader types them
        return value
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError("wanted a number, or a number as text")
    return as_decimal(value)


_AMOUNT = {"type": "number", "minimum": 0.001, "maximum": 1_000_000}
_TYPED = {"type": "string", "pattern": "^[1-9][0-9]{0,5}([.][0-9]{1,2})?$"}
Exact = Annotated[Decimal, BeforeValidator(_exact), WithJsonSchema({"anyOf": [_AMOUNT, _TYPED]})]
Quantity = Annotated[Exact, Field(gt=0, le=10**9, max_digits=LONGEST)]
Code = Annotated[str, Field(pattern="^[A-Z]{3}$")]


class PriceBody(RequestBody):
    """A price of one piece from a quantity on."""

    quantity: Exact = Decimal(1)
    price: Exact


class SupplierPartBody(RequestBody):
    """A supplier part; see ``SupplierPart``."""

    supplier: Annotated[Short, Field(min_length=1)]
    number: Short = ""
    link: Annotated[Short, WithJsonSchema({"type": "string", "pattern": "^(https?://[a-z]{1,60})?$"})] = ""
    pack_size: Quantity = Decimal(1)
    minimum: Exact = Decimal(0)
    prices: list[PriceBody] = Field(default_factory=list, max_length=suppliers.MOST_PRICES)
    currency: Code = "EUR"
    lead_time_days: Annotated[int, Field(strict=True, ge=0, le=suppliers.LONGEST_LEAD_TIME)] | None = None
    preferred: bool = False


class SuppliersBody(RequestBody):
    """``PUT …/suppliers``: the whole list, in the place of the one before."""

    supplier_parts: list[SupplierPartBody] = Field(max_length=suppliers.MOST_PARTS)


class OrderedBody(RequestBody):
    """What was ordered of an item; ``number``: the supplier's."""

    part_number: Short
    quantity: Quantity
    unit: Annotated[Brief, Field(max_length=32)] | None = None
    supplier: Short = ""
    number: Short = ""
    price: Annotated[Exact, Field(ge=0, le=suppliers.LARGEST_PRICE, max_digits=LONGEST)] | None = None
    currency: Code | None = None


class OrdersBody(RequestBody):
    """``POST …/orders``: what was ordered for a product."""

    parts: list[OrderedBody] = Field(min_length=1, max_length=1000)
    note: Text = ""


class RatesBody(RequestBody):
    """``PUT /api/rates``: the site's currency, and how much of it one unit of each other is worth."""

    currency: Code
    rates: dict[Code, Exact] = Field(
        default_factory=dict, max_length=200, json_schema_extra={"additionalProperties": False}
    )


@router.get("/items/{part_number}/suppliers")
def get_suppliers(call: Viewer, part_number: str) -> Response:
    """Return the supplier parts of an item; ``ETag`` is the version of the list, for ``If-Match``."""
    with call.read() as tx:
        item = get_item(tx, part_number, include_archived=True)
        version = suppliers.list_version(tx, item)
    return _suppliers(suppliers.supplier_parts_of(item), version)


@router.put(
    "/items/{part_number}/suppliers",
    responses=WRITE_ERRORS,
    openapi_extra=openapi.refused(
        "two supplier parts of one number, two preferred ones, and unusable values"
    ),
)
def put_suppliers(call: Editor, part_number: str, body: SuppliersBody, expected: ExpectedVersion) -> Response:
    """Replace an item's list of supplier parts; 412 if somebody else changed it first."""
    with call.write() as tx:
        parts = suppliers.read_parts(tx, [_texts(part) for part in body.supplier_parts], dot=True)
        item, _ = suppliers.set_supplier_parts(tx, part_number, parts, expected)
        return _suppliers(suppliers.supplier_parts_of(item), suppliers.list_version(tx, item))


def _texts(body: SupplierPartBody) -> dict[str, str]:
    made = body.model_dump(exclude={"prices"}, exclude_none=True)
    prices = "; ".join(f"{amount.quantity:f}: {amount.price:f}" for amount in body.prices)
    texts = {
        name: f"{amount:f}" if isinstance(amount, Decimal) else str(amount) for name, amount in made.items()
    }
    return texts | {"prices": prices, "preferred": "yes" if body.preferred else ""}


def _suppliers(parts: list[suppliers.SupplierPart], version: int) -> Response:
    content = {"version": version, "supplier_parts": [suppliers.to_json(part) for part in parts]}
    return json_answer(content, headers={"ETag": etag_of(version)})


@router.post("/suppliers/import", responses=WRITE_ERRORS, openapi_extra=IMPORT_BODY)
async def import_suppliers(
    call: Editor,
    dry_run: Annotated[bool, Query()] = False,
    leave_out: Annotated[bool, Query()] = False,
) -> Response:
    """Import supplier parts of many items from a CSV or a workbook; a wrong row refuses the whole file.

    ``leave_out``: items with problems are left out. ``import``, in the answer, can be undone.
    """
    data, name = await uploaded(call.request)

    def work() -> Response:
        read = prices_of(call, data)
        done = None
        with call.read() if dry_run else call.write() as tx:
            if dry_run:
                plan = suppliers.plan_suppliers(tx, read, leave_out=leave_out)
            else:
                plan, done = suppliers.apply_suppliers(tx, read, leave_out=leave_out, file_name=name or "")
            rows = [
                {
                    "part_number": item.part_number,
                    "rows": list(item.rows),
                    "status": item.status,
                    "problems": list(item.problems),
                    "changes": list(item.words),
                    **({"why": item.why} if item.why else {}),
                }
                for item in plan
            ]
            return json_answer(
                {
                    "dry_run": dry_run,
                    "import": done,
                    "unused_columns": list(read.unused),
                    "notes": list(read.notes),
                    "left_out": [{"row": row.line, "why": row.left_out} for row in read.rows if row.left_out],
                    "items": rows,
                }
            )

    return await anyio.to_thread.run_sync(work)


def prices_of(call: Call, table: bytes, layout: Layout | None = None) -> PriceRows:
    """Read a table of supplier parts; ``layout`` None: as a file with the same headings was read."""
    known: tuple[str, ...] = ()
    if layout is None:
        with call.read() as tx:
            layout, known = remembered_layout(tx, "prices", table, PRICES)
    read = suppliers.read_prices(table, call.server.settings.max_merge_entries, layout)
    return replace(read, notes=(*known, *read.notes))


@router.get("/suppliers/export.csv", response_class=Response, responses=content_of("text/csv"))
def export_suppliers(call: Viewer) -> Response:
    """Return the supplier parts of all items as CSV, a row for each price. The import takes it back."""
    with call.server.large_reads.enter(), call.read() as tx:
        text = "".join(suppliers.export_suppliers(tx))
    headers = {"Content-Disposition": 'attachment; filename="prices.csv"'}
    return Response(text.encode(), media_type=CSV, headers=headers)


def asked_of(
    pieces: Annotated[int, Query(ge=1, le=orders.MOST_PIECES)] = 1,
    spares: Annotated[
        str,
        Query(max_length=20),
        WithJsonSchema({"type": "string", "pattern": "^([0-9]{1,2}([.][0-9]{1,2})?)?$"}),
    ] = "",
    release: Annotated[str, Query(max_length=16)] = "",
    rest: bool = False,
) -> OrderRequest:
    """Read what an order list is for; ``spares`` in percent, ``rest``: without what was already ordered."""
    reading = read_number(spares or "0")
    if reading.value is None or not 0 <= reading.value <= orders.MOST_SPARES:
        problem = reading.problem or message(
            "wanted 0 to {most} percent, got {got}", most=orders.MOST_SPARES, got=spares
        )
        raise RejectedError(
            message("spares: {problem}", problem=problem), [message("spares: {problem}", problem=problem)]
        )
    return OrderRequest(pieces, reading.value, release, rest)


AskedFor = Annotated[OrderRequest, Depends(asked_of)]
Supplier = Annotated[str | None, Query(max_length=200)]
Kind = Annotated[str, Query(pattern="^(bought|made|unsaid)$")]


@router.get("/items/{part_number}/order")
def get_order(call: Viewer, part_number: str, asked: AskedFor) -> dict[str, Any]:
    """Return what to order for so many pieces: bought parts with prices, made parts, and undecided ones.

    Amounts and money are decimal numbers as text.
    """
    with call.server.large_reads.enter(), call.read() as tx:
        order_list = orders.order_list(tx, part_number, asked)
    return {
        "part_number": order_list.product.part_number,
        "pieces": asked.pieces,
        "spares": decimal_text(asked.spares),
        "release": asked.release or None,
        "state": order_list.state,
        "warnings": list(order_list.warnings),
        "costs": {currency: decimal_text(cost) for currency, cost in order_list.costs.items()},
        "total_cost": decimal_text(order_list.total),
        "currency": order_list.currency,
        "order_costs": {code: decimal_text(cost) for code, cost in order_list.order_costs.items()},
        "unpriced": order_list.unpriced,
        "without_rate": order_list.without_rate,
        "lead_time_days": order_list.lead_time,
        "without_lead_time": order_list.no_lead_time,
        "parts": [_row_to_wire(row) for row in order_list.rows],
    }


def _row_to_wire(row: OrderRow) -> dict[str, Any]:
    offer, of = row.offer, row.cost
    return {
        "part_number": row.item.part_number,
        "name": row.item.name,
        "kind": row.kind,
        "unit": row.unit,
        "total": decimal_text(row.total),
        "needed": decimal_text(row.needed),
        "ordered": decimal_text(row.ordered),
        "price": None if of.price is None else decimal_text(of.price),
        "cost": None if of.cost is None else decimal_text(of.cost),
        "currency": of.currency,
        "cost_from": of.words,
        "quantity": None if offer is None else decimal_text(offer.amount),
        "order_cost": None if offer is None or offer.cost is None else decimal_text(offer.cost),
        "remarks": row.remarks,
        "files": [amount._asdict() for amount in row.files],
        "supplier_part": suppliers.to_json(offer.of) if offer else None,
    }


@router.get("/items/{part_number}/order.csv", response_class=Response, responses=content_of("text/csv"))
def order_csv(
    call: Viewer,
    part_number: str,
    asked: AskedFor,
    kind: Kind = orders.BOUGHT,
    supplier: Supplier = None,
    semicolons: bool = False,
    layout: OrderLayout = OrderLayout.OWN,
) -> Response:
    """Return the parts of one kind as CSV; with ``supplier`` only those from this supplier.

    With ``layout`` what is bought has the columns that this program imports.
    """
    write = partial(to_csv, semicolons=semicolons)
    return _exported(call, part_number, asked, kind, supplier, write, CSV, layout)


@router.get("/items/{part_number}/order.xlsx", response_class=Response, responses=content_of(XLSX))
def order_xlsx(
    call: Viewer,
    part_number: str,
    asked: AskedFor,
    kind: Kind = orders.BOUGHT,
    supplier: Supplier = None,
    layout: OrderLayout = OrderLayout.OWN,
) -> Response:
    """Return the parts of one kind as a workbook; with ``supplier`` only those from this supplier.

    ``layout`` as for CSV.
    """
    return _exported(call, part_number, asked, kind, supplier, to_xlsx, XLSX, layout)


def _exported(
    call: Call,
    part_number: str,
    asked: OrderRequest,
    kind: str,
    supplier: str | None,
    write: Any,
    media: str,
    layout: OrderLayout,
) -> Response:
    def make(tx: Any) -> Export:
        order = orders.order_list(tx, part_number, asked)
        if layout is OrderLayout.OWN:
            return orders.export_orders(order, kind, supplier)
        return export_for(order, layout, supplier)

    end = "xlsx" if media == XLSX else "csv"
    of_whom = supplier or (kind if layout is OrderLayout.OWN else layout)
    name = "".join(c if c.isascii() and c.isalnum() else "_" for c in of_whom)
    return file_of(call, make, write, media, f"order-{name}.{end}")


@router.get("/items/{part_number}/orders")
def get_orders(call: Viewer, part_number: str) -> dict[str, Any]:
    """Return what was ordered for a product, newest first."""
    with call.read() as tx:
        product = get_item(tx, part_number, include_archived=True)
        recorded = orders.list_recorded(tx, product=product)
    return {"orders": [_recorded_to_wire(order, number) for order, number in recorded]}


@router.post("/items/{part_number}/orders", status_code=201, responses=WRITE_ERRORS)
def post_orders(call: Editor, part_number: str, body: OrdersBody) -> Response:
    """Record what was ordered for a product."""
    with call.write() as tx:
        made = record_all(tx, part_number, body.parts, body.note)
        return json_answer({"orders": [_recorded_to_wire(*recorded) for recorded in made]}, 201)


def record_all(
    tx: Tx, part_number: str, parts: Sequence[OrderedBody], note: str
) -> list[tuple[Recorded, str]]:
    """Record what was ordered; the model of the body has checked each value."""
    return orders.record(tx, part_number, [NewOrder(**part.model_dump()) for part in parts], note)


@router.post("/items/{part_number}/orders/{order_id}/take-back", responses=WRITE_ERRORS)
def take_back(call: Editor, part_number: str, order_id: Annotated[int, Path(ge=1, le=2**53 - 1)]) -> Response:
    """Record that an order was not placed after all."""
    with call.write() as tx:
        done = orders.take_back(tx, part_number, order_id)
        return json_answer(_recorded_to_wire(done, orders.list_recorded(tx, [order_id])[0][1]))


def _recorded_to_wire(recorded: Recorded, part_number: str) -> dict[str, Any]:
    return {"part_number": part_number, **to_wire(recorded, "product_id", "item_id")}


@router.get("/rates")
def get_rates(call: Viewer) -> dict[str, Any]:
    """Return the site's currency, and how much of it one unit of each other currency is worth."""
    with call.read() as tx:
        return _rates(suppliers.rates_of(tx))


@router.put("/rates", responses=WRITE_ERRORS)
def put_rates(call: Admin, body: RatesBody) -> dict[str, Any]:
    """Set the site's currency and the rates; rates that are not named are deleted."""
    with call.write() as tx:
        return _rates(
            suppliers.set_rates(tx, body.currency, [(code, f"{rate:f}") for code, rate in body.rates.items()])
        )


def _rates(rates: dict[str, Decimal]) -> dict[str, Any]:
    own, *others = rates
    return {"currency": own, "rates": {rate: decimal_text(rates[rate]) for rate in others}}
