# SPDX-License-Identifier: LGPL-2.1-or-later
"""Who is not known is not read: the credential first, then the body, bounded for each caller and in sum."""

from __future__ import annotations

import json
import select
import socket
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from fastapi.routing import APIRoute
from server_testing import Api, wait_until
from web_visitor import FORM, HTML, enter

from silo.budget import KIB
from silo_server.http.unknown_callers import LETS_IN, MOST_FOR_AN_ADDRESS, UNKNOWN_BODY
from silo_server.routes.call import Guard
from silo_server.routes.requests import BODY, BoundedRoute
from silo_server.run import RunningServer, routers, running_server
from silo_server.settings import Settings

TOKEN = "silo_known"
ROOM = 400 * KIB


@pytest.fixture(name="server")
def _server(url: str, tmp_path: Path) -> Iterator[RunningServer]:
    settings = Settings(database_url=url, max_bodies_bytes=ROOM)
    with running_server(url, token=TOKEN, files_dir=tmp_path, settings=settings) as running:
        yield running


@pytest.fixture(name="api")
def _api(server: RunningServer) -> Iterator[Api]:
    with Api(server.base_url, TOKEN) as caller:
        yield caller


class Half:
    """A request whose body never ends."""

    def __init__(self, server: RunningServer, path: str, headers: dict[str, str], length: int, body: bytes):
        parts = urlsplit(server.base_url)
        self.socket = socket.create_connection((parts.hostname or "", parts.port or 0), timeout=60)
        lines = [f"POST {path} HTTP/1.1", "Host: silo", f"Content-Length: {length}"]
        lines += [f"{name}: {value}" for name, value in headers.items()]
        self.socket.sendall("\r\n".join([*lines, "", ""]).encode() + body)

    def status(self) -> int:
        """The status that comes although the body has not ended."""
        return int(self.socket.recv(65536).split()[1])

    @property
    def is_answered(self) -> bool:
        """The server has answered already, or has hung up."""
        return bool(select.select([self.socket], [], [], 0)[0])

    def __enter__(self) -> Half:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()


def hold_until(opened: ExitStack, half: Callable[[], Half], full: Callable[[], bool]) -> None:
    """Keep half a request open until the server is full.

    A look at the server takes room too: where it came first, the half was refused, and another takes its
    place.
    """
    held = opened.enter_context(half())

    def is_full() -> bool:
        nonlocal held
        if held.is_answered:
            assert held.status() == 503
            held = opened.enter_context(half())
        return full()

    wait_until(is_full, "full")


JSON = {"Content-Type": "application/json"}


@pytest.mark.parametrize(
    "path", ["/api/items", "/api/items/X/bom/merge", "/api/items/X/file", "/api/auth/tokens"]
)
@pytest.mark.parametrize("token", [{}, {"Authorization": "Bearer silo_wrong"}, {"Cookie": "silo_session=no"}])
def test_a_program_that_is_not_known_is_answered_before_its_body(
    server: RunningServer, path: str, token: dict[str, str]
) -> None:
    with Half(server, path, {**JSON, **token}, 15_000_000, b"") as half:
        assert half.status() == 401


def test_a_browser_that_is_not_known_is_answered_before_a_large_form(server: RunningServer) -> None:
    headers = {**FORM, **HTML, "Sec-Fetch-Site": "same-origin"}
    with Half(server, "/items/X/bom/lines", headers, UNKNOWN_BODY + 1, b"") as half:
        assert half.status() == 401
    with Half(server, "/login", {**FORM, "Transfer-Encoding": "identity"}, UNKNOWN_BODY + 1, b"") as half:
        assert half.status() in (400, 413)


def test_a_body_of_unknown_length_is_bounded_where_callers_are_let_in(api: Api) -> None:
    stranger = api.as_(None)

    def endless() -> Iterator[bytes]:
        yield from (b"x" * KIB for _ in range(100))

    for path, kind in (("/login", FORM), ("/api/auth/login", JSON)):
        answer = stranger.call("POST", path, body=endless(), headers=kind)  # type: ignore[arg-type]
        assert answer.status == 413, path


