# SPDX-License-Identifier: LGPL-2.1-or-later
"""For admins: the users, and the audit list of who did what."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query
from pydantic import StrictBool, WithJsonSchema

from silo_server.actors import Role
from silo_server.fields import to_wire
from silo_server.routes import openapi
from silo_server.routes.answers import READ_ERRORS, WRITE_ERRORS
from silo_server.routes.call import Admin, Call
from silo_server.routes.models import RequestBody, Short, Text
from silo_server.routes.requests import BoundedRoute, PageFrom
from silo_server.services import audit
from silo_server.services.access import login_links, users
from silo_server.services.access.users import User

router = APIRouter(route_class=BoundedRoute, prefix="/api", tags=["auth"])

NewPassword = Annotated[Text, WithJsonSchema(openapi.PASSWORD)]


class NewUserBody(RequestBody):
    """``POST /api/users``; without a password only tokens and login links let the user in."""

    username: Annotated[Short, WithJsonSchema(openapi.USERNAME)]
    role: Role = Role.VIEWER
    display_name: Short = ""
    password: NewPassword | None = None


class UserChangeBody(RequestBody):
    """``PUT /api/users/{username}``: what is absent or null stays."""

    role: Role | None = None
    display_name: Short | None = None
    active: StrictBool | None = None
    approver: StrictBool | None = None
    password: NewPassword | None = None


@router.get("/users", responses=READ_ERRORS)
def list_users(call: Admin) -> list[dict[str, Any]]:
    """Return all users."""
    with call.read() as tx:
        return [_user(user) for user in users.list_users(tx)]


@router.post("/users", status_code=201, responses=WRITE_ERRORS)
def create_user(call: Admin, body: NewUserBody) -> dict[str, Any]:
    """Make a user."""
    with call.write(even_when_read_only=True) as tx:
        user = users.create_user(
            tx, body.username, body.role, display_name=body.display_name, password=body.password
        )
        return _user(user)


@router.put("/users/{username}", responses=WRITE_ERRORS)
def change_user(call: Admin, username: str, body: UserChangeBody) -> dict[str, Any]:
    """Change a user's role, name, password or right to approve, or block all access of the user."""
    with call.write(even_when_read_only=True) as tx:
        user = users.change_user(tx, username, **body.model_dump())
        return _user(user)


@router.post("/users/{username}/login-link", status_code=201, responses=WRITE_ERRORS)
def create_login_link(call: Admin, username: str) -> dict[str, Any]:
    """Make a link that lets this user in once; for a new colleague or a forgotten password."""
    path, public = login_path(call, username), call.server.settings.public_url
    return {"path": path, "url": f"{public}{path}" if public else None}


def login_path(call: Call, username: str) -> str:
    """Make a login link for a user; return its path."""
    with call.write(even_when_read_only=True) as tx:
        secret = login_links.create_login_link(tx, username)
        audit.note(tx, "login_link.created", username)
        return f"/login/link/{secret}"


@router.get("/admin/audit", responses=READ_ERRORS)
def list_audit(
    call: Admin, limit: Annotated[int, Query(ge=1, le=1000)] = 100, before: PageFrom = None
) -> list[dict[str, Any]]:
    """Return the audit list, newest first: who did what."""
    with call.read() as tx:
        entries = audit.list_entries(tx, limit, before)
    return [to_wire(entry) for entry in entries]


def _user(user: User) -> dict[str, Any]:
    return to_wire(user, "id")
