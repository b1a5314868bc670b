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
from silo_server.schema.catalog import ITEM_TYPES
from silo_server.services.items import ItemQuery, list_items
from silo_server.web.guard import Reader
from silo_server.web.render import page

router = APIRouter(include_in_schema=False)

PAGE_SIZE = 50


@router.get("/")
@router.get("/items")
def items_page(
    request: Request,
    server: ServerDep,
    caller: Reader,
    q: Annotated[str, Query(max_length=200)] = "",
    type: Annotated[str, Query(max_length=20)] = "",
    start: Annotated[int, Query(ge=0, le=10**9)] = 0,
) -> Response:
    """Search as you type; without script the form does the same."""
    query = ItemQuery(search=q, item_type=type or None, limit=PAGE_SIZE, offset=start)
    with server.db.read(caller) as tx:
        found, total = list_items(tx, query)
        used = _use_counts(tx, [item.id for item in found])
    return page(
        request,
        "items.html",
        caller,
        items=found,
        used=used,
        total=total,
        q=q,
        type=type,
        types=ITEM_TYPES,
        start=start,
        size=PAGE_SIZE,
    )


def _use_counts(tx: Tx, ids: list[int]) -> dict[int, int]:
    rows = tx.conn.execute(
        select(bom_lines.c.child_id, func.count())
        .where(one_of(tx, bom_lines.c.child_id, ids))
        .group_by(bom_lines.c.child_id)
    )
    return {row[0]: row[1] for row in rows}
