# SPDX-License-Identifier: LGPL-2.1-or-later
"""BOM lines, the merge, and the tree."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from functools import partial
from tempfile import SpooledTemporaryFile
from typing import IO, Annotated, Any, cast

import anyio.to_thread
import pydantic_core
from fastapi import APIRouter, Depends, Path, Query, Request
from pydantic import Field, StrictBool, WithJsonSchema
from starlette.datastructures import UploadFile
from starlette.responses import Response, StreamingResponse

from silo.api.wire import MergeResult
from silo.bom.errors import CycleError, RejectedError
from silo.bom.numbers import whole_number
from silo.bom.quantities import plain
from silo_server.db.answers import KeptAnswer, KeyedRequest, earlier_answer, keep_answer
from silo_server.db.transaction import Tx
from silo_server.fields import to_wire
from silo_server.routes import context, models
from silo_server.routes.context import (
    FORM_TYPES,
    READ_ERRORS,
    WRITE_ERRORS,
    Call,
    Editor,
    ExpectedVersion,
    PageFrom,
    Viewer,
    etag_of,
    idempotency_key,
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
    RequestBody,
    Short,
    Text,
)
from silo_server.services.bom import history, imports, review, transfer, tree
from silo_server.services.bom.frozen import changes_of
from silo_server.services.bom.last_sync import NEVER, last_syncs, record_refusal
from silo_server.services.bom.lines import (
    LineId,
    check_line_count,
    child_to_wire,
    line_state_to_wire,
    line_to_wire,
    lines_of_many,
    locked_parent,
    revisions_to_wire,
    state_to_json,
)
from silo_server.services.bom.merge import MergeOutcome, merge_bom, preview_merge
from silo_server.services.bom.merge_request import MergeRequestIn, read_merge_request
from silo_server.services.bom.review import told_quantities
from silo_server.services.bom.summary import Summary, standing_alone, summary_of
from silo_server.services.bom.transfer import View
from silo_server.services.items import get_by_numbers, get_item
from silo_server.services.revisions import clean_name
from silo_server.times import stamp, wire_time
from silo_server.user_json import dumps
from silo_server.values import Item, LineState

router = APIRouter(prefix="/api/items/{part_number}/bom", tags=["bom"], responses=READ_ERRORS)
several = APIRouter(prefix="/api", tags=["bom"], responses=READ_ERRORS)

Depth = Annotated[int, Query(ge=1, le=tree.MAX_DEPTH)]
MERGE_BODY = {
    **context.refused(
        "an entry whose part number no item has, an assembly as its own child, and entries of one child that "
        "add up to more than 1e9; all of them are listed and nothing is changed"
    ),
    "requestBody": {
        "required": True,
        "content": {"application/json": {"schema": {"$ref": "#/components/schemas/MergeRequest"}}},
    },
}


@router.get("", response_model=list[LineOut])
def get_bom(call: Viewer, part_number: str) -> Response:
    """Return the BOM lines of an item, one level. ``ETag`` is the version of the BOM, for ``If-Match``."""
    with call.read() as tx:
        item = get_item(tx, part_number)
        rows = _lines_of(tx, [item])[item.id]
    return json_answer(rows, headers={"ETag": etag_of(item.bom_version)})


@several.post("/items/boms", response_model=BomsOut)
def get_boms(call: Viewer, body: NumbersBody) -> Response:
    """Return the BOM lines of many items, one level each; unknown items are absent. Changes nothing.

    413 if several items have more than 10 000 lines in all: ask for fewer items. One item alone may have any
    number of lines.
    """
    with call.read() as tx:
        items = get_by_numbers(tx, body.part_numbers)
        check_line_count(tx, [item.id for item in items.values()])
        rows = _lines_of(tx, list(items.values()))
    return json_answer({"boms": {number: rows[item.id] for number, item in items.items()}})


def _lines_of(tx: Tx, parents: Sequence[Item]) -> dict[int, list[dict[str, Any]]]:
    """Return the BOM lines of these items as the API sends them, by the item's internal id."""
    ids = [parent.id for parent in parents]
    lines, quantities, last = lines_of_many(tx, ids), told_quantities(tx, ids), last_syncs(tx, ids)
    return {
        parent.id: [
            {
                **line_to_wire(line, parent.part_number),
                "assembly_told": line.child_id in quantities.get(parent.id, {}),
                "assembly_quantity": plain(quantities.get(parent.id, {}).get(line.child_id)),
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
        edited = review.add_line(tx, part_number, body.child_part_number, state, expected)
        return _edited(edited, 201)


@router.put("/{child}", response_model=LineOut, responses=WRITE_ERRORS)
def change_line(
    call: Editor, part_number: str, child: str, body: LineChangeBody, expected: ExpectedVersion
) -> Response:
    """Change the one line of a child; 409 if the child has several lines.

    A different quantity on a line of the assembly makes it a manual override.
    """
    return _change(call, part_number, child, body, expected)


@router.delete("/{child}", status_code=204, responses=WRITE_ERRORS)
def remove_line(call: Editor, part_number: str, child: str, expected: ExpectedVersion) -> Response:
    """Remove the one line of a child; 409 if the child has several lines."""
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
    """Merge the direct children of an assembly into its BOM (spec bom-sync §5).

    A repeat with the same ``sync_id`` gets the same answer. ``dry_run`` gives the answer and changes nothing.
    With ``If-Match`` the merge is refused (412) if somebody else changed the BOM first.
    """
    body = await json_body(call.request)

    def work() -> MergeOutcome:
        request = read_merge_request(body, call.server.settings.max_merge_entries)
        return _merge(call, part_number, request, expected)

    outcome = await anyio.to_thread.run_sync(work)
    return raw_json(outcome.answer, headers={"ETag": etag_of(outcome.version)})


@router.get("/expanded", response_model=list[LineOut])
def get_expanded(call: Viewer, part_number: str, depth: Depth = tree.MAX_DEPTH) -> Response:
    """Return the tree as rows, parents before their children, with the quantity per parent and in total."""
    with call.server.large_reads.enter():
        with call.read() as tx:
            item = get_item(tx, part_number)
            graph = tree.load_graph(tx, item, None if depth == tree.MAX_DEPTH else depth)
        return raw_json(render_expanded(tree.expand(graph, depth, call.server.settings.max_expanded_rows)))


@router.get("/flat")
def get_flat(call: Viewer, part_number: str) -> dict[str, Any]:
    """Return the leaf parts with their quantities, multiplied down the tree and added up; 409 for a cycle."""
    with call.server.large_reads.enter(), call.read() as tx:
        graph = tree.load_graph(tx, get_item(tx, part_number))
        summary = summary_of(tx, graph.root)
    return {
        "part_number": graph.root.part_number,
        **_open_to_wire(summary),
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
            }
            for row in tree.flatten(graph)
        ],
    }


def _open_to_wire(summary: Summary) -> dict[str, Any]:
    boms = summary.open.values()
    return {
        "open": {each.part_number: each.questions for each in boms if each.questions},
        "incomplete": {each.part_number: each.incomplete for each in boms if each.incomplete},
    }


@router.get("/cost")
def get_cost(call: Viewer, part_number: str) -> dict[str, Any]:
    """Return the flat BOM × ``standard_cost``, per currency; ``missing`` names the parts without a cost."""
    with call.server.large_reads.enter(), call.read() as tx:
        graph = tree.load_graph(tx, get_item(tx, part_number))
        cost = tree.roll_up_cost(tree.flatten(graph), tree.parts_of(tx, graph))
    only = next(iter(cost.totals.values())) if len(cost.totals) == 1 else None
    return {
        "part_number": graph.root.part_number,
        "total_cost": only if cost.totals else 0.0,
        "totals": [{"currency": c, "total_cost": t} for c, t in cost.totals.items()],
        "complete": not cost.missing,
        "missing": list(cost.missing),
        "lines": [row._asdict() for row in cost.rows],
    }


@router.get("/mass")
def get_mass(call: Viewer, part_number: str) -> dict[str, Any]:
    """Return the mass of one piece [kg] from its parts' ``mass_kg``; ``missing`` names parts without one."""
    with call.server.large_reads.enter(), call.read() as tx:
        graph = tree.load_graph(tx, get_item(tx, part_number))
        alone = standing_alone(tx, graph)
        mass = tree.roll_up_mass(tree.flatten(graph, alone), tree.parts_of(tx, graph), alone)
    return {
        "part_number": graph.root.part_number,
        "total_mass_kg": mass.total,
        "stated_mass_kg": tree.positive_number(graph.root.properties, "mass_kg"),
        "complete": not mass.missing,
        "missing": list(mass.missing),
        "lines": [row._asdict() for row in mass.rows],
    }


@router.get("/summary")
def get_summary(call: Viewer, part_number: str) -> dict[str, Any]:
    """Return the summary of a product over all levels: what is open, mass, cost, counts, the last change.

    ``total_mass_kg`` and ``totals`` do not include the parts that ``mass_missing`` and ``cost_missing``
    count; the first of these are named.
    """
    with call.read() as tx:
        item = get_item(tx, part_number)
        summary = summary_of(tx, item)
    costs = summary.worth.costs.items()
    return {
        "part_number": item.part_number,
        **_open_to_wire(summary),
        "questions": summary.questions,
        **to_wire(summary, "open", "worth", "as_part", "levels", "no_mass", "no_cost", "changed"),
        "levels": len(summary.levels),
        "total_mass_kg": plain(summary.worth.mass),
        "totals": [{"currency": currency, "total_cost": plain(cost)} for currency, cost in costs],
        "mass_missing": {"count": summary.no_mass, "first": list(summary.mass_missing)},
        "cost_missing": {"count": summary.no_cost, "first": list(summary.cost_missing)},
        "last_change": {
            "at": wire_time(summary.changed.at),
            "user": summary.changed.username,
            "item": summary.changed.part_number,
        },
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
        usages, total = tree.where_used(tx, item, indirect=indirect, limit=limit, offset=offset)
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


def line_changes(body: LineChangeBody) -> dict[str, Any]:
    """Return the changes that a body asks for: only the fields that it names; null clears a field."""
    changes = body.model_dump(exclude_unset=True)
    if "reference_designators" in changes:
        changes["reference_designators"] = tuple(changes["reference_designators"] or ())
    if "metadata" in changes:
        changes["metadata"] = changes["metadata"] or {}
    return changes


def _merge(call: Call, part_number: str, request: MergeRequestIn, expected: int | None) -> MergeOutcome:
    if request.dry_run:
        with call.read() as tx:
            return preview_merge(tx, part_number, request, expected)
    try:
        with call.write() as tx:
            return merge_bom(tx, part_number, request, expected)
    except (RejectedError, CycleError) as error:
        # In a transaction of its own: that of the merge is undone.
        with call.write() as tx:
            record_refusal(tx, get_item(tx, part_number, lock=True), str(error)[:4096])
        raise


def _change(
    call: Call, part_number: str, which: str | LineId, body: LineChangeBody, expected: int | None
) -> Response:
    with call.write() as tx:
        return _edited(review.change_line(tx, part_number, which, line_changes(body), expected), 200)


def _remove(call: Call, part_number: str, which: str | LineId, expected: int | None) -> Response:
    with call.write() as tx:
        edited = review.remove_line(tx, part_number, which, expected)
    return Response(status_code=204, headers={"ETag": etag_of(edited.version)})


def _edited(edited: review.Edited, status: int) -> Response:
    assert edited.line is not None  # add and change leave a line behind
    return json_answer(
        line_to_wire(edited.line, edited.parent.part_number), status, {"ETag": etag_of(edited.version)}
    )


def render_expanded(rows: Iterable[tree.Occurrence]) -> bytes:
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
        parts.append(
            b'{"id":"%b","parent_part_number":%b,%b,%b,%b,"depth":%d,"total_quantity":%b}'
            % (line.id.encode(), above, child, state, revisions, depth, repr(plain(total)).encode())
        )
    return b"[" + b",".join(parts) + b"]"


def _members(value: Mapping[str, Any]) -> bytes:
    return pydantic_core.to_json(value)[1:-1]


review_router = APIRouter(prefix="/api/items/{part_number}/bom", tags=["bom review"], responses=READ_ERRORS)

ChangeId = Annotated[int, Path(ge=0, le=2**62)]


class DecisionBody(RequestBody):
    """One decision; ``reason`` says why a line is kept.

    The line is named by ``line_id``, or by its child: then the component is meant.
    """

    child_part_number: Short = ""
    line_id: Short | None = None
    action: review.ReviewAction
    reason: Text | None = None


class ResolveBody(RequestBody):
    """``POST …/bom/resolve``: all of them as one change."""

    decisions: Annotated[list[DecisionBody], Field(min_length=1, max_length=20_000)]


class RestoreBody(RequestBody):
    """``POST …/bom/restore``: the change whose state comes back (0 = the empty BOM).

    ``with_archived``: archived parts may come back with it; else 409 names them.
    """

    change_id: models.ChangeIdOrNone
    reason: Text | None = None
    with_archived: StrictBool = False


class UndoBody(RequestBody):
    """``POST …/bom/undo``."""

    change_id: models.ChangeId


@review_router.get("/review")
def get_review(call: Viewer, part_number: str) -> Response:
    """Return the open questions of a BOM: unreferenced lines, conflicts (both values), and the last merge."""
    with call.read() as tx:
        open_lines = review.review(tx, part_number)
        open_below = summary_of(tx, open_lines.parent).told(open_lines.parent.id)
    name = open_lines.parent.part_number
    body = {
        "part_number": name,
        "version": open_lines.parent.bom_version,
        "unreferenced": [line_to_wire(line, name) for line in open_lines.unreferenced],
        "conflicts": [
            {
                "child_part_number": conflict.line.child_part_number,
                "child_name": conflict.line.child_name,
                "assembly_quantity": plain(conflict.cad_quantity),
                "server_quantity": plain(conflict.line.state.quantity),
                "since": wire_time(conflict.since),
                "override": conflict.line.state.override,
            }
            for conflict in open_lines.conflicts
        ],
        "last_merge": change_to_wire(open_lines.last_merge) if open_lines.last_merge else None,
        "below": dict(open_below),
    }
    return json_answer(body, headers={"ETag": etag_of(open_lines.parent.bom_version)})


@review_router.post(
    "/resolve",
    responses=WRITE_ERRORS,
    openapi_extra=context.refused(
        "a decision that does not fit its line, such as keep for one that is referenced, or a line that the "
        "BOM does not have; all of them are listed and nothing is changed"
    ),
)
def resolve(call: Editor, part_number: str, body: ResolveBody, expected: ExpectedVersion) -> Response:
    """Decide on lines: ``remove``, ``keep`` (as intentional), ``take_cad``, ``keep_silo``."""
    decisions = [review.Decision(d.child_part_number, d.action, d.reason, d.line_id) for d in body.decisions]
    with call.write() as tx:
        change_id, version = review.resolve(tx, part_number, decisions, expected)
        return _changed(change_id, version)


@review_router.get("/history")
def list_history(
    call: Viewer, part_number: str, limit: Annotated[int, Query(ge=1, le=500)] = 50, before: PageFrom = None
) -> list[dict[str, Any]]:
    """Return the changes of a BOM, newest first: who, when, why, from which file."""
    with call.read() as tx:
        changes = history.list_changes(tx, get_item(tx, part_number, include_archived=True), limit, before)
    return [change_to_wire(change) for change in changes]


@review_router.get("/history/{change_id}")
def get_change(call: Viewer, part_number: str, change_id: ChangeId) -> dict[str, Any]:
    """Return one change with its lines before and after."""
    with call.read() as tx:
        item = get_item(tx, part_number, include_archived=True)
        change, lines = history.get_change(tx, item, change_id)
    rows = [
        {
            "line_id": line.line_id,
            "child_part_number": line.child.part_number,
            "child_name": line.child.name,
            "before": state_to_wire(line.before),
            "after": state_to_wire(line.after),
        }
        for line in lines
    ]
    return {**change_to_wire(change), "lines": rows}


@review_router.get("/history/{change_id}/bom")
def get_past_bom(call: Viewer, part_number: str, change_id: ChangeId) -> list[dict[str, Any]]:
    """Return the BOM as this change left it; 0 is the empty BOM before the first change."""
    with call.read() as tx:
        item = get_item(tx, part_number, include_archived=True)
        lines = history.state_at(tx, item, change_id)
    return [
        {
            "id": line.line_id,
            "child_part_number": line.child.part_number,
            "child_name": line.child.name,
            **(state_to_wire(line.state) or {}),
        }
        for line in lines
    ]


Point = Annotated[str, Query(max_length=40), WithJsonSchema(context.POINT)]


@review_router.get("/compare")
def compare(
    call: Viewer,
    part_number: str,
    from_point: Annotated[str, Query(alias="from", max_length=40), WithJsonSchema(context.POINT)] = "0",
    to: Point = "now",
) -> dict[str, Any]:
    """Compare a BOM at two points of time side by side; each is a change id, a time, or ``now``."""
    with call.read() as tx:
        item = get_item(tx, part_number, include_archived=True)
        first, second = find_point(tx, item, from_point), find_point(tx, item, to)
        rows = history.compare(history.state_at(tx, item, first), history.state_at(tx, item, second))
    return {
        "part_number": item.part_number,
        "from": first,
        "to": second,
        "lines": [
            {
                "child_part_number": row.child.part_number,
                "child_name": row.child.name,
                "status": row.status,
                "fields": list(row.fields),
                "before": state_to_wire(row.before),
                "after": state_to_wire(row.after),
            }
            for row in rows
        ],
    }


@review_router.post("/restore", responses=WRITE_ERRORS)
def restore(call: Editor, part_number: str, body: RestoreBody, expected: ExpectedVersion) -> Response:
    """Restore an earlier state of a BOM, as a new change."""
    with call.write() as tx:
        change_id, version = history.restore(
            tx, part_number, body.change_id, body.reason, expected, with_archived=body.with_archived
        )
        return _changed(change_id, version)


@review_router.post("/undo", responses=WRITE_ERRORS)
def undo(call: Editor, part_number: str, body: UndoBody, expected: ExpectedVersion) -> Response:
    """Undo one change, as a new change; 409 if its lines have changed again since."""
    with call.write() as tx:
        change_id, version = history.undo(tx, part_number, body.change_id, expected)
        return _changed(change_id, version)


def find_point(tx: Tx, item: Item, text: str) -> int:
    """Find the id of the change that a point of time means; RejectedError if the text is no such point."""
    if (change_id := whole_number(text, 18)) is not None:
        return change_id
    if text == "now":
        return history.change_at(tx, item, "9999")
    try:
        when = datetime.fromisoformat(text.replace(" ", "+"))
        at = stamp(when) if when.tzinfo is not None else ""
    except (ValueError, OverflowError):
        raise RejectedError(
            f"from, to: wanted a change id, a time such as 2026-02-08T22:15:00Z, or now, got {text!r}"
        ) from None
    if when.tzinfo is None:
        raise RejectedError(f"from, to: wanted a time with its zone (such as …Z), got {text!r}")
    return history.change_at(tx, item, at)


def change_to_wire(change: history.Change) -> dict[str, Any]:
    """Return a change as the API sends it, without its lines."""
    context = {
        "file": change.document_file,
        "sha256": change.document_sha256,
        "revision": change.document_revision,
    }
    return {
        **to_wire(change, "username", "document_file", "document_sha256", "document_revision"),
        "user": change.username,
        "document": context if any(v is not None for v in context.values()) else None,
    }


def state_to_wire(state: LineState | None) -> dict[str, Any] | None:
    """Return a line's state as the API sends it, only with the fields that are set."""
    if state is None:
        return None
    state_json = line_state_to_wire(state)
    return {name: state_json[name] for name in state_to_json(state)}


def _changed(change_id: int, version: int) -> Response:
    return json_answer({"change_id": change_id, "version": version}, headers={"ETag": etag_of(version)})


transfer_router = APIRouter(
    prefix="/api/items/{part_number}/bom", tags=["bom transfer"], responses=READ_ERRORS
)

SPOOL_BYTES = 1024 * 1024
CHUNK = 64 * 1024
CSV = "text/csv; charset=utf-8; header=present"
XLSX = "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet"


def content_of(media_type: str) -> dict[int | str, dict[str, Any]]:
    """Return the documented answers of a route that sends a file."""
    return {200: {"content": {media_type: {}}, "description": "The file"}}


IMPORT_BODY = {
    **context.refused(
        "what is no table with a header row (part number, quantity), and rows that name unknown parts or "
        "unusable values; without dry_run a wrong row refuses the whole file"
    ),
    "requestBody": {
        "required": True,
        "content": {
            "text/csv": {"schema": {"type": "string"}},
            XLSX: {"schema": {"type": "string", "format": "binary"}},
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "required": ["file"],
                    "properties": {"file": {"type": "string", "format": "binary"}},
                }
            },
        },
    },
}


