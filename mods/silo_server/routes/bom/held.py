# SPDX-License-Identifier: LGPL-2.1-or-later
"""A BOM that a client holds back, over HTTP."""

from __future__ import annotations

import anyio.to_thread
from starlette.responses import Response

from silo.api.wire import HeldBom
from silo_server.routes.answers import WRITE_ERRORS, json_answer
from silo_server.routes.bom import bom_router
from silo_server.routes.call import Editor
from silo_server.routes.requests import json_body
from silo_server.services.bom.held import record_held
from silo_server.services.bom.merge_request import read_held_report
from silo_server.services.items import get_item

router = bom_router("bom")

HELD_BODY = {
    "requestBody": {
        "required": True,
        "content": {"application/json": {"schema": {"$ref": "#/components/schemas/HeldReport"}}},
    }
}


@router.post("/held", response_model=HeldBom, responses=WRITE_ERRORS, openapi_extra=HELD_BODY)
async def hold(call: Editor, part_number: str) -> Response:
    """Report that the BOM of an assembly waits on the caller's computer, and what for.

    It changes no line. A repeat replaces the report; the next merge of the assembly takes it back.
    """
    body = await json_body(call.request)

    def work() -> Response:
        left_out, file, folder = read_held_report(body, call.server.settings.max_merge_entries)
        with call.write() as tx:
            item = get_item(tx, part_number, lock=True)
            return json_answer(record_held(tx, item, left_out, file, folder).to_wire())

    return await anyio.to_thread.run_sync(work)
