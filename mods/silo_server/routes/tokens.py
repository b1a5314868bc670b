# SPDX-License-Identifier: LGPL-2.1-or-later
"""A caller's API tokens."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Path, Query
from pydantic import ConfigDict, Field, WithJsonSchema
from starlette.responses import Response

from silo_server.actors import Role, Scope
from silo_server.fields import to_wire
from silo_server.routes import openapi
from silo_server.routes.answers import READ_ERRORS, WRITE_ERRORS
from silo_server.routes.call import Call, Viewer
from silo_server.routes.models import RequestBody, Short
from silo_server.routes.requests import BoundedRoute
from silo_server.services.access import tokens
from silo_server.services.access.tokens import Children, Parent, Token, check_may_change, create_own_token

router = APIRouter(route_class=BoundedRoute, prefix="/api", tags=["auth"])


class TokenBody(RequestBody):
    """``POST /api/auth/tokens``.

    expires_in_days
        null = until revoked; absent = as long as the token that asks (a session: until revoked).
    scopes
        ``read``, ``write``, ``admin``, each with those before it; absent = all that the caller may.

    Unknown keys are refused: a misspelt limit must not make a token without it.
    """

    model_config = ConfigDict(extra="forbid")

    name: Annotated[Short, Field(min_length=1), WithJsonSchema(openapi.text(200, minLength=1))]
    expires_in_days: Annotated[float, Field(gt=0, le=3650, strict=True)] | None = None
    scopes: Annotated[list[Scope], Field(min_length=1, max_length=3)] | None = None


@router.get("/auth/tokens", responses=READ_ERRORS)
def list_tokens(call: Viewer) -> list[dict[str, Any]]:
    """Return the caller's tokens; never their secrets."""
    with call.read() as tx:
        return [_token(token) for token in tokens.list_tokens(tx, call.actor.own_id)]


@router.post("/auth/tokens", status_code=201, responses=WRITE_ERRORS)
def create_token(call: Viewer, body: TokenBody) -> dict[str, Any]:
    """Make a token. Only this answer shows its secret."""
    forever = "expires_in_days" in body.model_fields_set and body.expires_in_days is None
    scope = max(body.scopes, key=list(Scope).index) if body.scopes else None
    with call.write(even_when_read_only=True) as tx:
        token, secret = create_own_token(
            tx, body.name, days=body.expires_in_days, forever=forever, scope=scope
        )
        return {**_token(token), "token": secret}


@router.delete("/auth/tokens/{token_id}", status_code=204, responses=WRITE_ERRORS)
def revoke_token(
    call: Viewer,
    token_id: Annotated[int, Path(ge=1, le=2**62)],
    children: Annotated[Children | None, Query()] = None,
) -> Response:
    """Revoke a token: one's own, or anybody's for an admin.

    ``children``: if what was made with the token, and lives on, ends as well (``end``, as after a leak) or
    stays (``keep``). Without it a token that has such children is not revoked: the 409 lists them.
    """
    revoke(call, token_id, children)
    return Response(status_code=204)


def revoke(call: Call, token_id: int, children: Children | None = None) -> None:
    """Revoke a token of the caller's own, or anybody's for an admin."""
    check_may_change(call.actor)
    owner = None if call.actor.role is Role.ADMIN else call.actor.own_id
    with call.write(even_when_read_only=True) as tx:
        tokens.revoke_token(tx, token_id, owner, children)


def _parent(parent: Parent | None) -> dict[str, Any] | None:
    """Describe what made a token: null for the server itself, ``known`` false for an older version's."""
    return None if parent is None else to_wire(parent)


def _token(token: Token) -> dict[str, Any]:
    return {
        **to_wire(token, "username", "scope", "parent"),
        "parent": _parent(token.parent),
        "scopes": [scope.value for scope in Scope if token.scope.covers(scope)],
    }
