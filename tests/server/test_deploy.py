# SPDX-License-Identifier: LGPL-2.1-or-later
"""The files under ``deploy/`` and ``examples/night/``: what they name exists; nginx works with them."""

from __future__ import annotations

import http.client
import itertools
import json
import os
import re
import shutil
import signal
import ssl
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from model_file import model_file
from server_testing import Api, reserved_port, sqlite_database, wait_until

from silo.api.client import SiloClient
from silo.api.policy import Retries
from silo.bom.errors import SiloError
from silo.cli.parser import build_parser
from silo.cli.setup.site_checks import site
from silo_server.backup import BACKED_UP, RESTORE_TRIED
from silo_server.db.database import Database
from silo_server.db.state import put_state
from silo_server.run import RunningServer, running_server
from silo_server.settings import _ENVIRONMENT, Settings

DEPLOY = Path(__file__).parents[2] / "deploy"
NIGHT = DEPLOY.parent / "examples" / "night"
CONTAINER = (DEPLOY / "Containerfile").read_text("utf-8")
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
    "unit",
    [
        DEPLOY / "silo.service",
        DEPLOY / "silo-backup.service",
        DEPLOY / "silo-restore-test.service",
        NIGHT / "silo-sync.service",
    ],
    ids=str,
)
def test_the_units_call_commands_that_there_are(unit: Path) -> None:
    """With options that the command line takes."""
    line = re.search(r"silo-mod ([^'\n]+)", unit.read_text("utf-8").split("ExecStart=")[1])
    assert line is not None
    args = build_parser().parse_args(re.sub(r"\$\$\(.*?\)", "x", line[1]).replace('"', "").split())
    assert args.command in ("serve", "backup", "restore", "sync")


