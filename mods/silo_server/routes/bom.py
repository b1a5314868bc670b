# SPDX-License-Identifier: LGPL-2.1-or-later
"""BOM lines, the merge, and the tree."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any

import anyio.to_thread
import pydantic_core
from fastapi import APIRouter, Query
from starlette.responses import Response

from silo.api.wire import MergeResult
from silo.bom.errors import CycleError, RejectedError
from silo.bom.numbers import plain
from silo_server.db.engine import Tx
from silo_server.routes import document
from silo_server.routes.context import (
    READ_ERRORS,
    WRITE_ERRORS,
    Call,
    Editor,
    ExpectedVersion,
    Viewer,
    etag_of,
    json_answer,
    json_body,
    raw_json,
)
from silo_server.routes.models import (
    BomsOut,
    LineChangeBody,
    LineOut,
    NewLineBody,
    NumbersBody,
)
from silo_server.services.bom import edits, rollup, tree
from silo_server.services.bom.last_sync import NEVER, last_syncs, marks, remember_refusal
from silo_server.services.bom.lines import (
    LineId,
    check_line_count,
    child_to_wire,
    line_state_to_wire,
    line_to_wire,
    lines_of_many,
    revisions_to_wire,
)
from silo_server.services.bom.merge import MergeOutcome, merge_bom, preview_merge
from silo_server.services.bom.merge_json import MergeOrder, read_merge_order
from silo_server.services.bom.review import told_quantities
from silo_server.services.items import get_by_numbers, get_item
from silo_server.values import Item, LineState, to_wire

router = APIRouter(prefix="/api/items/{part_number}/bom", tags=["bom"])
several = APIRouter(prefix="/api", tags=["bom"])

Depth = Annotated[int, Query(ge=1, le=tree.MAX_DEPTH)]
MERGE_BODY = {
    **document.refused(
        "an entry whose part number no item has, an assembly as its own child, and entries of one child that "
        "add up to more than 1e9; all of them are listed and nothing is changed"
    ),
    "requestBody": {
        "required": True,
        "content": {"application/json": {"schema": {"$ref": "#/components/schemas/MergeRequest"}}},
    },
}


@router.get("", response_model=list[LineOut], responses=READ_ERRORS)
def get_bom(call: Viewer, part_number: str) -> Response:
    """The lines of one level. ``ETag`` is the BOM's version, for ``If-Match``."""
    with call.read() as tx:
        item = get_item(tx, part_number)
        rows = _lines_of(tx, [item])[item.id]
    return json_answer(rows, headers={"ETag": etag_of(item.bom_version)})


@several.post("/items/boms", response_model=BomsOut, responses=READ_ERRORS)
def get_boms(call: Viewer, body: NumbersBody) -> Response:
    """The lines of many items, one level each; items that are not known are absent. Reads only."""
    with call.read() as tx:
        found = get_by_numbers(tx, body.part_numbers)
        check_line_count(tx, [item.id for item in found.values()])
        rows = _lines_of(tx, list(found.values()))
    return json_answer({"boms": {number: rows[item.id] for number, item in found.items()}})


def _lines_of(tx: Tx, parents: Sequence[Item]) -> dict[int, list[dict[str, Any]]]:
    """The lines of these items as the API has them, by the item's internal id."""
    ids = [parent.id for parent in parents]
    lines, told, last = lines_of_many(tx, ids), told_quantities(tx, ids), last_syncs(tx, ids)
    return {
        parent.id: [
            {
                **line_to_wire(line, parent.part_number),
                "assembly_told": line.child_id in told.get(parent.id, {}),
                "assembly_quantity": plain(told.get(parent.id, {}).get(line.child_id)),
                "components": last.get(parent.id, NEVER).components.get(line.child_id, []),
            }
            for line in lines.get(parent.id, [])
        ]
        for parent in parents
    }


@router.post("", status_code=201, response_model=LineOut, responses=WRITE_ERRORS)
def add_line(call: Editor, part_number: str, body: NewLineBody, expected: ExpectedVersion) -> Response:
    """Add a line by hand."""
    values = body.model_dump(exclude={"child_part_number"})
    state = LineState(**{**values, "reference_designators": tuple(body.reference_designators)})
    with call.write() as tx:
        edited = edits.add_line(tx, part_number, body.child_part_number, state, expected)
        return _edited(edited, 201)