@dataclass(frozen=True)
class ExportRequest:
    """What an export shows: the view, for how many pieces, the page's filter (words, a type); and of which
    released revision."""

    view: View = View.SINGLE
    pieces: Annotated[int, Query(ge=1, le=1_000_000)] = 1
    q: Annotated[str, Query(max_length=200)] = ""
    type: Annotated[str, Query(max_length=20)] = ""
    release: Annotated[str, Query(max_length=16)] = ""


As = Annotated[ExportRequest, Depends()]


@transfer_router.get("/export.csv", response_class=Response, responses=content_of("text/csv"))
def export_csv(call: Viewer, part_number: str, wanted: As, semicolons: bool = False) -> Response:
    """Return the BOM as CSV (RFC 4180, UTF-8); a cell that would run as a formula becomes text.

    ``pieces``: totals for so many pieces; ``q``, ``type``: only the lines that match. ``semicolons``: for an
    Excel that expects 1,5 instead of 1.5.
    """
    write = partial(transfer.to_csv, semicolons=semicolons)
    return _exported(call, part_number, wanted, write, CSV, "csv")


@transfer_router.get("/export.xlsx", response_class=Response, responses=content_of(XLSX))
def export_xlsx(call: Viewer, part_number: str, wanted: As, pictures: bool = False) -> Response:
    """Return the BOM as a workbook. ``pictures``: the first 2000 rows show a picture of their part."""
    shown = call.server.files.path_of if pictures else None
    return _exported(call, part_number, wanted, partial(transfer.to_xlsx, picture=shown), XLSX, "xlsx")


