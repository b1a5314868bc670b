# SPDX-License-Identifier: LGPL-2.1-or-later
"""What an administrator meets: balancers, warnings at the start, full disks, streams and uploads that end."""

from __future__ import annotations

import asyncio
import errno
import json
import socket
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from fastapi import Request
from hunting import over
from server_testing import Api, ServerProcess, run_alone, sqlite_database
from sqlalchemy.exc import InternalError, OperationalError
from starlette.types import Message
from web_visitor import Visitor, enter

from silo_server.db.database import Database
from silo_server.db.migrate import upgrade
from silo_server.events.hub import Hub
from silo_server.events.stream import EventResponse
from silo_server.http.errors import _database_error, _disk_error
from silo_server.run import running_server, start_warnings
from silo_server.settings import MIB, Settings

TOKEN = "silo_operation_0123456789"


@pytest.mark.parametrize("path", ["/health", "/ready"])
def test_balancers_may_look_in_their_own_way(api: Api, path: str) -> None:
    """HEAD and OPTIONS, without a token."""
    nobody = api.as_(None)
    assert nobody.call("GET", path).status == 200
    head = nobody.call("HEAD", path)
    assert head.status in (200, 204)
    assert head.body == b""
    options = nobody.call("OPTIONS", path)
    assert (options.status, options.headers["allow"]) == (204, "GET, HEAD, OPTIONS")


@pytest.mark.parametrize(
    ("settings", "loopback", "words"),
    [
        ({}, True, ()),
        ({}, False, ("SILO_PUBLIC_URL is not set",)),
        ({"public_url": "http://silo.example.com"}, False, ()),
        ({"public_url": "https://silo.example.com"}, True, ("SILO_SECURE_COOKIES is off",)),
        ({"public_url": "https://silo.example.com", "secure_cookies": True}, True, ()),
        ({"trusted_proxies": "*"}, True, ("SILO_TRUSTED_PROXIES is *",)),
    ],
)
def test_wrong_settings_are_said_at_the_start(
    tmp_path: Path, settings: dict[str, object], loopback: bool, words: tuple[str, ...]
) -> None:
    """Each in a sentence that says what to do."""
    values = {"database_url": f"sqlite:///{tmp_path / 'x.db'}", **settings}
    said = start_warnings(Settings(**values), loopback, 1024 * MIB)  # type: ignore[arg-type]
    assert len(said) == len(words)
    assert all(word in sentence for word, sentence in zip(words, said, strict=True))


def test_a_disk_with_little_room_is_said_at_the_start(tmp_path: Path) -> None:
    """Which folder it holds and how much is left, below 1 GiB."""
    settings = Settings(database_url=f"sqlite:///{tmp_path / 'x.db'}", files_dir=tmp_path)
    (warning,) = start_warnings(settings, True, 1024 * MIB - 1)
    assert warning.startswith(f"The disk of {tmp_path} has 1023 MiB left: make room")


@pytest.mark.parametrize(
    ("error", "full"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), True),
        (OSError(errno.EDQUOT, "Disk quota exceeded"), True),
        (OSError(errno.EIO, "Input/output error"), False),
        (OperationalError("", {}, Exception("database or disk is full")), True),
        (OperationalError("", {}, Exception("could not extend file: No space left on device")), True),
        (OperationalError("", {}, Exception("connection refused")), False),
        (InternalError("", {}, Exception("idle for too long"), connection_invalidated=True), False),
    ],
)
def test_a_full_disk_is_said_as_that(error: Exception, full: bool) -> None:
    """Whether SQLite, PostgreSQL or the store of files meets it: 503, and what to do."""
    request = Request({"type": "http", "method": "POST", "path": "/", "headers": [], "state": {}})
    handle = _disk_error if isinstance(error, OSError) else _database_error
    answer = run_alone(handle(request, error))
    assert answer.status_code == 503
    assert ("disk is full" in json.loads(bytes(answer.body))["message"]) == full


