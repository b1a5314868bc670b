# SPDX-License-Identifier: LGPL-2.1-or-later
"""Request ids, the log of requests, metrics, the sub-path, trusted proxies, requests that end too soon."""

from __future__ import annotations

import json
import logging
import re
import socket
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from model_file import model_file
from prometheus_client.parser import text_string_to_metric_families
from server_testing import Api, form_body, sqlite_database, wait_until

from silo.bom.errors import ConfigError
from silo_server.run import RunningServer, running_server
from silo_server.settings import Settings

TOKEN = "silo_requests_0123456789abcdef"


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    """A server below a sub-path, with a log of its requests."""
    url = sqlite_database(tmp_path_factory.mktemp("requests") / "x.db")
    settings = Settings(
        database_url=url, request_log=True, root_path="/plm/silo", trusted_proxies="127.0.0.1"
    )
    with running_server(url, token=TOKEN, settings=settings) as running:
        yield running


@pytest.fixture(scope="module")
def api(server: RunningServer) -> Iterator[Api]:
    """A caller with the first admin's token."""
    with Api(server.base_url, TOKEN) as caller:
        yield caller


def lines(caplog: pytest.LogCaptureFixture) -> list[dict[str, object]]:
    """The requests that were logged."""
    return [json.loads(r.message) for r in caplog.records if r.name == "silo_server.requests"]


def test_each_request_is_one_line_with_its_id(api: Api, caplog: pytest.LogCaptureFixture) -> None:
    """Id (the caller's where it is a plain one), user, status, duration; no query and no secret."""
    caplog.set_level(logging.INFO, "silo_server.requests")
    own = api.call("GET", "/api/items?search=hidden", headers={"X-Request-ID": "from-proxy.7"})
    bad = api.call("GET", "/api/items/none", headers={"X-Request-ID": 'x" onload'})
    api.as_(None).call("GET", "/login/link/silo_link_secret")
    wait_until(lambda: len(lines(caplog)) == 3, "three lines")
    first, second, third = lines(caplog)
    assert own.headers["x-request-id"] == first["id"] == "from-proxy.7"
    assert bad.headers["x-request-id"] == second["id"] != 'x" onload'
    assert re.fullmatch("[0-9a-f]{16}", str(second["id"]))
    assert (first["method"], first["path"], first["status"], first["user"]) == (
        "GET",
        "/api/items",
        200,
        "admin",
    )
    assert (second["status"], third["path"], third["user"]) == (404, "/login/link/…", None)
    assert isinstance(first["ms"], float)
    assert "hidden" not in caplog.text
    assert "link_secret" not in caplog.text


@pytest.mark.parametrize("path", ["/api/items", "/api/items/{}/file", "/api/items/{}/bom/merge", "/login"])
def test_a_body_that_ends_too_soon_is_one_quiet_line(
    server: RunningServer, api: Api, caplog: pytest.LogCaptureFixture, path: str
) -> None:
    """A client that hangs up in the middle of its body: no trace, and nothing was done."""
    number = api.item()
    path = path.format(number)
    caplog.set_level(logging.INFO)
    body, headers = form_body({"file": ("a.FCStd", model_file(b"x" * 5000))})
    kind = headers["Content-Type"] if "file" in path or path == "/login" else "application/json"
    parts = urlsplit(server.base_url)
    with socket.create_connection((parts.hostname, parts.port)) as connection:
        head = f"POST {path} HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {TOKEN}\r\nContent-Type: {kind}\r\n"
        connection.sendall(f"{head}Content-Length: 100000\r\n\r\n".encode() + body[:3000])
    wait_until(lambda: any(line["path"] == path for line in lines(caplog)), "the end of the request")
    noise = [r for r in caplog.records if r.levelno > logging.INFO or r.exc_info]
    assert noise == []
    own = [r for r in caplog.records if r.name.startswith(("silo_server", "uvicorn"))]
    assert len([r for r in own if r.name != "silo_server.requests"]) <= 1
    assert len(api.get(f"/api/items/{number}/revisions")) <= 1


