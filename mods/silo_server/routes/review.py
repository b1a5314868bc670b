# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a person decides on a BOM, and its history."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any

from fastapi import APIRouter, Path, Query
from pydantic import Field, WithJsonSchema
from starlette.responses import Response

from silo.bom.errors import RejectedError
from silo.bom.numbers import plain, whole_number
from silo_server.clock import stamp, wire
from silo_server.db.engine import Tx
from silo_server.routes import document, models
from silo_server.routes.context import (
    READ_ERRORS,
    WRITE_ERRORS,
    Editor,
    ExpectedVersion,
    PageFrom,
    Viewer,
    etag_of,
    json_answer,
)
from silo_server.routes.models import Body, Short, Text
from silo_server.services.bom import history
from silo_server.services.bom import review as service
from silo_server.services.bom.lines import line_state_to_wire, line_to_wire, state_to_json
from silo_server.services.items import get_item
from silo_server.values import Item, LineState, to_wire

router = APIRouter(prefix="/api/items/{part_number}/bom", tags=["bom review"])

ChangeId = Annotated[int, Path(ge=0, le=2**62)]


class DecisionBody(Body):
    """One decision; ``reason`` says why a line is kept.

    The line is named by ``line_id``, or by its child: then the component is meant.
    """

    child_part_number: Short = ""
    line_id: Short | None = None
    action: service.Action
    reason: Text | None = None


class ResolveBody(Body):
    """``POST …/bom/resolve``: all of them as one change."""

    decisions: Annotated[list[DecisionBody], Field(min_length=1, max_length=20_000)]


class RestoreBody(Body):
    """``POST …/bom/restore``: the change whose state comes back (0 = the empty BOM)."""

    change_id: models.ChangeIdOrNone
    reason: Text | None = None


class UndoBody(Body):
    """``POST …/bom/undo``."""

    change_id: models.ChangeId


@router.get("/review", responses=READ_ERRORS)
def get_review(call: Viewer, part_number: str) -> Response:
    """What is open: unreferenced lines, conflicts with both values, and the last merge."""
    with call.read() as tx:
        found = service.review(tx, part_number)
    name = found.parent.part_number
    body = {
        "part_number": name,
        "version": found.parent.bom_version,
        "unreferenced": [line_to_wire(line, name) for line in found.unreferenced],
        "conflicts": [
            {
                "child_part_number": conflict.line.child_part_number,
                "child_name": conflict.line.child_name,
                "assembly_quantity": plain(conflict.cad_quantity),
                "server_quantity": plain(conflict.line.state.quantity),
                "since": wire(conflict.since),
                "override": conflict.line.state.override,
            }
            for conflict in found.conflicts
        ],
        "last_merge": change_to_wire(found.last_merge) if found.last_merge else None,
    }
    return json_answer(body, headers={"ETag": etag_of(found.parent.bom_version)})


@router.post(
    "/resolve",
    responses=WRITE_ERRORS,
    openapi_extra=document.refused(
        "a decision that does not fit its line, such as keep for one that is referenced, or a line that the "
        "BOM does not have; all of them are listed and nothing is changed"
    ),
)
def resolve(call: Editor, part_number: str, body: ResolveBody, expected: ExpectedVersion) -> Response:
    """Decide on lines: ``remove``, ``keep`` (as intentional), ``take_cad``, ``keep_silo``."""
    decisions = [service.Decision(d.child_part_number, d.action, d.reason, d.line_id) for d in body.decisions]
    with call.write() as tx:
        change_id, version = service.resolve(tx, part_number, decisions, expected)
        return _changed(change_id, version)


@router.get("/history", responses=READ_ERRORS)
def list_history(
    call: Viewer, part_number: str, limit: Annotated[int, Query(ge=1, le=500)] = 50, before: PageFrom = None
) -> list[dict[str, Any]]:
    """The changes, newest first: who, when, why, from which file."""
    with call.read() as tx:
        found = history.list_changes(tx, get_item(tx, part_number, include_archived=True), limit, before)
    return [change_to_wire(change) for change in found]


@router.get("/history/{change_id}", responses=READ_ERRORS)
def get_change(call: Viewer, part_number: str, change_id: ChangeId) -> dict[str, Any]:
    """One change with its lines before and after."""
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


@router.get("/history/{change_id}/bom", responses=READ_ERRORS)
def get_past_bom(call: Viewer, part_number: str, change_id: ChangeId) -> list[dict[str, Any]]:
    """The BOM as this change left it (0 = before everything)."""
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


Point = Annotated[str, Query(max_length=40), WithJsonSchema(document.POINT)]


@router.get("/compare", responses=READ_ERRORS)
def compare(
    call: Viewer,
    part_number: str,
    from_point: Annotated[str, Query(alias="from", max_length=40), WithJsonSchema(document.POINT)] = "0",
    to: Point = "now",
) -> dict[str, Any]:
    """Two points of time side by side; each a change id, a time, or ``now``."""
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


@router.post("/restore", responses=WRITE_ERRORS)
def restore(call: Editor, part_number: str, body: RestoreBody, expected: ExpectedVersion) -> Response:
    """Bring an earlier state back, as a new change."""
    with call.write() as tx:
        change_id, version = history.restore(tx, part_number, body.change_id, body.reason, expected)
        return _changed(change_id, version)


@router.post("/undo", responses=WRITE_ERRORS)
def undo(call: Editor, part_number: str, body: UndoBody, expected: ExpectedVersion) -> Response:
    """Take one change back, as a new change; 409 where its lines changed again since."""
    with call.write() as tx:
        change_id, version = history.undo(tx, part_number, body.change_id, expected)
        return _changed(change_id, version)


def find_point(tx: Tx, item: Item, text: str) -> int:
    """The change that a point of time means; RejectedError where it is none."""
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
    """A change, without its lines."""
    document = {
        "file": change.document_file,
        "sha256": change.document_sha256,
        "revision": change.document_revision,
    }
    return {
        **to_wire(change, "username", "document_file", "document_sha256", "document_revision"),
        "user": change.username,
        "document": document if any(v is not None for v in document.values()) else None,
    }


def state_to_wire(state: LineState | None) -> dict[str, Any] | None:
    """A line's state; only what is set."""
    if state is None:
        return None
    told = line_state_to_wire(state)
    return {name: told[name] for name in state_to_json(state)}


def _changed(change_id: int, version: int) -> Response:
    return json_answer({"change_id": change_id, "version": version}, headers={"ETag": etag_of(version)})
