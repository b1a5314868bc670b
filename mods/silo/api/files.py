# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files of items over HTTP: streamed both ways, checked by SHA-256, never in memory, never half-written."""

from __future__ import annotations

import hashlib
import os
import secrets
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO, Self
from urllib.parse import urljoin

from silo.api.caller import LISTS, Caller
from silo.api.replies import error_of
from silo.api.revisions import checksum_of
from silo.api.transport import MAX_ERROR, Call, Cancel, Transport, as_json, stop_if
from silo.api.wire import LinkedFile, Revision, Wire
from silo.bom.errors import (
    ConflictError,
    DocumentError,
    RejectedError,
    RouteMissingError,
    ServerFaultError,
)
from silo.bom.numbers import whole_number
from silo.durable import replacing

MAX_DOWNLOAD = 4 << 30
_PAGE = 1000  # revisions in one answer
_BLOCK = 1 << 18

Progress = Callable[[int, int], object]
"""Called with (bytes done, bytes in all)."""


class Origin(Wire):
    """What a client says of a file that it sends: the fields of :class:`Revision` of these names."""

    base_revision: int | None = None
    file_path: str = ""
    links: list[LinkedFile] | None = None


class FileCalls(Caller):
    """Revisions of items, and their files."""

    def revisions(self, part_number: str, /, *, newest: int | None = None, after: int = 0) -> list[Revision]:
        """The revisions of an item, newest first; those above the number ``after``.

        ``newest``: only so many. A server that knows neither sends all, and gets no further question.
        """
        found: list[Revision] = []
        params: dict[str, int] = {"limit": newest or _PAGE, **({"after": after} if after else {})}
        while True:
            subject = f"the revisions of {part_number}"
            reply = self._get(subject, "items", part_number, "revisions", params=params)
            page = reply.models(Revision, "revisions", *LISTS)
            lowest = found[-1].revision_number if found else None
            fresh = [r for r in page if r.revision_number > after]
            fresh = [r for r in fresh if lowest is None or r.revision_number < lowest]
            found += sorted(fresh, key=lambda revision: revision.revision_number, reverse=True)
            if newest is not None or not fresh or len(found) >= reply.total:
                return found[:newest]
            params["before"] = found[-1].revision_number

    def get_revision(self, part_number: str, number: int, /) -> Revision:
        """One revision, with the files that its file links to."""
        subject = f"revision {number} of {part_number}"
        return self._get(subject, "items", part_number, "revisions", str(number)).model(Revision)

    def upload_file(
        self,
        part_number: str,
        path: Path | str,
        comment: str = "",
        properties: Mapping[str, Any] | None = None,
        on_progress: Progress | None = None,
        *,
        file_name: str | None = None,
        idempotency_key: str | None = None,
        sha256: str | None = None,
        origin: Origin | None = None,
        cancelled: Cancel | None = None,
    ) -> Revision:
        """Send a file as a new revision, streamed; never repeated by itself (see :mod:`silo.outbox`).

        ``sha256`` is what must arrive: a server that knows the field makes no revision of anything else.
        ``origin`` says what the file was made from: :class:`silo.bom.errors.NewerRevisionError` where a newer
        one is there. A server that does not know this takes the file; one that takes no form gets the file in
        two steps. Raises :class:`silo.bom.errors.DocumentError` for a file that cannot be read, ConflictError
        where the server's checksum is another one.
        """
        path = Path(path)
        name = file_name or path.name
        subject = f"{name} for {part_number}"
        fields = _upload_fields(comment, properties, sha256, origin)
        with closing(FileForm(path, fields, name, on_progress, cancelled)) as form:
            headers = {"Content-Type": form.content_type, "Accept": "application/json"}
            if idempotency_key:
                headers["Idempotency-Key"] = idempotency_key
            url = self._address.api("items", part_number, "file")
            call = Call("POST", url, subject, body=form.rewound, headers=headers, cancelled=cancelled)
            try:
                revision, sent = self._transport.send(call).model(Revision), form.sha256
            except (RouteMissingError, RejectedError) as error:
                if isinstance(error, RejectedError) and error.status != 415:
                    raise
                about = {"comment": comment, **({"properties": dict(properties)} if properties else {})}
                revision, sent = _in_two_steps(self._transport, call, path, name, about, on_progress)
        if (checksum_of(revision) or sent) != sent:
            # Sending it again by itself would make a revision each time.
            raise ConflictError(
                f"{self._address.host} stored another content than was sent for {subject} "
                f"(revision {revision.revision_number}); look at that revision, then send the file again"
            )
        return revision

    def download_file(
        self,
        part_number: str,
        path: Path | str,
        revision: int | None = None,
        on_progress: Progress | None = None,
        *,
        cancelled: Cancel | None = None,
    ) -> str:
        """Fetch the latest file of an item, or that of a revision, to ``path``; gives its SHA-256 in hex.

        ``path`` appears whole or not at all; what was there before is replaced only then. The bytes may
        differ from those uploaded: a server re-packs some formats.
        """
        segments = ("items", part_number, "file") + ((str(revision),) if revision is not None else ())
        call = Call(
            "GET",
            self._address.api(*segments),
            f"the file of {part_number}",
            headers={"Accept-Encoding": "identity"},
            max_bytes=MAX_DOWNLOAD,
            endless=True,
            cancelled=cancelled,
        )
        transport = self._transport
        with transport.opened(call) as response:
            if not 200 <= response.status_code < 300:
                raise error_of(transport.reply(response, replace(call, max_bytes=MAX_ERROR, endless=False)))
            total = whole_number(response.headers.get("Content-Length", "")) or 0
            return _write(Path(path), transport.pieces(response, call), total, on_progress)


def _upload_fields(
    comment: str, properties: Mapping[str, object] | None, sha256: str | None, origin: Origin | None
) -> dict[str, str]:
    """The text parts of an upload: comment, properties, what must arrive, and where the file came from.

    A server that does not know the last two ignores them.
    """
    fields = {"comment": comment}
    if properties:
        fields["properties"] = as_json(properties).decode()
    if sha256:
        fields["sha256"] = sha256
    if origin is None:
        return fields
    if origin.base_revision is not None:
        fields["base_revision"] = str(origin.base_revision)
    if origin.file_path:
        fields["path"] = origin.file_path
    if origin.links is not None:
        fields["links"] = as_json([link.model_dump() for link in origin.links]).decode()
    return fields


def _in_two_steps(
    transport: Transport,
    call: Call,
    path: Path,
    name: str,
    said: Mapping[str, Any],
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
    with closing(FileBody(path, on_progress, call.cancelled)) as content:
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
    final = as_json({**about, "object_key": key, **said, "file_checksum": sha256})
    return transport.send(replace(call, body=lambda: final, headers=headers)).model(Revision), sha256


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
        file_name: str,
        on_progress: Progress | None = None,
        cancelled: Cancel | None = None,
    ) -> None:
        self._path = path
        self._progress, self._cancelled = on_progress, cancelled
        self._boundary = secrets.token_hex(16)
        self._begin = self._text_parts(fields) + self._file_head(file_name)
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

    def __init__(self, path: Path, on_progress: Progress | None, cancelled: Cancel | None) -> None:
        super().__init__(path, {}, path.name, on_progress, cancelled)
        self._begin = self._end = b""
        self.len = self.file_size
        self.rewound()


def _unreadable(path: Path, error: OSError) -> DocumentError:
    return DocumentError(str(path), f"the file cannot be read ({error.strerror or error}); nothing was sent")
