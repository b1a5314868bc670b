# SPDX-License-Identifier: LGPL-2.1-or-later
"""While one waits, the others continue: foreign locks, locked rows, a frozen PostgreSQL, another database."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import socket
import sqlite3
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NoReturn

import psycopg
import pytest
from hunting import over
from server_testing import Api, Databases, bom, run_alone, wait_until
from sqlalchemy import make_url

from silo.bom.errors import RejectedError
from silo_server.db.database import WRITERS_WAITING, Database
from silo_server.db.transaction import Tx
from silo_server.later import Later
from silo_server.probe import Probe
from silo_server.run import running_server
from silo_server.services.access.tokens import actor_by_token, list_tokens, note_token_uses
from silo_server.services.file_store import FileStore
from silo_server.settings import Settings

TOKEN = "silo_waiting"
READ_EVENTS = "SELECT id, name, item_uuid, part_number_key, data, at FROM events ORDER BY id"
WRITE_EVENT = (
    "INSERT INTO events (id, name, item_uuid, part_number_key, data, at) VALUES (%s, %s, %s, %s, %s, %s)"
)


@contextlib.contextmanager
def locked_against_writers(url: str) -> Iterator[None]:
    """Another process holds what every writer needs: SQLite's write lock, or the rows on PostgreSQL."""
    if url.startswith("sqlite"):
        other = sqlite3.connect(url.removeprefix("sqlite:///"), isolation_level=None, check_same_thread=False)
        other.execute("BEGIN IMMEDIATE")
        try:
            yield
        finally:
            other.execute("ROLLBACK")
            other.close()
        return
    plain = make_url(url).set(drivername="postgresql").render_as_string(hide_password=False)
    with psycopg.connect(plain) as connection:
        connection.execute("SELECT 1 FROM items FOR UPDATE")
        connection.execute("LOCK TABLE api_tokens, audit IN SHARE MODE")
        yield
        connection.rollback()


def test_reads_and_health_go_on_while_writers_wait(url: str, tmp_path: Path) -> None:
    """So many writers that every place is taken: reads are answered, further writers are sent away."""
    with (
        running_server(url, token=TOKEN, files_dir=tmp_path) as server,
        Api(server.base_url, TOKEN) as api,
    ):
        parent, child = api.items(2)
        statuses: list[tuple[int, str]] = []

        def write(number: int) -> None:
            with Api(server.base_url, TOKEN) as mine:
                body = {"child_part_number": child, "quantity": number + 1}
                answer = mine.call("POST", bom(parent), body)
                statuses.append((answer.status, answer.headers.get("retry-after", "")))

        count = WRITERS_WAITING + 30
        threads = [threading.Thread(target=write, args=(n,)) for n in range(count)]
        with locked_against_writers(url):
            for thread in threads:
                thread.start()
            wait_until(lambda: len(statuses) > 0, "a writer being sent away")
            assert {status for status, _ in statuses} == {503}
            assert all(retry for _, retry in statuses)
            # Most of the writers hold a thread now, and wait. Nobody who reads notices.
            assert sum(thread.is_alive() for thread in threads) > 20
            for path in ("/health", "/ready", f"/api/items/{parent}", "/api/items", bom(parent)):
                assert api.call("GET", path).status == 200
            assert sum(thread.is_alive() for thread in threads) > 20
        for thread in threads:
            thread.join(90)
        assert {status for status, _ in statuses} <= {201, 409, 503}
        assert len(statuses) == count
        assert api.call("PUT", f"/api/items/{parent}", {"name": "free again"}).status == 200


@over("sqlite")
def test_many_may_ask_for_the_health_at_once(db: Database, tmp_path: Path) -> None:
    """One look serves all who wait for it, while others begin the next."""
    probe = Probe(db, FileStore(tmp_path))

    async def ask() -> None:
        for _ in range(20):
            state = await probe.look(30)
            assert state is not None
            assert state.ready

    async def ask_together() -> None:
        await asyncio.gather(*(ask() for _ in range(8)))

    run_alone(ask_together())
    probe.stop()


@over("sqlite")
def test_the_last_use_of_a_token_is_noted_when_it_can_be(db: Database) -> None:
    """Reading with a token needs no write; what could not be noted is noted later."""
    with db.read() as tx:
        token = list_tokens(tx)[0]
    assert actor_by_token(db, "silo_test", "") is not None
    assert list(db.token_uses) == [token.id]
    with db.read() as tx:
        assert list_tokens(tx)[0].last_used_at is None
    note_token_uses(db)
    assert db.token_uses == {}
    with db.read() as tx:
        assert list_tokens(tx)[0].last_used_at is not None


