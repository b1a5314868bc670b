# SPDX-License-Identifier: LGPL-2.1-or-later
"""Every route × every role: who may do what. The pages have their own tests (``test_web_access``)."""

from __future__ import annotations

import re

import pytest
from fastapi.routing import APIRoute
from server_testing import Api
from web_visitor import ROLES, Visitor

from silo_server.run import RunningServer, routers
from silo_server.web.pages import ROUTERS

VIEWER, EDITOR, ADMIN = ROLES
# The contract (silo-contract §1.1): reading is for viewers, changing for editors. These are the exceptions.
PUBLIC = {f"{method} {path}" for method in ("GET", "OPTIONS") for path in ("/health", "/ready")}
PUBLIC |= {"POST /api/auth/login", "POST /api/auth/device", "POST /api/auth/device/token"}
# Public unless the site asks for a login (tests/server/test_system.py).
PUBLIC |= {"GET /api/openapi.json"}
# Asked last: after that, no credential of the caller lets in any more.
ENDS_ALL = "POST /api/auth/logout-everywhere"
OF_VIEWERS = {
    # The own account.
    *("POST /api/auth/logout", "PUT /api/auth/password", "POST /api/auth/tokens"),
    *("DELETE /api/auth/tokens/{token_id}", ENDS_ALL),
    # Look-ups with a long list, which change nothing.
    *("POST /api/items/look-alikes", "POST /api/items/by-uuid", "POST /api/items/boms"),
    *("POST /api/documents/by-uuid", "POST /api/documents/by-content", "POST /api/models/missing"),
    # These two need the right to approve, or an editor who withdraws (tests/contract/test_releases.py).
    "POST /api/items/{part_number}/releases/{label}/approval",
    "POST /api/items/{part_number}/releases/{label}/end",
}
OF_ADMINS = re.compile("[A-Z]+ /api/(admin|users)|PUT /api/rates|POST /api/categories/import")

PARAMETERS = {
    "token_id": "999999",
    "number": "1",
    "change_id": "1",
    "uuid": "00000000-0000-4000-8000-000000000000",
    "name": "kindred-rd",
}


def needed(route: str) -> str:
    """Return the least role that a route lets in."""
    if OF_ADMINS.match(route):
        return ADMIN
    return VIEWER if route.startswith("GET ") or route in OF_VIEWERS else EDITOR


@pytest.fixture(scope="module")
def callers(api: Api, visitors: dict[str, Visitor]) -> dict[str, Api]:
    """A caller per role."""
    made = {}
    for role, visitor in visitors.items():
        headers = {"Cookie": visitor.cookie, "X-CSRF-Token": visitor.csrf}
        token = visitor.api.good("POST", "/api/auth/tokens", {"name": "role"}, headers=headers)
        made[role] = api.as_(token["token"])
    return made


def test_a_route_lets_in_who_may(server: RunningServer, api: Api, callers: dict[str, Api]) -> None:
    """401 without a token, 403 below the role, and from the role on neither; in the document or hidden."""
    routes = [*server.app.routes, *(route for router in routers() for route in router.routes)]
    pages = {id(route) for router in ROUTERS for route in router.routes}
    own = [route for route in routes if isinstance(route, APIRoute) and id(route) not in pages]
    named = {f"{method} {route.path}" for route in own for method in route.methods - {"HEAD"}}
    assert named >= PUBLIC | OF_VIEWERS
    wrong = {}
    for route in sorted(named - PUBLIC, key=lambda route: (route == ENDS_ALL, route)):
        # Nothing there exists, so nothing is harmed.
        method, path = re.sub(r"{(\w+)}", lambda part: PARAMETERS.get(part[1], "NO-SUCH"), route).split()
        statuses = {"nobody": api.as_(None).call(method, path).status}
        if path != "/api/events":  # the answer would never end; the events' own tests let people in
            statuses |= {role: caller.call(method, path).status for role, caller in callers.items()}
        refused = {role: status for role, status in statuses.items() if status in (401, 403)}
        below = ROLES[: ROLES.index(needed(route))]
        if refused != {"nobody": 401, **dict.fromkeys(below, 403)}:
            wrong[route] = refused
    assert wrong == {}