@transfer_router.get("/export.json")
def export_json(call: Viewer, part_number: str, wanted: As) -> Response:
    """Return the BOM as JSON."""
    return _exported(call, part_number, wanted, transfer.to_json, "application/json", "json")


_NOW: context.Schema = {"type": "string", "maxLength": 0}
Moment = Annotated[str, Query(max_length=40), WithJsonSchema({"anyOf": [context.MOMENT, _NOW]})]
Since = Annotated[str, Query(alias="from", min_length=1, max_length=40), WithJsonSchema(context.MOMENT)]


@transfer_router.get("/changes")
def get_changes(call: Viewer, part_number: str, since: Since, to: Moment = "") -> dict[str, Any]:
    """Return the changes in a product over all levels: lines, quantities, data and files of its parts.

    ``from`` and ``to`` are a date, a time, a revision of the item (``r3``), or the label of a revision that
    was frozen for release; without ``to``: now. Two frozen revisions do not show who made a change, or when.
    """
    with call.server.large_reads.enter(), call.read() as tx:
        item = get_item(tx, part_number)
        first, last, happenings = changes_of(tx, item, since, to)
    return {
        "part_number": item.part_number,
        "from": wire_time(first),
        "to": wire_time(last),
        "changes": [change._asdict() | {"at": wire_time(change.at or None)} for change in happenings],
    }


