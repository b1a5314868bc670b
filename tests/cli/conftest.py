# SPDX-License-Identifier: LGPL-2.1-or-later
"""A real embedded server for the command line, a copy of the example, and a home of its own."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema_rs
import pytest
from server_testing import sqlite_database

from silo.api.client import SiloClient
from silo.api.policy import Retries
from silo.cli.main import main
from silo.cli.shapes import schema_of
from silo_server.run import running_server

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "gearbox"


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


@pytest.fixture
def gearbox(tmp_path: Path) -> Path:
    """The top file of a copy of the example."""
    folder = tmp_path / "gearbox"
    shutil.copytree(EXAMPLE, folder, ignore=shutil.ignore_patterns("*.py", "__pycache__"))
    return folder / "TopAssembly.FCStd"


@pytest.fixture(autouse=True)
def home(tmp_path: Path, warm: None, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Nothing of the user's own configuration or data is read or written."""
    for name in ("SILO_API_URL", "SILO_API_TOKEN", "SILO_SSL_VERIFY"):
        monkeypatch.delenv(name, raising=False)
    folder = tmp_path / "home"
    for name in ("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME"):
        monkeypatch.setenv(name, str(folder / name.lower()))
    first = 0.01  # [s], the first pause before a command tries again
    monkeypatch.setattr(Retries.__init__, "__defaults__", (3, first, *Retries.__init__.__defaults__[2:]))
    return folder


@pytest.fixture
def silo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Silo]:
    """A running server that the environment names."""
    token = "silo_" + "c1" * 20
    with running_server(sqlite_database(tmp_path / "silo.db"), token=token) as server:
        monkeypatch.setenv("SILO_API_URL", server.base_url)
        monkeypatch.setenv("SILO_API_TOKEN", token)
        with SiloClient(server.base_url, token) as client:
            yield Silo(client, token)


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Any:
    """Run ``silo-mod`` with these words."""

    def _run(*words: object) -> Ran:
        code = main([str(word) for word in words])
        captured = capsys.readouterr()
        return Ran(str(words[0]), code, captured.out, captured.err)

    return _run
