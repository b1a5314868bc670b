# SPDX-License-Identifier: LGPL-2.1-or-later
"""A file as the body of a request: streamed from the disk, hashed as it is read."""

from __future__ import annotations

import hashlib
import os
import secrets
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import BinaryIO, Self

from silo.api.transport import Cancel, stop_if
from silo.bom.errors import DocumentError
from silo.bom.message import message
from silo.bom.system_refusals import why_refused

_BLOCK = 1 << 18

Progress = Callable[[int, int], object]
"""Called with (bytes done, bytes in all)."""


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
        # The quoting that browsers use for file names (WHATWG HTML, multipart/form-data encoding).
        quoted = file_name.replace('"', "%22").replace("\r", "%0D").replace("\n", "%0A")
        begin, disposition = f"--{self._boundary}\r\n", "Content-Disposition: form-data; name="
        parts = [
            f'{begin}{disposition}"{name}"\r\nContent-Type: text/plain; charset=utf-8\r\n\r\n{text}\r\n'
            for name, text in fields.items()
        ]
        parts.append(f'{begin}{disposition}"file"; filename="{quoted}"\r\n')
        parts.append("Content-Type: application/octet-stream\r\n\r\n")
        self._begin = "".join(parts).encode("utf-8", "replace")
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
        """Return the hash of the bytes of the file that were read so far; it is the file's when the form is
        read to its end.
        """
        return self._hash.hexdigest()

    def rewound(self) -> Self:
        """Go back to the beginning of the form, for a redirect, and return it."""
        self._head, self._tail, self._left = self._begin, self._end, self.file_size
        self._hash = hashlib.sha256()
        self._file.seek(0)
        return self

    def read(self, size: int = -1) -> bytes:
        """Read the next bytes of the form."""
        stop_if(self._cancelled)
        if self._head:
            size = len(self._head) if size < 0 else size
            block, self._head = self._head[:size], self._head[size:]
            return block
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

    def _take_file(self, size: int) -> bytes:
        try:
            block = self._file.read(min(self._left, size if size > 0 else _BLOCK))
        except OSError as error:
            raise _unreadable(self._path, error) from error
        if not block:
            raise DocumentError(
                str(self._path), message("the file became shorter while it was sent; save it, then try again")
            )
        self._hash.update(block)
        self._left -= len(block)
        if self._progress is not None:
            self._progress(self.file_size - self._left, self.file_size)
        return block


class FileBody(FileForm):
    """The bare bytes of a file as the body of a request."""

    def __init__(self, path: Path, on_progress: Progress | None, cancelled: Cancel | None) -> None:
        super().__init__(path, {}, path.name, on_progress, cancelled)
        self._begin = self._end = b""
        self.len = self.file_size
        self.rewound()


def _unreadable(path: Path, error: OSError) -> DocumentError:
    return DocumentError(
        str(path),
        message("the file cannot be read ({error}); nothing was sent", error=why_refused(error)),
    )
