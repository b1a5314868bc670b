# SPDX-License-Identifier: LGPL-2.1-or-later
"""The merge of an assembly into its BOM over HTTP."""

from __future__ import annotations

import anyio.to_thread
from starlette.responses import Response

from silo.api.wire import MergeResult
from silo.bom.errors import CycleError, RejectedError
from silo_server.routes import openapi
from silo_server.routes.answers import WRITE_ERRORS, etag_of, raw_json
from silo_server.routes.bom import bom_router
from silo_server.routes.call import Call, Editor
from silo_server.routes.requests import ExpectedVersion, json_body
from silo_server.services.bom.last_sync import record_refusal
from silo_server.services.bom.merge import MergeOutcome, merge_bom, preview_merge
from silo_server.services.bom.merge_request import MergeRequestIn, read_merge_request
from silo_server.services.items import get_item

router = bom_router("bom")

MERGE_BODY = {
    **openapi.refused(
        "an entry whose part number no item has, an assembly as its own child, and entries of one child that "
        "add up to more than 1e9; all of them are listed and nothing is changed"
    ),
    "requestBody": {
        "required": True,
        "content": {"application/json": {"schema": {"$ref": "#/components/schemas/MergeRequest"}}},
    },
}


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
