# SPDX-License-Identifier: LGPL-2.1-or-later
"""What every route gets: the server's parts, who is calling, and how an answer is written.

The values in the OpenAPI document: it calls valid what the server takes, and nothing else.

Some requests are refused although their form is right: a CSV without a header row, a merge that names an
unknown part number. Such an operation says why under ``x-valid-but-refused``, and so does its 400.
"""

from __future__ import annotations

import json
import secrets
from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Annotated, Any

import anyio.to_thread
import pydantic_core
from fastapi import Depends, Query, Request
from starlette.datastructures import FormData
from starlette.responses import Response

from silo.api.wire import RELEASE_LABEL, ErrorBody, MergeRequest
from silo.bom.errors import AuthError, ForbiddenError, RejectedError
from silo.bom.numbers import whole_number
from silo.bom.quantities import LARGEST_QUANTITY
from silo.bom.text import REFUSED_CHARACTERS
from silo_server.actors import Actor, Role
from silo_server.db.database import Database
from silo_server.db.transaction import Tx
from silo_server.db.turnstile import Turnstile
from silo_server.events.hub import Hub
from silo_server.housekeeping import Probe
from silo_server.http import info_of
from silo_server.schema import ITEM_TYPES, find_schema
from silo_server.services.access import (
    MAX_PASSWORD,
    MIN_PASSWORD,
    USERNAME_FORM,
    actor_by_session,
    actor_by_token,
)
from silo_server.services.field_checks import text_problem
from silo_server.services.items import NUMBER_FORM, RESERVED
from silo_server.services.revisions import FileStore
from silo_server.settings import Settings
from silo_server.user_json import MAX_KEY, MAX_NUMBER

SESSION_COOKIE = "silo_session"
SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
FORM_TYPES = ("application/x-www-form-urlencoded", "multipart/form-data")
# A decision about all lines of the largest BOM has a field for each.
MOST_FIELDS = 25_000

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


@dataclass(frozen=True)
class Server:
    """The parts of a running server; one per process, in ``app.state.server``."""

    settings: Settings
    db: Database
    hub: Hub
    files: FileStore
    probe: Probe
    # Reads that may take seconds and much memory: one at a time, so that all others continue.
    large_reads: Turnstile = field(default_factory=lambda: Turnstile(1, 16, 60, "exports and large reads"))


def server_of(request: Request) -> Server:
    """Return the server that received this request."""
    server: Server = request.app.state.server
    return server


ServerDep = Annotated[Server, Depends(server_of)]


class FormSecretError(ForbiddenError):
    """The secret of a form is not that of the session: another site's form, or one of an earlier session."""


@dataclass(frozen=True, slots=True)
class Call:
    """A request that was let in: from whom, and to which server."""

    request: Request
    server: Server
    actor: Actor

    def read(self) -> AbstractContextManager[Tx]:
        """Open a read transaction for this caller: one consistent snapshot of the database."""
        return self.server.db.read(self.actor)

    def write(self, *, even_when_read_only: bool = False) -> AbstractContextManager[Tx]:
        """Open a write transaction in the name of this caller."""
        return self.server.db.write(self.actor, even_when_read_only=even_when_read_only)


class Guard:
    """A dependency that lets a caller of at least ``role`` in: Bearer token first, then session cookie."""

    def __init__(self, role: Role) -> None:
        self.role = role

    async def __call__(self, request: Request) -> Call:
        actor = await anyio.to_thread.run_sync(find_actor, request)
        info_of(request.scope).user = actor.username if actor else None
        if actor is None:
            raise AuthError("a valid token is needed: send it as 'Authorization: Bearer silo_…'")
        if not actor.role.covers(self.role):
            raise ForbiddenError(
                f"{actor.username} is {actor.role}, this needs {self.role}; an admin can change that"
            )
        if actor.auth_source == "session" and request.method not in SAFE_METHODS:
            await _check_csrf(request, actor)
        return Call(request, server_of(request), actor)


Viewer = Annotated[Call, Depends(Guard(Role.VIEWER))]
Editor = Annotated[Call, Depends(Guard(Role.EDITOR))]
Admin = Annotated[Call, Depends(Guard(Role.ADMIN))]


def find_actor(request: Request) -> Actor | None:
    """Find who sends the request; None if unknown. A wrong token is refused even with a good cookie."""
    server, address = server_of(request), client_address(request)
    header = request.headers.get("authorization")
    if header is not None:
        scheme, _, secret = header.partition(" ")
        if scheme.lower() != "bearer" or not secret.strip():
            return None
        return actor_by_token(server.db, secret.strip(), address)
    cookie = request.cookies.get(SESSION_COOKIE)
    return actor_by_session(server.db, cookie, address) if cookie else None


def client_address(request: Request) -> str:
    """Return the caller's network address: that of the connection, or what a trusted proxy says."""
    return request.client.host if request.client else ""


