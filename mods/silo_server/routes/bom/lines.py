# SPDX-License-Identifier: LGPL-2.1-or-later
"""The lines of a BOM over HTTP: read for one item or many, and changed by hand."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fastapi import APIRouter
from starlette.responses import Response

from silo.bom.quantities import plain
from silo_server.db.transaction import Tx
from silo_server.routes.answers import READ_ERRORS, WRITE_ERRORS, etag_of, json_answer
from silo_server.routes.bom import bom_router
from silo_server.routes.call import Call, Editor, Viewer
from silo_server.routes.models import (
    BomsOut,
    LineChangeBody,
    LineOut,
    NewLineBody,
    NumbersBody,
)
from silo_server.routes.requests import BoundedRoute, ExpectedVersion
from silo_server.services.bom import line_edit
from silo_server.services.bom.conflicts import last_cad_quantities
from silo_server.services.bom.last_sync import NEVER, last_syncs
from silo_server.services.bom.line_edit import Edited
from silo_server.services.bom.line_wire import line_to_wire
from silo_server.services.bom.lines import LineId, check_line_count, lines_of_many
from silo_server.services.items import get_by_numbers, get_item
from silo_server.values import Item, LineState

router = bom_router("bom")

several = APIRouter(route_class=BoundedRoute, prefix="/api", tags=["bom"], responses=READ_ERRORS)


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
    lines, quantities, last = lines_of_many(tx, ids), last_cad_quantities(tx, ids), last_syncs(tx, ids)
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
        edited = line_edit.add_line(tx, part_number, body.child_part_number, state, expected)
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


def line_changes(body: LineChangeBody) -> dict[str, Any]:
    """Return the changes that a body asks for: only the fields that it names; null clears a field."""
    changes = body.model_dump(exclude_unset=True)
    if "reference_designators" in changes:
        changes["reference_designators"] = tuple(changes["reference_designators"] or ())
    if "metadata" in changes:
        changes["metadata"] = changes["metadata"] or {}
    return changes


def _change(
    call: Call, part_number: str, which: str | LineId, body: LineChangeBody, expected: int | None
) -> Response:
    with call.write() as tx:
        return _edited(line_edit.change_line(tx, part_number, which, line_changes(body), expected), 200)


def _remove(call: Call, part_number: str, which: str | LineId, expected: int | None) -> Response:
    with call.write() as tx:
        edited = line_edit.remove_line(tx, part_number, which, expected)
    return Response(status_code=204, headers={"ETag": etag_of(edited.version)})


def _edited(edited: Edited, status: int) -> Response:
    assert edited.line is not None  # add and change leave a line behind
    return json_answer(
        line_to_wire(edited.line, edited.parent.part_number), status, {"ETag": etag_of(edited.version)}
    )
