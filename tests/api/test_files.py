# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files over HTTP: streamed, checked, stopped, never half-written."""

from __future__ import annotations

import hashlib
import os
import threading
import tracemalloc
from collections.abc import Iterator
from email.parser import BytesParser
from email.policy import HTTP
from pathlib import Path
from typing import Any

import pytest

from silo.api.client import SiloClient
from silo.bom.errors import (
    CancelledError,
    ConflictError,
    DocumentError,
    ForbiddenError,
    InputError,
    NotFoundError,
    UnreachableError,
)

UPLOAD = "POST /api/items/A01-0001/file"
DOWNLOAD = "GET /api/items/A01-0001/file"


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / 'Wel"le ä.FCStd'
    path.write_bytes(bytes(range(256)) * 4000)
    return path


def parts_of(seen: Any) -> dict[str, tuple[str | None, bytes]]:
    """The parts of a multipart form, as the standard library's own parser reads them."""
    head = f"Content-Type: {seen.headers['Content-Type']}\r\n\r\n".encode()
    form = BytesParser(policy=HTTP).parsebytes(head + seen.body)
    return {
        part.get_param("name", header="content-disposition"): (
            part.get_param("filename", header="content-disposition"),
            part.get_payload(decode=True),
        )
        for part in form.iter_parts()
    }


def test_a_form_holds_comment_properties_and_file(server: Any, client: SiloClient, source: Path) -> None:
    """silo-contract §1.4; the length is known, so that nothing is sent in chunks."""
    server.on(UPLOAD, {"revision_number": 3})
    made = client.upload_file(
        "A01-0001", source, "längere\r\nWelle", {"mass_kg": 1.5}, idempotency_key="key-1"
    )
    (seen,) = server.seen
    parts = parts_of(seen)
    assert made.revision_number == 3
    assert {name: content for name, (_, content) in parts.items()} == {
        "comment": "längere\r\nWelle".encode(),
        "kind": b"model",
        "properties": b'{"mass_kg": 1.5}',
        "file": source.read_bytes(),
    }
    assert parts["file"][0] == "Wel%22le ä.FCStd"
    assert seen.headers["Content-Length"] == str(len(seen.body))
    assert seen.headers["Transfer-Encoding"] is None
    assert seen.headers["Idempotency-Key"] == "key-1"


def test_a_name_cannot_break_out_of_its_header(server: Any, client: SiloClient, source: Path) -> None:
    """Line ends and quotes in a file name stay in it."""
    server.on(UPLOAD, {"revision_number": 1})
    client.upload_file("A01-0001", source, file_name='x"\r\nX-Evil: 1\r\n\r\n.FCStd')
    assert set(parts_of(server.seen[0])) == {"comment", "file", "kind"}
    assert b"X-Evil" in server.seen[0].body.rpartition(b"filename=")[2].split(b"\r\n\r\n")[0]


def test_an_empty_file_is_a_file(server: Any, client: SiloClient, tmp_path: Path) -> None:
    """Nothing divides by its size."""
    (tmp_path / "empty").touch()
    server.on(UPLOAD, {"revision_number": 1, "file_checksum": hashlib.sha256(b"").hexdigest()})
    client.upload_file("A01-0001", tmp_path / "empty")
    assert parts_of(server.seen[0])["file"][1] == b""


@pytest.mark.parametrize("form", ["{}", "sha256:{}", "upper"])
def test_the_servers_checksum_is_compared(server: Any, client: SiloClient, source: Path, form: str) -> None:
    """In any spelling; another one means that the file was damaged on the way."""
    sha256 = hashlib.sha256(source.read_bytes()).hexdigest()
    told = sha256.upper() if form == "upper" else form.format(sha256)
    server.on(
        UPLOAD, {"revision_number": 1, "file_checksum": told}, {"revision_number": 2, "sha256": "0" * 64}
    )
    client.upload_file("A01-0001", source)
    with pytest.raises(ConflictError, match=r"other content than was sent.*revision 2"):
        client.upload_file("A01-0001", source)


def test_a_file_that_is_not_there_is_no_request(server: Any, client: SiloClient, tmp_path: Path) -> None:
    """Ours to mend; nor are properties that JSON cannot hold."""
    with pytest.raises(DocumentError, match=r"gone\.FCStd.*nothing was sent"):
        client.upload_file("A01-0001", tmp_path / "gone.FCStd")
    with pytest.raises(InputError):
        client.upload_file("A01-0001", tmp_path, properties={"mass": float("inf")})
    assert server.seen == []


