# SPDX-License-Identifier: LGPL-2.1-or-later
"""The first, plain page at ``resolve_url``, and the way in: a login form and the one-time link."""

from __future__ import annotations

from html import escape
from importlib import resources
from string import Template
from typing import Annotated
from urllib.parse import quote

from fastapi import APIRouter, Form, Query, Request
from starlette.responses import HTMLResponse, RedirectResponse, Response

from silo.bom.errors import AuthError
from silo_server.errors import TooManyAttemptsError
from silo_server.routes.auth import set_session_cookie
from silo_server.routes.context import ServerDep, client_address, find_actor
from silo_server.services import logins
from silo_server.services.items import get_item
from silo_server.services.lines import lines_of
from silo_server.values import Line, number

router = APIRouter(include_in_schema=False)


@router.get("/login")
def login_form(request: Request, next: Annotated[str, Query(max_length=500)] = "/") -> Response:
    """The login form."""
    return HTMLResponse(
        _page("Log in", _template("login").substitute(next=escape(local_path(next)), problem=""))
    )


@router.post("/login")
def log_in(
    request: Request,
    server: ServerDep,
    username: Annotated[str, Form(max_length=200)],
    password: Annotated[str, Form(max_length=200)],
    next: Annotated[str, Form(max_length=500)] = "/",
) -> Response:
    """Begin a session and go on to ``next``."""
    try:
        session = logins.log_in(server.db, username, password, client_address(request))
    except (AuthError, TooManyAttemptsError) as error:
        body = _template("login").substitute(next=escape(local_path(next)), problem=escape(str(error)))
        return HTMLResponse(_page("Log in", body), error.status_hint)
    response = RedirectResponse(local_path(next), 303)
    set_session_cookie(response, server, session, request)
    return response


@router.get("/login/link/{secret}")
def use_link(
    request: Request, server: ServerDep, secret: str, next: Annotated[str, Query(max_length=500)] = "/"
) -> Response:
    """Begin a session by a one-time link."""
    try:
        session = logins.use_login_link(server.db, secret, client_address(request))
    except AuthError as error:
        body = _template("login").substitute(next=escape(local_path(next)), problem=escape(str(error)))
        return HTMLResponse(_page("Log in", body), 401)
    response = RedirectResponse(local_path(next), 303)
    set_session_cookie(response, server, session, request)
    return response


@router.get("/items/{part_number}/bom")
def bom_page(request: Request, server: ServerDep, part_number: str) -> Response:
    """The BOM with its sources and what the assembly does not reference any more."""
    actor = find_actor(request)
    if actor is None:
        return RedirectResponse("/login?next=" + quote(request.url.path), 303)
    with server.db.read(actor) as tx:
        item = get_item(tx, part_number)
        lines = lines_of(tx, item)
    gone = sum(line.state.unreferenced_since is not None for line in lines)
    banner = (
        f'<p role="status">{gone} items in the Silo BOM are not referenced by components '
        "in this assembly.</p>"
        if gone
        else ""
    )
    body = _template("bom").substitute(
        title=escape(f"{item.part_number} {item.name}"), banner=banner, rows="".join(map(_row, lines))
    )
    return HTMLResponse(_page(f"BOM of {item.part_number}", body))


def local_path(target: str) -> str:
    """``target`` where it is a path of this server, else the start page: nobody is sent elsewhere."""
    plain = target.startswith("/") and not target.startswith(("//", "/\\"))
    return target if plain and target.isprintable() else "/"


def _row(line: Line) -> str:
    state = line.state
    since = f"unreferenced since {state.unreferenced_since[:10]}" if state.unreferenced_since else ""
    cells = (
        line.child_part_number,
        line.child_name,
        f"{number(state.quantity)} {state.unit or ''}".strip(),
        state.source,
        since,
    )
    return "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>\n"


def _template(name: str) -> Template:
    return Template(resources.files("silo_server.routes").joinpath(f"{name}.html").read_text("utf-8"))


def _page(title: str, body: str) -> str:
    return _template("page").substitute(title=escape(title), body=body)
