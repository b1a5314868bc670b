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


@contextmanager
def serving(database: Path, *options: str, token: str | None = None) -> Iterator[subprocess.Popen[str]]:
    """Start one; its output is a pipe, and nothing turns buffering off for it."""
    env = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "SILO_"))}
    words = ["serve", "--port", "0", "--database", f"sqlite:///{database}", *options]
    with subprocess.Popen(
        [sys.executable, "-m", "silo.cli.main", *words],
        env=env | ({"SILO_API_TOKEN": token} if token else {}),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            yield process
        finally:
            process.terminate()
    assert process.returncode == 0, "stopping a server is no failure"


def get(url: str, token: str, **how: Any) -> requests.Response:
    return requests.get(url, headers={"Authorization": f"Bearer {token}"}, timeout=30, **how)


def first_lines(process: subprocess.Popen[str], count: int) -> list[str]:
    assert process.stdout is not None
    return [process.stdout.readline().rstrip("\n") for _ in range(count)]


def test_it_says_its_address_at_once_and_ends_cleanly(tmp_path: Path) -> None:
    """Also while somebody listens to its events. The database, with its password hashes, is its owner's."""
    database = tmp_path / "silo.db"
    database.touch(mode=0o644)  # as an older release left it
    with serving(database) as server:
        url, token = (line.partition(":")[2].strip() for line in first_lines(server, 2))
        assert url.startswith("http://127.0.0.1:")
        assert get(f"{url}/api/items", token).json() == []
        if os.name != "nt":  # Windows keeps rights in lists, not in modes
            assert [path for path in tmp_path.rglob("*") if path.stat().st_mode & 0o077] == []
        with get(f"{url}/api/events", token, stream=True) as events:
            assert events.status_code == 200
            server.send_signal(signal.SIGINT)
            assert server.wait(60) == 0


def test_the_token_of_the_environment_is_taken_and_shown(tmp_path: Path) -> None:
    """Whatever it looks like; it is good after a restart, also one that makes a token of its own. A server
    for other machines says that it is; machines get one line of JSON.
    """
    database, ours = tmp_path / "silo.db", "our-own-token-of-some-length"
    with serving(database, "--host", "0.0.0.0", token=ours) as server:
        lines = first_lines(server, 5)  # address, token, login link, database, warning
        url, shown = (line.partition(":")[2].strip() for line in lines[:2])
        assert url.startswith("http://127.0.0.1:"), "an address that can be opened here"
        assert "other machines" in lines[-1]
        assert shown == "our-own… (the one you gave)"
        assert ours not in "".join(lines)
        assert [get(f"{url}/api/items", token).status_code for token in (ours, "another")] == [200, 401]
    with serving(database, "--json") as server:
        greeting = json.loads(first_lines(server, 1)[0])
        assert set(greeting) == {"url", "token", "login_url", "database", "public", "warnings"}
        assert greeting["public"] is False
        assert greeting["token"] != ours
        for token in (greeting["token"], ours):
            assert get(f"{greeting['url']}/api/items", token).status_code == 200


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
