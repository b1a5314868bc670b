# SPDX-License-Identifier: LGPL-2.1-or-later
"""The pages put together: their routers, their static files, and errors as pages in plain words.

The words of an error page are those that the JSON has.
"""

from __future__ import annotations

import json
from collections.abc import Awaitable, Callable
from typing import Any, cast
from urllib.parse import quote, unquote

import anyio.to_thread
from fastapi import Depends, FastAPI, Request
from sqlalchemy.exc import SQLAlchemyError
from starlette.responses import RedirectResponse, Response
from starlette.routing import Match
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Receive, Scope, Send

from silo_server.actors import Actor
from silo_server.http.headers import SECURITY_HEADERS
from silo_server.routes.call import SAFE_METHODS, find_actor
from silo_server.routes.known_parameters import refuse_unknown
from silo_server.web import (
    accounts,
    activity_page,
    attachments,
    device_page,
    import_page,
    item_edit_page,
    item_page,
    merge_page,
    orders_page,
    parts_page,
    print_page,
    releases_page,
    waiting_page,
)
from silo_server.web.accounts import LoginNeededError, OldFormError, send_again, to_login
from silo_server.web.render import (
    LANGUAGE,
    LANGUAGE_COOKIE,
    N_,
    NOTICE,
    TIMEZONE,
    TIMEZONE_COOKIE,
    _,
    language_for,
    page_for,
)

ROUTERS = (
    accounts.router,
    device_page.router,
    parts_page.router,  # before item_page: /items/import is no part number, nor is
    item_edit_page.router,  # /items/new
    item_page.router,
    print_page.router,
    attachments.router,
    merge_page.router,
    releases_page.router,
    orders_page.router,
    activity_page.router,
    import_page.router,
    waiting_page.router,
)
# The notice of the form that led to a page is in its address.
DEPENDENCIES = (Depends(refuse_unknown(NOTICE)),)


class Spoken:
    """Sets language and time zone of a page; the answers of the API never depend on them."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http" and not scope["path"].startswith("/api/"):
            request = Request(scope)
            chosen = request.cookies.get(LANGUAGE_COOKIE, "")
            LANGUAGE.set(language_for(chosen, request.headers.get("accept-language", "")))
            TIMEZONE.set(unquote(request.cookies.get(TIMEZONE_COOKIE, "UTC"))[:100])
        await self.app(scope, receive, send)


class OwnFiles(StaticFiles):
    """Our style sheets and scripts, and the viewer, which reports of masses have as well.

    A browser asks each time whether they are new, so that none gets old.
    """

    async def get_response(self, path: str, scope: Scope) -> Response:
        response = await super().get_response(path, scope)
        response.headers["Cache-Control"] = "no-cache"
        return response


def install(app: FastAPI) -> None:
    """Add what is not a route: static files, the language, the way to the login page, errors as pages."""
    app.add_middleware(Spoken)
    app.mount(
        "/static", OwnFiles(packages=[("silo_server.web", "static"), ("silo", "viewer")]), name="static"
    )
    # Browsers get pages instead of the JSON that the handlers of ``app`` give.
    for kind, handler in list(app.exception_handlers.items()):
        app.add_exception_handler(kind, _for_browsers(cast(Handler, handler)))
    app.add_exception_handler(LoginNeededError, to_login)
    app.add_exception_handler(OldFormError, send_again)


Handler = Callable[[Request, Exception], Awaitable[Response]]

TITLES = {
    400: N_("That did not work"),
    401: N_("Please log in"),
    403: N_("Not allowed"),
    404: N_("Not found"),
    405: N_("Not found"),
    409: N_("Another change or entry is in the way"),
    412: N_("The BOM changed in between"),
    413: N_("Too large"),
    429: N_("Too many attempts"),
    503: N_("Not possible at the moment"),
}


def wants_page(request: Request) -> bool:
    """Return True if a browser asks for a page; the API and programs get JSON."""
    return not request.url.path.startswith("/api/") and "text/html" in request.headers.get("accept", "")


def _for_browsers(handler: Handler) -> Handler:
    async def answer(request: Request, error: Exception) -> Response:
        plain = await handler(request, error)
        if plain.status_code == 405 and request.method in SAFE_METHODS and wants_page(request):
            return RedirectResponse(_page_above(request), 303)
        return await error_page(request, plain) if wants_page(request) else plain

    return answer


async def error_page(request: Request, plain: Response) -> Response:
    """Make the page for an error that was answered as JSON."""
    values: dict[str, Any] = json.loads(bytes(plain.body))

    kept = getattr(request.state, "kept", None)

    def draw() -> Response:
        return page_for(
            request,
            _actor(request),
            "error.html",
            status=plain.status_code,
            title=_(TITLES.get(plain.status_code, N_("The server made a mistake"))),
            message=_sentence(plain.status_code, values["message"], request),
            problems=values.get("problems", [])[:50],
            path=values.get("path", []),
            kept=kept,
        )

    response = await anyio.to_thread.run_sync(draw)
    if "retry-after" in plain.headers:
        response.headers["retry-after"] = plain.headers["retry-after"]
    # A fault is answered outside of the middleware that adds these otherwise.
    response.headers.update(SECURITY_HEADERS)
    return response


def _page_above(request: Request) -> str:
    """Find the page with the form of this address: the nearest one above that can be opened."""
    path = request.scope["path"].rstrip("/")
    while path:
        path = path.rpartition("/")[0]
        scope = {**request.scope, "path": path, "method": "GET"}
        if any(route.matches(scope)[0] is Match.FULL for route in request.app.routes):
            return quote(path)
    return "/"


def _sentence(status: int, message: str, request: Request) -> str:
    if message.startswith(("Not Found:", "Method Not Allowed:")):
        return _("There is no page %(path)s.", path=request.url.path)
    return message


def _actor(request: Request) -> Actor | None:
    try:
        return find_actor(request)
    except SQLAlchemyError:
        return None
