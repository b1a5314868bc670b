# SPDX-License-Identifier: LGPL-2.1-or-later
"""The pages put together: their routers, their static files, and errors as pages."""

from __future__ import annotations

from fastapi import FastAPI
from starlette.responses import Response
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

from silo_server.web import (
    account_page,
    activity_page,
    error_page,
    guard,
    history_page,
    import_page,
    item_edit_page,
    item_page,
    items_page,
    login_page,
    merge_page,
    users_page,
    waiting_page,
)

ROUTERS = (
    login_page.router,
    items_page.router,
    item_edit_page.router,  # before item_page: /items/new is no part number
    item_page.router,
    merge_page.router,
    history_page.router,
    import_page.router,
    activity_page.router,
    account_page.router,
    waiting_page.router,
    users_page.router,
)


class OwnFiles(StaticFiles):
    """Our style sheet and scripts; a browser asks each time whether they are new, so that none gets old."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        response = await super().get_response(path, scope)
        response.headers["Cache-Control"] = "no-cache"
        return response


def install(app: FastAPI) -> None:
    """Add what is no route: static files, the way to the login page, errors as pages."""
    app.mount("/static", OwnFiles(packages=[("silo_server.web", "static")]), name="static")
    guard.install(app)
    error_page.install(app)
