# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod serve`` as a process of its own: what a script, a supervisor and a hurried person do with it."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import requests

from silo.cli.main import main

LINES = 4  # address, token, login link, database


class Served:
    """A running ``silo-mod serve`` and the lines that it printed."""

    def __init__(self, process: subprocess.Popen[str], lines: list[str]) -> None:
        self.process = process
        self.lines = lines
        self.url, self.token = (line.partition(":")[2].strip() for line in lines[:2])

    def get(self, path: str, token: str | None = None) -> requests.Response:
        headers = {"Authorization": f"Bearer {token or self.token}"}
        return requests.get(self.url + path, headers=headers, timeout=30)

    def stop(self, how: signal.Signals) -> int:
        self.process.send_signal(how)
        return self.process.wait(60)


@contextmanager
def serving(
    database: Path, *options: str, lines: int = LINES, token: str | None = None
) -> Iterator[list[str] | Served]:
    """Start one; its output is a pipe, and nothing turns buffering off for it."""
    env = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "SILO_"))}
    if token:
        env["SILO_API_TOKEN"] = token
    words = ["serve", "--port", "0", "--database", f"sqlite:///{database}", *options]
    process = subprocess.Popen(
        [sys.executable, "-m", "silo.cli.main", *words],
        env=env,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stderr is not None
    try:
        told = [process.stdout.readline().rstrip("\n") for _ in range(lines)]
        yield told if "--json" in options else Served(process, told)
    finally:
        process.terminate()
        assert process.wait(60) == 0, process.stderr.read()
        process.stdout.close()
        process.stderr.close()


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_it_says_its_address_at_once_and_ends_cleanly(tmp_path: Path, how: signal.Signals) -> None:
    """Also while somebody listens to its events; stopping a server is no failure."""
    with serving(tmp_path / "silo.db") as server:
        assert isinstance(server, Served)
        assert server.url.startswith("http://127.0.0.1:")
        assert server.get("/api/items").json() == []
        headers = {"Authorization": f"Bearer {server.token}"}
        with requests.get(server.url + "/api/events", headers=headers, stream=True, timeout=30) as events:
            assert events.status_code == 200
            assert server.stop(how) == 0


def test_the_token_of_the_environment_is_taken_and_shown(tmp_path: Path) -> None:
    """Whatever it looks like; it is good after a restart, also one that makes a token of its own."""
    database = tmp_path / "silo.db"
    with serving(database, token="our-own-token-of-some-length") as server:
        assert isinstance(server, Served)
        assert server.token == "our-own… (the one you gave)"
        assert "our-own-token-of-some-length" not in "".join(server.lines)
        assert server.get("/api/items", token="our-own-token-of-some-length").status_code == 200
        assert server.get("/api/items", token="another").status_code == 401
    with serving(database) as server:
        assert isinstance(server, Served)
        assert server.token != "our-own-token-of-some-length"
        assert server.get("/api/items").status_code == 200
        assert server.get("/api/items", token="our-own-token-of-some-length").status_code == 200


def test_machines_get_one_line_of_json(tmp_path: Path) -> None:
    """``--json``: address, token, login link, database, what to mend."""
    with serving(tmp_path / "silo.db", "--json", lines=1) as told:
        assert isinstance(told, list)
        greeting = json.loads(told[0])
    assert set(greeting) == {"url", "token", "login_url", "database", "public", "warnings"}
    assert greeting["public"] is False


def test_a_server_for_other_machines_says_so(tmp_path: Path) -> None:
    """Only on request, and with a warning that it speaks without TLS."""
    with serving(tmp_path / "silo.db", "--host", "0.0.0.0", lines=LINES + 1) as server:
        assert isinstance(server, Served)
        assert server.url.startswith("http://127.0.0.1:"), "an address that can be opened here"
        assert "other machines" in server.lines[-1]


WRONG: dict[str, tuple[list[str], str]] = {
    "no port": (["--port", "99999"], "0 to 65535"),
    "no host": (["--host", "192.0.2.1"], "cannot listen on 192.0.2.1"),
    "no URL": (["--database", "silo.db"], "sqlite:///path"),
    "another database": (["--database", "mysql://a:hunter2@b/c"], "postgresql://"),
    "no file": (["--database", "sqlite:////dev/null/silo.db"], "cannot be used"),
    "nobody there": (["--database", "postgresql://silo:hunter2@127.0.0.1:9/silo"], "cannot be used"),
}


@pytest.mark.parametrize(("words", "told"), WRONG.values(), ids=WRONG)
def test_what_cannot_be_served_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], told: str
) -> None:
    """Exit code 2; no stack trace, no password."""
    given: list[Any] = [*words]
    if "--database" not in words:
        given += ["--database", f"sqlite:///{tmp_path / 'silo.db'}"]
    if "--port" not in words:
        given += ["--port", "0"]
    assert main(["serve", *given]) == 2
    err = capsys.readouterr().err
    assert told in err
    assert len(err.splitlines()) == 1
    assert "hunter2" not in err


def test_a_port_that_is_taken_is_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The way out is in it."""
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = str(other.getsockname()[1])
        assert main(["serve", "--port", port, "--database", f"sqlite:///{tmp_path / 'silo.db'}"]) == 2
    assert "--port 0" in capsys.readouterr().err
    assert not (tmp_path / "silo.db").exists()  # nor a user or a token that nobody has seen


@pytest.mark.skipif(os.name == "nt", reason="Windows keeps rights in lists, not in modes")
def test_the_database_is_its_owners(tmp_path: Path) -> None:
    """It has password hashes in it; one that an older release left open to others is closed."""
    database = tmp_path / "silo.db"
    database.touch(mode=0o644)
    database.chmod(0o644)
    with serving(database) as server:
        assert isinstance(server, Served)
        open_to_others = [
            path.name for path in [database, *tmp_path.rglob("*")] if path.stat().st_mode & 0o077
        ]
        assert open_to_others == []