@over("sqlite")
@pytest.mark.parametrize("of_session", [False, True])
def test_a_stream_ends_with_its_credential(url: str, tmp_path: Path, of_session: bool) -> None:
    """At once, and not with the next heartbeat; others go on."""
    settings = Settings(database_url=url, heartbeat_seconds=3600)
    with (
        running_server(url, token=TOKEN, files_dir=tmp_path, settings=settings) as server,
        Api(server.base_url, TOKEN) as api,
    ):
        made = api.good("POST", "/api/auth/tokens", {"name": "brief"})
        proof = f"Authorization: Bearer {made['token']}"
        if of_session:
            person = {"username": "eve", "password": "a long password"}
            api.good("POST", "/api/users", person)
            begun = api.as_(None).call("POST", "/api/auth/login", person)
            proof = f"Cookie: {begun.headers['set-cookie'].partition(';')[0]}"
        parts = urlsplit(server.base_url)
        with (
            socket.create_connection((parts.hostname, parts.port), timeout=60) as stream,
            api.events() as mine,
        ):
            stream.sendall(f"GET /api/events HTTP/1.1\r\nHost: x\r\n{proof}\r\n\r\n".encode())
            assert stream.recv(65536).startswith(b"HTTP/1.1 200")
            if of_session:
                api.good("PUT", "/api/users/eve", {"password": "another password"})
            else:
                api.good("DELETE", f"/api/auth/tokens/{made['id']}")
            while data := stream.recv(65536):
                if data.endswith(b"0\r\n\r\n"):
                    break
            number = api.item()
            assert mine.next("item.created").data["part_number"] == number


def test_a_stream_ends_if_its_credential_went_before_it_began(tmp_path: Path) -> None:
    """Between the check of the request and the first byte; the next heartbeat may be an hour away."""
    db = Database(Settings(database_url=f"sqlite:///{tmp_path / 'x.db'}", heartbeat_seconds=3600))
    upgrade(db)
    sent: list[Message] = []

    async def run() -> None:
        hub = Hub(db)
        await hub.start()

        async def send(message: Message) -> None:
            sent.append(message)

        stream = EventResponse(hub, None, still_allowed=lambda: False)
        try:
            await asyncio.wait_for(stream({"type": "http"}, asyncio.Event().wait, send), 60)  # type: ignore[arg-type]
        finally:
            await hub.stop()

    run_alone(run())
    db.close()
    assert sent[-1] == {"type": "http.response.body", "body": b"", "more_body": False}


def test_half_an_upload_does_not_hold_a_server_that_stops(tmp_path: Path) -> None:
    """It is told so, and the server ends in good order."""
    with ServerProcess(sqlite_database(tmp_path / "x.db"), tmp_path, TOKEN) as server:
        with Api(server.base_url, TOKEN) as api:
            number = api.item()
        parts = urlsplit(server.base_url)
        with socket.create_connection((parts.hostname, parts.port), timeout=60) as upload:
            head = (
                f"POST /api/items/{number}/file HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {TOKEN}\r\n"
                "Content-Type: multipart/form-data; boundary=b\r\nContent-Length: 100000\r\n\r\n--b\r\n"
            )
            upload.sendall(head.encode())
            with Api(server.base_url, TOKEN) as api:
                api.get("/api/items")  # the upload is under way by then
            assert server.stop() == 0
            answer = upload.recv(65536)
    assert answer.startswith(b"HTTP/1.1 503")
    assert b"the server is stopping" in answer


def test_archiving_a_part_in_use_says_where(api: Api) -> None:
    """The first of the assemblies by their numbers, and how many more there are."""
    child, *parents = api.items(8)
    for parent in parents:
        api.merge(parent, {child: 1})
    visitor: Visitor = enter(api, "admin")
    version = str(api.get(f"/api/items/{child}")["version"])
    answer = visitor.post(f"/items/{child}/archive", version=version)
    cookie = f"{visitor.cookie}; {answer.headers['set-cookie'].split(';')[0]}"
    shown = visitor.api.call("GET", answer.headers["location"], headers={"Cookie": cookie})
    page = shown.body.decode()
    assert "It stays in the BOM of" in page
    assert "and 2 more" in page
