# SPDX-License-Identifier: LGPL-2.1-or-later
"""The dispatcher: slow clients neither block others nor lose anything; the ring and the log are one."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from hunting import over
from server_testing import Api

from silo_server.db.database import Database
from silo_server.events import log
from silo_server.events.hub import RING_EVENTS
from silo_server.run import RunningServer, running_server
from silo_server.user_json import dumps
from silo_server.values import NewEvent

pytestmark = over("sqlite")
TOKEN = "silo_hub"


@pytest.fixture
def server(url: str, tmp_path: Path) -> Iterator[RunningServer]:
    """A server of its own."""
    with running_server(url, token=TOKEN, files_dir=tmp_path) as running:
        yield running


def emit(db: Database, first: int, count: int, padding: int = 0) -> None:
    """Write ``count`` events that are numbered from ``first``, in one transaction."""
    with db.write() as tx:
        for n in range(first, first + count):
            tx.emit(NewEvent("test", dumps({"n": n, "pad": "x" * padding})))


def test_a_slow_client_blocks_nobody_and_loses_nothing(server: RunningServer) -> None:
    """One reads nothing while more is announced than socket and ring can hold; then it reads it all."""
    db: Database = server.app.state.server.db
    parts = urlsplit(server.base_url)
    with Api(server.base_url, TOKEN) as api, api.events() as quick:
        slow = socket.create_connection((parts.hostname, parts.port or 80), timeout=30)
        request = f"GET /api/events HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {TOKEN}\r\n\r\n"
        slow.sendall(request.encode())
        file = slow.makefile("rb")
        while file.readline() != b": connected\n":
            pass
        batches, size = 12, RING_EVENTS // 4
        for batch in range(batches):
            emit(db, batch * size, size, padding=2000)
            assert [quick.next("test").data["n"] for _ in range(size)][-1] == (batch + 1) * size - 1
        seen: list[int] = []
        while len(seen) < batches * size:
            line = file.readline()
            assert line, "the slow client was hung up on"
            if line.startswith(b'data: {"n":'):
                seen.append(int(line.split(b":")[2].split(b",")[0]))
        file.close()
        slow.close()
    assert seen == list(range(batches * size))


def test_a_client_far_behind_is_served_from_the_log(server: RunningServer) -> None:
    """More was missed than the ring holds: it comes from the database, in order, then live."""
    db: Database = server.app.state.server.db
    with Api(server.base_url, TOKEN) as api:
        with api.events() as stream:
            emit(db, 0, 1)
            start = stream.next("test").id
        count = RING_EVENTS + 700
        emit(db, 1, count)
        with api.events("", start) as stream:
            seen = [stream.next("test").data["n"] for _ in range(count)]
            emit(db, count + 1, 1)
            seen.append(stream.next("test").data["n"])
    assert seen == list(range(1, count + 2))


def test_the_log_is_trimmed_to_its_size_and_remembers_how_far(db: Database) -> None:
    """Old events go, ids never come again, the horizon says where the log begins."""
    emit(db, 0, 30)
    with db.write() as tx:
        horizon, head = log.bounds(tx)
        assert log.trim(tx, 10) == head - 10
        assert log.trim(tx, 10) == 0
    with db.read() as tx:
        assert log.bounds(tx) == (head - 10, head)
        assert [event.id for event in log.read_after(tx, 0)] == list(range(head - 9, head + 1))
    with db.write() as tx:
        log.trim(tx, 0)
    emit(db, 30, 1)
    with db.read() as tx:
        assert log.bounds(tx) == (head, head + 1)
    assert horizon == 0


def test_an_event_of_a_failed_transaction_never_was(db: Database) -> None:
    """Events are in the transaction: no commit, no event."""
    with db.read() as tx:
        before = log.bounds(tx)[1]

    def fail() -> None:
        with db.write() as tx:
            tx.emit(NewEvent("test", "{}"))
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    with db.read() as tx:
        assert log.read_after(tx, before) == []
