# SPDX-License-Identifier: LGPL-2.1-or-later
"""Several servers over one database: events cross, no state in a process that another lacks."""

from __future__ import annotations

import os
import signal
import sqlite3
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from pathlib import Path

import pytest
from hunting import over
from server_testing import Api, Databases, ServerProcess, sqlite_database, wait_until

from silo.bom.errors import ConfigError
from silo.cli.main import main
from silo_server.db.database import Database
from silo_server.db.engine import write_ahead
from silo_server.run import Welcome, _without_password, is_loopback, prepare, running_server, serve
from silo_server.settings import Settings

TOKEN = "silo_several_0123456789abcdef"


@pytest.mark.postgres
def test_notify_carries_events_to_the_other_server(databases: Databases, tmp_path: Path) -> None:
    """PostgreSQL's NOTIFY alone does it: neither server looks by itself within the test's life."""
    url = databases.new("postgres")
    settings = Settings(database_url=url, poll_seconds=3600.0)
    with (
        running_server(url, token=TOKEN, files_dir=tmp_path, settings=settings) as one,
        running_server(url, token=TOKEN, files_dir=tmp_path, settings=settings) as two,
        Api(one.base_url, TOKEN) as here,
        Api(two.base_url, TOKEN) as there,
        there.events() as events,
    ):
        for _ in range(5):
            number = here.item()
            assert events.next("item.created").data["part_number"] == number


@over("sqlite")
def test_the_poll_carries_events_where_nobody_tells(url: str, tmp_path: Path) -> None:
    """Another process over the same file, or a lost notification: the log is looked at anyway."""
    settings = Settings(database_url=url, poll_seconds=0.05)
    with (
        running_server(url, token=TOKEN, files_dir=tmp_path, settings=settings) as one,
        running_server(url, token=TOKEN, files_dir=tmp_path, settings=settings) as two,
        Api(one.base_url, TOKEN) as here,
        Api(two.base_url, TOKEN) as there,
        there.events() as events,
    ):
        number = here.item()
        assert events.next("item.created").data["part_number"] == number


@over("postgres")
def test_what_one_server_did_another_knows(url: str, tmp_path: Path) -> None:
    """Tokens, answers, modes and files are in the database and the store, not in a process."""
    with (
        running_server(url, token=TOKEN, files_dir=tmp_path) as one,
        running_server(url, token=TOKEN, files_dir=tmp_path) as two,
        Api(one.base_url, TOKEN) as here,
        Api(two.base_url, TOKEN) as there,
    ):
        parent, child = here.items(2)
        first = here.merge(parent, {child: 1}, sync_id="crossing")
        there.merge(parent, {child: 2})
        assert there.merge(parent, {child: 1}, sync_id="crossing") == first
        assert here.quantities(parent) == {child: 2}
        made = there.good("POST", "/api/auth/tokens", {"name": "x"})
        mine = here.as_(made["token"])
        assert mine.get("/api/auth/me")["username"] == "admin"
        there.good("DELETE", f"/api/auth/tokens/{made['id']}")
        mine.bad(401, "GET", "/api/auth/me")
        there.good("PUT", "/api/admin/mode", {"mode": "read-only"})
        here.bad(503, "POST", "/api/items", {"part_number": "X", "name": "x"})


@pytest.mark.postgres
@pytest.mark.slow
def test_worker_processes_share_a_socket_events_and_counts(databases: Databases, tmp_path: Path) -> None:
    """``--workers 2``: whichever process a listener is at, it hears what any other did, and counts it."""
    url = databases.new("postgres")
    with (
        ServerProcess(url, tmp_path, TOKEN, workers=2) as server,
        Api(server.base_url, TOKEN) as api,
    ):
        with ExitStack() as stack:
            streams = [stack.enter_context(api.events()) for _ in range(12)]
            for _ in range(5):
                api.forget_connection()
                number = api.item()
                for stream in streams:
                    assert stream.next("item.created").data["part_number"] == number
        for _ in range(30):
            api.forget_connection()
            api.call("GET", "/api/items/none")
        counted = 'silo_requests_total{method="GET",route="/api/items/{part_number}",status="404"} 30'
        assert counted in api.call("GET", "/metrics").body.decode().replace("30.0", "30")
        assert server.stop() == 0