def test_an_address_has_a_few_requests_that_are_not_known(server: RunningServer, api: Api) -> None:
    """The next is refused, those of a known caller are not, and it goes on when the others have ended."""
    body = b'{"username": "x", "password": "y"}'
    with ExitStack() as opened:
        # Only when all others are under way is one refused; which of them, they settle among themselves.
        halves = [
            opened.enter_context(Half(server, "/api/auth/login", JSON, 200, b"{"))
            for _ in range(MOST_FOR_AN_ADDRESS + 1)
        ]
        wait_until(lambda: any(half.is_answered for half in halves), "full")
        assert [half.status() for half in halves if half.is_answered] == [503]
        stranger = api.as_(None)
        answer = stranger.call("POST", "/api/auth/login", body=body, headers=JSON)
        assert (answer.status, "retry-after" in answer.headers) == (503, True)
        assert "without a login" in answer.json()["message"]
        api.item()
    wait_until(
        lambda: stranger.call("POST", "/api/auth/login", body=body, headers=JSON).status in (401, 429), "room"
    )


def test_bodies_that_are_held_are_bounded_for_a_user_and_in_sum(server: RunningServer, api: Api) -> None:
    """Half-sent bodies take half of the room for one user, and all of it for all users."""

    others = []
    for name in ("anna", "bert"):
        api.good("POST", "/api/users", {"username": name, "role": "editor"})
        others.append({**JSON, "Cookie": enter(api, name).cookie})
    half, ours = ROOM // 2, {**JSON, "Authorization": f"Bearer {TOKEN}"}
    with ExitStack() as opened:
        hold_until(
            opened,
            lambda: Half(server, "/api/items", ours, half * 2, b" " * (half - 100)),
            lambda: api.call("POST", "/api/items", body=b" " * 200, headers=JSON).status == 503,
        )
        refused = api.bad(503, "POST", "/api/items", body=b" " * 200, headers=JSON)
        assert (refused["error"], "holds too many requests" in refused["message"]) == ("busy", True)
        # Another user has the other half, and a third none.
        third = api.as_(None)
        hold_until(
            opened,
            lambda: Half(server, "/api/items", others[0], half * 2, b" " * (half - 100)),
            lambda: third.call("POST", "/api/items", body=b" " * 300, headers=others[1]).status == 503,
        )
    wait_until(lambda: api.call("POST", "/api/items", body=b" " * 200, headers=JSON).status == 400, "room")


@pytest.fixture(name="wide")
def _wide(url: str, tmp_path: Path) -> Iterator[Api]:
    with (
        running_server(url, token=TOKEN, files_dir=tmp_path) as running,
        Api(running.base_url, TOKEN) as caller,
    ):
        yield caller


@pytest.mark.parametrize("path", ["/api/items", "/api/items/X/bom/merge", "/api/items/by-uuid"])
def test_json_beyond_the_budget(wide: Api, path: str) -> None:
    body = b"[" + b"{}," * BODY.objects + b"{}]"
    tracemalloc.start()
    try:
        error = wide.bad(413, "POST", path, body=body, headers=JSON)
        held = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert "more than 250000 objects" in error["message"]
    assert held < 12 * len(body)  # 250 000 parsed objects take 64 bytes each, beside the body
    assert wide.bad(400, "POST", path, body=json.dumps([float("nan")]).encode(), headers=JSON)


def test_every_route_with_a_body_is_bounded_and_wants_to_know_its_caller() -> None:
    """A new route cannot forget it: it is bounded, and guarded or named among those that let callers in."""

    def guards(route: APIRoute) -> bool:
        found = [route.dependant]
        for dependant in found:
            found.extend(dependant.dependencies)
        return any(isinstance(dependant.call, Guard) for dependant in found)

    seen = [route for router in routers() for route in router.routes if isinstance(route, APIRoute)]
    assert len(seen) > 100
    for route in seen:
        if route.path.startswith("/api/"):
            assert isinstance(route, BoundedRoute), route.path
        if route.methods & {"POST", "PUT", "PATCH", "DELETE"} and not guards(route):
            assert LETS_IN.fullmatch(route.path), route.path
