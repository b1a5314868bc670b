# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files of items over HTTP: streamed both ways, checked by SHA-256, never half-written."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO
from urllib.parse import urljoin

from silo.api.multipart import FileBody, FileForm, Progress, as_json, upload_fields
from silo.api.replies import error_of
from silo.api.transport import MAX_ERROR, Call, Cancel, Transport
from silo.api.wire import Origin, Revision
from silo.bom.errors import (
    ConflictError,
    DocumentError,
    RejectedError,
    RouteMissingError,
    ServerFaultError,
)
from silo.durable import replacing

MAX_DOWNLOAD = 4 << 30


def upload(
    transport: Transport,
    part_number: str,
    path: Path,
    comment: str,
    properties: Mapping[str, Any] | None,
    on_progress: Progress | None,
    *,
    file_name: str | None,
    idempotency_key: str | None,
    sha256: str | None,
    origin: Origin | None,
    cancelled: Cancel | None,
) -> Revision:
    """Send a file as a new revision (``POST …/file``); the server's checksum must be that of the file.

    A server that takes no form gets the file in two steps.
    """
    name = file_name or path.name
    subject = f"{name} for {part_number}"
    fields = upload_fields(comment, properties, sha256) | _origin_fields(origin)
    with FileForm(path, fields, file_name=name, on_progress=on_progress, cancelled=cancelled) as form:
        headers = {"Content-Type": form.content_type, "Accept": "application/json"}
        if idempotency_key:
            headers["Idempotency-Key"] = idempotency_key
        call = Call(
            "POST",
            transport.address.api("items", part_number, "file"),
            subject,
            body=form.rewound,
            headers=headers,
            cancelled=cancelled,
        )
        try:
            revision, sent = transport.send(call).model(Revision), form.sha256
        except RouteMissingError:
            revision, sent = _in_two_steps(transport, call, path, name, comment, properties, on_progress)
        except RejectedError as error:
            if error.status != 415:
                raise
            revision, sent = _in_two_steps(transport, call, path, name, comment, properties, on_progress)
    stored = (revision.file_checksum or sent).lower().removeprefix("sha256:")
    if stored != sent:
        # Sending it again by itself would make a revision each time.
        raise ConflictError(
            f"{transport.address.host} stored another content than was sent for {subject} "
            f"(revision {revision.revision_number}); look at that revision, then send the file again"
        )
    return revision


def _origin_fields(origin: Origin | None) -> dict[str, str]:
    """Where the file came from; a server that knows none of these takes no notice."""
    said: dict[str, str] = {}
    if origin is None:
        return said
    if origin.base_revision is not None:
        said["base_revision"] = str(origin.base_revision)
    if origin.file_path:
        said["path"] = origin.file_path
    if origin.links is not None:
        said["links"] = as_json([link.model_dump() for link in origin.links]).decode()
    return said


def _in_two_steps(
    transport: Transport,
    call: Call,
    path: Path,
    name: str,
    comment: str,
    properties: Mapping[str, Any] | None,
    on_progress: Progress | None,
) -> tuple[Revision, str]:
    """First the bytes to the server's store, then the revision (silo-contract §1.4, "presign").

    For a server that takes no forms. The store may be another host: it gets no token.
    """
    size = path.stat().st_size
    about = {"filename": name, "content_type": "application/octet-stream", "size": size}
    headers = {**call.headers, "Content-Type": "application/json"}
    asked = as_json(about)
    place = transport.send(
        replace(
            call,
            url=transport.address.api("uploads", "presign"),
            body=lambda: asked,
            headers=headers,
            repeatable=True,
        )
    ).mapping()
    key, url = place.get("object_key"), place.get("upload_url")
    if not isinstance(key, str) or not isinstance(url, str):
        raise ServerFaultError(f"{call.subject}: the server names no place to upload the file to")
    content = FileBody(path, on_progress=on_progress, cancelled=call.cancelled)
    with content:
        put = replace(
            call,
            method="PUT",
            url=urljoin(transport.address.web_root + "/", url),
            body=content.rewound,
            headers={"Content-Type": "application/octet-stream"},
            repeatable=True,
        )
        transport.send(put)
        sha256 = content.sha256
    said = {**about, "object_key": key, "comment": comment, "file_checksum": sha256}
    final = as_json({**said, "properties": dict(properties)} if properties else said)
    return transport.send(replace(call, body=lambda: final, headers=headers)).model(Revision), sha256


def download(
    transport: Transport,
    part_number: str,
    path: Path,
    revision: int | None,
    on_progress: Progress | None,
    *,
    cancelled: Cancel | None,
) -> str:
    """Fetch a file (the latest revision's, or the given one's) to ``path``; gives its SHA-256 in hex.

    ``path`` appears whole or not at all; what was there before is replaced only then.
    """
    segments = ("items", part_number, "file") + ((str(revision),) if revision is not None else ())
    call = Call(
        "GET",
        transport.address.api(*segments),
        f"the file of {part_number}",
        headers={"Accept-Encoding": "identity"},
        max_bytes=MAX_DOWNLOAD,
        endless=True,
        cancelled=cancelled,
    )
    with transport.opened(call) as response:
        if not 200 <= response.status_code < 300:
            raise error_of(transport.reply(response, replace(call, max_bytes=MAX_ERROR, endless=False)))
        total = response.headers.get("Content-Length", "")
        pieces = transport.pieces(response, call)
        return _write(path, pieces, int(total) if total.isdigit() else 0, on_progress)


def _write(path: Path, pieces: Iterator[bytes], total: int, on_progress: Progress | None) -> str:
    digest, done = hashlib.sha256(), 0
    with _replacing(path) as file:
        for piece in pieces:
            done += len(piece)
            digest.update(piece)
            file.write(piece)
            if on_progress is not None:
                on_progress(done, max(total, done))
    return digest.hexdigest()


@contextmanager
def _replacing(path: Path) -> Iterator[BinaryIO]:
    try:
        with replacing(path) as file:
            yield file
    except OSError as error:
        raise DocumentError(str(path), f"cannot be written ({error.strerror or error})") from error
