# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a request says beside its parameters: its body, the version it expects, its key for repeats."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Annotated, Any

import anyio.to_thread
from fastapi import Depends, HTTPException, Query, Request
from fastapi.routing import APIRoute
from starlette.datastructures import FormData
from starlette.responses import Response
from starlette.routing import Match
from starlette.types import Scope

from silo.bom.errors import RejectedError
from silo.bom.items.part_address import part_number_of
from silo.bom.message import message
from silo.bom.numbers import whole_number
from silo.bounded_json import read_json
from silo.budget import MIB, Budget, OverBudgetError
from silo_server.services.field_checks import text_problem

FORM_TYPES = ("application/x-www-form-urlencoded", "multipart/form-data")
# A decision about all lines of the largest BOM has a field for each.
MOST_FIELDS = 25_000
# The largest merge that is taken has 20 000 entries of some twenty values.
BODY = Budget(bytes=64 * MIB, objects=250_000, cells=1_000_000, depth=1000, text=16 * MIB)


async def form_of(request: Request) -> FormData:
    """Read the form of a request; Starlette keeps it for the next caller."""
    return await request.form(max_files=1, max_fields=MOST_FIELDS)


async def json_body(request: Request) -> Any:
    """Read the request's JSON body; RejectedError if it is no JSON. NaN and Infinity are no JSON."""
    body = await request.body()

    def parse() -> Any:
        try:
            return read_json(body, BODY, "body", _no_constant)
        except ValueError as error:
            raise RejectedError(
                message("body: wanted JSON, got something else ({problem})", problem=error)
            ) from None

    return await anyio.to_thread.run_sync(parse)


class _BoundedRequest(Request):
    """A request whose JSON is parsed within a budget, and beside the loop that answers all others."""

    async def json(self) -> Any:
        body = await self.body()
        try:
            return await anyio.to_thread.run_sync(read_json, body, BODY, "body")
        except OverBudgetError as error:
            raise HTTPException(error.status_hint, str(error)) from None


class NumberedRoute(APIRoute):
    """A route whose part numbers stand in the address as :func:`part_segment` writes them."""

    def matches(self, scope: Scope) -> tuple[Match, Scope]:
        """Match a path, and read its parameters."""
        match, found = super().matches(scope)
        given: dict[str, str] = found.get("path_params", {})
        return match, {**found, "path_params": {name: part_number_of(text) for name, text in given.items()}}


class BoundedRoute(NumberedRoute):
    """A route of the API that reads the JSON of its requests within a budget."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Return the handler, which gets the bounded request."""
        handler = super().get_route_handler()

        async def bounded(request: Request) -> Response:
            return await handler(_BoundedRequest(request.scope, request.receive))

        return bounded


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
