# SPDX-License-Identifier: LGPL-2.1-or-later
"""How an answer is written: JSON, its ETag, and the errors that the API's document names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pydantic_core
from starlette.responses import Response

from silo.api.wire import ErrorBody

_SHAPE = {"model": ErrorBody}

READ_ERRORS: dict[int | str, dict[str, Any]] = {
    400: {**_SHAPE, "description": "The request is unusable; all problems are listed"},
    401: {**_SHAPE, "description": "No token, or one that is not known"},
    403: {**_SHAPE, "description": "The role is too low"},
    404: {**_SHAPE, "description": "There is no such item, line, revision or route"},
    409: {**_SHAPE, "description": "Two truths met: a cycle, a duplicate, a change in between"},
    503: {**_SHAPE, "description": "Read-only, or the database is not there; try again later"},
}

WRITE_ERRORS: dict[int | str, dict[str, Any]] = {
    **READ_ERRORS,
    412: {**_SHAPE, "description": "The BOM has another version than If-Match says"},
    413: {**_SHAPE, "description": "More than the server takes in one request"},
}


def json_answer(value: Any, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """Answer with ``value`` as JSON, written by pydantic's fast writer.

    It writes all that :mod:`silo_server.user_json` lets in. Call it before the commit: an answer that
    cannot be written must not leave anything behind.
    """
    return raw_json(pydantic_core.to_json(value), status, headers)


def raw_json(text: str | bytes, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """Answer with JSON that is already written."""
    return Response(text, status, headers, media_type="application/json")


def etag_of(version: int) -> str:
    """Return the ETag of a version: of a BOM, an item or a list of suppliers."""
    return f'"v{version}"'
