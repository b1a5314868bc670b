# SPDX-License-Identifier: LGPL-2.1-or-later
"""One shape for every error, limits, headers."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from server_testing import Api, Databases, bom, form_body, merge_body

from silo.api.wire import ErrorBody
from silo_server.run import RunningServer, running_server
from silo_server.settings import Settings


def test_every_error_has_the_one_shape(api: Api) -> None:
    """Also those of the framework: machine code, plain message, nothing of our insides."""
    for method, path, status in (
        ("GET", "/nothing", 404),
        ("GET", "/api/nothing", 404),
        ("GET", "/api/items/NO-SUCH", 404),
        ("PATCH", "/api/items", 405),
        ("GET", "/api/items?limit=x", 400),
        ("GET", "/api/items?limit=0", 400),
        ("GET", "/api/items/NO-SUCH%00", 404),
        ("GET", "/api/items/" + "x" * 3000, 404),
        ("POST", "/api/items", 400),
        ("DELETE", "/api/items/NO-SUCH", 404),
    ):
        error = ErrorBody.model_validate(api.bad(status, method, path))
        assert error.message
        for inside in ("Traceback", "sqlalchemy", "psycopg", "sqlite", 'File "'):
            assert inside not in error.message


def test_a_missing_route_is_kept_apart_from_a_missing_item(api: Api) -> None:
    """A client must not take "no such route" for "not registered"."""
    assert api.bad(404, "GET", "/api/nothing")["error"] == "no_route"
    assert api.bad(405, "POST", "/api/events")["error"] == "no_route"
    assert api.bad(404, "GET", "/api/items/NO-SUCH")["error"] == "not_found"


def test_a_bad_body_is_reported_field_by_field(api: Api) -> None:
    """400 with every problem, each with its place."""
    error = api.bad(400, "POST", bom(api.item()), {"quantity": "x", "reference_designators": 5})
    places = {problem.split(":")[0] for problem in error["problems"]}
    assert places == {"child_part_number", "quantity", "reference_designators"}


def test_security_headers_are_on_every_answer(api: Api) -> None:
    """Strict CSP without inline scripts, no sniffing, no framing; on errors and pages too."""
    for path in ("/health", "/nothing", "/api/items", "/login"):
        headers = api.call("GET", path).headers
        policy = headers["content-security-policy"]
        assert "unsafe-inline" not in policy
        assert "script-src 'self'" in policy
        assert "frame-ancestors 'none'" in policy
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["x-frame-options"] == "DENY"
        assert headers["referrer-policy"] == "same-origin"


@pytest.fixture(scope="module")
def small(
    kind: str, databases: Databases, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[RunningServer]:
    """A server with narrow limits."""
    url, tmp_path = databases.new(kind), tmp_path_factory.mktemp("small")
    settings = Settings(
        database_url=url,
        max_body_bytes=2048,
        max_file_bytes=100_000,
        max_merge_entries=5,
        max_expanded_rows=3,
    )
    with running_server(url, token="silo_small", files_dir=tmp_path, settings=settings) as running:
        yield running


def test_limits_are_413_and_say_what_they_are(small: RunningServer) -> None:
    """Entries, body, file and tree each have a limit; the message names it."""
    with Api(small.base_url, "silo_small") as api:
        parent, *children = api.items(7)
        many = merge_body(dict.fromkeys(children, 1))
        for entry in many["entries"]:
            del entry["source"]
        assert "at most 5" in api.bad(413, "POST", bom(parent, "merge"), many)["message"]
        big = b'{"name": "' + b"x" * 3000 + b'"}'
        error = api.bad(413, "POST", "/api/items", body=big, headers={"Content-Type": "application/json"})
        assert error["error"] == "too_large"
        assert "(2 KiB)" in error["message"]
        api.forget_connection()
        body, headers = form_body({"file": ("a", b"x" * 99_000)})
        path = f"/api/items/{parent}/file"
        assert api.call("POST", path, body=body, headers=headers).status == 201
        body, headers = form_body({"file": ("a", b"x" * 300_000)})
        assert api.call("POST", path, body=body, headers=headers).status == 413
        api.forget_connection()
        api.merge(parent, dict.fromkeys(children[:4], 1))
        assert "depth=" in api.bad(413, "GET", bom(parent, "expanded"))["message"]


def test_a_body_without_a_declared_length_is_counted(small: RunningServer) -> None:
    """Chunked bodies have no Content-Length; they are stopped where they pass the limit."""
    import http.client
    from urllib.parse import urlsplit

    parts = urlsplit(small.base_url)
    connection = http.client.HTTPConnection(parts.hostname or "", parts.port, timeout=60)
    headers = {"Authorization": "Bearer silo_small", "Content-Type": "application/json"}
    chunks = iter([b'{"name": "', b"x" * 1500, b"x" * 1500, b'"}'])
    connection.request("POST", "/api/items", body=chunks, headers=headers, encode_chunked=True)
    response = connection.getresponse()
    assert response.status == 413
    response.read()
    connection.close()


def test_nobody_without_a_role_fills_the_disk(small: RunningServer) -> None:
    """An upload without a token is refused and leaves nothing behind."""
    with Api(small.base_url, None) as api:
        body, headers = form_body({"file": ("a", b"x" * 50_000)})
        assert api.call("POST", "/api/items/X/file", body=body, headers=headers).status == 401
    assert [p for p in small.settings.storage.rglob("*") if p.is_file() and p.stat().st_size == 50_000] == []


def test_modules_and_health(api: Api) -> None:
    """What this server can do, for clients that ask; health needs no token."""
    assert api.get("/api/modules")["modules"]["bom_merge"] == {"enabled": True}
    stranger = api.as_(None)
    assert stranger.get("/health") == {"status": "ok", "mode": "normal"}
    ready = stranger.get("/ready")
    assert (ready["status"], ready["database"], ready["freecad"]) == ("ready", "ok", "")
    stranger.bad(401, "GET", "/api/modules")
