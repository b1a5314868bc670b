# SPDX-License-Identifier: LGPL-2.1-or-later
"""One request done with care, against a real server that misbehaves by script."""

from __future__ import annotations

import email.utils
import logging
import re
import socket
import subprocess
import threading
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from server_testing import reserved_port
from urllib3 import HTTPResponse

from silo.api.client import SiloClient
from silo.api.policy import Retries
from silo.api.wire import MergeEntry, MergeRequest
from silo.bom.errors import (
    AuthError,
    CancelledError,
    ConfigError,
    ReadOnlyError,
    ServerFaultError,
    UnreachableError,
)

ITEM = {"id": "6f9619ff-8b86-4011-b42d-00cf4fc964ff", "part_number": "F01-0001", "description": "Bolt"}
GET = "GET /api/items/F01-0001"
MERGE = "POST /api/items/A01-0001/bom/merge"


def merge_request(sync_id: str | None = "sync-1") -> MergeRequest:
    return MergeRequest(entries=[MergeEntry(child_part_number="F01-0001", quantity=2)], sync_id=sync_id)


# -- the token ----------------------------------------------------------------------------------------------


def test_the_token_is_sent_and_never_shown(
    server: Any, client: SiloClient, caplog: pytest.LogCaptureFixture
) -> None:
    """Bearer on the wire; in no repr, no error, no log, even where the server echoes it."""
    caplog.set_level(logging.DEBUG)
    server.on(GET, ITEM)
    server.on("GET /api/items/X", {"error": "Bearer silo_secret is not nice", "message": "see silo_secret"})
    server.scripts["GET /api/items/X"][0].status = 400
    client.get_item("F01-0001")
    with pytest.raises(Exception, match="not accepted") as caught:
        client.get_item("X")
    assert server.seen[0].headers["Authorization"] == "Bearer silo_secret"
    shown = [repr(client), str(caught.value), repr(caught.value), caplog.text, repr(vars(client))]
    assert not [text for text in shown if "silo_secret" in text]


def test_a_token_that_cannot_be_sent_is_reported_without_it() -> None:
    """The library's own error would quote the header."""
    for bad in ("silo_a\nb", "silo ä", "two words"):
        with pytest.raises(ConfigError) as caught:
            SiloClient("http://127.0.0.1:1", bad)
        assert bad not in str(caught.value)


