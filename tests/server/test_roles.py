# SPDX-License-Identifier: LGPL-2.1-or-later
"""Every route × every role: who may do what, and no route that this table does not know."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest
from fastapi import FastAPI
from fastapi.routing import APIRoute
from server_testing import Api, sqlite_database

from silo_server.run import create_app, routers, running_server
from silo_server.settings import Settings
from silo_server.web.pages import ROUTERS as PAGE_ROUTERS

PUBLIC, VIEWER, EDITOR, ADMIN = "public", "viewer", "editor", "admin"
ROLES = (VIEWER, EDITOR, ADMIN)

# The contract (silo-contract §1.1): reading is for viewers, changing for editors, a few things for admins.
TABLE: dict[tuple[str, str], str] = {
    ("GET", "/health"): PUBLIC,
    ("OPTIONS", "/health"): PUBLIC,
    ("OPTIONS", "/ready"): PUBLIC,
    ("GET", "/ready"): PUBLIC,
    ("GET", "/login"): PUBLIC,
    ("POST", "/login"): PUBLIC,
    ("GET", "/login/link/{secret}"): PUBLIC,
    ("POST", "/login/link/{secret}"): PUBLIC,
    ("POST", "/api/auth/login"): PUBLIC,
    ("GET", "/api/events"): VIEWER,
    ("GET", "/api/modules"): VIEWER,
    ("GET", "/api/auth/me"): VIEWER,
    ("POST", "/api/auth/logout"): VIEWER,
    ("PUT", "/api/auth/password"): VIEWER,
    ("GET", "/api/auth/tokens"): VIEWER,
    ("POST", "/api/auth/tokens"): VIEWER,
    ("DELETE", "/api/auth/tokens/{token_id}"): VIEWER,
    ("GET", "/metrics"): VIEWER,
    ("GET", "/api/admin/housekeeping"): ADMIN,
    ("GET", "/api/admin/mode"): ADMIN,
    ("PUT", "/api/admin/mode"): ADMIN,
    ("GET", "/api/admin/audit"): ADMIN,
    ("GET", "/api/users"): ADMIN,
    ("POST", "/api/users"): ADMIN,
    ("PUT", "/api/users/{username}"): ADMIN,
    ("POST", "/api/users/{username}/login-link"): ADMIN,
    ("GET", "/api/items"): VIEWER,
    ("GET", "/api/items/search"): VIEWER,
    ("POST", "/api/items"): EDITOR,
    ("GET", "/api/items/by-uuid/{uuid}"): VIEWER,
    ("POST", "/api/items/look-alikes"): VIEWER,  # the same
    ("POST", "/api/items/by-uuid"): VIEWER,  # a look-up with a long list; changes nothing
    ("POST", "/api/items/boms"): VIEWER,  # the same
    ("GET", "/api/items/{part_number}"): VIEWER,
    ("PUT", "/api/items/{part_number}"): EDITOR,
    ("PATCH", "/api/items/{part_number}/properties"): EDITOR,
    ("GET", "/api/items/{part_number}/suppliers"): VIEWER,
    ("PUT", "/api/items/{part_number}/suppliers"): EDITOR,
    ("POST", "/api/suppliers/import"): EDITOR,
    ("GET", "/api/items/{part_number}/order"): VIEWER,
    ("GET", "/api/items/{part_number}/order.csv"): VIEWER,
    ("GET", "/api/items/{part_number}/order.xlsx"): VIEWER,
    ("GET", "/api/items/{part_number}/orders"): VIEWER,
    ("POST", "/api/items/{part_number}/orders"): EDITOR,
    ("POST", "/api/items/{part_number}/orders/{order_id}/take-back"): EDITOR,
    ("GET", "/api/rates"): VIEWER,
    ("PUT", "/api/rates"): ADMIN,
    ("GET", "/api/items/{part_number}/releases"): VIEWER,
    ("POST", "/api/items/{part_number}/releases"): EDITOR,
    ("GET", "/api/items/{part_number}/releases/{label}"): VIEWER,
    # These two need the right to approve, or an editor who withdraws (tests/contract/test_releases.py).
    ("POST", "/api/items/{part_number}/releases/{label}/approval"): VIEWER,
    ("POST", "/api/items/{part_number}/releases/{label}/end"): VIEWER,
    ("POST", "/api/models/missing"): VIEWER,  # a look-up with a long list
    ("PUT", "/api/models/{sha256}/geometry"): EDITOR,
    ("PUT", "/api/models/{sha256}/structure"): EDITOR,
    ("GET", "/api/models/{sha256}/geometry"): VIEWER,
    ("GET", "/api/models/{sha256}/structure"): VIEWER,
    ("GET", "/api/items/{part_number}/scene"): VIEWER,
    ("DELETE", "/api/items/{part_number}"): EDITOR,
    ("POST", "/api/items/{part_number}/unarchive"): EDITOR,
    ("POST", "/api/generate-part-number"): EDITOR,
    ("GET", "/api/schemas"): VIEWER,
    ("GET", "/api/schemas/{name}"): VIEWER,
    ("GET", "/api/schemas/{name}/form"): VIEWER,
    ("GET", "/api/items/{part_number}/revisions"): VIEWER,
    ("GET", "/api/items/{part_number}/revisions/{number}"): VIEWER,
    ("POST", "/api/items/{part_number}/revisions"): EDITOR,
    ("POST", "/api/items/{part_number}/file"): EDITOR,
    ("GET", "/api/items/{part_number}/file"): VIEWER,
    ("GET", "/api/items/{part_number}/file/{number}"): VIEWER,
    ("GET", "/api/items/{part_number}/thumbnail"): VIEWER,
    ("PUT", "/api/items/{part_number}/thumbnail"): EDITOR,
    ("GET", "/api/items/{part_number}/bom"): VIEWER,
    ("POST", "/api/items/{part_number}/bom"): EDITOR,
    ("PUT", "/api/items/{part_number}/bom/{child}"): EDITOR,
    ("DELETE", "/api/items/{part_number}/bom/{child}"): EDITOR,
    ("PUT", "/api/items/{part_number}/bom/lines/{line_id}"): EDITOR,
    ("DELETE", "/api/items/{part_number}/bom/lines/{line_id}"): EDITOR,
    ("POST", "/api/items/{part_number}/bom/merge"): EDITOR,
    ("GET", "/api/items/{part_number}/bom/expanded"): VIEWER,
    ("GET", "/api/items/{part_number}/bom/flat"): VIEWER,
    ("GET", "/api/items/{part_number}/bom/cost"): VIEWER,
    ("GET", "/api/items/{part_number}/bom/mass"): VIEWER,
    ("GET", "/api/items/{part_number}/bom/where-used"): VIEWER,
    ("GET", "/api/items/{part_number}/bom/review"): VIEWER,
    ("POST", "/api/items/{part_number}/bom/resolve"): EDITOR,
    ("GET", "/api/items/{part_number}/bom/history"): VIEWER,
    ("GET", "/api/items/{part_number}/bom/history/{change_id}"): VIEWER,
    ("GET", "/api/items/{part_number}/bom/history/{change_id}/bom"): VIEWER,
    ("GET", "/api/items/{part_number}/bom/compare"): VIEWER,
    ("POST", "/api/items/{part_number}/bom/restore"): EDITOR,
    ("POST", "/api/items/{part_number}/bom/undo"): EDITOR,
    ("GET", "/api/items/{part_number}/bom/export.csv"): VIEWER,
    ("GET", "/api/items/{part_number}/bom/export.xlsx"): VIEWER,
    ("GET", "/api/items/{part_number}/bom/export.json"): VIEWER,
    ("POST", "/api/items/{part_number}/bom/import"): EDITOR,
    ("GET", "/api/items/{part_number}/bom/summary"): VIEWER,
    ("GET", "/api/items/{part_number}/bom/changes"): VIEWER,
    ("GET", "/api/items/{part_number}/bom/changes.csv"): VIEWER,
    ("GET", "/api/items/{part_number}/bom/changes.xlsx"): VIEWER,
    ("GET", "/api/items/{part_number}/documents"): VIEWER,
    ("POST", "/api/documents/by-uuid"): VIEWER,  # a look-up with a long list
    ("GET", "/api/documents/{uuid}"): VIEWER,
    ("GET", "/api/documents/{uuid}/revisions"): VIEWER,
    ("GET", "/api/documents/{uuid}/revisions/{number}"): VIEWER,
    ("POST", "/api/documents/{uuid}/file"): EDITOR,
    ("GET", "/api/documents/{uuid}/file"): VIEWER,
    ("GET", "/api/documents/{uuid}/file/{number}"): VIEWER,
    ("GET", "/api/admin/system"): ADMIN,
}
# Pages are not in the OpenAPI document; their own tests look after the rest of them.
PAGES = {
    ("GET", "/login"),
    ("POST", "/login"),
    ("GET", "/login/link/{secret}"),
    ("POST", "/login/link/{secret}"),
}

PARAMETERS = {
    "token_id": "999999",
    "number": "1",
    "change_id": "1",
    "uuid": "00000000-0000-4000-8000-000000000000",
    "name": "kindred-rd",
}


def fill(path: str) -> str:
    """The path with its parameters filled in; nothing there exists, so nothing is harmed."""
    for part in path.split("/"):
        if part.startswith("{"):
            path = path.replace(part, PARAMETERS.get(part[1:-1], "NO-SUCH"))
    return path


@pytest.fixture(scope="module")
def callers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Api]]:
    """A caller per role, and one without a token ("nobody")."""
    folder = tmp_path_factory.mktemp("roles")
    with (
        running_server(sqlite_database(folder / "roles.db"), token="silo_roles") as server,
        Api(server.base_url, "silo_roles") as api,
    ):
        made = {"nobody": api.as_(None), ADMIN: api}
        for role in (VIEWER, EDITOR):
            api.good("POST", "/api/users", {"username": role, "role": role})
            link = api.good("POST", f"/api/users/{role}/login-link")["path"]
            cookie = api.as_(None).call("POST", link).headers["set-cookie"].split(";")[0]
            made[role] = api.as_(token_by_session(server, api, cookie))
        yield made


def token_by_session(server: object, api: Api, cookie: str) -> str:
    """A token of the user whose session this is, made with the session's CSRF secret."""
    from silo_server.services.access import actor_by_session

    db = server.app.state.server.db  # type: ignore[attr-defined]
    actor = actor_by_session(db, cookie.partition("=")[2], "")
    assert actor is not None
    headers = {"Cookie": cookie, "X-CSRF-Token": actor.csrf_token or ""}
    token = api.as_(None).good("POST", "/api/auth/tokens", {"name": "role"}, headers=headers)
    return str(token["token"])