@router.put("/{child}", response_model=LineOut, responses=WRITE_ERRORS)
def change_line(
    call: Editor, part_number: str, child: str, body: LineChangeBody, expected: ExpectedVersion
) -> Response:
    """Change the one line of a child; 409 where it has several.

    Another quantity on an assembly line makes it a manual override.
    """
    return _change(call, part_number, child, body, expected)


@router.delete("/{child}", status_code=204, responses=WRITE_ERRORS)
def remove_line(call: Editor, part_number: str, child: str, expected: ExpectedVersion) -> Response:
    """Remove the one line of a child; 409 where it has several."""
    return _remove(call, part_number, child, expected)


@router.put("/lines/{line_id}", response_model=LineOut, responses=WRITE_ERRORS)
def change_line_by_id(
    call: Editor, part_number: str, line_id: str, body: LineChangeBody, expected: ExpectedVersion
) -> Response:
    """Change the line with this id; for a child that has several lines (a component and an alternate)."""
    return _change(call, part_number, LineId(line_id), body, expected)


@router.delete("/lines/{line_id}", status_code=204, responses=WRITE_ERRORS)
def remove_line_by_id(call: Editor, part_number: str, line_id: str, expected: ExpectedVersion) -> Response:
    """Remove the line with this id."""
    return _remove(call, part_number, LineId(line_id), expected)


@router.post("/merge", response_model=MergeResult, responses=WRITE_ERRORS, openapi_extra=MERGE_BODY)
async def merge(call: Editor, part_number: str, expected: ExpectedVersion) -> Response:
    """Merge an assembly's direct children (spec bom-sync §5).

    ``sync_id`` makes a repeat give the same answer, ``dry_run`` gives the answer without the change,
    ``If-Match`` refuses (412) where somebody was quicker.
    """
    body = await json_body(call.request)

    def work() -> MergeOutcome:
        order = read_merge_order(body, call.server.settings.max_merge_entries)
        return _merge(call, part_number, order, expected)

    outcome = await anyio.to_thread.run_sync(work)
    return raw_json(outcome.answer, headers={"ETag": etag_of(outcome.version)})


@router.get("/expanded", response_model=list[LineOut], responses=READ_ERRORS)
def get_expanded(call: Viewer, part_number: str, depth: Depth = tree.MAX_DEPTH) -> Response:
    """The tree as rows, parents before children; quantities per one parent, and in total."""
    with call.read() as tx:
        graph = tree.load_graph(tx, get_item(tx, part_number), None if depth == tree.MAX_DEPTH else depth)
    rows = tree.expand(graph, depth, call.server.settings.max_expanded_rows)
    return raw_json(render_expanded(rows))


@router.get("/flat", responses=READ_ERRORS)
def get_flat(call: Viewer, part_number: str) -> dict[str, Any]:
    """The leaf parts, quantities multiplied down the tree and summed; 409 where it never ends."""
    with call.read() as tx:
        graph = tree.load_graph(tx, get_item(tx, part_number))
        found = marks(tx, graph)
    return {
        "part_number": graph.root.part_number,
        "incomplete": {graph.names()[one]: words for one, words in found.items()},
        "flat_bom": [
            {
                "part_number": row.line.child_part_number,
                "id": row.line.child_uuid,
                "name": row.line.child_name,
                "description": row.line.child_description,
                "item_type": row.line.child_item_type,
                "total_quantity": plain(row.total),
                "unit": row.unit,
            }
            for row in tree.flatten(graph)
        ],
    }


@router.get("/cost", responses=READ_ERRORS)
def get_cost(call: Viewer, part_number: str) -> dict[str, Any]:
    """Flat BOM × ``standard_cost``, per currency; ``missing`` names what has no cost."""
    with call.read() as tx:
        graph = tree.load_graph(tx, get_item(tx, part_number))
        cost = rollup.roll_up_cost(graph, rollup.parts_of(tx, graph))
    only = next(iter(cost.totals.values())) if len(cost.totals) == 1 else None
    return {
        "part_number": graph.root.part_number,
        "total_cost": only if cost.totals else 0.0,
        "totals": [{"currency": c, "total_cost": t} for c, t in cost.totals.items()],
        "complete": not cost.missing,
        "missing": list(cost.missing),
        "lines": [to_wire(row) for row in cost.rows],
    }


