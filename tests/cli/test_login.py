# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod login``: what was seen to work is kept, and nothing else."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import pytest

from silo.api.config import config_path, load_config


def test_the_server_and_the_token_are_kept_for_this_user(
    run: Any, silo: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The other commands need no options any more."""
    for name in ("SILO_API_URL", "SILO_API_TOKEN"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("sys.stdin", io.StringIO(f"{silo.token}\n"))
    ran = run("login", silo.client.base_url)
    assert (ran.code, ran.err) == (0, "")
    assert "admin" in ran.out
    assert silo.token not in ran.out
    assert config_path().stat().st_mode & 0o077 == 0
    assert run("doctor").code == 0


@pytest.mark.parametrize("token", ["silo_wrong", ""])
def test_what_does_not_work_is_not_kept(
    run: Any, silo: Any, monkeypatch: pytest.MonkeyPatch, token: str
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO(f"{token}\n"))
    ran = run("login", silo.client.base_url)
    assert ran.code == (3 if token else 2)
    assert ran.err
    assert not config_path().exists()


def test_what_else_is_configured_stays(run: Any, silo: Any) -> None:
    path = config_path()
    path.parent.mkdir(parents=True)
    path.write_text('[server]\nurl = "http://old.example"\ntoken = "silo_old"\n')
    path.chmod(0o600)
    assert run("login", silo.client.base_url, "--token", silo.token).code == 0
    assert load_config(path)["server"]["url"] == silo.client.base_url


def test_without_a_token_the_message_says_so(
    run: Any, silo: Any, gearbox: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("SILO_API_TOKEN", raising=False)
    ran = run("sync", gearbox, "--server", silo.client.base_url)
    assert ran.code == 3
    assert "wants a token, and none was given" in ran.err


@pytest.mark.parametrize("option", ["--server", "--token"])
def test_an_empty_option_is_an_error(run: Any, silo: Any, gearbox: Path, option: str) -> None:
    """A script whose variable is not set must not reach another server than it thinks."""
    ran = run("diff", gearbox, option, "")
    assert ran.code == 2
    assert f"{option} is empty" in ran.err