@transfer_router.get("/changes.csv", response_class=Response, responses=content_of("text/csv"))
def changes_csv(call: Viewer, part_number: str, since: Since, to: Moment = "") -> Response:
    """Return the changes in a product as CSV."""
    make = partial(transfer.export_changes, part_number=part_number, since=since, until=to)
    return file_of(call, make, transfer.to_csv, CSV, "changes.csv")


@transfer_router.get("/changes.xlsx", response_class=Response, responses=content_of(XLSX))
def changes_xlsx(call: Viewer, part_number: str, since: Since, to: Moment = "") -> Response:
    """Return the changes in a product as a workbook."""
    make = partial(transfer.export_changes, part_number=part_number, since=since, until=to)
    return file_of(call, make, transfer.to_xlsx, XLSX, "changes.xlsx")


@transfer_router.post("/import", responses=WRITE_ERRORS, openapi_extra=IMPORT_BODY)
async def import_csv(
    call: Editor,
    part_number: str,
    expected: ExpectedVersion,
    dry_run: Annotated[bool, Query()] = False,
    make: Annotated[str, Query(max_length=32)] = "",
    add_up: Annotated[bool, Query()] = False,
) -> Response:
    """Import a CSV or a workbook: XLSX, ODS, XLS (as the body, or as the form part ``file``).

    ``dry_run`` says row by row what would happen. Without it everything is imported or, if a row is wrong,
    nothing (400 with all problems). ``make``: unknown parts are made in this category; ``add_up``: rows of
    one part are added up. A repeat with the same ``Idempotency-Key`` gets the first answer.
    """
    data, name = await uploaded(call.request)
    allowed = imports.Allowed(make, add_up)

    def work() -> Response:
        records = imports.read_csv(imports.as_csv(data), call.server.settings.max_merge_entries)
        if dry_run:
            with call.read() as tx:
                return json_answer(
                    plan_to_wire(imports.plan_import(tx, part_number, records, allowed), dry_run)
                )
        with call.write() as tx:
            parent = locked_parent(tx, part_number)
            digest = hashlib.sha256(data).hexdigest()
            request = KeyedRequest.of(
                f"import {parent.id}",
                idempotency_key(call.request),
                digest,
                name,
                *filter(None, (make, add_up)),
            )
            answer = earlier_answer(tx, request)
            if answer is None:
                plan, _, version = imports.apply_import(tx, part_number, records, name, expected, allowed)
                answer = KeptAnswer(dumps(plan_to_wire(plan, dry_run)), version)
                keep_answer(tx, request, answer)
            return raw_json(answer.text, headers={"ETag": etag_of(answer.version)})

    return await anyio.to_thread.run_sync(work)


