# SPDX-License-Identifier: LGPL-2.1-or-later
"""Who may see and do what on the pages: as for the API, but visitors are led to the login page."""

from __future__ import annotations

from typing import Annotated
from urllib.parse import quote, urlsplit

import anyio.to_thread
from fastapi import Depends, FastAPI, Request
from starlette.responses import RedirectResponse, Response

from silo.bom.errors import AuthError, ForbiddenError
from silo_server.routes.context import (
    FORM_TYPES,
    SAFE_METHODS,
    FormSecretError,
    Guard,
    find_actor,
    form_of,
    server_of,
)
from silo_server.values import Actor, Role
from silo_server.web.forms import MOST_KEPT, Kept, kept_form, own_site
from silo_server.web.render import page


class LoginNeededError(Exception):
    """Nobody is logged in; the login page leads back to ``target``, or to the form that was ``kept``."""

    def __init__(self, target: str, kept: Kept | None = None) -> None:
        super().__init__(target)
        self.target, self.kept = target, kept


class OldFormError(Exception):
    """A form of ours that was shown in an earlier session; the person is asked whether to send it now."""

    def __init__(self, actor: Actor, kept: Kept) -> None:
        super().__init__(kept.path)
        self.actor, self.kept = actor, kept


class PageGuard(Guard):
    """As :class:`Guard`, for people: what they typed is kept over a login."""

    async def __call__(self, request: Request) -> Actor:
        try:
            return await super().__call__(request)
        except FormSecretError:
            kept, actor = await _kept(request), await anyio.to_thread.run_sync(find_actor, request)
            if kept is None or actor is None or not own_site(request):
                raise
            raise OldFormError(actor, kept) from None
        except AuthError as error:
            kept = await _kept(request)
            if error.status_hint != 401:
                request.state.kept = kept
                raise
            raise LoginNeededError(_here(request), kept if own_site(request) else None) from None


async def _kept(request: Request) -> Kept | None:
    """What the request's form holds; None where it is none, or too large to be carried along."""
    length = request.headers.get("content-length", "")
    small = length.isdigit() and int(length) <= MOST_KEPT
    is_form = request.headers.get("content-type", "").startswith(FORM_TYPES)
    if request.method in SAFE_METHODS or not is_form or not small:
        return None
    return kept_form(request.url.path, await form_of(request))


Reader = Annotated[Actor, Depends(PageGuard(Role.VIEWER))]
Writer = Annotated[Actor, Depends(PageGuard(Role.EDITOR))]
Administrator = Annotated[Actor, Depends(PageGuard(Role.ADMIN))]


def own_form(request: Request) -> None:
    """For the one form without a session, the login: ForbiddenError where another site sent it.

    A browser says where a form comes from; a page elsewhere must not log somebody in under its own name.
    """
    if own_site(request) is False:
        raise ForbiddenError("this form was sent by another site; log in on the login page itself")


def install(app: FastAPI) -> None:
    """Lead visitors who are not logged in to the login page."""
    app.add_exception_handler(LoginNeededError, _to_login)
    app.add_exception_handler(OldFormError, _send_again)


def _here(request: Request) -> str:
    if request.method in SAFE_METHODS:
        query = f"?{request.url.query}" if request.url.query else ""
        return request.url.path + query
    # A form cannot be sent again by a link; the page before it is the best that is left.
    referer = urlsplit(request.headers.get("referer", ""))
    path = referer.path.removeprefix(server_of(request).settings.root_path)
    return path if referer.netloc == request.headers.get("host") and path else "/"


async def _to_login(request: Request, error: Exception) -> Response:
    assert isinstance(error, LoginNeededError)
    if error.kept is None:
        return RedirectResponse("/login?next=" + quote(error.target, safe="/"), 303)
    values = {"target": error.target, "kept": error.kept, "problem": ""}
    return await anyio.to_thread.run_sync(lambda: page(request, "login.html", None, status=401, **values))


async def _send_again(request: Request, error: Exception) -> Response:
    assert isinstance(error, OldFormError)
    kept = error.kept
    return await anyio.to_thread.run_sync(
        lambda: page(request, "again.html", error.actor, status=403, kept=kept)
    )