def test_the_image_copies_all_that_its_package_is_built_from() -> None:
    """What pyproject.toml and setup.py read; examples and docs are not needed in an image."""
    copied = set(re.findall(r"[\w.]+", " ".join(re.findall(r"^COPY (.*) /src/", CONTAINER, re.MULTILINE))))
    setup = (DEPLOY.parent / "setup.py").read_text("utf-8")
    read = set(re.findall(r'"([\w.]+\.(?:py|xml|md)|LICENSE)"', setup))
    assert {"package.xml", "Init.py", "LICENSE"} <= read
    assert read | {"pyproject.toml", "setup.py", "mods"} <= copied


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
    # Its workers must reach the folder that the test's own user made.
    user = "user root;" if os.geteuid() == 0 else ""
    (folder / "nginx.conf").write_text(
        f"{user} pid {folder}/pid; error_log {folder}/error.log; worker_processes 1; daemon off;\n"
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
    settings = Settings(database_url=sqlite_database(tmp_path / "x.db"), root_path=sub_path)
    with (
        reserved_port() as port,
        running_server(settings.database_url, token=TOKEN, settings=settings) as server,
    ):
        text = (DEPLOY / "nginx.conf").read_text("utf-8")
        text = re.sub(r"ssl_\w+ .*;", "", text).replace("listen 443 ssl", f"listen 127.0.0.1:{port}")
        text = text.replace("listen 80;", f"listen unix:{tmp_path}/plain;")
        text = text.replace("http://127.0.0.1:8080", server.base_url)
        text = text.replace("location /", f"location {sub_path}/")
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


@pytest.mark.skipif(
    not shutil.which("nginx") or not shutil.which("openssl"), reason="needs nginx and openssl"
)
def test_tls_the_public_address_events_and_a_large_upload(tmp_path: Path) -> None:
    """The file as it is but for the port and its certificate: a login link, a stream, and 20 MiB."""
    os.chmod(tmp_path, 0o755)
    key, certificate = tmp_path / "key.pem", tmp_path / "certificate.pem"
    made = "openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=localhost".split()  # noqa: SIM905
    made += ["-addext", "subjectAltName=DNS:localhost", "-keyout", str(key), "-out", str(certificate)]
    subprocess.run(made, check=True, capture_output=True)
    with reserved_port() as port, reserved_port() as plain:
        public = f"https://localhost:{port}"
        url = sqlite_database(tmp_path / "x.db")
        settings = Settings(database_url=url, public_url=public, secure_cookies=True)
        with running_server(settings.database_url, token=TOKEN, settings=settings) as server:
            text = (DEPLOY / "nginx.conf").read_text("utf-8")
            text = text.replace("listen 443 ssl", f"listen 127.0.0.1:{port} ssl")
            text = re.sub(r"(ssl_certificate) .*;", rf"\1 {certificate};", text)
            text = re.sub(r"(ssl_certificate_key) .*;", rf"\1 {key};", text)
            text = text.replace("http://127.0.0.1:8080", server.base_url)
            text = text.replace("listen 80;", f"listen 127.0.0.1:{plain};")
            text = text.replace("silo.example.com", "localhost")
            with nginx(text, tmp_path), ExitStack() as stack:
                _try_all(f"localhost:{port}", ssl.create_default_context(cafile=certificate), server, stack)
                _look(public, plain, certificate, server, {"TLS": "ends in 1 day", **WITHOUT_BACKUP})
                set_up(server)
                _look(public, plain, certificate, server, {"TLS": "ends in 1 day"})
                week = {"tls": datetime.now(UTC) - timedelta(days=30)}
                _look(public, plain, certificate, server, {"clock": "apart"}, now=week["tls"])
            faulty = {
                "port 80": ("return 301 https://", "return 404; #"),
                "HSTS": ("add_header Strict", "#"),
                "proxy": ("proxy_set_header X-Forwarded-Proto $scheme;", ""),
            }
            for name, (line, instead) in faulty.items():
                assert line in text
                with nginx(text.replace(line, instead), tmp_path):
                    _look(public, plain, certificate, server, {"TLS": "ends in 1 day", name: WRONG[name]})
            hidden = text.replace("$proxy_add_x_forwarded_for", "$http_x_forwarded_for")
            with nginx(hidden, tmp_path):
                _look(
                    public, plain, certificate, server, {"TLS": "ends in", "proxy": "does not add the caller"}
                )


WRONG = {"port 80": "status 404", "HSTS": "does not tell browsers", "proxy": "let the proxy send"}
WITHOUT_BACKUP = {"backup": "there is none", "test restore": "no backup was ever restored"}


def set_up(server: RunningServer) -> None:
    """Write down a backup of today on another disk, and its test restore."""
    db = Database(server.settings)
    with db.write() as tx:
        put_state(tx, BACKED_UP, json.dumps({"at": tx.stamp, "target": "/b", "same_disk": False}))
        put_state(tx, RESTORE_TRIED, json.dumps({"at": tx.stamp, "made_at": tx.stamp}))
    db.close()


def _look(
    public: str,
    plain: int,
    certificate: Path,
    server: RunningServer,
    faults: dict[str, str],
    now: datetime | None = None,
) -> None:
    """``doctor --server`` names these faults and no others."""

    def answers() -> bool:
        try:
            return client.ready().status == "ready"
        except SiloError:
            return False

    with SiloClient(public, TOKEN, verify=str(certificate), retries=Retries(tries=1)) as client:
        wait_until(answers, "nginx")
        clock = (lambda: now) if now else (lambda: datetime.now(UTC))
        found = site(client, str(certificate), plain_port=plain, now=clock)
    wrong = {name: str(value) for name, value in found.items() if isinstance(value, SiloError)}
    assert wrong.keys() == faults.keys(), wrong
    assert all(words in wrong[name] for name, words in faults.items()), wrong


def _try_all(host: str, trust: ssl.SSLContext, server: RunningServer, stack: ExitStack) -> None:
    public, token = f"https://{host}", {"Authorization": f"Bearer {TOKEN}"}

    def call(
        method: str, path: str, body: Any = None, headers: dict[str, str] | None = None
    ) -> http.client.HTTPResponse:
        connection = http.client.HTTPSConnection(host, context=trust, timeout=60)
        stack.callback(connection.close)
        connection.request(method, path, body, token if headers is None else headers)
        return stack.enter_context(closing(connection.getresponse()))

    def up() -> bool:
        try:
            return call("GET", "/health").status == 200
        except OSError:
            return False

    wait_until(up, "nginx")
    assert server.login_url.startswith(f"{public}/login/link/")
    entered = call("POST", server.login_url.removeprefix(public), headers={"Origin": public})
    cookie = entered.headers["set-cookie"]
    assert (entered.status, "Secure" in cookie, "HttpOnly" in cookie) == (303, True, True)
    events = call("GET", "/api/events")
    body = b'{"part_number": "N", "name": "n"}'
    assert call("POST", "/api/items", body, {**token, "Content-Type": "application/json"}).status == 201
    while not (line := events.readline()).startswith(b"event: item.created"):
        assert line, "the stream ended"
    megabytes, block, model = 20, b"x" * 2**20, model_file(b"")
    head = b'--b\r\nContent-Disposition: form-data; name="file"; filename="large.FCStd"\r\n\r\n' + model
    parts = itertools.chain([head], itertools.repeat(block, megabytes), [b"\r\n--b--\r\n"])
    length = len(head) + megabytes * len(block) + len(b"\r\n--b--\r\n")
    form = {"Content-Type": "multipart/form-data; boundary=b", "Content-Length": str(length)}
    assert call("POST", "/api/items/N/file", parts, {**token, **form}).status == 201
    sent = call("GET", "/api/items/N/file")
    size = sum(len(part) for part in iter(lambda: sent.read(2**20), b""))
    assert size == len(model) + megabytes * len(block)
