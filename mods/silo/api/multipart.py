# SPDX-License-Identifier: LGPL-2.1-or-later
"""A form with one file, streamed: the file is never held in memory, and its SHA-256 is taken on the way."""

from __future__ import annotations

import hashlib
import os
import secrets
from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

from silo.api.transport import Cancel, as_json, stop_if
from silo.bom.errors import DocumentError

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


def _unreadable(path: Path, error: OSError) -> DocumentError:
    return DocumentError(str(path), f"the file cannot be read ({error.strerror or error}); nothing was sent")
