# SPDX-License-Identifier: LGPL-2.1-or-later
"""For the purchaser: an item's suppliers in a table, what to order for a product, what was ordered, prices
from a supplier's file, and the site's currencies."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query
from pydantic import ValidationError
from starlette.datastructures import FormData
from starlette.responses import Response

from silo.bom.errors import NotFoundError, RejectedError, SiloError, VersionConflictError
from silo.bom.quantities import decimal_text
from silo.tables.price_rows import PRICES, PriceRows
from silo.tables.sheet import Layout
from silo_server.routes.call import Call
from silo_server.routes.orders import OrderedBody, asked_of, prices_of, record_all
from silo_server.routes.requests import NumberedRoute
from silo_server.services import items as item_service
from silo_server.services import orders, releases, suppliers
from silo_server.services.import_log import last_imports
from silo_server.services.items import ItemChange, get_item
from silo_server.services.orders import OrderRequest, OrderRow
from silo_server.services.suppliers import COLUMNS, EXAMPLES, MOST_PARTS
from silo_server.services.table_layouts import remember_layout, remembered_layout
from silo_server.web.accounts import Administrator, Reader, Writer
from silo_server.web.attachments import kind_words
from silo_server.web.forms import Form, amount, back, back_to, problems_of, text, texts, whole
from silo_server.web.import_page import Problem, Upload, carried, checked, layout_of, reading
from silo_server.web.releases_page import STAMPS
from silo_server.web.render import (
    N_,
    PAGE_ROWS,
    Address,
    _,
    in_reader_form,
    isolate,
    number_text,
    page,
    page_of,
    segment,
)

router = APIRouter(route_class=NumberedRoute, include_in_schema=False)

EMPTY_ROWS = 3
_NO_PROBLEM = Problem()
_STALE = N_("chosen: wanted the boxes of this page; load it again")
AskedFor = Annotated[OrderRequest, Depends(asked_of)]


@router.get("/items/{part_number}/suppliers")
def suppliers_page(call: Reader, part_number: str) -> Response:
    """Show the table of an item's supplier parts, and its last changes."""
    return _suppliers(call, part_number)


def _suppliers(
    call: Call, part_number: str, error: SiloError | None = None, typed: Sequence[Mapping[str, str]] = ()
) -> Response:
    with call.read() as tx:
        item = get_item(tx, part_number, include_archived=True)
        changes = suppliers.supplier_changes_of(tx, item)
    rows = typed or [suppliers.texts_of(part, number_text) for part in suppliers.supplier_parts_of(item)]
    empty = [dict.fromkeys(COLUMNS, "")] * min(EMPTY_ROWS, MOST_PARTS - len(rows))
    return page(
        call,
        "suppliers.html",
        status=error.status_hint if error else 200,
        item=item,
        columns=COLUMNS,
        examples=EXAMPLES,
        rows=[*rows, *empty],
        version=changes[0].id if changes else 0,
        changes=changes,
        problems=problems_of(error) if error else [],
        most=MOST_PARTS,
    )


@router.post("/items/{part_number}/suppliers")
def save_suppliers(call: Writer, part_number: str, form: Form) -> Response:
    """Save the table as one change."""
    count = min(whole(form, "rows") or 0, 2 * MOST_PARTS)
    rows = [{name: text(form, f"{name}.{row}", 5000) for name in COLUMNS} for row in range(count)]
    typed = [row for row in rows if any(row.values())]
    try:
        with call.write() as tx:
            now = suppliers.supplier_parts_of(get_item(tx, part_number))
            parts = suppliers.read_parts(tx, typed, known=suppliers.numbers_of(now, number_text))
            item, change = suppliers.set_supplier_parts(tx, part_number, parts, whole(form, "version"))
    except VersionConflictError:
        problem = _(
            "Somebody else changed this table meanwhile. Below are your values and the changes; to "
            "replace the changes with your values, save again"
        )
        return _suppliers(call, part_number, VersionConflictError(problem), typed)
    except SiloError as error:
        return _suppliers(call, part_number, error, typed)
    notice = (
        _("Suppliers of %(number)s saved.", number=isolate(item.part_number))
        if change
        else _("Nothing differs, so nothing was saved.")
    )
    return back(f"/items/{segment(item.part_number)}/suppliers", notice)


