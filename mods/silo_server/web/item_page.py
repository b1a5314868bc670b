# SPDX-License-Identifier: LGPL-2.1-or-later
"""Finding items, and one item with all that is known of it: BOM, totals, revisions, where-used."""

from __future__ import annotations

import secrets
from dataclasses import replace
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query
from starlette.responses import Response

from silo.bom.errors import ConflictError
from silo_server.db.engine import Tx
from silo_server.errors import TooLargeError
from silo_server.schema.catalog import ITEM_TYPES, find_schema
from silo_server.services import revisions
from silo_server.services.bom import rollup, tree
from silo_server.services.bom.last_sync import in_sentences, last_sync
from silo_server.services.bom.last_sync import marks as marks_of
from silo_server.services.items import ItemQuery, get_item, list_items
from silo_server.values import Item
from silo_server.web.item_edit_page import shown_properties
from silo_server.web.login_page import Reader
from silo_server.web.render import page, segment
from silo_server.web.structure import Look, Structure, flat_page, level_counts, tree_page, usual_depth
from silo_server.web.tables import PAGE_ROWS, Address, Page

router = APIRouter(include_in_schema=False)

MOST_USES = 200
# Some 400 sheets of paper.
MOST_PRINTED = 20_000


Asked = Annotated[Look, Depends()]


@router.get("/items/{part_number}")
def item_page(
    call: Reader,
    part_number: str,
    look: Asked,
    used_from: Annotated[int, Query(ge=0, le=10_000_000)] = 0,
    revisions_before: Annotated[int, Query(ge=1, le=2**31 - 1)] = 2**31 - 1,
) -> Response:
    """The item and everything around it; ``view=flat`` shows the leaf parts with their totals.

    ``used_from`` pages through where it is used, ``revisions_before`` through its revisions.
    """
    with call.read() as tx:
        item = get_item(tx, part_number, include_archived=True)
        shown = structure_of(tx, item, look)
        history, revision_count = revisions.list_revisions(tx, item, before=revisions_before)
        used, uses = tree.where_used(tx, item, indirect=True, limit=MOST_USES, offset=used_from)
    return page(
        call,
        "item.html",
        item=item,
        look=look,
        at=look.address(f"/items/{segment(item.part_number)}"),
        types=ITEM_TYPES,
        revisions=history,
        revision_count=revision_count,
        used=used,
        uses=uses,
        used_from=used_from,
        most_uses=MOST_USES,
        properties=shown_properties(item),
        upload_key=secrets.token_urlsafe(16),  # a form that is sent twice makes one revision
        **shown,
    )


@router.get("/items/{part_number}/print")
def print_page(call: Reader, part_number: str, look: Asked) -> Response:
    """The BOM for paper: all rows of the view on one page, with what a reader must know on top."""
    with call.read() as tx:
        item = get_item(tx, part_number, include_archived=True)
        shown = structure_of(tx, item, look, MOST_PRINTED)
        now = tx.stamp
    path = f"/items/{segment(item.part_number)}"
    values = {"item": item, "look": look, "at": look.address(path), "now": now, **shown}
    return page(call, "print.html", **values)


def structure_of(tx: Tx, item: Item, look: Look, size: int = PAGE_ROWS) -> dict[str, Any]:
    """What the templates of a BOM over all levels show: table, totals, what the last sync left out."""
    try:
        graph, problem = tree.load_graph(tx, item), ""
    except TooLargeError as error:
        graph, problem = tree.load_graph(tx, item, 1), str(error)
    last, marks = last_sync(tx, item), marks_of(tx, graph)
    values: dict[str, Any] = {"last": last, "gaps": in_sentences(last.gaps), "marks": marks}
    values |= {
        "problem": problem,
        "table": None,
        "above": (),
        "levels": 0,
        "depth": 0,
        "cost": None,
        "mass": None,
    }
    if problem or item.id not in graph.lines:
        return values
    counts = level_counts(graph)
    depth = look.depth or (len(counts) if size > PAGE_ROWS else usual_depth(counts))
    look = replace(look, depth=depth)
    values |= {"levels": len(counts), "occurrences": sum(counts), "depth": depth}
    try:
        parts = rollup.parts_of(tx, graph)
        values |= {"cost": rollup.roll_up_cost(graph, parts), "mass": rollup.roll_up_mass(graph, parts)}
        shown = Structure(graph, parts, rollup.worths(graph, parts), marks, size)
        if look.is_flat:
            return values | {"table": flat_page(shown, look)}
        table, above = tree_page(shown, look, sum(counts))
        return values | {"table": table, "above": above}
    except (ConflictError, TooLargeError) as error:
        return {**values, "problem": str(error)}


PAGE_SIZE = 100


@router.get("/")
@router.get("/items")
def items_page(
    call: Reader,
    q: Annotated[str, Query(max_length=200)] = "",
    type: Annotated[str, Query(max_length=20)] = "",
    category: Annotated[str, Query(max_length=32)] = "",
    archived: bool = False,
    sort: Annotated[str, Query(max_length=20)] = "",
    number: Annotated[int, Query(ge=1, le=10**7, alias="page")] = 1,
) -> Response:
    """Search as you type; without script the form does the same."""
    query = ItemQuery(
        search=q,
        item_type=type or None,
        category=category or None,
        archived=archived,
        limit=PAGE_SIZE,
        offset=(number - 1) * PAGE_SIZE,
        sort=sort,
    )
    with call.read() as tx:
        found, total = list_items(tx, query)
        used = tree.use_counts(tx, [item.id for item in found])
    asked = {"q": q, "type": type, "category": category, "archived": "1" if archived else "", "sort": sort}
    return page(
        call,
        "items.html",
        at=Address("/items", {name: value for name, value in asked.items() if value}),
        table=Page(found, total, total, number, PAGE_SIZE),
        used=used,
        q=q,
        type=type,
        types=ITEM_TYPES,
        category=category,
        categories=find_schema(None).categories,
        archived=archived,
        sort=sort,
    )
