# SPDX-License-Identifier: LGPL-2.1-or-later
"""Change the Document.xml of an FCStd file, and nothing else of it.

All other entries keep their bytes, order and times. The file is replaced in one step, so a reader sees the
old one or the new one; what was written is read back first.

The container with one entry packed anew: APPNOTE.TXT 4.3.7, 4.3.12, 4.3.16.
"""

from __future__ import annotations

import contextlib
import os
import stat
import tempfile
import zlib
from collections.abc import Callable, Iterable
from typing import BinaryIO, NamedTuple

from silo.bom.errors import DocumentError
from silo.durable import remove_patiently, sync_folder
from silo.fcstd.container import (
    CENTRAL,
    DOCUMENT_XML,
    END,
    LOCAL,
    ContainerFile,
    Directory,
    Entry,
    FileState,
    Inflater,
)
from silo.fcstd.limits import FcstdError, Limits
from silo.platform import copy_rights, patiently, swap

_HAS_DESCRIPTOR = 0x8
_DEFLATED = 8
_LARGEST = 0xFFFFFFFF
_REFERENCES = {'"': "&quot;", "'": "&apos;", "\n": "&#10;", "\r": "&#13;", "\t": "&#9;"}


class Span(NamedTuple):
    """Bytes of the old container that stay as they are: taken from there when the new one is written."""

    offset: int
    length: int


Piece = bytes | Span


def in_attribute(text: str) -> str:
    """A text as the value of an XML attribute, to stand between quotes."""
    from xml.sax.saxutils import escape  # late, as it imports HTTP and TLS

    return escape(text, _REFERENCES)


def replaced_entry(container: ContainerFile, entry: Entry, content: bytes) -> tuple[Piece, ...]:
    """The container with ``content`` in ``entry``, in pieces: a big file is never held in memory.

    Raises FcstdError where entries overlap, or the result were too large for a plain zip.
    """
    entries = _entries(container)
    begin = entry.offset
    # Up to the next entry: header, data, a data descriptor where there is one, and any padding.
    end = min((e.offset for e in entries if e.offset > begin), default=container.directory.offset)
    if end < container.data_offset(entry) + entry.packed:
        raise FcstdError(container.path, "it is damaged: its entries overlap")
    local, packed = _local(container, entry, content)
    growth = len(local) - (end - begin)
    before, after = Span(0, begin), Span(end, container.directory.offset - end)
    directory = _directory(container.directory, entries, entry, content, packed, growth)
    tail = _end(container.directory, growth)
    size = before.length + len(local) + after.length + len(directory) + len(tail)
    if size > _LARGEST:
        raise FcstdError(container.path, "it is too large for a plain zip container")
    return before, local, after, directory, tail


def _entries(container: ContainerFile) -> list[Entry]:
    try:
        return list(container.directory.entries())
    except ValueError as error:
        raise FcstdError(container.path, str(error)) from error


def _local(container: ContainerFile, entry: Entry, content: bytes) -> tuple[bytes, int]:
    """Local header and data, and the packed length; times, name and extra field as they were."""
    engine = zlib.compressobj(wbits=-zlib.MAX_WBITS)
    data = engine.compress(content) + engine.flush()
    header = list(LOCAL.unpack(container.read(entry.offset, LOCAL.size)))
    names = container.read(entry.offset + LOCAL.size, header[9] + header[10])
    header[2] &= ~_HAS_DESCRIPTOR
    header[3] = _DEFLATED
    header[6:9] = [zlib.crc32(content), len(data), len(content)]
    return LOCAL.pack(*header) + names + data, len(data)


def _directory(
    directory: Directory, entries: list[Entry], changed: Entry, content: bytes, packed: int, growth: int
) -> bytes:
    raw = bytearray(directory.raw)
    for entry in entries:
        fields = list(CENTRAL.unpack_from(raw, entry.central))
        if entry == changed:
            fields[3] &= ~_HAS_DESCRIPTOR
            fields[4] = _DEFLATED
            fields[7:10] = [zlib.crc32(content), packed, len(content)]
        elif entry.offset > changed.offset:
            fields[16] += growth
        CENTRAL.pack_into(raw, entry.central, *fields)
    return bytes(raw)


