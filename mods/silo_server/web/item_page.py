# SPDX-License-Identifier: LGPL-2.1-or-later
"""One item with all that is known of it: BOM as a tree or flat, totals, revisions, where-used."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from silo.bom.errors import ConflictError
from silo_server.db.engine import Tx
from silo_server.errors import TooLargeError
from silo_server.routes.context import ServerDep
from silo_server.services import revisions
from silo_server.services.bom import rollup, tree
from silo_server.services.bom.last_sync import in_sentences, last_sync
from silo_server.services.bom.last_sync import marks as marks_of
from silo_server.services.items import get_item
from silo_server.values import Item, Line
from silo_server.web.guard import Reader
from silo_server.web.render import page

router = APIRouter(include_in_schema=False)

# A tree with more lines than this helps nobody; it is shown less deep, and the exports have all of it.
MOST_LINES = 2000
MOST_ROWS = 5000
MOST_USES = 200


@dataclass
class Node:
    """A line of the tree with what lies below it."""

    line: Line
    total: tree.Exact
    mark: str = ""
    below: list[Node] = field(default_factory=list)


@router.get("/items/{part_number}")
def item_page(
    request: Request,
    server: ServerDep,
    caller: Reader,
    part_number: str,
    view: Annotated[str, Query(max_length=10)] = "tree",
    used_from: Annotated[int, Query(ge=0, le=10_000_000)] = 0,
    revisions_before: Annotated[int, Query(ge=1, le=2**31 - 1)] = 2**31 - 1,
) -> Response:
    """The item and everything around it; ``view=flat`` shows the leaf parts with their totals.

    ``used_from`` pages through where it is used, ``revisions_before`` through its revisions.
    """
    with server.db.read(caller) as tx:
        item = get_item(tx, part_number, include_archived=True)
        shown = _structure(tx, item, flat=view == "flat")
        history, revision_count = revisions.list_revisions(tx, item, before=revisions_before)
        used, uses = tree.where_used(tx, item, indirect=True, limit=MOST_USES, offset=used_from)
    return page(
        request,
        "item.html",
        caller,
        item=item,
        view="flat" if view == "flat" else "tree",
        revisions=history,
        revision_count=revision_count,
        used=used,
        uses=uses,
        used_from=used_from,
        most_uses=MOST_USES,
        **shown,
    )


def _structure(tx: Tx, item: Item, *, flat: bool) -> dict[str, Any]:
    graph = tree.load_graph(tx, item)
    last, marks = last_sync(tx, item), marks_of(tx, graph)
    values: dict[str, Any] = {"last": last, "gaps": in_sentences(last.gaps), "marks": marks}
    values |= {"problem": "", "nodes": [], "levels": 0, "rows": [], "cost": None, "mass": None}
    if item.id not in graph.lines:
        return values
    try:
        parts = rollup.parts_of(tx, graph)
        cost, mass = rollup.roll_up_cost(graph, parts), rollup.roll_up_mass(graph, parts)
    except ConflictError as error:
        return {**values, "problem": str(error)}
    values |= {"cost": cost, "mass": mass}
    if flat:
        return values | {"rows": _flat_rows(graph, cost, mass)}
    rows, levels = _deepest(graph)
    return values | {"nodes": nested(rows, marks), "levels": levels}


def _deepest(graph: tree.Graph) -> tuple[Sequence[tree.Occurrence], int]:
    """As much of the tree as a page can show, and down to which level (0 = all of it)."""
    for depth in (tree.MAX_DEPTH, 4, 3, 2):
        try:
            rows = tree.expand(graph, depth, MOST_LINES)
        except TooLargeError:
            continue
        return rows, 0 if depth == tree.MAX_DEPTH else depth
    return tree.expand(graph, 1, 10**9)[:MOST_LINES], 1


def _flat_rows(
    graph: tree.Graph, cost: rollup.CostRollup, mass: rollup.MassRollup
) -> list[tuple[tree.FlatRow, rollup.CostRow | None, rollup.MassRow | None]]:
    costs = {row.part_number: row for row in cost.rows}
    masses = {row.part_number: row for row in mass.rows}
    return [
        (row, costs.get(row.line.child_part_number), masses.get(row.line.child_part_number))
        for row in tree.flatten(graph)[:MOST_ROWS]
    ]


def nested(rows: Sequence[tree.Occurrence], marks: Mapping[int, str] | None = None) -> list[Node]:
    """The rows of an expanded BOM (parents before children) as a tree; ``marks`` by item id."""
    top: list[Node] = []
    stack: list[list[Node]] = [top]
    for row in rows:
        del stack[row.depth :]
        node = Node(row.line, row.total, (marks or {}).get(row.line.child_id, ""))
        stack[-1].append(node)
        stack.append(node.below)
    return top
