# SPDX-License-Identifier: LGPL-2.1-or-later
"""Who may see and do what on the pages: as for the API, but who is not logged in is led to the login page."""

from __future__ import annotations

from typing import Annotated
from urllib.parse import quote

from fastapi import Depends, FastAPI, Request
from starlette.responses import RedirectResponse, Response

from silo.bom.errors import AuthError
from silo_server.routes.context import SAFE_METHODS, Guard
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
            here = request.url.path if request.method in SAFE_METHODS else "/"
            raise LoginNeededError(here) from None


Reader = Annotated[Actor, Depends(PageGuard(Role.VIEWER))]
Writer = Annotated[Actor, Depends(PageGuard(Role.EDITOR))]
Administrator = Annotated[Actor, Depends(PageGuard(Role.ADMIN))]


def install(app: FastAPI) -> None:
    """Lead who is not logged in to the login page."""
    app.add_exception_handler(LoginNeededError, _to_login)


async def _to_login(_request: Request, error: Exception) -> Response:
    assert isinstance(error, LoginNeededError)
    return RedirectResponse("/login?next=" + quote(error.target), 303)
