# SPDX-License-Identifier: LGPL-2.1-or-later
"""Finding items."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request
from sqlalchemy import func, select
from starlette.responses import Response

from silo_server.db.bulk import one_of
from silo_server.db.engine import Tx
from silo_server.db.tables import bom_lines
from silo_server.routes.context import ServerDep
from silo_server.schema.catalog import ITEM_TYPES, find_schema
from silo_server.services.items import ItemQuery, list_items
from silo_server.web.guard import Reader
from silo_server.web.render import page
from silo_server.web.tables import Address, Page

router = APIRouter(include_in_schema=False)

PAGE_SIZE = 100


@router.get("/")
@router.get("/items")
def items_page(
    request: Request,
    server: ServerDep,
    caller: Reader,
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
    with server.db.read(caller) as tx:
        found, total = list_items(tx, query)
        used = _use_counts(tx, [item.id for item in found])
    asked = {"q": q, "type": type, "category": category, "archived": "1" if archived else "", "sort": sort}
    return page(
        request,
        "items.html",
        caller,
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


def _use_counts(tx: Tx, ids: list[int]) -> dict[int, int]:
    rows = tx.conn.execute(
        select(bom_lines.c.child_id, func.count())
        .where(one_of(tx, bom_lines.c.child_id, ids))
        .group_by(bom_lines.c.child_id)
    )
    return {row[0]: row[1] for row in rows}