def _end(directory: Directory, growth: int) -> bytes:
    fields = list(END.unpack_from(directory.tail))
    fields[6] += growth
    return END.pack(*fields) + directory.tail[END.size :]


_BLOCK = 1 << 20

# The text of Document.xml → as it is to become; ValueError where it cannot be edited, says why.
Edit = Callable[[bytes], bytes]


def changed(path: str) -> FcstdError:
    """Somebody else wrote the file meanwhile."""
    return FcstdError(path, "it was changed by somebody else meanwhile; nothing was written")


def check_writable(path: str) -> None:
    """Raise DocumentError where the file may not be replaced."""
    # Asked of the mode: an administrator may write anything, and replacing a file needs no right to it at
    # all.
    if not os.stat(path).st_mode & stat.S_IWUSR or not os.access(path, os.W_OK):
        raise DocumentError(path, "it is read-only; nothing was written")
    if not os.access(os.path.dirname(path), os.W_OK):
        raise DocumentError(path, "its folder is read-only; nothing was written")
    names = os.stat(path).st_nlink
    if names > 1:
        raise DocumentError(
            path,
            f"it has {names} names on this disk (hard links), and the others would keep the old content; "
            "nothing was written. Make it a file of its own: copy it, then put the copy in its place",
        )


def document_xml(container: ContainerFile, limits: Limits) -> tuple[Entry, bytes]:
    """The entry Document.xml and its text. Raises DocumentError."""
    entry = container.entry(DOCUMENT_XML)
    if entry is None:
        raise FcstdError(container.path, "it is no FreeCAD document (there is no Document.xml in it)")
    packed = container.packed(entry, limits.packed)
    return entry, Inflater(container.path, entry, packed, limits.document_xml, limits).whole()


def edited_xml(container: ContainerFile, edit: Edit, limits: Limits) -> tuple[Entry, bytes]:
    """The entry Document.xml, and its text as it is to become. Raises DocumentError."""
    entry, text = document_xml(container, limits)
    try:
        return entry, edit(text)
    except ValueError as error:
        raise FcstdError(container.path, f"its Document.xml {error}; nothing was written") from error


def replace_file(path: str, state: FileState, content: Iterable[Piece], check: Callable[[str], None]) -> None:
    """Replace the file, which must still be in ``state``, in one step. Raises DocumentError.

    check
        looks at the copy that was written, and raises DocumentError where it is not what it should be.
    """
    # The file is closed by now: Windows lets nobody replace an open one.
    try:
        _write(path, state, content, check)
    except OSError as error:
        raise DocumentError(path, f"it cannot be written: {error.strerror or error}") from error


def _write(path: str, state: FileState, content: Iterable[Piece], check: Callable[[str], None]) -> None:
    folder = os.path.dirname(path)
    descriptor, temporary = tempfile.mkstemp(prefix=".silo-", suffix=".tmp", dir=folder)
    try:
        with os.fdopen(descriptor, "wb") as file:
            _put(path, content, file)
            file.flush()
            copy_rights(path, temporary)
            os.fsync(file.fileno())
        check(temporary)
        if FileState.now(path) != state:
            raise changed(path)
        patiently(lambda: swap(temporary, path))
    except BaseException:
        with contextlib.suppress(OSError):
            remove_patiently(temporary)
        raise
    sync_folder(folder)


def _put(path: str, content: Iterable[Piece], file: BinaryIO) -> None:
    with open(path, "rb") as old:
        for piece in content:
            if isinstance(piece, bytes):
                file.write(piece)
                continue
            old.seek(piece.offset)
            left = piece.length
            while left:
                block = old.read(min(left, _BLOCK))
                if not block:
                    raise changed(path)
                file.write(block)
                left -= len(block)