def plan_to_wire(plan: imports.ImportPlan, dry_run: bool) -> dict[str, Any]:
    """Return the plan of an import as the API sends it."""
    return {
        "dry_run": dry_run,
        "counts": {status: plan.count(status) for status in ("add", "change", "same", "skip", "error")},
        "problems": plan.problems,
        "rows": [
            {
                "row": row.row,
                "part_number": row.part_number,
                "status": row.status,
                **({"name": row.name} if row.name else {}),
                **({"new": True} if row.new else {}),
                "problems": list(row.problems),
                "before": state_to_wire(row.before),
                "after": state_to_wire(row.after),
            }
            for row in plan.rows
        ],
    }


async def uploaded(request: Request) -> tuple[bytes, str | None]:
    """Read the table of an import (the body, or the form part ``file``), and the name of its file."""
    if not request.headers.get("content-type", "").startswith(FORM_TYPES):
        return await request.body(), None
    async with request.form(max_files=1, max_fields=20) as form:
        file = form.get("file")
        if not isinstance(file, UploadFile):
            raise RejectedError("file: wanted a multipart form with the table in a part named 'file'")
        return await file.read(), clean_name(file.filename or "")


class _Spool(SpooledTemporaryFile[bytes]):
    """A file, on the disk if it is large: an export must not take the memory of a whole file.

    Nor the time of a server that ends, which ``check`` reports.
    """

    check: Callable[[], object]

    def write(self, data: Any) -> int:
        self.check()
        return super().write(data)