def test_stored_passwords_of_the_account_are_not_used(
    server: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """requests would take ~/.netrc over our header; with and without a token it does not here."""
    netrc = tmp_path / "netrc"
    netrc.write_text("machine 127.0.0.1 login designer password hunter2\n")
    monkeypatch.setenv("NETRC", str(netrc))
    server.on("*", ITEM)
    for token in ("silo_secret", None):
        with SiloClient(server.url, token) as client:
            client.get_item("F01-0001")
    assert [seen.headers["Authorization"] for seen in server.seen] == ["Bearer silo_secret", None]


def test_this_computer_is_asked_without_a_proxy(server: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise a company's proxy setting would break the embedded server."""
    for name in ("HTTP_PROXY", "http_proxy", "ALL_PROXY", "all_proxy"):
        monkeypatch.setenv(name, "http://127.0.0.1:9")
    for name in ("NO_PROXY", "no_proxy"):
        monkeypatch.delenv(name)
    server.on("*", ITEM)
    with SiloClient(server.url) as client:
        assert client.get_item("F01-0001").part_number == "F01-0001"


def test_cookies_are_not_kept(server: Any, client: SiloClient, answer: Any) -> None:
    """A session cookie would outlive the token's withdrawal."""
    server.on(GET, answer(200, ITEM, {"Set-Cookie": "silo_session=abc; Path=/"}))
    client.get_item("F01-0001")
    client.get_item("F01-0001")
    assert [seen.headers["Cookie"] for seen in server.seen] == [None, None]


# -- repeats ------------------------------------------------------------------------------------------------


def test_a_question_is_repeated_when_the_way_breaks(
    server: Any, client: SiloClient, answer: Any, pauses: list[float]
) -> None:
    """Busy once, cut off once, then answered; the pauses grow."""
    server.on(GET, answer(502, "bad gateway"), answer(drop=True), ITEM)
    assert client.get_item("F01-0001").part_number == "F01-0001"
    assert pauses == [0.5, 1.0]


def test_repeats_are_bounded(server: Any, client: SiloClient, answer: Any, pauses: list[float]) -> None:
    """Three attempts, then the error."""
    server.on(GET, answer(504))
    with pytest.raises(UnreachableError, match="cannot answer now"):
        client.get_item("F01-0001")
    assert (len(server.seen), len(pauses)) == (3, 2)


@pytest.mark.parametrize(
    ("call", "route"),
    [
        (lambda c: c.create_item("kindred-rd", "F01", "Bolt"), "POST /api/items"),
        (lambda c: c.update_item("F01-0001", description="x"), "PUT /api/items/F01-0001"),
        (lambda c: c.merge_bom("A01-0001", merge_request(None)), MERGE),
        (lambda c: c.add_bom_line("A01-0001", "F01-0001"), "POST /api/items/A01-0001/bom"),
        (lambda c: c.remove_bom_line("A01-0001", "F01-0001"), "DELETE /api/items/A01-0001/bom/F01-0001"),
    ],
)
def test_a_change_is_not_repeated(
    server: Any, client: SiloClient, answer: Any, call: Callable[[SiloClient], Any], route: str
) -> None:
    """Whether the first one arrived cannot be known, so doing it twice may do it twice."""
    server.on(route, answer(drop=True), ITEM)
    with pytest.raises(UnreachableError):
        call(client)
    assert len(server.seen) == 1


def test_a_merge_with_a_sync_id_is_repeated_as_it_is(server: Any, client: SiloClient, answer: Any) -> None:
    """The server knows the sync_id, so a repeat is harmless."""
    server.on(MERGE, answer(drop=True), answer(502), {"status": "merged", "diff": {"added": []}})
    assert client.merge_bom("A01-0001", merge_request()).status == "merged"
    assert [seen.json()["sync_id"] for seen in server.seen] == ["sync-1"] * 3
    assert len({seen.body for seen in server.seen}) == 1


def test_the_merge_request_is_the_one_of_the_spec(server: Any, client: SiloClient) -> None:
    """Spec §5, byte for byte in meaning: no further keys, whole numbers as integers."""
    server.on(MERGE, {"status": "merged", "diff": {"added": []}})
    client.merge_bom("A01-0001", merge_request(None))
    assert server.seen[0].body.replace(b" ", b"") == (
        b'{"source":"assembly","entries":[{"child_part_number":"F01-0001","quantity":2,"source":"assembly"}]}'
    )
    assert server.seen[0].headers["Content-Type"] == "application/json"


def test_read_only_is_reported_at_once(
    server: Any, client: SiloClient, answer: Any, pauses: list[float]
) -> None:
    """A person made it so; pausing here would help nobody."""
    server.on(MERGE, answer(503, {"error": "read_only", "message": "maintenance"}, {"Retry-After": "5"}))
    with pytest.raises(ReadOnlyError, match="maintenance"):
        client.merge_bom("A01-0001", merge_request())
    assert (len(server.seen), pauses) == (1, [])


@pytest.mark.parametrize("form", ["seconds", "date"])
def test_the_servers_own_pause_is_kept(
    server: Any, client: SiloClient, answer: Any, pauses: list[float], form: str
) -> None:
    """Retry-After in both its forms."""
    when = (
        "7"
        if form == "seconds"
        else email.utils.format_datetime(datetime.now(UTC) + timedelta(seconds=7.9), usegmt=True)
    )
    server.on(GET, answer(429, headers={"Retry-After": when}), ITEM)
    client.get_item("F01-0001")
    assert pauses == [7.0] if form == "seconds" else 0 < pauses[0] <= 7.9


@pytest.mark.parametrize("told", ["11", "99999999999999999999", "Fri, 31 Dec 9999 23:59:59 GMT"])
def test_a_pause_beyond_bounds_is_not_waited_for(
    server: Any, client: SiloClient, answer: Any, pauses: list[float], told: str
) -> None:
    """A server may not hold us for an hour."""
    server.on(GET, answer(503, headers={"Retry-After": told}), ITEM)
    with pytest.raises(UnreachableError):
        client.get_item("F01-0001")
    assert pauses == []


@pytest.mark.parametrize("told", ["soon", "-5", "", "1e9", "٣"])
def test_a_pause_that_is_none_counts_as_untold(
    server: Any, client: SiloClient, answer: Any, pauses: list[float], told: str
) -> None:
    """Then our own pause is taken."""
    server.on(GET, answer(503, headers={"Retry-After": told.encode().decode("latin-1")}), ITEM)
    client.get_item("F01-0001")
    assert pauses == [0.5]


# -- redirects ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("status", [301, 302, 303, 307, 308])
def test_the_token_does_not_go_to_another_server(
    server: Any, other_server: Any, client: SiloClient, answer: Any, status: int
) -> None:
    """The question follows, the token stays; and it is there again on the way back."""
    server.on(GET, answer(status, headers={"Location": f"{other_server.url}/away"}))
    other_server.on("GET /away", answer(302, headers={"Location": f"{server.url}/back"}))
    server.on("GET /back", ITEM)
    assert client.get_item("F01-0001").part_number == "F01-0001"
    assert other_server.seen[0].headers["Authorization"] is None
    assert server.seen[-1].headers["Authorization"] == "Bearer silo_secret"


def test_the_token_goes_along_within_the_server(server: Any, client: SiloClient, answer: Any) -> None:
    """A relative Location is the same server."""
    server.on(GET, answer(308, headers={"Location": "/api/items/NEW"}))
    server.on("GET /api/items/NEW", ITEM)
    client.get_item("F01-0001")
    assert server.seen[1].headers["Authorization"] == "Bearer silo_secret"


def test_a_change_does_not_leave_the_server(
    server: Any, other_server: Any, client: SiloClient, answer: Any
) -> None:
    """A BOM is not handed to whom the server points at; the message says what to set."""
    server.on(MERGE, answer(307, headers={"Location": f"{other_server.url}/api/x"}))
    with pytest.raises(ServerFaultError, match=r"set it as the server address"):
        client.merge_bom("A01-0001", merge_request())
    assert other_server.seen == []


def test_a_change_does_not_become_a_question(server: Any, client: SiloClient, answer: Any) -> None:
    """After 301 and 302 libraries turn POST into GET, and the change would be lost without a word."""
    server.on("POST /api/items", answer(301, headers={"Location": "/api/items/"}))
    server.on("GET /api/items/", [ITEM])
    with pytest.raises(ServerFaultError, match="redirects a change"):
        client.create_item("kindred-rd", "F01", "Bolt")


def test_a_change_follows_within_the_server_with_its_body(
    server: Any, client: SiloClient, answer: Any
) -> None:
    """308 keeps method and body."""
    server.on(MERGE, answer(308, headers={"Location": "/v2/merge"}))
    server.on("POST /v2/merge", {"status": "merged", "diff": {"added": []}})
    client.merge_bom("A01-0001", merge_request())
    assert server.seen[0].body == server.seen[1].body


def test_a_circle_of_redirects_ends(server: Any, client: SiloClient, answer: Any) -> None:
    """Six requests at most."""
    server.on(GET, answer(302, headers={"Location": "/api/items/F01-0001"}))
    with pytest.raises(ServerFaultError, match="circle"):
        client.get_item("F01-0001")
    assert len(server.seen) == 6


def test_a_redirect_to_the_login_page_means_the_token(server: Any, client: SiloClient, answer: Any) -> None:
    """silo-contract §1.1: the web answers a missing login so."""
    server.on(GET, answer(302, headers={"Location": "/login"}))
    with pytest.raises(AuthError, match="valid token"):
        client.get_item("F01-0001")


@pytest.mark.parametrize(
    "location",
    ["/login?next=%2Fapi", "/users/sign_in?a=b", "/auth/oidc?x", "http://sso.example.com/login?to=x"],
)
def test_an_expired_session_is_a_matter_of_the_token(
    server: Any, client: SiloClient, answer: Any, location: str
) -> None:
    """With a query, on the server or at a portal; for questions and changes."""
    server.on(GET, answer(302, headers={"Location": location}))
    server.on("POST /api/items", answer(303, headers={"Location": location}))
    with pytest.raises(AuthError, match="wants a login"):
        client.get_item("F01-0001")
    with pytest.raises(AuthError, match="wants a login"):
        client.create_item("kindred-rd", "F01", "Bolt")


def test_a_redirect_may_have_a_query(server: Any, client: SiloClient, answer: Any) -> None:
    """A server address has none; what a server points at may."""
    server.on(GET, answer(307, headers={"Location": "/v2/items?number=F01-0001"}))
    server.on("GET /v2/items", ITEM)
    assert client.get_item("F01-0001").part_number == "F01-0001"
    assert server.seen[1].path == "/v2/items?number=F01-0001"


@pytest.mark.parametrize("status", [301, 307])
def test_https_on_another_port_says_which_address_to_use(
    server: Any, client: SiloClient, answer: Any, status: int
) -> None:
    """The token would be left behind, and the refusal would read like a wrong token."""
    server.on("*", answer(status, headers={"Location": "https://127.0.0.1:8443/api/x?y"}))
    for ask in (lambda: client.get_item("F01-0001"), lambda: client.create_item("s", "F01", "Bolt")):
        with pytest.raises(ConfigError, match=r"set https://127\.0\.0\.1:8443 as the server address"):
            ask()


def test_a_redirect_to_nowhere_is_an_error_in_plain_words(
    server: Any, client: SiloClient, answer: Any
) -> None:
    """Whatever stands in Location."""
    for location in ("ftp://x/", "http://[", "http://user:pw@h/", "javascript:alert(1)"):
        server.scripts.clear()
        server.on(GET, answer(302, headers={"Location": location}))
        with pytest.raises((ConfigError, ServerFaultError)) as caught:
            client.get_item("F01-0001")
        assert "pw" not in str(caught.value)


# -- bounds -------------------------------------------------------------------------------------------------


def test_a_silent_server_is_given_up(server: Any, answer: Any) -> None:
    """The read time-out; the message names host, question and seconds."""
    server.on("POST /api/items", answer(200, ITEM, before=server.ending.wait))
    with (
        SiloClient(server.url, timeout=(5, 0.1)) as client,
        pytest.raises(UnreachableError, match=r"127\.0\.0\.1.*a new item.*silent for 0\.1 s"),
    ):
        client.create_item("kindred-rd", "F01", "Bolt")
    server.ending.set()


def test_an_upload_may_stall_for_longer_than_a_connection_takes(tmp_path: Path) -> None:
    """The short time-out is for connecting only."""
    path = tmp_path / "a.FCStd"
    path.write_bytes(b"x" * 30_000_000)  # more than the buffers on the way hold
    stalled, left = threading.Event(), [0]
    with socket.create_server(("127.0.0.1", 0)) as listening:

        def serve() -> None:
            conversation, _ = listening.accept()
            with conversation:
                head = b""
                while b"\r\n\r\n" not in head:
                    head += conversation.recv(4096)
                stalled.wait(0.5)  # a line that stalls: twice the time for connecting
                length = re.search(rb"Content-Length: (\d+)", head)
                left[0] = int(length[1]) - len(head.partition(b"\r\n\r\n")[2]) if length else -1
                while left[0] > 0:
                    left[0] -= len(conversation.recv(1 << 20))
                said = b'{"revision_number": 1}'
                conversation.sendall(b"HTTP/1.1 201 x\r\nContent-Length: %d\r\n\r\n" % len(said) + said)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        port = listening.getsockname()[1]
        with SiloClient(f"http://127.0.0.1:{port}", timeout=(0.25, 60)) as client:
            assert client.upload_file("F01-0001", path).revision_number == 1
        thread.join(60)
    assert left == [0]


def test_a_dripping_server_is_given_up(server: Any, answer: Any) -> None:
    """Each byte comes in time, the whole never would."""

    def drip() -> Iterator[bytes]:
        while not server.ending.wait(0.01):
            yield b" "

    server.on(GET, answer(200, chunks=drip()))
    with (
        SiloClient(server.url, timeout=5, total_timeout=0.2, retries=Retries(tries=1)) as client,
        pytest.raises(UnreachableError, match=r"more than 0\.2 s"),
    ):
        client.get_item("F01-0001")


def test_an_endless_answer_is_refused(server: Any, answer: Any) -> None:
    """Memory is bounded."""

    def flood() -> Iterator[bytes]:
        while not server.ending.is_set():
            yield b"x" * 10_000

    server.on(GET, answer(200, chunks=flood()))
    with (
        SiloClient(server.url, max_bytes=50_000) as client,
        pytest.raises(ServerFaultError, match=r"more than 0\.05 MB"),
    ):
        client.get_item("F01-0001")


def test_a_packed_answer_counts_unpacked(server: Any, answer: Any) -> None:
    """A small gzip may hold a large text."""
    import gzip

    packed = gzip.compress(b" " * 10_000_000)
    server.on(GET, answer(200, packed, {"Content-Encoding": "gzip"}))
    with (
        SiloClient(server.url, max_bytes=1_000_000) as client,
        pytest.raises(ServerFaultError, match=r"1 MB|understood"),
    ):
        client.get_item("F01-0001")


@pytest.mark.parametrize("noticed", [True, False], ids=["urllib3 2", "urllib3 1"])
def test_half_an_answer_is_no_answer(
    server: Any, client: SiloClient, answer: Any, monkeypatch: pytest.MonkeyPatch, noticed: bool
) -> None:
    """Content-Length says more than came, and urllib3 1, which some FreeCADs have, takes that for the end."""
    make = HTTPResponse.__init__

    def as_it_was(self: HTTPResponse, *args: Any, **more: Any) -> None:
        make(self, *args, **{**more, "enforce_content_length": noticed})

    monkeypatch.setattr(HTTPResponse, "__init__", as_it_was)
    server.on(GET, answer(200, b'{"id": 1}', {"Content-Length": "500"}))
    with pytest.raises(UnreachableError, match=r"closed the connection (before|after)"):
        client.get_item("F01-0001")


def test_nobody_there_says_how_to_start_one(pauses: list[float]) -> None:
    """Connection refused."""
    with (
        reserved_port() as port,
        SiloClient(f"http://127.0.0.1:{port}", retries=Retries(sleep=pauses.append)) as client,
        pytest.raises(UnreachableError, match=r"nothing answers at 127\.0\.0\.1.*silo-mod serve"),
    ):
        client.get_item("F01-0001")
    assert len(pauses) == 2


# -- stopping -----------------------------------------------------------------------------------------------


def test_a_stopped_call_sends_nothing(server: Any, client: SiloClient) -> None:
    """Stopped before it began."""
    stopped = threading.Event()
    stopped.set()
    with pytest.raises(CancelledError):
        client.merge_bom("A01-0001", merge_request(), cancelled=stopped)
    assert server.seen == []


def test_a_stop_ends_the_pause_between_attempts(server: Any, answer: Any) -> None:
    """Nobody waits for a pause after pressing Cancel."""
    stopped = threading.Event()
    server.on(MERGE, answer(502, before=stopped.set))
    with (
        SiloClient(server.url, retries=Retries(first=600, longest=600)) as client,
        pytest.raises(CancelledError),
    ):
        client.merge_bom("A01-0001", merge_request(), cancelled=stopped)
    assert len(server.seen) == 1


def test_a_stop_ends_a_long_answer(server: Any, answer: Any) -> None:
    """Looked at with each piece."""
    stopped = threading.Event()

    def drip() -> Iterator[bytes]:
        yield b"{"
        stopped.set()
        while not server.ending.is_set():
            yield b" "

    server.on(MERGE, answer(200, chunks=drip()))
    with SiloClient(server.url) as client, pytest.raises(CancelledError):
        client.merge_bom("A01-0001", merge_request(), cancelled=stopped)


# -- TLS ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A certificate of our own for 127.0.0.1, with its key in the same file."""
    folder = tmp_path_factory.mktemp("tls")
    pem = folder / "server.pem"
    command = (
        "openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=127.0.0.1"
        " -addext subjectAltName=IP:127.0.0.1 -keyout key.pem -out cert.pem"
    )
    try:
        subprocess.run(command.split(), cwd=folder, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(f"needs the openssl command to make a certificate: {error}")
    pem.write_bytes((folder / "key.pem").read_bytes() + (folder / "cert.pem").read_bytes())
    return pem


@pytest.fixture
def tls_server(certificate: Path, new_server: Any) -> Any:
    import ssl

    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificate)
    return new_server(context)


def test_an_unknown_certificate_is_refused_and_said_how_to_trust(tls_server: Any) -> None:
    """Nothing is sent before that."""
    tls_server.on("*", ITEM)
    with (
        SiloClient(tls_server.url, "silo_secret", retries=Retries(tries=1)) as client,
        pytest.raises(UnreachableError, match=r"certificate is not trusted.*SILO_SSL_VERIFY"),
    ):
        client.get_item("F01-0001")
    assert tls_server.seen == []


def test_an_own_authority_is_trusted_by_its_file(tls_server: Any, certificate: Path) -> None:
    """verify=path."""
    tls_server.on("*", ITEM)
    with SiloClient(tls_server.url, verify=certificate.with_name("cert.pem")) as client:
        assert client.get_item("F01-0001").part_number == "F01-0001"


def test_nothing_follows_from_https_to_http(
    tls_server: Any, server: Any, certificate: Path, answer: Any
) -> None:
    """Neither token nor question."""
    tls_server.on("*", answer(302, headers={"Location": f"{server.url}/api/items/F01-0001"}))
    with (
        SiloClient(tls_server.url, "silo_secret", verify=certificate.with_name("cert.pem")) as client,
        pytest.raises(ServerFaultError, match="not secure"),
    ):
        client.get_item("F01-0001")
    assert server.seen == []


def test_http_spoken_on_an_https_address_is_reported(server: Any) -> None:
    """A wrong scheme in the settings."""
    with (
        SiloClient(server.url.replace("http:", "https:"), retries=Retries(tries=1)) as client,
        pytest.raises(UnreachableError, match="speaks no https"),
    ):
        client.get_item("F01-0001")
