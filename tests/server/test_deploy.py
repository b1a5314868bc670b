# SPDX-License-Identifier: LGPL-2.1-or-later
"""The files under ``deploy/`` and ``examples/night/``: what they name exists; nginx works with them."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from server_testing import Api, reserved_port, wait_until

from silo.cli.main import build_parser
from silo_server.run import running_server
from silo_server.settings import _ENVIRONMENT, Settings

DEPLOY = Path(__file__).parents[2] / "deploy"
NIGHT = DEPLOY.parent / "examples" / "night"
TOKEN = "silo_deploy"
OTHER = {"SILO_API_TOKEN", "SILO_DB_PASSWORD"}


def test_every_variable_is_one_of_ours() -> None:
    """A setting that was renamed, or misspelt, would be ignored in silence."""
    named = {
        name for path in DEPLOY.iterdir() for name in re.findall(r"SILO_[A-Z_]+", path.read_text("utf-8"))
    }
    assert named <= {*_ENVIRONMENT.values(), *OTHER}
    assert {"SILO_DATABASE_URL", "SILO_STORAGE_ROOT_DIR"} <= named


@pytest.mark.parametrize(
    "unit", [DEPLOY / "silo.service", DEPLOY / "silo-backup.service", NIGHT / "silo-sync.service"], ids=str
)
def test_the_units_call_commands_that_there_are(unit: Path) -> None:
    """With options that the command line takes."""
    line = re.search(r"silo-mod ([^'\n]+)", unit.read_text("utf-8").split("ExecStart=")[1])
    assert line is not None
    args = build_parser().parse_args(re.sub(r"\$\$\(.*?\)", "", line[1]).replace('"', "").split())
    assert args.command in ("serve", "backup", "sync")


def test_the_container_of_the_night_job_runs_a_command_that_there_is() -> None:
    """Its words, and the files that it copies, are there."""
    text = (NIGHT / "Containerfile").read_text("utf-8")
    (words,) = re.findall(r"^CMD (\[.*\])$", text, re.MULTILINE)
    assert build_parser().parse_args(json.loads(words)).command == "sync"
    assert "SILO_HOME" in text
    assert {"SILO_API_URL", "SILO_API_TOKEN"} <= set(re.findall(r"SILO_[A-Z_]+", text))


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="systemd is not on this machine")
@pytest.mark.parametrize("unit", sorted([*DEPLOY.glob("*.[st]*er*"), *NIGHT.glob("*.[st]*er*")]), ids=str)
def test_systemd_understands_the_units(unit: Path) -> None:
    """Only that the program is not installed may be found wrong."""
    done = subprocess.run(["systemd-analyze", "verify", str(unit)], capture_output=True, text=True)
    said = [line for line in done.stderr.splitlines() if unit.name in line and "not executable" not in line]
    assert said == []


@contextmanager
def nginx(config: str, folder: Path) -> Iterator[None]:
    """A private nginx with this server block."""
    (folder / "nginx.conf").write_text(
        f"pid {folder}/pid; error_log {folder}/error.log; worker_processes 1; daemon off;\n"
        "events {}\n"
        f"http {{ access_log off; client_body_temp_path {folder}/body; proxy_temp_path {folder}/proxy;\n"
        f"fastcgi_temp_path {folder}/f; uwsgi_temp_path {folder}/u; scgi_temp_path {folder}/s;\n"
        f"{config} }}",
        "utf-8",
    )
    process = subprocess.Popen(["nginx", "-p", str(folder), "-c", str(folder / "nginx.conf")])
    try:
        yield
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(60)


@pytest.mark.skipif(shutil.which("nginx") is None, reason="nginx is not on this machine")
@pytest.mark.parametrize("sub_path", ["", "/silo"])
def test_nginx_passes_pages_and_events_on(tmp_path: Path, sub_path: str) -> None:
    """The file as it is but for TLS, ports, and the sub-path as its comment says."""
    os.chmod(tmp_path, 0o755)
    settings = Settings(database_url=f"sqlite:///{tmp_path / 'x.db'}", root_path=sub_path)
    with (
        reserved_port() as port,
        running_server(settings.database_url, token=TOKEN, settings=settings) as server,
    ):
        text = (DEPLOY / "nginx.conf").read_text("utf-8")
        text = re.sub(r"ssl_\w+ .*;", "", text).replace("listen 443 ssl", f"listen 127.0.0.1:{port}")
        text = text.replace("http://127.0.0.1:8080", server.base_url)
        text = text.replace("location /api", f"location {sub_path}/api").replace(
            "location / ", f"location {sub_path}/ "
        )
        with nginx(text, tmp_path), Api(f"http://127.0.0.1:{port}", TOKEN) as api:

            def up() -> bool:
                try:
                    return api.call("GET", f"{sub_path}/health").status == 200
                except OSError:
                    return False

            wait_until(up, "nginx")
            answer = api.call("POST", f"{sub_path}/api/items", {"part_number": "N", "name": "n"})
            assert answer.status == 201
            assert re.fullmatch("[0-9a-f]{32}", answer.headers["x-request-id"])  # nginx's own
            sent = api.as_(None).call("GET", f"{sub_path}/items", headers={"Accept": "text/html"})
            assert sent.status == 303
            assert sent.headers["location"].endswith(f"{sub_path}/login?next=/items")
            page = api.as_(None).call("GET", f"{sub_path}/login", headers={"Accept": "text/html"})
            assert f'action="{sub_path}/login"'.encode() in page.body
            if not sub_path:
                with api.events() as events:
                    api.item("N2")
                    assert events.next("item.created").data["part_number"] == "N2"
