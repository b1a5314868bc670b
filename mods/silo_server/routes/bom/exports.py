# SPDX-License-Identifier: LGPL-2.1-or-later
"""Exports of a BOM: CSV, XLSX and JSON."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import IO, Annotated

from fastapi import Depends, Query
from starlette.responses import Response

from silo_server.db.transaction import Tx
from silo_server.routes.bom import bom_router
from silo_server.routes.call import Call, Viewer
from silo_server.routes.known_parameters import refuse_unknown
from silo_server.routes.made_files import CSV, XLSX, content_of, file_of
from silo_server.services.product.export import Export, View, export
from silo_server.services.product.export_files import to_csv, to_json, to_xlsx

router = bom_router("bom transfer")
router.dependencies.append(Depends(refuse_unknown()))


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


@router.get("/export.csv", response_class=Response, responses=content_of("text/csv"))
def export_csv(call: Viewer, part_number: str, wanted: As, semicolons: bool = False) -> Response:
    """Return the BOM as CSV (RFC 4180, UTF-8); a cell that would run as a formula becomes text.

    ``pieces``: totals for so many pieces; ``q``, ``type``: only the lines that match. ``semicolons``: for an
    Excel that expects 1,5 instead of 1.5.
    """
    write = partial(to_csv, semicolons=semicolons)
    return _exported(call, part_number, wanted, write, CSV, "csv")


@router.get("/export.xlsx", response_class=Response, responses=content_of(XLSX))
def export_xlsx(call: Viewer, part_number: str, wanted: As, pictures: bool = False) -> Response:
    """Return the BOM as a workbook. ``pictures``: the first 2000 rows show a picture of their part."""
    shown = call.server.files.path_of if pictures else None
    return _exported(call, part_number, wanted, partial(to_xlsx, picture=shown), XLSX, "xlsx")


@router.get("/export.json")
def export_json(call: Viewer, part_number: str, wanted: As) -> Response:
    """Return the BOM as JSON."""
    return _exported(call, part_number, wanted, to_json, "application/json", "json")


def _exported(
    call: Call,
    part_number: str,
    wanted: ExportRequest,
    write: Callable[[Export, IO[bytes]], Callable[[], None] | None],
    media_type: str,
    suffix: str,
) -> Response:
    view, pieces = wanted.view, wanted.pieces

    def make(tx: Tx) -> Export:
        return export(tx, part_number, view, pieces, wanted.q, wanted.type, wanted.release)

    many = f"-{wanted.release}" if wanted.release else ""
    many += f"-for-{pieces}" if pieces > 1 else ""
    return file_of(call, make, write, media_type, f"bom-{view.value}{many}.{suffix}")
