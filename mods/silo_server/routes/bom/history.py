# SPDX-License-Identifier: LGPL-2.1-or-later
"""The history of a BOM over HTTP: changes, past states, comparing, restoring and undoing."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any

from fastapi import Path, Query
from pydantic import StrictBool, WithJsonSchema
from starlette.responses import Response

from silo.bom.errors import RejectedError
from silo.bom.message import message
from silo.bom.numbers import whole_number
from silo_server.db.transaction import Tx
from silo_server.fields import to_wire
from silo_server.routes import models, openapi
from silo_server.routes.answers import WRITE_ERRORS, etag_of, json_answer
from silo_server.routes.bom import bom_router
from silo_server.routes.call import Editor, Viewer
from silo_server.routes.models import RequestBody, Text
from silo_server.routes.requests import ExpectedVersion, PageFrom
from silo_server.services.bom import differences, history
from silo_server.services.bom.line_state import state_to_json
from silo_server.services.bom.line_wire import line_state_to_wire
from silo_server.services.bom.restore import restore_bom, undo_change
from silo_server.services.items import get_item
from silo_server.times import stamp
from silo_server.values import Item, LineState

router = bom_router("bom review")

ChangeId = Annotated[int, Path(ge=0, le=2**62)]


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


@router.get("/history")
def list_history(
    call: Viewer, part_number: str, limit: Annotated[int, Query(ge=1, le=500)] = 50, before: PageFrom = None
) -> list[dict[str, Any]]:
    """Return the changes of a BOM, newest first: who, when, why, from which file."""
    with call.read() as tx:
        changes = history.list_changes(tx, get_item(tx, part_number, include_archived=True), limit, before)
    return [change_to_wire(change) for change in changes]


@router.get("/history/{change_id}")
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


@router.get("/history/{change_id}/bom")
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


Point = Annotated[str, Query(max_length=40), WithJsonSchema(openapi.POINT)]


@router.get("/compare")
def compare(
    call: Viewer,
    part_number: str,
    from_point: Annotated[str, Query(alias="from", max_length=40), WithJsonSchema(openapi.POINT)] = "0",
    to: Point = "now",
) -> dict[str, Any]:
    """Compare a BOM at two points of time side by side; each is a change id, a time, or ``now``."""
    with call.read() as tx:
        item = get_item(tx, part_number, include_archived=True)
        first, second = find_point(tx, item, from_point), find_point(tx, item, to)
        rows = differences.compare(history.state_at(tx, item, first), history.state_at(tx, item, second))
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
    """Restore an earlier state of a BOM, as a new change."""
    with call.write() as tx:
        change_id, version = restore_bom(
            tx, part_number, body.change_id, body.reason, expected, with_archived=body.with_archived
        )
        return changed_answer(change_id, version)


@router.post("/undo", responses=WRITE_ERRORS)
def undo(call: Editor, part_number: str, body: UndoBody, expected: ExpectedVersion) -> Response:
    """Undo one change, as a new change; 409 if its lines have changed again since."""
    with call.write() as tx:
        change_id, version = undo_change(tx, part_number, body.change_id, expected)
        return changed_answer(change_id, version)


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
            message(
                "from, to: wanted a change id, a time such as 2026-02-08T22:15:00Z, or now, got {got}",
                got=repr(text),
            )
        ) from None
    if when.tzinfo is None:
        raise RejectedError(
            message("from, to: wanted a time with its zone (such as …Z), got {got}", got=repr(text))
        )
    return history.change_at(tx, item, at)


def change_to_wire(change: history.Change) -> dict[str, Any]:
    """Return a change as the API sends it, without its lines."""
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
    """Return a line's state as the API sends it, only with the fields that are set."""
    if state is None:
        return None
    state_json = line_state_to_wire(state)
    return {name: state_json[name] for name in state_to_json(state)}


def changed_answer(change_id: int, version: int) -> Response:
    return json_answer({"change_id": change_id, "version": version}, headers={"ETag": etag_of(version)})