@router.post("/items/{part_number}/suppliers/undo")
def undo_suppliers(call: Writer, part_number: str, form: Form) -> Response:
    """Undo the newest change of the table."""
    with call.write() as tx:
        item = suppliers.undo_supplier_change(tx, part_number, whole(form, "change") or 0)
    return back(f"/items/{segment(item.part_number)}/suppliers", _("The last change is undone."))


@router.get("/items/{part_number}/order")
def order_page(
    call: Reader,
    part_number: str,
    asked: AskedFor,
    number: Annotated[int, Query(ge=0, le=10**9, alias="page")] = 1,
) -> Response:
    """Show what to order for so many pieces; page 0 has all rows, for paper."""
    with call.server.large_reads.enter(), call.read() as tx:
        product = get_item(tx, part_number, include_archived=True)
        states = {
            release.label: release.status
            for release in releases.list_releases(tx, product)
            if release.status in releases.NUMBERED
        }
        draft = releases.coming_label(tx, product)
        recorded = orders.list_recorded(tx, product=product)
        problem, order_list = "", None
        try:
            order_list = orders.order_list(tx, part_number, asked)
        except NotFoundError:
            raise  # an unknown revision: the draft in its place would be ordered
        except SiloError as error:
            problem = str(error)
        now = tx.stamp
    rows = order_list.by_supplier if order_list else []
    table = page_of(rows, len(rows), number, PAGE_ROWS if number else max(1, len(rows)))
    view = {
        "pieces": asked.pieces,
        "spares": decimal_text(asked.spares),
        "release": asked.release,
        "rest": "true" if asked.rest else "",
        "page": number and table.number,
    }
    given = {name: str(value) for name, value in view.items() if value not in ("", "0", 1)}
    at = Address(f"/items/{segment(product.part_number)}/order", given)
    return page(
        call,
        "order.html",
        item=product,
        kinds=kind_words(),
        asked=asked,
        spares=decimal_text(asked.spares),
        found=order_list,
        problem=problem,
        labels=list(states),
        draft=draft,
        stamp=STAMPS[states[asked.release] if asked.release else ""],
        recorded=recorded,
        at=at,
        now=now,
        decimal=number_text,
        fact_of=_fact_of,
        table=table,
        counts=order_list.counts if order_list else {},
        some=_some(rows),
    )


def _some(rows: Sequence[OrderRow]) -> dict[str, bool]:
    """Find which columns say anything."""
    return {
        "ordered": any(row.ordered for row in rows),
        "mass": any(row.mass for row in rows),
        "price": any(row.cost.price is not None for row in rows if row.kind != orders.BOUGHT),
        "material": any(row.item.properties.get("material") for row in rows),
    }


def _fact_of(row: OrderRow) -> str:
    """Write what the box of a row records, with the quantity that is shown.

    The price is last: behind the last space is the mark of a box, and a row with another price has to be
    chosen again.
    """
    offer = row.offer
    quantity = decimal_text(offer.amount if offer else row.needed)
    fact: dict[str, Any] = {"quantity": quantity, "part_number": row.item.part_number, "unit": row.unit}
    if offer:
        of = offer.of
        fact = {"supplier": of.supplier, "number": of.number, "currency": of.currency, **fact}
    price = None if offer is None or offer.price is None else str(offer.price)
    return json.dumps({**fact, "price": price})


@router.post("/items/{part_number}/order")
def record(call: Writer, part_number: str, form: Form) -> Response:
    """Record the chosen parts as ordered, or mark them as made or bought."""
    chosen = [_read_fact(key) for key in texts(form, "chosen")]
    kind = text(form, "kind")
    with call.write() as tx:
        if kind in ("manufactured", "purchased"):
            for number in dict.fromkeys(key["part_number"] for key in chosen):
                item_service.change_item(tx, number, ItemChange(texts={"sourcing_type": kind}))
            made, bought = N_("%(count)s now made."), N_("%(count)s now bought.")
            notice = _(made if kind == "manufactured" else bought, count=len(chosen))
            notice = notice if chosen else _("Nothing was chosen.")
        else:
            facts = [_order_of(form, key) for key in chosen]
            done = record_all(tx, part_number, facts, text(form, "note"))
            notice = _("%(count)s noted as ordered.", count=len(done))
    home = f"/items/{segment(part_number)}/order"
    return back(back_to(form, home, home), notice)


def _read_fact(written: str) -> dict[str, Any]:
    try:
        fact = json.loads(written)
        return {name: None if fact[name] is None else str(fact[name])[:200] for name in fact}
    except (ValueError, TypeError):
        raise RejectedError(_(_STALE)) from None