@pytest.mark.slow
def test_workers_end_with_their_parent(tmp_path: Path) -> None:
    """A parent that was killed leaves no workers behind that serve on."""
    server = ServerProcess(sqlite_database(tmp_path / "x.db"), tmp_path, TOKEN, workers=2)
    with Api(server.base_url, TOKEN) as api:
        api.item()
        server.kill()

        def gone() -> bool:
            api.forget_connection()
            try:
                api.call("GET", "/health")
            except OSError:
                return True
            return False

        wait_until(gone, "the end of the workers")


@pytest.mark.parametrize("by", [signal.SIGTERM, signal.SIGINT])
def test_a_server_ends_when_it_is_asked_to_though_somebody_listens(
    tmp_path: Path, by: signal.Signals
) -> None:
    """SIGTERM or Ctrl-C with open event streams: they are ended, the exit is clean."""
    start = ServerProcess if by == signal.SIGINT else ServerProcess.forked
    with (
        start(sqlite_database(tmp_path / "x.db"), tmp_path, TOKEN) as server,
        Api(server.base_url, TOKEN) as api,
        api.events() as events,
    ):
        api.item()
        events.next("item.created")
        code = server.stop(by)
        with pytest.raises(AssertionError, match="the stream ended"):
            events.next("never")
    assert code in ((0, -signal.SIGTERM) if by == signal.SIGTERM else (0,))


def test_two_servers_may_start_at_once(empty_url: str, tmp_path: Path) -> None:
    """Both bring the new database up to date; one waits for the other."""
    gate = threading.Barrier(2)

    def start(_: int) -> Welcome:
        db = Database(Settings(database_url=empty_url, files_dir=tmp_path))
        gate.wait(60)
        try:
            return prepare(db, TOKEN)
        finally:
            db.close()

    with ThreadPoolExecutor(2) as pool:
        assert [(one.username, one.token) for one in pool.map(start, range(2))] == [("admin", TOKEN)] * 2


def test_a_new_database_that_another_server_writes_to_is_waited_for(tmp_path: Path) -> None:
    """SQLite does not wait before it changes the journal; a start does, and not without end."""
    path = tmp_path / "new.db"
    with (
        closing(sqlite3.connect(path, isolation_level=None)) as other,
        closing(sqlite3.connect(path, isolation_level=None, timeout=0)) as own,
    ):
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(sqlite3.OperationalError, match="locked"):
            write_ahead(own, seconds=0)
        pauses: list[float] = []

        def pause(seconds: float) -> None:
            pauses.append(seconds)
            other.execute("COMMIT")

        write_ahead(own, pause=pause)
        assert len(pauses) == 1
        assert own.execute("PRAGMA journal_mode").fetchone() == ("wal",)


def test_what_cannot_be_served_is_one_plain_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A port that is taken, a database that is none, no workers: exit code 2, no stack trace."""
    url = sqlite_database(tmp_path / "x.db")
    with running_server(url, token=TOKEN, files_dir=tmp_path) as running:
        port = running.base_url.rpartition(":")[2]
        assert main(["serve", "--port", port, "--database", url]) == 2
    assert "cannot listen" in capsys.readouterr().err
    assert main(["serve", "--database", "sqlite://"]) == 2
    assert "sqlite:///path" in capsys.readouterr().err
    with pytest.raises(ConfigError, match="workers"):
        serve(database_url=url, workers=0)


def test_the_greeting_has_no_password() -> None:
    """The database is named without its password."""
    settings = Settings(database_url="postgresql://silo:hunter2@db/silo")
    assert "hunter2" not in _without_password(settings)


def test_loopback() -> None:
    """Only what no other machine reaches counts."""
    told = {
        host: is_loopback(host)
        for host in ("127.0.0.1", "::1", "localhost", "0.0.0.0", "::", "10.0.0.1", "h")
    }
    assert [host for host, yes in told.items() if yes] == ["127.0.0.1", "::1", "localhost"]


def test_no_token_in_a_log(tmp_path: Path) -> None:
    """Neither requests nor failures write tokens, links or passwords anywhere."""
    read, write = os.pipe()
    with os.fdopen(read) as log:
        saved = os.dup(2)
        os.dup2(write, 2)
        os.close(write)
        try:
            with (
                ServerProcess(
                    sqlite_database(tmp_path / "x.db"), tmp_path, "silo_secret_token_0123456789"
                ) as server,
                Api(server.base_url, "silo_secret_token_0123456789") as api,
            ):
                api.get("/api/items")
                api.bad(401, "POST", "/api/auth/login", {"username": "x", "password": "secret-password"})
                api.call("GET", "/login/link/secret-link")
        finally:
            os.dup2(saved, 2)
            os.close(saved)
        text = log.read()
    assert "secret" not in text
