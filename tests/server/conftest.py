# SPDX-License-Identifier: LGPL-2.1-or-later
"""Databases for the tests that start their own servers, or none; a server, and visitors of its pages."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from hunting import kinds
from server_testing import Api, Databases, sqlite_database
from web_visitor import Visitor, visitors_of

from silo_server.db.database import Database
from silo_server.run import RunningServer, prepare, running_server
from silo_server.settings import Settings

TOKEN = "silo_pages"


@pytest.fixture(scope="session")
def databases(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Databases]:
    """Databases of both kinds."""
    made = Databases(tmp_path_factory.mktemp("databases"))
    yield made
    made.close()


@pytest.fixture(scope="session", params=kinds("sqlite", "postgres"))
def kind(request: pytest.FixtureRequest) -> str:
    """Which database a test is over: each, or that of :func:`hunting.over` where they cannot differ."""
    return str(request.param)


@pytest.fixture
def url(kind: str, databases: Databases) -> str:
    """A database at the newest schema, of each kind."""
    return databases.new(kind)


@pytest.fixture
def empty_url(kind: str, databases: Databases) -> str:
    """A database without a schema, of each kind."""
    return databases.empty(kind)


@pytest.fixture
def db(url: str, tmp_path: Path) -> Iterator[Database]:
    """A database at the newest schema, with a first admin."""
    made = Database(Settings(database_url=url, files_dir=tmp_path))
    prepare(made, "silo_test")
    yield made
    made.close()


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    """A server over an empty database."""
    folder = tmp_path_factory.mktemp("pages")
    with running_server(sqlite_database(folder / "silo.db"), token=TOKEN) as running:
        yield running


@pytest.fixture(scope="module")
def api(server: RunningServer) -> Iterator[Api]:
    """The admin's token."""
    with Api(server.base_url, TOKEN) as caller:
        yield caller


@pytest.fixture(scope="module")
def visitors(api: Api) -> dict[str, Visitor]:
    """A session per role."""
    return visitors_of(api)