def _order_of(form: FormData, fact: Mapping[str, Any]) -> OrderedBody:
    number, unit = str(fact.get("part_number")), fact.get("unit")
    typed = text(form, f"quantity.{number}.{unit or ''}")
    shown = str(fact.get("quantity"))
    quantity = shown if typed == in_reader_form(shown) else amount(typed, number)
    given = {name: value for name, value in fact.items() if value is not None}
    try:
        return OrderedBody.model_validate(given | {"quantity": quantity})
    except ValidationError:
        raise RejectedError(_(_STALE)) from None


@router.post("/items/{part_number}/order/{order_id}/take-back")
def take_back(call: Writer, part_number: str, order_id: int, form: Form) -> Response:
    """Record that an order was not placed after all."""
    with call.write() as tx:
        orders.take_back(tx, part_number, order_id)
    return back(f"/items/{segment(part_number)}/order#recorded", _("Taken back; it stays in the list below."))


@router.get("/suppliers")
def prices_page(call: Reader) -> Response:
    """Show where prices of suppliers are imported, and the site's currencies."""
    return _prices(call)


def _prices(
    call: Call,
    upload: Upload | None = None,
    layout: Layout | None = None,
    problem: Problem = _NO_PROBLEM,
    typed: Sequence[tuple[str, str]] | None = None,
    *,
    leave_out: bool = False,
) -> Response:
    file = upload or problem.upload
    layout_read = layout or problem.layout
    if file and layout_read is None:
        with call.read() as tx:
            layout_read = remembered_layout(tx, "prices", file.data, PRICES)[0]
    plan, read = None, PriceRows(())
    if upload:
        read = prices_of(call, upload.data, layout)
        with call.read() as tx:
            plan = suppliers.plan_suppliers(tx, read, leave_out=leave_out)
        order = {"error": 0, "skip": 1, "change": 2, "same": 3}
        plan.sort(key=lambda item: order[item.status])
    with call.read() as tx:
        own, *rates = suppliers.rates_of(tx).items()
        last = last_imports(tx, ("prices",))
    return page(
        call,
        "prices.html",
        status=problem.status,
        upload=upload,
        plan=plan,
        unused=read.unused if upload else (),
        notes=read.notes if upload else (),
        left_out=[row for row in read.rows if row.left_out] if upload else (),
        wrong=sum(item.status == "error" for item in plan or ()),
        changed=sum(item.status == "change" for item in plan or ()),
        problem=problem.words,
        file=file,
        reading=reading(file, layout_read, PRICES) if file else None,
        action="/suppliers/check",
        leave_out=leave_out,
        last=last,
        own=own[0],
        rates=typed if typed is not None else [(code, number_text(rate)) for code, rate in rates],
    )


@router.post("/suppliers/check")
def check(call: Writer, form: Form) -> Response:
    """Show what a table would change; write nothing."""
    return checked(form, PRICES, partial(_prices, call, leave_out=bool(text(form, "leave_out"))))


@router.post("/suppliers/import")
def apply(call: Writer, form: Form) -> Response:
    """Import a table that was checked."""
    upload, layout = carried(form), layout_of(form, PRICES)
    leave_out = bool(text(form, "leave_out"))
    try:
        read = prices_of(call, upload.data, layout)
        with call.write() as tx:
            plan, _done = suppliers.apply_suppliers(tx, read, leave_out=leave_out, file_name=upload.name)
            remember_layout(tx, "prices", upload.data, PRICES, layout)
    except SiloError as error:
        return _prices(call, upload, layout, Problem.of(error), leave_out=leave_out)
    changed = sum(item.status == "change" for item in plan)
    return back(
        "/suppliers",
        _(
            "Imported %(file)s: suppliers of %(changed)s items changed.",
            file=isolate(upload.name),
            changed=changed,
        ),
    )


@router.post("/suppliers/rates")
def set_rates(call: Administrator, form: Form) -> Response:
    """Set the site's currency and the rates."""
    typed = list(zip(texts(form, "code"), texts(form, "rate"), strict=False))
    try:
        with call.write() as tx:
            shown = {number_text(rate): rate for rate in suppliers.rates_of(tx).values()}
            suppliers.set_rates(tx, text(form, "own", 20), typed, shown)
    except RejectedError as error:
        return _prices(call, problem=Problem.of(error), typed=typed)
    return back("/suppliers#rates", _("The currencies are saved."))
