# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a request says beside its parameters: its body, the version it expects, its key for repeats."""

from __future__ import annotations

import json
from typing import Annotated, Any

import anyio.to_thread
from fastapi import Depends, Query, Request
from starlette.datastructures import FormData

from silo.bom.errors import RejectedError
from silo.bom.numbers import whole_number
from silo_server.services.field_checks import text_problem

FORM_TYPES = ("application/x-www-form-urlencoded", "multipart/form-data")
# A decision about all lines of the largest BOM has a field for each.
MOST_FIELDS = 25_000


async def form_of(request: Request) -> FormData:
    """Read the form of a request; Starlette keeps it for the next caller."""
    return await request.form(max_files=1, max_fields=MOST_FIELDS)


async def json_body(request: Request) -> Any:
    """Read the request's JSON body; RejectedError if it is no JSON. NaN and Infinity are no JSON."""
    body = await request.body()

    def parse() -> Any:
        try:
            return json.loads(body, parse_constant=_no_constant)
        except (ValueError, RecursionError) as error:
            raise RejectedError(f"body: wanted JSON, got something else ({error})") from None

    return await anyio.to_thread.run_sync(parse)


def _no_constant(name: str) -> Any:
    raise ValueError(f"{name} is not a JSON number")


def expected_version(request: Request) -> int | None:
    """Read the version in ``If-Match``: None without one (or ``*``), -1 if it cannot be one of ours."""
    header = request.headers.get("if-match", "").strip()
    if header in ("", "*"):
        return None
    version = whole_number(header.removeprefix("W/").strip('"').removeprefix("v"), 9)
    return -1 if version is None else version


def idempotency_key(request: Request) -> str | None:
    """Read the ``Idempotency-Key``; a repeat of the request under the same key gets the first answer."""
    key = request.headers.get("idempotency-key")
    if key is not None and (not key or (problem := text_problem(key, 128))):
        raise RejectedError(f"Idempotency-Key: {problem if key else 'wanted 1 to 128 characters, got none'}")
    return key


ExpectedVersion = Annotated[int | None, Depends(expected_version)]
# The id of a row, to page a list from.
PageFrom = Annotated[int | None, Query(ge=0, le=2**62)]
