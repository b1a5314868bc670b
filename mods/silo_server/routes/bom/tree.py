# SPDX-License-Identifier: LGPL-2.1-or-later
"""The tree below an item over HTTP: expanded, flat, its cost and mass; and where an item is used."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Annotated, Any

import pydantic_core
from fastapi import Query
from starlette.responses import Response

from silo.bom.quantities import plain
from silo_server.fields import to_wire
from silo_server.routes.answers import json_answer, raw_json
from silo_server.routes.bom import bom_router
from silo_server.routes.bom.summary import open_to_wire
from silo_server.routes.call import Viewer
from silo_server.routes.models import LineOut
from silo_server.services.bom.line_wire import child_to_wire, line_state_to_wire, revisions_to_wire
from silo_server.services.items import get_item
from silo_server.services.product.amounts import unit_is_open
from silo_server.services.product.cost import bought_whole, prices_in
from silo_server.services.product.flat import flatten
from silo_server.services.product.graph import MAX_DEPTH, load_graph
from silo_server.services.product.parts import parts_of, positive_number
from silo_server.services.product.rollup import roll_up_cost, roll_up_mass
from silo_server.services.product.summary_read import standing_alone, summary_of
from silo_server.services.product.tree import Occurrence, expand
from silo_server.services.product.where_used import where_used
from silo_server.services.suppliers import rates_of
from silo_server.values import LineState

router = bom_router("bom")

Depth = Annotated[int, Query(ge=1, le=MAX_DEPTH)]


@router.get("/expanded", response_model=list[LineOut])
def get_expanded(call: Viewer, part_number: str, depth: Depth = MAX_DEPTH) -> Response:
    """Return the tree as rows, parents before their children, with the quantity per parent and in total."""
    with call.server.large_reads.enter():
        with call.read() as tx:
            item = get_item(tx, part_number)
            graph = load_graph(tx, item, None if depth == MAX_DEPTH else depth)
        return raw_json(render_expanded(expand(graph, depth, call.server.settings.max_expanded_rows)))


@router.get("/flat")
def get_flat(call: Viewer, part_number: str) -> dict[str, Any]:
    """Return the leaf parts with their quantities, multiplied down the tree and added up; 409 for a cycle."""
    with call.server.large_reads.enter(), call.read() as tx:
        graph = load_graph(tx, get_item(tx, part_number))
        summary = summary_of(tx, graph.root)
    return {
        "part_number": graph.root.part_number,
        **open_to_wire(summary),
        "flat_bom": [
            {
                "part_number": row.line.child_part_number,
                "id": row.line.child_uuid,
                "name": row.line.child_name,
                "description": row.line.child_description,
                "item_type": row.line.child_item_type,
                "total_quantity": plain(row.total),
                "unit": row.unit,
                **({"unreferenced_quantity": plain(row.gone)} if row.gone else {}),
                **({"in_conflict": True} if row.disputed else {}),
                **({"unit_open": True} if row.unit_open else {}),
            }
            for row in flatten(graph)
        ],
    }


@router.get("/cost")
def get_cost(call: Viewer, part_number: str) -> dict[str, Any]:
    """Return the cost of one piece part by part, per currency; ``missing`` names the parts without a cost.

    A bought assembly is one part.
    """
    with call.server.large_reads.enter(), call.read() as tx:
        graph = load_graph(tx, get_item(tx, part_number))
        parts = parts_of(tx, graph)
        flat = flatten(graph, bought_whole(graph, parts))
        cost = roll_up_cost(flat, parts, prices_in(graph, parts, rates_of(tx)))
    only = plain(next(iter(cost.totals.values()))) if len(cost.totals) == 1 else None
    return {
        "part_number": graph.root.part_number,
        "total_cost": only if cost.totals else 0.0,
        "totals": [{"currency": c, "total_cost": plain(t)} for c, t in cost.totals.items()],
        "complete": not cost.missing,
        "missing": list(cost.missing),
        "lines": [row._asdict() for row in cost.rows],
    }


@router.get("/mass")
def get_mass(call: Viewer, part_number: str) -> dict[str, Any]:
    """Return the mass of one piece [kg] from its parts' ``mass_kg``; ``missing`` names parts without one."""
    with call.server.large_reads.enter(), call.read() as tx:
        graph = load_graph(tx, get_item(tx, part_number))
        alone = standing_alone(tx, graph)
        mass = roll_up_mass(flatten(graph, alone), parts_of(tx, graph), alone)
    return {
        "part_number": graph.root.part_number,
        "total_mass_kg": mass.total,
        "stated_mass_kg": positive_number(graph.root.properties, "mass_kg"),
        "complete": not mass.missing,
        "missing": list(mass.missing),
        "lines": [row._asdict() for row in mass.rows],
    }


@router.get("/where-used", response_model=list[dict[str, Any]])
def get_where_used(
    call: Viewer,
    part_number: str,
    indirect: bool = False,
    limit: Annotated[int, Query(ge=1, le=1000)] = 1000,
    offset: Annotated[int, Query(ge=0, le=10_000_000)] = 0,
) -> Response:
    """Return the parents of an item; with ``indirect`` their parents as well.

    ``X-Total-Count`` is the number of all of them.
    """
    with call.read() as tx:
        item = get_item(tx, part_number)
        usages, total = where_used(tx, item, indirect=indirect, limit=limit, offset=offset)
    rows = [
        {
            "parent_part_number": usage.parent.part_number,
            "parent_id": usage.parent.uuid,
            "parent_name": usage.parent.name,
            "parent_description": usage.parent.description,
            "parent_archived": usage.parent.archived_at is not None,
            **to_wire(usage, "parent"),
            "quantity": plain(usage.quantity),
        }
        for usage in usages
    ]
    return json_answer(rows, headers={"X-Total-Count": str(total)})


def render_expanded(rows: Iterable[Occurrence]) -> bytes:
    """Write the rows as a JSON list, each a line with ``depth`` and ``total_quantity``.

    The list is put together from pieces that are made once per child and once per state: a tree of 100 000
    occurrences has few of them. The pieces are those of ``line_to_wire``.
    """
    children: dict[int, bytes] = {}
    parents: dict[str, bytes] = {}
    states: dict[int, bytes] = {}
    keep: list[LineState] = []  # keeps them alive: Python reuses the id() of a dead one
    parts: list[bytes] = []
    for line, parent, depth, total in rows:
        line_state = line.state
        if (child := children.get(line.child_id)) is None:
            child = children[line.child_id] = _members(child_to_wire(line))
        if (state := states.get(id(line_state))) is None:
            keep.append(line_state)
            state = states[id(line_state)] = _members(line_state_to_wire(line_state))
        if (above := parents.get(parent)) is None:
            above = parents[parent] = pydantic_core.to_json(parent)
        if line_state.child_revision is None:
            revisions = b'"effective_revision":%d,"newer_revision_exists":false' % line.child_current_revision
        else:
            revisions = _members(revisions_to_wire(line))
        amount = b"null" if total is None else repr(plain(total)).encode()
        unit_open = b"true" if unit_is_open(line) else b"false"
        parts.append(
            b'{"id":"%b","parent_part_number":%b,%b,%b,%b,"unit_open":%b,"depth":%d,"total_quantity":%b}'
            % (line.id.encode(), above, child, state, revisions, unit_open, depth, amount)
        )
    return b"[" + b",".join(parts) + b"]"


def _members(value: Mapping[str, Any]) -> bytes:
    return pydantic_core.to_json(value)[1:-1]
