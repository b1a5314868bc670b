# SPDX-License-Identifier: LGPL-2.1-or-later
"""The changes in a product over all levels between two times, as JSON and as tables."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

from fastapi import Query
from pydantic import WithJsonSchema
from starlette.responses import Response

from silo_server.routes import openapi
from silo_server.routes.bom import bom_router
from silo_server.routes.call import Viewer
from silo_server.routes.made_files import CSV, XLSX, content_of, file_of
from silo_server.services.items import get_item
from silo_server.services.product.export import export_changes
from silo_server.services.product.export_files import to_csv, to_xlsx
from silo_server.services.product.frozen import changes_of
from silo_server.times import wire_time

router = bom_router("bom transfer")

_NOW: openapi.Schema = {"type": "string", "maxLength": 0}
Moment = Annotated[str, Query(max_length=40), WithJsonSchema({"anyOf": [openapi.MOMENT, _NOW]})]
Since = Annotated[str, Query(alias="from", min_length=1, max_length=40), WithJsonSchema(openapi.MOMENT)]


@router.get("/changes")
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


@router.get("/changes.csv", response_class=Response, responses=content_of("text/csv"))
def changes_csv(call: Viewer, part_number: str, since: Since, to: Moment = "") -> Response:
    """Return the changes in a product as CSV."""
    make = partial(export_changes, part_number=part_number, since=since, until=to)
    return file_of(call, make, to_csv, CSV, "changes.csv")


@router.get("/changes.xlsx", response_class=Response, responses=content_of(XLSX))
def changes_xlsx(call: Viewer, part_number: str, since: Since, to: Moment = "") -> Response:
    """Return the changes in a product as a workbook."""
    make = partial(export_changes, part_number=part_number, since=since, until=to)
    return file_of(call, make, to_xlsx, XLSX, "changes.xlsx")
