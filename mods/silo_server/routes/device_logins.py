# SPDX-License-Identifier: LGPL-2.1-or-later
"""Logins of programs over RFC 8628: a program asks for a code, and for its token until a user let it in.

Both requests are forms and have no credential; errors of the second have the words of the RFC.
"""

from __future__ import annotations

from typing import Annotated, Any

import anyio.to_thread
from fastapi import APIRouter, Depends, Request
from starlette.datastructures import FormData
from starlette.responses import Response

from silo.api.wire import ErrorBody
from silo_server.routes.answers import json_answer
from silo_server.routes.call import ServerDep, client_address
from silo_server.routes.requests import FORM_TYPES, BoundedRoute, form_of
from silo_server.services.access import device_logins
from silo_server.services.access.device_logins import INTERVAL_SECONDS, WAITS_SECONDS, Answer

router = APIRouter(route_class=BoundedRoute, prefix="/api/auth/device", tags=["auth"])

GRANT = "urn:ietf:params:oauth:grant-type:device_code"
PAGE = "/login/device"
NO_STORE = {"Cache-Control": "no-store"}

Form = Annotated[FormData, Depends(form_of)]


def _form_body(required: list[str], *optional: str) -> dict[str, Any]:
    fields = {name: {"type": "string"} for name in (*required, *optional)}
    schema = {"type": "object", "properties": fields, "required": required}
    return {"requestBody": {"required": True, "content": {FORM_TYPES[0]: {"schema": schema}}}}


@router.post(
    "",
    responses={400: {"model": ErrorBody}, 503: {"model": ErrorBody}},
    openapi_extra=_form_body(["client_id"], "machine"),
)
async def begin(server: ServerDep, request: Request, form: Form) -> Response:
    """Begin the login of a program.

    ``client_id`` is the name of the program and ``machine`` that of its computer: the page shows both as the
    program's own words. The program shows ``user_code``, and keeps ``device_code`` for itself.
    """
    program, machine = _text(form, "client_id"), _text(form, "machine")
    codes = await anyio.to_thread.run_sync(
        device_logins.begin, server.db, program, machine, client_address(request)
    )
    page = f"{(server.settings.public_url or str(request.base_url)).rstrip('/')}{PAGE}"
    answer = {
        "device_code": codes.device_code,
        "user_code": codes.user_code,
        "verification_uri": page,
        "verification_uri_complete": f"{page}?code={codes.user_code}",
        "expires_in": WAITS_SECONDS,
        "interval": INTERVAL_SECONDS,
    }
    return json_answer(answer, headers=NO_STORE)


@router.post(
    "/token",
    responses={400: {"description": "No token yet, or none at all: ``error`` says why, as the RFC has it"}},
    openapi_extra=_form_body(["grant_type", "device_code"], "client_id"),
)
async def token(server: ServerDep, request: Request, form: Form) -> Response:
    """Return the token of a program that a user let in, once."""
    if _text(form, "grant_type") != GRANT:
        return _no_token("unsupported_grant_type")
    code = _text(form, "device_code")
    if not code:
        return _no_token("invalid_request")
    fetched = await anyio.to_thread.run_sync(device_logins.fetch, server.db, code, client_address(request))
    if isinstance(fetched, Answer):
        return _no_token(fetched)
    answer = {"access_token": fetched, "token_type": "Bearer", "scope": "write"}
    return json_answer(answer, headers=NO_STORE)


def _no_token(error: str) -> Response:
    return json_answer({"error": error}, 400, NO_STORE)


def _text(form: FormData, name: str) -> str:
    value = form.get(name, "")
    return value if isinstance(value, str) else ""
