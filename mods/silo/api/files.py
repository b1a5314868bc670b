# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files of items over HTTP: streamed both ways, checked by SHA-256, never half-written."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO

from silo.api.multipart import FileForm, Progress, upload_fields
from silo.api.replies import error_of
from silo.api.transport import MAX_ERROR, Call, Cancel, Transport
from silo.api.wire import Revision
from silo.bom.errors import ConflictError, DocumentError
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
    cancelled: Cancel | None,
) -> Revision:
    """Send a file as a new revision (``POST …/file``); the server's checksum must be that of the file."""
    subject = f"{path.name} for {part_number}"
    with FileForm(
        path,
        upload_fields(comment, properties, sha256),
        file_name=file_name,
        on_progress=on_progress,
        cancelled=cancelled,
    ) as form:
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
        revision = transport.send(call).model(Revision)
        stored = (revision.file_checksum or form.sha256).lower().removeprefix("sha256:")
        if stored != form.sha256:
            # Sending it again by itself would make a revision each time.
            raise ConflictError(
                f"{transport.address.host} stored another content than was sent for {subject} "
                f"(revision {revision.revision_number}); look at that revision, then send the file again"
            )
    return revision


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
