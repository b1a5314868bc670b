# SPDX-License-Identifier: LGPL-2.1-or-later
"""A fault of ours is reported in one sentence; what is wrong goes to the log only."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from server_testing import Answer, Api, sqlite_database
from sqlalchemy import event
from sqlalchemy.exc import DataError, DisconnectionError, IntegrityError, OperationalError

from silo_server.actors import Role
from silo_server.db.database import Database
from silo_server.run import RunningServer, create_app, prepare, running_server
from silo_server.services.access.users import list_users
from silo_server.settings import Settings


def failing(server: RunningServer, api: Api, error: Exception) -> Answer:
    """Ask a route that raises this."""

    def fail() -> None:
        raise error

    server.app.add_api_route("/fail", fail)
    server.app.router.routes.insert(0, server.app.router.routes.pop())
    return api.call("GET", "/fail")


@pytest.mark.parametrize(
    ("error", "status", "code"),
    [
        (ZeroDivisionError("secret inside"), 500, "server_fault"),
        (OperationalError("SELECT secret inside", {}, Exception("x")), 503, "busy"),
        (DataError("INSERT secret inside", {}, Exception("x")), 400, "rejected"),
        (IntegrityError("INSERT secret inside", {}, Exception("x")), 409, "conflict"),
        (OSError(28, "No space left on secret"), 503, "busy"),
        (UnicodeEncodeError("utf-8", "secret inside", 0, 1, "lone"), 400, "rejected"),
    ],
)
def test_what_goes_wrong_inside_stays_inside(
    server: RunningServer,
    api: Api,
    error: Exception,
    status: int,
    code: str,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Whatever a route raises becomes the one shape; neither SQL nor stack trace reaches the client.

    A fault of ours has one trace in the log, under the id that the client sees.
    """
    answer = failing(server, api, error)
    said, number = answer.json(), answer.headers["x-request-id"]
    assert (answer.status, said["error"], "secret" in str(said)) == (status, code, False)
    traces = [number in record.getMessage() for record in caplog.records if record.exc_info]
    assert status != 500 or (traces, number in said["message"]) == ([True], True)


def test_the_log_names_the_request_and_what_the_database_said(
    server: RunningServer, api: Api, caplog: pytest.LogCaptureFixture
) -> None:
    """The id is the one that the client sees; values and SQL stay out of the log."""
    answer = failing(
        server, api, OperationalError("SELECT secret inside", {}, Exception("disk I/O error\nmore"))
    )
    assert f"request {answer.headers['x-request-id']}: the database: disk I/O error" in caplog.messages
    assert "secret" not in caplog.text


def connect_again(*_connection: Any) -> None:
    """Have the pool close the connection that it gives out, and make a new one."""
    raise DisconnectionError


def test_a_database_that_is_away_is_503_and_not_ready(tmp_path: Path) -> None:
    """``/health`` still answers, ``/ready`` says no, requests may be sent again later."""
    path = tmp_path / "x.db"
    with running_server(sqlite_database(path), token="silo_failures") as running:
        server = running.app.state.server
        with Api(running.base_url, "silo_failures") as api:
            api.item("BEFORE")
            away = path.rename(tmp_path / "away.db")
            path.mkdir()  # where the file was is now something that is no database
            event.listen(server.db.engine, "checkout", connect_again)
            try:
                assert api.bad(503, "GET", "/api/items/BEFORE")["error"] == "busy"
                assert api.call("GET", "/ready").status == 503
                assert api.get("/health")["mode"] == "degraded"
            finally:
                event.remove(server.db.engine, "checkout", connect_again)
                path.rmdir()
                away.rename(path)
            assert api.get("/api/items/BEFORE")["part_number"] == "BEFORE"
            assert api.get("/ready")["status"] == "ready"


def test_a_store_that_cannot_be_written_is_degraded(tmp_path: Path) -> None:
    """The mode says so before somebody loses an upload."""
    blocked = tmp_path / "blocked"
    blocked.write_text("a file where the folder should be")
    with (
        running_server(
            sqlite_database(tmp_path / "x.db"), token="silo_failures", files_dir=blocked
        ) as running,
        Api(running.base_url, None) as api,
    ):
        answer = api.call("GET", "/ready")
        assert (answer.status, answer.json()["mode"], answer.json()["files"]) == (
            503,
            "degraded",
            "unwritable",
        )


def test_the_document_promises_only_what_we_answer(tmp_path: Path) -> None:
    """No 422 anywhere: we answer 400; every operation documents its errors in the one shape."""
    document = create_app(Settings(database_url=f"sqlite:///{tmp_path / 'x.db'}")).openapi()
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            assert "422" not in operation["responses"], (method, path)
            if path.startswith("/api/") and not path.startswith("/api/auth/device"):
                assert "401" in operation["responses"], (method, path)


def test_the_first_start_makes_an_admin_and_later_ones_do_not(tmp_path: Path) -> None:
    """A token without SILO_API_TOKEN is new at each start; the admin and the data are the same."""
    db = Database(Settings(database_url=f"sqlite:///{tmp_path / 'x.db'}"))
    first, second = prepare(db), prepare(db)
    with db.read() as tx:
        assert [(user.username, user.role) for user in list_users(tx)] == [("admin", Role.ADMIN)]
    db.close()
    assert first.username == second.username == "admin"
    assert first.token != second.token
    assert first.token.startswith("silo_")
