# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files of items over HTTP: streamed both ways, checked by SHA-256, never in memory, never half-written."""

from __future__ import annotations

import hashlib
import json
import os
import secrets
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self
from urllib.parse import urljoin

from silo.api.replies import error_of
from silo.api.transport import MAX_ERROR, Call, Cancel, Transport, stop_if
from silo.api.wire import LinkedFile, Revision, Wire
from silo.bom.errors import (
    ConflictError,
    DocumentError,
    InputError,
    RejectedError,
    RouteMissingError,
    ServerFaultError,
)
from silo.durable import replacing

Progress = Callable[[int, int], object]
"""Told (bytes done, bytes in all)."""

_BLOCK = 1 << 18


class FileForm:
    """The body of a multipart upload; a readable of known length, as :mod:`requests` wants a stream.

    fields
        text parts, sent before the file.
    on_progress
        called with the bytes of the file that were taken so far; a pure observer.

    Raises :class:`DocumentError` where the file cannot be read or changes under our hands.
    """

    def __init__(
        self,
        path: Path,
        fields: Mapping[str, str],
        *,
        file_name: str | None = None,
        on_progress: Progress | None = None,
        cancelled: Cancel | None = None,
    ) -> None:
        self._path = path
        self._progress, self._cancelled = on_progress, cancelled
        self._boundary = secrets.token_hex(16)
        self._begin = self._text_parts(fields) + self._file_head(file_name or path.name)
        self._end = f"\r\n--{self._boundary}--\r\n".encode()
        try:
            self._file: BinaryIO = path.open("rb")
        except OSError as error:
            raise _unreadable(path, error) from error
        self.file_size = os.fstat(self._file.fileno()).st_size
        # `requests` takes the length of a stream from this attribute and sends it as Content-Length.
        self.len = len(self._begin) + self.file_size + len(self._end)
        self.rewound()

    @property
    def content_type(self) -> str:
        return f"multipart/form-data; boundary={self._boundary}"

    @property
    def sha256(self) -> str:
        """Of the bytes read so far; of the file, once the form was read to its end."""
        return self._hash.hexdigest()

    def rewound(self) -> Self:
        """The form from its beginning: a redirect wants it once more."""
        self._head, self._tail, self._left = self._begin, self._end, self.file_size
        self._hash = hashlib.sha256()
        self._file.seek(0)
        return self

    def read(self, size: int = -1) -> bytes:
        """The next bytes of the form."""
        stop_if(self._cancelled)
        if self._head:
            return self._take_head(size)
        if self._left:
            return self._take_file(size)
        tail, self._tail = self._tail, b""
        return tail

    def __iter__(self) -> Self:
        return self

    def __next__(self) -> bytes:
        block = self.read(_BLOCK)
        if not block:
            raise StopIteration
        return block

    def close(self) -> None:
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _take_head(self, size: int) -> bytes:
        size = len(self._head) if size < 0 else size
        block, self._head = self._head[:size], self._head[size:]
        return block

    def _take_file(self, size: int) -> bytes:
        try:
            block = self._file.read(min(self._left, size if size > 0 else _BLOCK))
        except OSError as error:
            raise _unreadable(self._path, error) from error
        if not block:
            raise DocumentError(
                str(self._path), "the file became shorter while it was sent; save it, then try again"
            )
        self._hash.update(block)
        self._left -= len(block)
        if self._progress is not None:
            self._progress(self.file_size - self._left, self.file_size)
        return block

    def _text_parts(self, fields: Mapping[str, str]) -> bytes:
        return "".join(
            f'--{self._boundary}\r\nContent-Disposition: form-data; name="{name}"\r\n'
            f"Content-Type: text/plain; charset=utf-8\r\n\r\n{text}\r\n"
            for name, text in fields.items()
        ).encode("utf-8", "replace")

    def _file_head(self, name: str) -> bytes:
        # The quoting that browsers use for file names (WHATWG HTML, multipart/form-data encoding).
        quoted = name.replace('"', "%22").replace("\r", "%0D").replace("\n", "%0A")
        return (
            f'--{self._boundary}\r\nContent-Disposition: form-data; name="file"; filename="{quoted}"\r\n'
            "Content-Type: application/octet-stream\r\n\r\n"
        ).encode("utf-8", "replace")


class FileBody(FileForm):
    """The bare bytes of a file as the body of a request."""

    def __init__(
        self, path: Path, *, on_progress: Progress | None = None, cancelled: Cancel | None = None
    ) -> None:
        super().__init__(path, {}, on_progress=on_progress, cancelled=cancelled)
        self._begin = self._end = b""
        self.len = self.file_size
        self.rewound()


def upload_fields(
    comment: str, properties: Mapping[str, object] | None, sha256: str | None = None
) -> dict[str, str]:
    """The text parts of a file upload: the comment, the properties as JSON, and what must arrive."""
    fields = {"comment": comment}
    if properties:
        fields["properties"] = as_json(properties).decode()
    if sha256:
        fields["sha256"] = sha256
    return fields


def as_json(data: object) -> bytes:
    """Strict JSON; raises :class:`InputError` for what it cannot hold (NaN, bytes, a value in itself)."""
    try:
        return json.dumps(data, ensure_ascii=False, allow_nan=False).encode("utf-8", "replace")
    except (TypeError, ValueError, RecursionError) as error:
        raise InputError(f"this cannot be sent as JSON: {error}") from error


def _unreadable(path: Path, error: OSError) -> DocumentError:
    return DocumentError(str(path), f"the file cannot be read ({error.strerror or error}); nothing was sent")


MAX_DOWNLOAD = 4 << 30


class Origin(Wire):
    """What a client says of a file that it sends: the fields of :class:`Revision` of these names."""

    base_revision: int | None = None
    file_path: str = ""
    links: list[LinkedFile] | None = None


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