async def _check_csrf(request: Request, actor: Actor) -> None:
    sent: object = request.headers.get("x-csrf-token")
    if sent is None and request.headers.get("content-type", "").startswith(FORM_TYPES):
        sent = (await form_of(request)).get("csrf_token")
    wanted = actor.csrf_token or ""
    if not isinstance(sent, str) or not secrets.compare_digest(unmasked(sent), wanted.encode()):
        raise FormSecretError("the form's secret is missing or old; load the page again and repeat")


async def form_of(request: Request) -> FormData:
    """Read the form of a request; Starlette keeps it for the next caller."""
    return await request.form(max_files=1, max_fields=MOST_FIELDS)


def masked(secret: str) -> str:
    """Mask a secret for a page: the text is different each time.

    So the size of a compressed page that also shows an attacker's text reveals nothing about the secret (the
    BREACH attack).
    """
    raw = secret.encode()
    mask = secrets.token_bytes(len(raw))
    return _MASKED + (mask + bytes(a ^ b for a, b in zip(mask, raw, strict=True))).hex()


def unmasked(sent: str) -> bytes:
    """Return the secret behind a text of :func:`masked`; any other text comes back as it is."""
    if not sent.startswith(_MASKED):
        return sent.encode()
    try:
        both = bytes.fromhex(sent.removeprefix(_MASKED))
    except ValueError:
        return b""
    half = len(both) // 2
    return bytes(a ^ b for a, b in zip(both[:half], both[half:], strict=False))


_MASKED = "m."


