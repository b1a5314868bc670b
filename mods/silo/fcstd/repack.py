# SPDX-License-Identifier: LGPL-2.1-or-later
"""The container of an FCStd file with one entry packed again: APPNOTE.TXT 4.3.7, 4.3.12, 4.3.16."""

from __future__ import annotations

import zlib
from typing import NamedTuple

from silo.bom.message import message
from silo.fcstd.container import CENTRAL, END, LOCAL, ContainerFile, Directory, ZipEntry
from silo.fcstd.errors import FcstdError

_HAS_DESCRIPTOR = 0x8
_DEFLATED = 8
_LARGEST = 0xFFFFFFFF


class KeptBytes(NamedTuple):
    """Bytes of the old container that stay as they are: taken from there when the new one is written."""

    offset: int
    length: int


Piece = bytes | KeptBytes


def replaced_entry(container: ContainerFile, entry: ZipEntry, content: bytes) -> tuple[Piece, ...]:
    """Make the container with ``content`` in ``entry``, in pieces, so that a big file is never held in
    memory.

    Raises FcstdError if entries overlap, or if the result is too large for a plain zip.
    """
    entries = _entries(container)
    begin = entry.offset
    # Up to the next entry: header, data, a data descriptor if there is one, and any padding.
    end = min((e.offset for e in entries if e.offset > begin), default=container.directory.offset)
    if end < container.data_offset(entry) + entry.packed:
        raise FcstdError(container.path, message("it is damaged: its entries overlap"))
    local, packed = _local(container, entry, content)
    growth = len(local) - (end - begin)
    before, after = KeptBytes(0, begin), KeptBytes(end, container.directory.offset - end)
    directory = _directory(container.directory, entries, entry, content, packed, growth)
    tail = _end(container.directory, growth)
    size = before.length + len(local) + after.length + len(directory) + len(tail)
    if size > _LARGEST:
        raise FcstdError(container.path, message("it is too large for a plain zip container"))
    return before, local, after, directory, tail


def _entries(container: ContainerFile) -> list[ZipEntry]:
    try:
        return list(container.directory.entries())
    except ValueError as error:
        raise FcstdError(container.path, str(error)) from error


def _local(container: ContainerFile, entry: ZipEntry, content: bytes) -> tuple[bytes, int]:
    """Make the local header and data, and return them with the packed length; times, name and extra field
    stay.
    """
    engine = zlib.compressobj(wbits=-zlib.MAX_WBITS)
    data = engine.compress(content) + engine.flush()
    header = list(LOCAL.unpack(container.read(entry.offset, LOCAL.size)))
    names = container.read(entry.offset + LOCAL.size, header[9] + header[10])
    header[2] &= ~_HAS_DESCRIPTOR
    header[3] = _DEFLATED
    header[6:9] = [zlib.crc32(content), len(data), len(content)]
    return LOCAL.pack(*header) + names + data, len(data)


def _directory(
    directory: Directory, entries: list[ZipEntry], changed: ZipEntry, content: bytes, packed: int, growth: int
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
