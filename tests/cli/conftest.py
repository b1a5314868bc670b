# SPDX-License-Identifier: LGPL-2.1-or-later
"""A real embedded server for the command line, a copy of the example, and a home of its own.

``registered`` and ``synced`` (with ``usefixtures``) say what the server of a test and its copy of the example
begin with: this is made once, for it takes a hundred times as long as a copy of it.
"""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema_rs
import pytest
from server_testing import sqlite_database

from silo.api.client import SiloClient
from silo.api.policy import Retries
from silo.cli.json_schemas import schema_of
from silo.cli.main import main
from silo_server.run import running_server

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "gearbox"
TOKEN = "silo_" + "c1" * 20


@dataclass(frozen=True)
class Silo:
    """Where the server is, and a client for looking at what it has."""

    client: SiloClient
    token: str


@dataclass(frozen=True)
class Ran:
    """What a command printed, and its exit code. Its JSON is held against the command's schema."""

    command: str
    code: int
    out: str
    err: str

    def json(self) -> Any:
        data = json.loads(self.out)
        validator_of(self.command).validate(data)
        return data


@cache
def validator_of(command: str) -> jsonschema_rs.Validator:
    return jsonschema_rs.validator_for(schema_of(command))


@pytest.fixture(scope="session")
def beginnings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for each beginning, with the database and the example."""
    folder, now = tmp_path_factory.mktemp("beginnings"), tmp_path_factory.mktemp("now")
    copy_example(EXAMPLE, now / "gearbox")
    url = sqlite_database(now / "silo.db")
    top = str(now / "gearbox" / "TopAssembly.FCStd")
    with pytest.MonkeyPatch.context() as patch:
        set_home(patch, tmp_path_factory.mktemp("home"))
        patch.setenv("SILO_API_TOKEN", TOKEN)
        steps = {"registered": ["register", top, "--yes"], "synced": ["sync", top, "--recursive"]}
        for name, words in steps.items():
            with running_server(url, token=TOKEN) as server:
                patch.setenv("SILO_API_URL", server.base_url)
                assert main(words) == 0
            shutil.copytree(now, folder / name)
    return folder


@pytest.fixture
def registered(beginnings: Path) -> Path:
    """The parts of the example have their items."""
    return beginnings / "registered"


@pytest.fixture
def synced(beginnings: Path) -> Path:
    """The BOMs of the example are merged too."""
    return beginnings / "synced"


def copy_example(source: Path, target: Path) -> None:
    shutil.copytree(source, target, ignore=shutil.ignore_patterns("*.py", "__pycache__"))


def beginning_of(request: pytest.FixtureRequest) -> Path | None:
    """Return the folder with what the test begins with; None for nothing."""
    name = next((name for name in ("registered", "synced") if name in request.fixturenames), None)
    return request.getfixturevalue(name) if name else None


@pytest.fixture
def gearbox(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """The top file of a copy of the example."""
    beginning = beginning_of(request)
    copy_example(beginning / "gearbox" if beginning else EXAMPLE, tmp_path / "gearbox")
    return tmp_path / "gearbox" / "TopAssembly.FCStd"


@pytest.fixture(autouse=True)
def home(tmp_path: Path, warm: None, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Nothing of the user's own configuration or data is read or written."""
    folder = tmp_path / "home"
    set_home(monkeypatch, folder)
    first = 0.01  # [s], the first pause before a command tries again
    monkeypatch.setattr(Retries.__init__, "__defaults__", (3, first, *Retries.__init__.__defaults__[2:]))
    return folder


def set_home(patch: pytest.MonkeyPatch, folder: Path) -> None:
    for name in ("SILO_API_URL", "SILO_API_TOKEN", "SILO_SSL_VERIFY"):
        patch.delenv(name, raising=False)
    for name in ("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME"):
        patch.setenv(name, str(folder / name.lower()))


@pytest.fixture
def silo(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Silo]:
    """A running server that the environment names."""
    database = sqlite_database(tmp_path / "silo.db")
    if beginning := beginning_of(request):
        shutil.copy(beginning / "silo.db", tmp_path)
    with running_server(database, token=TOKEN) as server:
        monkeypatch.setenv("SILO_API_URL", server.base_url)
        monkeypatch.setenv("SILO_API_TOKEN", TOKEN)
        with SiloClient(server.base_url, TOKEN) as client:
            yield Silo(client, TOKEN)


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Any:
    """Run ``silo-mod`` with these words."""

    def _run(*words: object) -> Ran:
        code = main([str(word) for word in words])
        captured = capsys.readouterr()
        return Ran(str(words[0]), code, captured.out, captured.err)

    return _run


@pytest.fixture
def git(needs_git: None) -> Callable[..., str]:
    """Run git in a folder, as a user whom the repository knows; return what it prints."""

    def _git(folder: Path, *words: str) -> str:
        who = ("-c", "user.name=t", "-c", "user.email=t@example.com", "-c", "commit.gpgsign=false")
        done = subprocess.run(["git", *who, *words], cwd=folder, capture_output=True, text=True, check=True)
        return done.stdout.strip()

    return _git
