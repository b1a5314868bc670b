# SPDX-License-Identifier: LGPL-2.1-or-later
"""Every test in this folder runs against a real server, over SQLite.

Those whose answer the database could change (races, times, credentials, losses, order and search) run over
PostgreSQL as well. The server is shared; each test makes its own items, so that none sees another's.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from hunting import kinds
from server_testing import Api, Databases

from silo_server.run import RunningServer, running_server

TOKEN = "silo_" + "0123456789abcdef" * 2


@pytest.fixture(scope="session")
def databases(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Databases]:
    """Databases of both kinds."""
    made = Databases(tmp_path_factory.mktemp("databases"))
    yield made
    made.close()


@pytest.fixture(scope="session", params=kinds("sqlite"), name="kind")
def _kind(request: pytest.FixtureRequest) -> str:
    """Which database this run is over."""
    return str(request.param)


@pytest.fixture(scope="session")
def server(
    kind: str, databases: Databases, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[RunningServer]:
    """A server over an empty database."""
    with running_server(
        databases.new(kind), token=TOKEN, files_dir=tmp_path_factory.mktemp("files")
    ) as running:
        yield running


@pytest.fixture
def api(server: RunningServer) -> Iterator[Api]:
    """A caller with the first admin's token."""
    with Api(server.base_url, TOKEN) as caller:
        yield caller