def json_answer(value: Any, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """Answer with ``value`` as JSON, written by pydantic's fast writer.

    It writes all that :mod:`silo_server.user_json` lets in. Call it before the commit: an answer that
    cannot be written must not leave anything behind.
    """
    return raw_json(pydantic_core.to_json(value), status, headers)


def raw_json(text: str | bytes, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """Answer with JSON that is already written."""
    return Response(text, status, headers, media_type="application/json")


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


def etag_of(version: int) -> str:
    """Return the ETag of a version: of a BOM, an item or a list of suppliers."""
    return f'"v{version}"'


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


Schema = dict[str, Any]
ALLOWED = f"^[^{REFUSED_CHARACTERS}]*$"
_BLANK = rf"[^\S{REFUSED_CHARACTERS}]"
NOTHING: Schema = {"type": "null"}
REFUSED = "x-valid-but-refused"


def text(longest: int, **more: Any) -> Schema:
    """Make the schema of a text of allowed characters."""
    return {"type": "string", "maxLength": longest, "pattern": ALLOWED, **more}


def or_null(schema: Schema) -> Schema:
    """Make a schema that also allows null."""
    return {"anyOf": [schema, NOTHING]}


def part_number(*, or_empty: bool = False) -> Schema:
    """Make the schema of a new part number; ``or_empty``: an empty text means that there is none."""
    optional = "?" if or_empty else ""
    return {
        "type": "string",
        "maxLength": 200,
        "pattern": f"^({_BLANK}*{NUMBER_FORM.pattern}{_BLANK}*){optional}$",
        "not": {"pattern": f"^\\s*(\\.|\\.\\.|{'|'.join(map(_in_any_case, sorted(RESERVED)))})\\s*$"},
        "description": "1 to 64 characters, none of / \\ ? # % and no control characters; unique in any case",
    }


def _in_any_case(word: str) -> str:
    """Make a pattern that matches ``word`` in upper and lower case; ſ counts as an s."""
    same = {"s": "sSſ", "k": "kK\u212a"}
    return "".join(
        f"[{same.get(c, c + c.upper())}]" if c.isalpha() else "\\" + c if c == "." else c for c in word
    )


def refused(reason: str) -> Schema:
    """Return ``openapi_extra`` that says why an operation refuses (400) requests of the right form."""
    return {REFUSED: reason}


CATEGORIES = list(find_schema(None).categories)
CATEGORY: Schema = {
    "type": "string",
    "enum": CATEGORIES,
    "description": "a category of the part-number schema; lower case is taken as well",
}
CATEGORY_OR_EMPTY: Schema = {**CATEGORY, "enum": [*CATEGORIES, ""]}
ITEM_TYPE: Schema = {"type": "string", "enum": list(ITEM_TYPES)}
UUID: Schema = {"type": "string", "format": "uuid"}
USERNAME: Schema = {"type": "string", "pattern": f"^{USERNAME_FORM.pattern}$"}
PASSWORD: Schema = text(MAX_PASSWORD, minLength=MIN_PASSWORD)
SHA256: Schema = {"type": "string", "pattern": "^[0-9A-Fa-f]{64}$"}
# An item gets its number from one or the other.
NUMBER_OR_CATEGORY: Schema = {
    "anyOf": [
        {"required": ["category"], "properties": {"category": {"enum": CATEGORIES}}},
        {"required": ["part_number"], "properties": {"part_number": {"type": "string", "minLength": 1}}},
    ]
}

_TIME = "T([01][0-9]|2[0-3]):[0-5][0-9]:[0-5][0-9](\\.[0-9]{1,6})?(Z|[+-](0[0-9]|1[0-4]):[0-5][0-9])"
_DATE = "[1-9][0-9]{3}-[0-9]{2}-[0-9]{2}"
_AT: Schema = {
    "type": "string",
    "maxLength": 40,
    "format": "date-time",
    "pattern": f"^{_DATE}{_TIME}$",
    "description": "a time with its zone (ISO 8601)",
}
POINT: Schema = {
    "anyOf": [
        {"type": "string", "enum": ["now"]},
        {
            "type": "string",
            "pattern": "^[0-9]{1,18}$",
            "description": "the id of a change, 0 = no lines",
        },
        _AT,
    ]
}
MOMENT: Schema = {
    "anyOf": [
        _AT,
        {"type": "string", "format": "date", "pattern": f"^{_DATE}$"},
        {"type": "string", "pattern": "^r[0-9]{1,9}$", "description": "a revision of the item"},
        {"type": "string", "pattern": f"^({RELEASE_LABEL})$", "description": "a frozen revision's label"},
    ]
}

_ANY_JSON: Schema = {"title": "JsonValue"}
_JSON = "#/components/schemas/JsonValue"
_KEY = {"maxLength": MAX_KEY, "pattern": ALLOWED}
# pydantic has no way to refer to a schema that it did not make; :func:`complete` puts the reference in.
JSON_OBJECT: Schema = {"type": "object", "propertyNames": _KEY, "additionalProperties": _ANY_JSON}
_JSON_VALUE: Schema = {
    "description": "JSON of at most 32 levels and 256 KiB, with numbers that a double can hold"
    " (send longer ones as text)",
    "anyOf": [
        NOTHING,
        {"type": "boolean"},
        {"type": "number", "minimum": -MAX_NUMBER, "maximum": MAX_NUMBER},
        {"type": "string", "pattern": ALLOWED},
        {"type": "array", "items": {"$ref": _JSON}},
        {"type": "object", "propertyNames": _KEY, "additionalProperties": {"$ref": _JSON}},
    ],
}
_NOT_BLANK = rf"^[^{REFUSED_CHARACTERS}]*[^\s{REFUSED_CHARACTERS}][^{REFUSED_CHARACTERS}]*$"
# What services.bom.merge_request asks of the wire model's fields.
_MERGE: dict[str, dict[str, Schema]] = {
    "MergeRequest": {
        "source": {"description": "not read: the entries are an assembly's"},
        "sync_id": or_null(text(128, minLength=1)),
        "dry_run": or_null({"type": "boolean", "default": False}),
    },
    "MergeEntry": {
        "child_part_number": {
            "type": "string",
            "maxLength": 200,
            "pattern": _NOT_BLANK,
        },
        "quantity": {"type": "number", "exclusiveMinimum": 0, "maximum": LARGEST_QUANTITY},
        "source": {"description": "not read: the entries are an assembly's"},
    },
    "Component": {"file": text(4096), "object": text(1024)},
    "SourceDocument": {
        "file": text(4096),
        "sha256": or_null(SHA256),
        "revision": or_null({"type": "integer", "minimum": 0, "maximum": 2**31 - 1}),
    },
    "LeftOutPart": {
        "reason": text(32, minLength=1),
        "name": text(1024),
        "file": text(4096),
        "object": text(1024),
        "message": text(4096),
        "quantity": {"type": "number", "minimum": 0, "maximum": LARGEST_QUANTITY},
    },
}


def complete(document: Schema) -> Schema:
    """Add to FastAPI's document what FastAPI does not know about this server."""
    for operations in document["paths"].values():
        for operation in operations.values():
            # We answer 400; FastAPI by itself would answer 422.
            answers = operation.get("responses", {})
            answers.pop("422", None)
            if REFUSED in operation:
                answers["400"]["description"] += f". Also if the form is right: {operation[REFUSED]}"
    schemas = document["components"]["schemas"]
    for name in ("HTTPValidationError", "ValidationError"):
        schemas.pop(name, None)
    # The merge reads its body by itself (services.bom.merge_request); its form is the wire model's.
    merge = MergeRequest.model_json_schema(ref_template="#/components/schemas/{model}")
    schemas.update(merge.pop("$defs"), MergeRequest=merge, JsonValue=_JSON_VALUE)
    for model, fields in _MERGE.items():
        schemas[model]["properties"].update(fields)
    _refer(document)
    return document


def _refer(part: Any) -> None:
    below = part.values() if isinstance(part, dict) else part if isinstance(part, list) else ()
    if isinstance(part, dict) and part.get("additionalProperties") == _ANY_JSON:
        part["additionalProperties"] = {"$ref": _JSON}
    for reference in below:
        _refer(reference)