@router.get("/mass", responses=READ_ERRORS)
def get_mass(call: Viewer, part_number: str) -> dict[str, Any]:
    """The mass of one piece [kg] from its parts' ``mass_kg``; ``missing`` names what has none."""
    with call.read() as tx:
        graph = tree.load_graph(tx, get_item(tx, part_number))
        mass = rollup.roll_up_mass(graph, rollup.parts_of(tx, graph))
    return {
        "part_number": graph.root.part_number,
        "total_mass_kg": mass.total,
        "stated_mass_kg": mass.stated,
        "complete": not mass.missing,
        "missing": list(mass.missing),
        "lines": [to_wire(row) for row in mass.rows],
    }


@router.get("/where-used", response_model=list[dict[str, Any]], responses=READ_ERRORS)
def get_where_used(
    call: Viewer,
    part_number: str,
    indirect: bool = False,
    limit: Annotated[int, Query(ge=1, le=1000)] = 1000,
    offset: Annotated[int, Query(ge=0, le=10_000_000)] = 0,
) -> Response:
    """The parents; with ``indirect`` theirs as well. ``X-Total-Count`` says how many there are in all."""
    with call.read() as tx:
        item = get_item(tx, part_number)
        found, total = tree.where_used(tx, item, indirect=indirect, limit=limit, offset=offset)
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
        for usage in found
    ]
    return json_answer(rows, headers={"X-Total-Count": str(total)})


def line_changes(body: LineChangeBody) -> dict[str, Any]:
    """The changes that a body asks for: only what it names; null clears what may be empty."""
    changes = body.model_dump(exclude_unset=True)
    if "reference_designators" in changes:
        changes["reference_designators"] = tuple(changes["reference_designators"] or ())
    if "metadata" in changes:
        changes["metadata"] = changes["metadata"] or {}
    return changes


def _merge(call: Call, part_number: str, order: MergeOrder, expected: int | None) -> MergeOutcome:
    if order.dry_run:
        with call.read() as tx:
            return preview_merge(tx, part_number, order, expected)
    try:
        with call.write() as tx:
            return merge_bom(tx, part_number, order, expected)
    except (RejectedError, CycleError) as error:
        # In a transaction of its own: that of the merge is undone.
        with call.write() as tx:
            remember_refusal(tx, get_item(tx, part_number, lock=True), str(error)[:4096])
        raise


def _change(
    call: Call, part_number: str, which: str | LineId, body: LineChangeBody, expected: int | None
) -> Response:
    with call.write() as tx:
        return _edited(edits.change_line(tx, part_number, which, line_changes(body), expected), 200)


def _remove(call: Call, part_number: str, which: str | LineId, expected: int | None) -> Response:
    with call.write() as tx:
        edited = edits.remove_line(tx, part_number, which, expected)
    return Response(status_code=204, headers={"ETag": etag_of(edited.version)})


def _edited(edited: edits.Edited, status: int) -> Response:
    assert edited.line is not None  # add and change leave a line behind
    return json_answer(
        line_to_wire(edited.line, edited.parent.part_number), status, {"ETag": etag_of(edited.version)}
    )


def render_expanded(rows: Sequence[tree.Occurrence]) -> bytes:
    """The rows as a JSON list, each a line with ``depth`` and ``total_quantity``.

    Written from pieces that are made once per child and once per state: a tree of 100 000 occurrences has few
    of either. The pieces are those of ``line_to_wire``.
    """
    children: dict[int, bytes] = {}
    parents: dict[str, bytes] = {}
    states: dict[int, bytes] = {}
    keep: list[LineState] = []  # states are found by their identity, which must not be given out anew
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
        parts.append(
            b'{"id":"%b","parent_part_number":%b,%b,%b,%b,"depth":%d,"total_quantity":%b}'
            % (line.id.encode(), above, child, state, revisions, depth, repr(plain(total)).encode())
        )
    return b"[" + b",".join(parts) + b"]"


def _members(value: Mapping[str, Any]) -> bytes:
    return pydantic_core.to_json(value)[1:-1]
