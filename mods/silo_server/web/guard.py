# SPDX-License-Identifier: LGPL-2.1-or-later
"""Who may see and do what on the pages: as for the API, but who is not logged in is led to the login page."""

from __future__ import annotations

from typing import Annotated
from urllib.parse import quote, urlsplit

from fastapi import Depends, FastAPI, Request
from starlette.responses import RedirectResponse, Response

from silo.bom.errors import AuthError, ForbiddenError
from silo_server.routes.context import SAFE_METHODS, Guard, server_of
from silo_server.values import Actor, Role


class LoginNeededError(Exception):
    """Nobody is logged in; the login page leads back to ``target``."""

    def __init__(self, target: str) -> None:
        super().__init__(target)
        self.target = target


class PageGuard(Guard):
    """As :class:`Guard`, for people."""

    async def __call__(self, request: Request) -> Actor:
        try:
            return await super().__call__(request)
        except AuthError as error:
            if error.status_hint != 401:
                raise
            raise LoginNeededError(_here(request)) from None


Reader = Annotated[Actor, Depends(PageGuard(Role.VIEWER))]
Writer = Annotated[Actor, Depends(PageGuard(Role.EDITOR))]
Administrator = Annotated[Actor, Depends(PageGuard(Role.ADMIN))]


def own_form(request: Request) -> None:
    """For the one form without a session, the login: ForbiddenError where another site sent it.

    A browser says where a form comes from; a page elsewhere must not log somebody in under its own name.
    """
    site = request.headers.get("sec-fetch-site")
    origin = request.headers.get("origin")
    if site is not None:
        foreign = site not in ("same-origin", "none")
    else:
        foreign = origin is not None and urlsplit(origin).netloc != request.headers.get("host")
    if foreign:
        raise ForbiddenError("this form was sent by another site; log in on the login page itself")


def install(app: FastAPI) -> None:
    """Lead who is not logged in to the login page."""
    app.add_exception_handler(LoginNeededError, _to_login)


def _here(request: Request) -> str:
    if request.method in SAFE_METHODS:
        query = f"?{request.url.query}" if request.url.query else ""
        return request.url.path + query
    # A form cannot be sent again by a link; the page before it is the best that is left.
    referer = urlsplit(request.headers.get("referer", ""))
    path = referer.path.removeprefix(server_of(request).settings.root_path)
    return path if referer.netloc == request.headers.get("host") and path else "/"


async def _to_login(_request: Request, error: Exception) -> Response:
    assert isinstance(error, LoginNeededError)
    return RedirectResponse("/login?next=" + quote(error.target, safe="/"), 303)
