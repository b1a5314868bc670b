# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod login``: what was seen to work is kept, and nothing else."""

from __future__ import annotations

import io
import os
import select
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest
from server_testing import Api, sqlite_database, wait_until
from web_visitor import enter

from silo.api.config import config_path, load_config
from silo_server.run import running_server
from silo_server.settings import Settings


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


@pytest.mark.parametrize("written", ["/silo", "/silo/", "/silo/api"])
def test_a_server_below_a_base_path_is_found_by_the_address_of_its_pages(
    run: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, written: str
) -> None:
    """``https://host/silo`` is what the browser shows; the API is below it."""
    for name in ("SILO_API_URL", "SILO_API_TOKEN"):
        monkeypatch.delenv(name, raising=False)
    url, token = sqlite_database(tmp_path / "below.db"), "silo_" + "d4" * 20
    settings = Settings(database_url=url, root_path="/silo")
    with running_server(url, token=token, settings=settings) as server:
        host = server.base_url.removesuffix("/silo")
        ran = run("login", f"{host}{written}", "--token", token)
        assert (ran.code, ran.err) == (0, "")
        assert f"{host}/silo/api" in str(load_config(config_path()))
        assert run("whoami").code == 0


@pytest.mark.usefixtures("needs_pty", "needs_signals")
def test_at_a_terminal_the_browser_lets_the_program_in(silo: Any, tmp_path: Path, home: Path) -> None:
    """The page is opened and shows the code of the terminal; nobody types a token."""
    opened = tmp_path / "opened"
    browser = tmp_path / "browser"
    browser.write_text(f'#!/bin/sh\necho "$1" > {opened}.new && mv {opened}.new {opened}\n')
    browser.chmod(0o755)
    env = {name: text for name, text in os.environ.items() if not name.startswith("SILO_API")}
    master, terminal = os.openpty()
    program = [sys.executable, "-m", "silo.cli.main", "login", silo.client.base_url]
    with subprocess.Popen(
        program,
        stdin=terminal,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**env, "BROWSER": str(browser)},
    ) as job:
        try:
            wait_until(opened.exists, "the browser")
            page = opened.read_text().strip().removeprefix(silo.client.base_url)
            with Api(silo.client.base_url, silo.token) as api:
                visitor = enter(api, "admin")
                shown = visitor.get(page).body.decode()
                code = parse_qs(urlsplit(page).query)["code"][0]
                assert visitor.post("/login/device", code=code, answer="allow").status == 303
            out, err = job.communicate(timeout=60)
        finally:
            job.kill()
    os.close(master)
    os.close(terminal)
    assert (job.returncode, "admin" in out) == (0, True), err
    assert code in shown
    assert code in err
    kept = load_config(config_path())["server"]["token"]
    assert kept.startswith("silo_")
    assert kept not in page + out + err


def test_what_does_not_work_is_not_kept(
    run: Any, silo: Any, gearbox: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A script whose variable is not set must not reach another server than it thinks."""
    for token in ("silo_wrong", ""):
        monkeypatch.setattr("sys.stdin", io.StringIO(f"{token}\n"))
        ran = run("login", silo.client.base_url)
        assert (ran.code, bool(ran.err)) == (3 if token else 2, True)
        assert not config_path().exists()
    for option in ("--server", "--token"):
        ran = run("diff", gearbox, option, "")
        assert (ran.code, f"{option} is empty" in ran.err) == (2, True)
    monkeypatch.delenv("SILO_API_TOKEN", raising=False)
    ran = run("sync", gearbox, "--server", silo.client.base_url)
    assert (ran.code, "wants a token, and none was given" in ran.err) == (3, True)


def test_logout_forgets_what_login_kept(run: Any, silo: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """And says that nothing was there, or that the environment still has a token. A file of others stays."""
    path = config_path()
    path.parent.mkdir(parents=True)
    path.write_text('[server]\nurl = "http://old.example"\ntoken = "silo_old"\n')
    path.chmod(0o600)
    assert run("login", silo.client.base_url, "--token", silo.token).code == 0
    assert load_config(path)["server"]["url"] == silo.client.base_url
    assert "SILO_API_TOKEN still" in run("logout").out
    assert not path.exists()
    for name in ("SILO_API_URL", "SILO_API_TOKEN"):
        monkeypatch.delenv(name, raising=False)
    assert "nothing is remembered" in run("logout").out
    assert run("whoami").code == 2
    path.write_text("[other]\nkey = 1\n")
    path.chmod(0o600)
    assert run("logout").code == 2
    assert path.exists()


@pytest.mark.usefixtures("synced")
def test_search_show_and_whoami(run: Any, silo: Any, gearbox: Path) -> None:
    (found,) = run("search", "base", "plate", "--json").json()["items"]
    assert found["name"] == "Base Plate"
    assert run("search", "no-such-words").code == 1
    (top,) = run("search", "Top Assembly", "--json").json()["items"]
    told = run("show", top["part_number"], "--json").json()
    assert found["part_number"] in {line["part_number"] for line in told["bom"]}
    assert told["page"].startswith(silo.client.base_url)
    assert run("show", "A99-9999").code == 2
    who = run("whoami", "--json").json()
    assert (who["url"], who["username"]) == (silo.client.base_url, "admin")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_shell_completes_every_command(run: Any, shell: str, tmp_path: Path) -> None:
    script = run("completion", shell).out
    option = "-l recursive" if shell == "fish" else "--recursive"
    assert all(name in script for name in ("bom-diff", "install-addon", option, "whoami"))
    program = shutil.which(shell)
    if program is not None:
        (tmp_path / "script").write_text(script)
        subprocess.run([program, "-n", tmp_path / "script"], check=True)


@pytest.mark.usefixtures("needs_pty")
@pytest.mark.skipif(shutil.which("zsh") is None, reason="needs zsh")
def test_zsh_completes_a_command_and_an_option(run: Any, tmp_path: Path) -> None:
    """As a person types it, in a terminal."""
    (tmp_path / "script").write_text(run("completion", "zsh").out)
    begin = f'autoload -Uz compinit && compinit -u -D; eval "$(cat {tmp_path}/script)"; print be"gun"'
    terminal, inside = os.openpty()
    child = subprocess.Popen(
        ["zsh", "-f", "-i"],
        stdin=inside,
        stdout=inside,
        stderr=inside,
        env={**os.environ, "TERM": "dumb", "PS1": "% "},
        start_new_session=True,
    )
    os.close(inside)
    try:
        for typed, shown in (
            (f"{begin}\n", b"begun"),
            ("silo-mod who\t", b"whoami"),
            ("\x15silo-mod sync --rec\t", b"--recursive"),
        ):
            os.write(terminal, typed.encode())
            seen = b""
            while shown not in seen:
                assert select.select([terminal], [], [], 60)[0], seen
                seen += os.read(terminal, 65536)
    finally:
        child.kill()
        child.wait()
        os.close(terminal)