def test_metrics_are_what_prometheus_reads(api: Api) -> None:
    """Counts by route (not by what was asked), listeners, log, housekeeping; for those who may read."""
    api.as_(None).bad(401, "GET", "/metrics")
    for number in range(3):
        api.call("GET", f"/api/items/none-{number}/suppliers")
    api.call("NONSENSE", "/nowhere")
    with api.events():
        text = api.call("GET", "/metrics")
    assert text.headers["content-type"].startswith("text/plain; version=")
    found = {
        (sample.name, tuple(sorted(sample.labels.items()))): sample.value
        for family in text_string_to_metric_families(text.body.decode())
        for sample in family.samples
    }
    labels = (("method", "GET"), ("route", "/api/items/{part_number}/suppliers"), ("status", "404"))
    assert found["silo_requests_total", labels] == 3
    assert found["silo_request_seconds_count", labels[:2]] == 3
    assert found["silo_event_listeners", ()] == 1
    assert found["silo_read_only", ()] == 0
    assert found["silo_housekeeping_age_seconds", ()] < 60
    assert found["silo_database_bytes", ()] > 0
    assert not any("none-1" in str(key) or "NONSENSE" in str(key) for key in found)


def test_below_a_sub_path_every_link_stays_there(server: RunningServer, api: Api) -> None:
    """Pages, redirects, forms; whether the proxy passes the sub-path on or strips it."""
    parent, child = api.items(2, description='" href="/typed')
    api.merge(parent, {child: 1})
    secret = urlsplit(server.login_url).path
    for path in (secret, "/plm/silo" + secret):
        api.as_(None).call("GET", path)
    api.good("POST", "/api/users", {"username": "u", "role": "admin", "password": "a long pass phrase"})
    answer = api.as_(None).call(
        "POST", "/plm/silo/api/auth/login", {"username": "u", "password": "a long pass phrase"}
    )
    cookie = answer.headers["set-cookie"].partition(";")[0]
    browser = {"Cookie": cookie, "Accept": "text/html"}
    pages = ["/items", f"/items/{parent}", f"/items/{parent}/bom", "/activity", "/account", "/users", "/none"]
    for page in pages:
        html, stripped = (
            # The secret and the key of a form are new in each answer.
            re.sub(r'value="[\w.-]{20,}"', "", api.as_(None).call("GET", path, headers=browser).body.decode())
            for path in ("/plm/silo" + page, page)
        )
        assert html == stripped
        links = re.findall(r'\s(?:href|src|action|formaction|data-events)="(/[^"]*)"', html)
        assert links
        assert [link for link in links if not link.startswith("/plm/silo/")] == []
    assert (
        "&#34; href=&#34;/typed"
        in api.as_(None).call("GET", f"/items/{parent}", headers=browser).body.decode()
    )
    sent = api.as_(None).call("GET", "/plm/silo/items?q=x", headers={"Accept": "text/html"})
    assert sent.status == 303
    assert sent.headers["location"] == "/plm/silo/login?next=/items%3Fq%3Dx"
    # What the API says is below its own root: a client puts its server's address before it.
    assert api.merge(parent, {child: 2})["resolve_url"] == f"/items/{parent}/bom"
    script = api.as_(None).call("GET", "/plm/silo/static/root.js")
    assert script.status == 200


def test_only_a_trusted_proxy_says_who_calls(tmp_path: Path) -> None:
    """``X-Forwarded-For`` counts from the proxies of the settings, and from nobody else."""
    url = sqlite_database(tmp_path / "y.db")
    for trusted, seen in (("127.0.0.0/8", "203.0.113.9"), ("10.0.0.1", "127.0.0.1")):
        given = Settings(database_url=url, trusted_proxies=trusted)
        with (
            running_server(given.database_url, token=TOKEN, settings=given) as running,
            Api(running.base_url, TOKEN) as api,
        ):
            sent = {"X-Forwarded-For": "203.0.113.9", "Content-Type": "application/json"}
            api.call("PUT", "/api/admin/mode", {"mode": "normal"}, headers=sent)
            assert api.get("/api/admin/audit?limit=1")[0]["address"] == seen


@pytest.mark.parametrize("path", ["silo", "/silo/", "/", "//x", "/a b", '/"x'])
def test_a_root_path_that_is_none_is_refused(path: str) -> None:
    """At the start, in one sentence."""
    with pytest.raises(ConfigError, match="root path"):
        Settings(database_url="sqlite:///x.db", root_path=path)
