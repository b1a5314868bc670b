# SPDX-License-Identifier: LGPL-2.1-or-later
"""Finding items, and one item with all that is known of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from fastapi import APIRouter, Query, Request
from sqlalchemy import func, select
from starlette.responses import Response

from silo.bom.errors import CycleError, NotFoundError
from silo_server.db.engine import Tx
from silo_server.db.tables import bom_lines
from silo_server.errors import TooLargeError
from silo_server.routes.context import ServerDep
from silo_server.schema.catalog import ITEM_TYPES
from silo_server.services import revisions, rollup, tree
from silo_server.services.items import ItemQuery, get_item, list_items
from silo_server.values import Item, Line
from silo_server.web.guard import Reader
from silo_server.web.render import page

router = APIRouter(include_in_schema=False)

PAGE_SIZE = 50
# A page with more lines than this helps nobody; the exports have them all.
MOST_LINES = 2000
MOST_LEVELS = 20


@dataclass
class Node:
    """A line of the tree with what lies below it."""

    line: Line
    total: float
    below: list[Node] = field(default_factory=list)


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
        .where(bom_lines.c.child_id.in_(ids))
        .group_by(bom_lines.c.child_id)
    )
    return {row[0]: row[1] for row in rows}


@router.get("/items/{part_number}")
def item_page(
    request: Request,
    server: ServerDep,
    caller: Reader,
    part_number: str,
    view: Annotated[str, Query(max_length=10)] = "tree",
) -> Response:
    """The item: BOM as a tree or flat, totals, revisions, where-used."""
    problem = ""
    nodes: list[Node] = []
    flat: list[tree.FlatRow] = []
    cost = mass = None
    with server.db.read(caller) as tx:
        item = get_item(tx, part_number, include_archived=True)
        graph = tree.load_graph(tx, item)
        try:
            flat = tree.flatten(graph)
            nodes = nested(tree.expand(graph, MOST_LEVELS, MOST_LINES))
            cost, mass = rollup.roll_up_cost(tx, graph), rollup.roll_up_mass(tx, graph)
        except (CycleError, TooLargeError) as error:
            problem = str(error)
        history = revisions.list_revisions(tx, item)
        used = tree.where_used(tx, item)
        newest = _newest_file(tx, item)
    return page(
        request,
        "item.html",
        caller,
        item=item,
        nodes=nodes,
        flat=flat,
        view="flat" if view == "flat" else "tree",
        cost=cost,
        mass=mass,
        revisions=history,
        newest=newest,
        used=used,
        problem=problem,
    )


def _newest_file(tx: Tx, item: Item) -> int | None:
    try:
        return revisions.newest_file(tx, item).revision_number
    except NotFoundError:
        return None


def nested(rows: list[tree.Occurrence]) -> list[Node]:
    """The rows of an expanded BOM (parents before children) as a tree."""
    top: list[Node] = []
    stack: list[list[Node]] = [top]
    for row in rows:
        del stack[row.depth :]
        node = Node(row.line, row.total)
        stack[-1].append(node)
        stack.append(node.below)
    return top