def test_a_file_that_shrinks_while_it_is_sent_is_reported(
    server: Any, client: SiloClient, source: Path
) -> None:
    """Somebody saved it again under our hands."""
    server.on(UPLOAD, {"revision_number": 1})

    def shrink(done: int, total: int) -> None:
        os.truncate(source, 20_000)

    with pytest.raises(DocumentError, match="became shorter"):
        client.upload_file("A01-0001", source, on_progress=shrink)


def test_an_upload_can_be_stopped(server: Any, client: SiloClient, source: Path) -> None:
    """Between two blocks; the server gets half a form, which is none."""
    stopped = threading.Event()
    with pytest.raises(CancelledError):
        client.upload_file("A01-0001", source, on_progress=lambda *_: stopped.set(), cancelled=stopped)


def test_a_refusal_before_the_end_of_the_upload_is_read(
    server: Any, client: SiloClient, source: Path, answer: Any
) -> None:
    """403 with its reason."""
    server.on(UPLOAD, answer(403, {"error": "forbidden", "message": "viewer"}))
    with pytest.raises(ForbiddenError, match="viewer"):
        client.upload_file("A01-0001", source)


def test_an_upload_is_never_repeated_by_itself(
    server: Any, client: SiloClient, source: Path, answer: Any
) -> None:
    """It would make a second revision; the outbox knows how to look first."""
    server.on(UPLOAD, answer(drop=True))
    with pytest.raises(UnreachableError):
        client.upload_file("A01-0001", source)
    assert len(server.seen) == 1


def test_a_redirected_upload_sends_the_whole_file_again(
    server: Any, client: SiloClient, source: Path, answer: Any
) -> None:
    """307 within the server keeps the body, from its beginning."""
    server.on(UPLOAD, answer(307, headers={"Location": "/v2/file"}))
    server.on("POST /v2/file", {"revision_number": 1})
    client.upload_file("A01-0001", source)
    assert parts_of(server.seen[1])["file"][1] == source.read_bytes()


def test_a_big_file_does_not_fill_the_memory(
    server: Any, client: SiloClient, tmp_path: Path, answer: Any
) -> None:
    """32 MB down again: a few blocks are held, not the file."""
    target = tmp_path / "big.FCStd"
    size, block = 32 << 20, b"\0" * (1 << 20)
    server.on(
        DOWNLOAD,
        answer(200, headers={"Content-Length": str(size)}, chunks=(block for _ in range(size >> 20))),
    )
    tracemalloc.start()
    client.download_file("A01-0001", target)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert target.stat().st_size == size
    assert peak < size / 4


@pytest.mark.parametrize("missing", [1, 100_000])
def test_half_a_file_replaces_nothing(
    server: Any, client: SiloClient, tmp_path: Path, answer: Any, missing: int
) -> None:
    """The connection broke: what was there stays, and no remains lie about."""
    target = tmp_path / "Top.FCStd"
    target.write_bytes(b"old")
    server.on(DOWNLOAD, answer(200, b"x" * 200_000, {"Content-Length": str(200_000 + missing)}))
    with pytest.raises(UnreachableError):
        client.download_file("A01-0001", target)
    assert target.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [target]


def test_a_download_can_be_stopped(server: Any, client: SiloClient, tmp_path: Path, answer: Any) -> None:
    """With each piece; nothing is left."""
    stopped = threading.Event()

    def drip() -> Iterator[bytes]:
        while not server.ending.is_set():
            yield b"x" * 1000

    server.on(DOWNLOAD, answer(200, chunks=drip()))
    with pytest.raises(CancelledError):
        client.download_file(
            "A01-0001", tmp_path / "f", on_progress=lambda *_: stopped.set(), cancelled=stopped
        )
    assert list(tmp_path.iterdir()) == []


def test_a_storage_elsewhere_gets_no_token(
    server: Any, other_server: Any, client: SiloClient, tmp_path: Path, answer: Any
) -> None:
    """A pre-signed address: the file is fetched from there, the token is not shown there."""
    server.on(f"{DOWNLOAD}/2", answer(302, headers={"Location": f"{other_server.url}/signed"}))
    other_server.on("GET /signed", b"content")
    assert client.download_file("A01-0001", tmp_path / "f", 2) == hashlib.sha256(b"content").hexdigest()
    assert other_server.seen[0].headers["Authorization"] is None


def test_a_place_that_cannot_be_written_is_reported(
    server: Any, client: SiloClient, tmp_path: Path, answer: Any
) -> None:
    """And so is a file that the server does not have."""
    server.on(DOWNLOAD, b"content")
    with pytest.raises(DocumentError, match="cannot be written"):
        client.download_file("A01-0001", tmp_path / "no" / "such" / "folder")
    server.on("GET /api/items/B/file", answer(404, {"error": "not_found"}))
    with pytest.raises(NotFoundError):
        client.download_file("B", tmp_path / "f")