def _while(check: Callable[[], object], rows: Iterable[transfer.Row]) -> Iterator[transfer.Row]:
    for row in rows:
        check()
        yield row


def _sent(out: IO[bytes]) -> Iterator[bytes]:
    with out:
        while chunk := out.read(CHUNK):
            yield chunk


def _exported(
    call: Call,
    part_number: str,
    wanted: ExportRequest,
    write: Callable[[transfer.Export, IO[bytes]], Callable[[], None] | None],
    media_type: str,
    suffix: str,
) -> Response:
    view, pieces = wanted.view, wanted.pieces

    def make(tx: Tx) -> transfer.Export:
        return transfer.export(tx, part_number, view, pieces, wanted.q, wanted.type, wanted.release)

    many = f"-{wanted.release}" if wanted.release else ""
    many += f"-for-{pieces}" if pieces > 1 else ""
    return file_of(call, make, write, media_type, f"bom-{view.value}{many}.{suffix}")


def file_of(
    call: Call,
    make: Callable[[Tx], transfer.Export],
    write: Callable[[transfer.Export, IO[bytes]], Callable[[], None] | None],
    media_type: str,
    name: str,
) -> Response:
    """Make a file and send it; its name begins with the part number."""
    turn = call.server.large_reads
    spool = _Spool(max_size=SPOOL_BYTES)
    spool.check = turn.check
    out = cast(IO[bytes], spool)
    try:
        with turn.enter():
            with call.read() as tx:
                made = make(tx)
                pack = write(replace(made, rows=_while(turn.check, made.rows)), out)
            if pack:
                pack()
    except BaseException:
        out.close()
        raise
    stem = "".join(c if c.isascii() and (c.isalnum() or c in "-_.") else "_" for c in made.root.part_number)
    headers = {
        "Content-Disposition": f'attachment; filename="{stem}-{name}"',
        "Content-Length": str(out.seek(0, os.SEEK_END)),
    }
    out.seek(0)
    return StreamingResponse(_sent(out), media_type=media_type, headers=headers)