def routes_of(routes: Iterable[object]) -> set[tuple[str, str]]:
    """(method, path) of each route of a router, hidden ones too."""
    return {
        (method, route.path)
        for route in routes
        if isinstance(route, APIRoute)
        for method in route.methods - {"HEAD"}
    }


def test_the_table_knows_every_route(tmp_path: Path) -> None:
    """A new route, in the document or hidden, is added here with its role, or this fails; none is invented.

    The pages have a table of their own (``test_web_access``), which is held against their routers.
    """
    app = create_app(Settings(database_url=f"sqlite:///{tmp_path / 'x.db'}"))
    documented = {
        (method.upper(), path) for path, operations in app.openapi()["paths"].items() for method in operations
    }
    assert documented <= TABLE.keys()
    pages = set().union(*(routes_of(router.routes) for router in PAGE_ROUTERS))
    assert {key for key in TABLE if key not in PAGES} == everything(app) - pages


def everything(app: FastAPI) -> set[tuple[str, str]]:
    """All routes that the application answers, but the files and the document."""
    found = routes_of(app.routes)
    for router in routers():
        found |= routes_of(router.routes)
    return found


@pytest.mark.parametrize(("method", "path"), [key for key, role in TABLE.items() if role != PUBLIC])
def test_a_route_lets_in_who_may(callers: dict[str, Api], method: str, path: str) -> None:
    """401 without a token, 403 below the role, and from the role on neither."""
    needed = ROLES.index(TABLE[(method, path)])
    assert callers["nobody"].call(method, fill(path)).status == 401
    if path == "/api/events":  # the answer would never end; the events' own tests let people in
        return
    for role in ROLES:
        answer = callers[role].call(method, fill(path))
        if ROLES.index(role) < needed:
            assert answer.status == 403, (role, answer.body)
            assert answer.json()["error"] == "forbidden"
        else:
            assert answer.status not in (401, 403), (role, answer.body)


@pytest.mark.parametrize(("method", "path"), [key for key, role in TABLE.items() if role == PUBLIC])
def test_a_public_route_needs_no_token(callers: dict[str, Api], method: str, path: str) -> None:
    """Health and login are for everybody."""
    answer = callers["nobody"].call(method, fill(path))
    assert answer.status not in (401, 403) or "link" in path or "login" in path
    assert answer.status < 500
