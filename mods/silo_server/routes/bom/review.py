# SPDX-License-Identifier: LGPL-2.1-or-later
"""The open questions of a BOM over HTTP, and the decisions about them."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field
from starlette.responses import Response

from silo.bom.quantities import plain
from silo_server.routes import openapi
from silo_server.routes.answers import WRITE_ERRORS, etag_of, json_answer
from silo_server.routes.bom import bom_router
from silo_server.routes.bom.history import change_to_wire, changed_answer
from silo_server.routes.call import Editor, Viewer
from silo_server.routes.models import RequestBody, Short, Text
from silo_server.routes.requests import ExpectedVersion
from silo_server.services.bom import decisions, review
from silo_server.services.bom.decisions import Decision, ReviewAction
from silo_server.services.bom.line_wire import line_to_wire
from silo_server.services.product.summary_read import summary_of
from silo_server.times import wire_time

router = bom_router("bom review")


class DecisionBody(RequestBody):
    """One decision; ``reason`` says why a line is kept.

    The line is named by ``line_id``, or by its child: then the component is meant.
    """

    child_part_number: Short = ""
    line_id: Short | None = None
    action: ReviewAction
    reason: Text | None = None


class ResolveBody(RequestBody):
    """``POST …/bom/resolve``: all of them as one change."""

    decisions: Annotated[list[DecisionBody], Field(min_length=1, max_length=20_000)]


@router.get("/review")
def get_review(call: Viewer, part_number: str) -> Response:
    """Return the open questions of a BOM: unreferenced lines, conflicts, units, and the last merge.

    ``units`` are the lines in a unit of another kind than their part's, which count in no sum.
    """
    with call.read() as tx:
        bom_review = review.review(tx, part_number)
        open_below = summary_of(tx, bom_review.parent).open_boms(bom_review.parent.id)
    name = bom_review.parent.part_number
    body = {
        "part_number": name,
        "version": bom_review.parent.bom_version,
        "unreferenced": [line_to_wire(line, name) for line in bom_review.unreferenced],
        "conflicts": [
            {
                "child_part_number": conflict.line.child_part_number,
                "child_name": conflict.line.child_name,
                "assembly_quantity": plain(conflict.cad_quantity),
                "server_quantity": plain(conflict.line.state.quantity),
                "since": wire_time(conflict.since),
                "override": conflict.line.state.override,
            }
            for conflict in bom_review.conflicts
        ],
        "units": [line_to_wire(line, name) for line in bom_review.units],
        "last_merge": change_to_wire(bom_review.last_merge) if bom_review.last_merge else None,
        "below": dict(open_below),
    }
    return json_answer(body, headers={"ETag": etag_of(bom_review.parent.bom_version)})


@router.post(
    "/resolve",
    responses=WRITE_ERRORS,
    openapi_extra=openapi.refused(
        "a decision that does not fit its line, such as keep for one that is referenced, or a line that the "
        "BOM does not have; all of them are listed and nothing is changed"
    ),
)
def resolve(call: Editor, part_number: str, body: ResolveBody, expected: ExpectedVersion) -> Response:
    """Decide on lines: ``remove``, ``keep`` (as intentional), ``take_cad``, ``keep_silo``."""
    asked = [Decision(d.child_part_number, d.action, d.reason, d.line_id) for d in body.decisions]
    with call.write() as tx:
        change_id, version = decisions.resolve(tx, part_number, asked, expected)
        return changed_answer(change_id, version)