class Meanwhile(Database):
    """Something happens while a change is written down."""

    then: Callable[[], object]

    @contextlib.contextmanager
    def write(self, *more: Any, **named: Any) -> Iterator[Tx]:
        with super().write(*more, **named) as tx:
            yield tx
            self.then()


@over("sqlite")
def test_a_use_that_comes_while_others_are_written_down_is_noted_next(db: Database) -> None:
    """It is not taken for one of them."""
    busy = Meanwhile(db.settings)
    busy.token_uses[1] = "2026-01-01"
    busy.then = lambda: busy.token_uses.update({1: "2026-01-02"})
    for left, noted in (({1: "2026-01-02"}, "2026-01-01"), ({}, "2026-01-02")):
        note_token_uses(busy)
        with busy.read() as tx:
            assert (list_tokens(tx)[0].last_used_at, busy.token_uses) == (noted, left)
    busy.close()


@over("sqlite")
def test_what_no_request_waits_for_is_tried_again_after_any_error(
    db: Database, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its thread lives on, also after an error that nobody thought of."""
    monkeypatch.setattr("silo_server.later.LATER_SECONDS", 0.0)
    busy = Meanwhile(db.settings)
    tried: list[int] = []

    def fail() -> None:
        tried.append(1)
        raise ZeroDivisionError

    busy.then = fail
    busy.token_uses[1] = "2026-01-01"
    later = Later(busy)
    later.start()
    wait_until(lambda: len(tried) > 1, "another try")
    later.stop()
    later._thread.join(60)
    assert "cannot be kept" in caplog.text
    busy.close()


def test_a_server_that_stops_does_not_wait_for_a_write_that_hangs(tmp_path: Path) -> None:
    """A supervisor kills a service that takes long to stop; the last use of a token is not worth that."""
    trying, free = threading.Event(), threading.Event()

    class Stuck(Database):
        def write(self, *_: object, **__: object) -> NoReturn:
            trying.set()
            free.wait(60)
            raise RejectedError("nothing can be written")

    db = Stuck(Settings(database_url=f"sqlite:///{tmp_path / 'x.db'}"))
    db.token_uses[1] = "2026"
    uses = Later(db)
    uses.start()
    assert trying.wait(60)
    uses.stop()
    assert any(thread.name == "silo-later" for thread in threading.enumerate())
    free.set()
    db.close()


@pytest.mark.postgres
@pytest.mark.usefixtures("needs_signals")
def test_a_frozen_postgres_stops_neither_health_nor_us(databases: Databases, tmp_path: Path) -> None:
    """Every process of the database stopped: health answers, ready says no, a request ends with 503."""
    url = databases.new("postgres")
    with (
        running_server(url, token=TOKEN, files_dir=tmp_path) as server,
        Api(server.base_url, TOKEN) as api,
    ):
        number = api.item()
        plain = make_url(url).set(drivername="postgresql").render_as_string(hide_password=False)
        with psycopg.connect(plain) as connection:
            query = "SELECT pid FROM pg_stat_activity WHERE datname = current_database() AND pid <> %s"
            mine = connection.info.backend_pid
            backends = [pid for (pid,) in connection.execute(query, (mine,))]
            status = Path(f"/proc/{mine}/status").read_text()
        # Without the one that starts new ones they could be replaced.
        backends.append(int(status.partition("PPid:")[2].split()[0]))
        stopped = []
        for pid in backends:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGSTOP)
                stopped.append(pid)
        try:
            assert api.call("GET", "/health").status == 200
            ready = api.call("GET", "/ready")
            assert (ready.status, ready.json()["database"]) == (503, "unreachable")
            assert api.call("GET", f"/api/items/{number}").status == 503
        finally:
            for pid in stopped:
                os.kill(pid, signal.SIGCONT)
        wait_until(lambda: api.call("GET", f"/api/items/{number}").status == 200, "a read after the thaw")
        wait_until(lambda: api.call("GET", "/ready").status == 200, "being ready after the thaw")


class LosesAnswers:
    """A way to PostgreSQL that hangs up where the answer to the COMMIT of a new BOM line should come."""

    def __init__(self, url: str) -> None:
        given = make_url(url)
        self._target = f"{given.query['host']}/.s.PGSQL.{given.port or 5432}"
        self.lost = 0
        self._open = [socket.create_server(("127.0.0.1", 0))]
        port = self._open[0].getsockname()[1]
        self.url = given.set(host="127.0.0.1", port=port, query={}).render_as_string(hide_password=False)
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self) -> None:
        """Hang up everywhere, and let nobody in any more."""
        for each in self._open:
            with contextlib.suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)
            each.close()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                client, _ = self._open[0].accept()
                server = socket.socket(socket.AF_UNIX)
                self._open += [client, server]
                server.connect(self._target)
                writes = threading.Event()
                threading.Thread(target=self._ask, args=(client, server, writes), daemon=True).start()
                threading.Thread(target=self._answer, args=(server, client, writes), daemon=True).start()

    def _ask(self, client: socket.socket, server: socket.socket, writes: threading.Event) -> None:
        with contextlib.suppress(OSError):
            while data := client.recv(65536):
                if b"INSERT INTO bom_lines" in data:
                    writes.set()
                server.sendall(data)
            server.shutdown(socket.SHUT_RDWR)

    def _answer(self, server: socket.socket, client: socket.socket, writes: threading.Event) -> None:
        with contextlib.suppress(OSError):
            while data := server.recv(65536):
                if writes.is_set() and b"COMMIT\0" in data:  # the tag of the server's word that it is done
                    self.lost += 1
                    break
                client.sendall(data)
            client.shutdown(socket.SHUT_RDWR)


@pytest.mark.postgres
def test_a_commit_whose_answer_was_lost_is_not_denied(databases: Databases, tmp_path: Path) -> None:
    """503 that says it may be stored; no ``Retry-After``, which clients take as "send it again"."""
    way = LosesAnswers(databases.new("postgres"))
    with (
        running_server(way.url, token=TOKEN, files_dir=tmp_path) as server,
        Api(server.base_url, TOKEN) as api,
    ):
        parent, child = api.items(2)
        answer = api.call("POST", bom(parent), {"child_part_number": child, "quantity": 2})
        assert way.lost == 1
        assert (answer.status, answer.json()["error"]) == (503, "unavailable")
        assert "may be stored" in answer.json()["message"]
        assert "retry-after" not in answer.headers
        assert api.quantities(parent) == {child: 2}  # and stored it was
    way.close()


def put_back(url: str, saved: Path, *, save: bool) -> None:
    """Save the database as an administrator does without us, or put it back behind a running server."""
    if url.startswith("sqlite"):
        path = url.removeprefix("sqlite:///")
        source, target = (path, saved) if save else (saved, path)
        with (
            contextlib.closing(sqlite3.connect(source)) as old,
            contextlib.closing(sqlite3.connect(target)) as new,
        ):
            old.backup(new)
        return
    plain = make_url(url).set(drivername="postgresql").render_as_string(hide_password=False)
    # The tables that matter here: the log, and what gives out its numbers.
    with psycopg.connect(plain) as connection:
        if save:
            saved.write_text(json.dumps(connection.execute(READ_EVENTS).fetchall()))
            return
        rows = json.loads(saved.read_text())
        connection.execute("DELETE FROM events")
        for row in rows:
            connection.execute(WRITE_EVENT, row)
        connection.execute("SELECT setval(pg_get_serial_sequence('events', 'id'), %s)", (rows[-1][0],))


def test_a_database_put_back_behind_listeners_is_a_reset(url: str, tmp_path: Path) -> None:
    """Whether they listen or come back, and although the log has passed their id again since."""
    settings = Settings(database_url=url, files_dir=tmp_path / "files", poll_seconds=0.05)
    with (
        running_server(url, token=TOKEN, settings=settings) as server,
        Api(server.base_url, TOKEN) as api,
        api.events() as stream,
    ):
        before = api.item()
        assert stream.next("item.created").data["part_number"] == before
        put_back(url, tmp_path / "saved", save=True)
        known = [api.item() for _ in range(3)]
        last = stream.next("item.created")
        while last.data["part_number"] != known[-1]:
            last = stream.next("item.created")
        put_back(url, tmp_path / "saved", save=False)
        assert stream.next("reset")
        for _ in range(5):
            new = api.item()
        while stream.next("item.created").data["part_number"] != new:
            pass
        with api.events(last_event_id=last.mark) as again:
            assert again.next().name == "reset"
        with api.events() as now:
            api.item()
            mark = now.next("item.created").mark
        with api.events(last_event_id=mark) as same:
            later = api.item()
            event = same.next()
            assert (event.name, event.data["part_number"]) == ("item.created", later)
