# SPDX-License-Identifier: LGPL-2.1-or-later
"""The zip container of an FCStd file, read without trust (APPNOTE.TXT 4.3).

The standard ``zipfile`` builds an object for each of the two entries per link that FreeCAD writes, and cannot
copy an entry as it stands; both matter here, for a quick walk and for stamping. The central directory is the
authority, the local header must agree with it. ZIP64, encryption and methods other than stored and deflated
are refused: FreeCAD writes none of them and cannot read them. Entries are unpacked in bounded steps: sizes
and ratios are counted on the bytes that really come out.
"""

from __future__ import annotations

import os
import stat
import zlib
from collections.abc import Iterator
from io import BytesIO
from struct import Struct
from typing import Any, NamedTuple

from silo.bom.findings import FindingCode
from silo.bom.message import message
from silo.bom.system_refusals import why_refused
from silo.fcstd.errors import FcstdError
from silo.fcstd.limits import Limits

DOCUMENT_XML = b"Document.xml"

# signature, versions, flags, method, time, date, crc, packed, size, name, extra, comment, disk, attributes,
# offset
CENTRAL = Struct("<4sHHHHHHLLLHHHHHLL")
_LENGTHS = Struct("<HHH")
LOCAL = Struct("<4sHHHHHLLLHH")
# signature, disk, disk of directory, entries here, entries, size of directory, its offset, comment length
END = Struct("<4sHHHHLLH")

_CENTRAL_MARK = b"PK\x01\x02"
_LOCAL_MARK = b"PK\x03\x04"
_END_MARK = b"PK\x05\x06"
_LFS_MARK = b"version https://git-lfs.github.com/spec/"
_SMALL, _USUAL_TAIL, _TAIL = 1 << 16, 1 << 13, END.size + 0xFFFF
# Without O_NONBLOCK, opening a named pipe waits until somebody writes to it.
_FLAGS = os.O_RDONLY | sum(getattr(os, name, 0) for name in ("O_NONBLOCK", "O_BINARY", "O_CLOEXEC"))
_ENCRYPTED = 0x1 | 0x40 | 0x2000
STORED, _DEFLATED = 0, 8
# Deflate cannot pack better than this, so this many packed bytes are safe to unpack in one step.
_HIGHEST_RATIO = 1032
# zlib joins its pieces, so a large text that is unpacked in one step would be in memory twice.
_LONGEST_STEP = 1 << 24


class FileStat(NamedTuple):
    """What identifies one state of a file without reading it."""

    device: int
    inode: int
    size: int
    modified_ns: int

    @classmethod
    def of(cls, status: os.stat_result) -> FileStat:
        """Make a state from ``os.stat`` or ``os.fstat``."""
        return cls(status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns)

    @classmethod
    def now(cls, path: str) -> FileStat | None:
        """Read the present state of a file; None if it cannot be read."""
        try:
            return cls.of(os.stat(path))
        except OSError:
            return None


class ZipEntry(NamedTuple):
    """One file in the container, as the central directory has it. ``offset`` counts from the file's begin."""

    name: bytes
    flags: int
    method: int
    crc: int
    packed: int
    size: int
    offset: int
    central: int  # where its record begins in the directory


class Directory(NamedTuple):
    """The central directory: raw, since most readers want one entry of thousands."""

    raw: bytes
    entry_count: int
    offset: int  # of the directory in the file
    shift: int  # bytes before the zip's own begin, which its offsets do not count
    tail: bytes  # end record, comment, and whatever follows

    def entries(self, wanted: bytes | None = None) -> Iterator[ZipEntry]:
        """Yield the entries in directory order, or only those of one name. Raises ValueError if the directory
        is damaged.
        """
        raw, position = self.raw, 0
        for _ in range(self.entry_count):
            if raw[position : position + 4] != _CENTRAL_MARK or position + CENTRAL.size > len(raw):
                raise ValueError(message("its directory is damaged"))
            name_length, extra, comment = _LENGTHS.unpack_from(raw, position + 28)
            name_at = position + CENTRAL.size
            name = raw[name_at : name_at + name_length]
            if wanted is None or name == wanted:
                yield self._entry(name, position)
            position = name_at + name_length + extra + comment
        if position > len(raw):
            raise ValueError(message("its directory is damaged"))

    def _entry(self, name: bytes, position: int) -> ZipEntry:
        fields = CENTRAL.unpack_from(self.raw, position)
        flags, method, crc, packed, size, offset = fields[3], fields[4], *fields[7:10], fields[16]
        if 0xFFFFFFFF in (packed, size, offset):
            raise ValueError(message("it is in the ZIP64 format, which FreeCAD does not write"))
        return ZipEntry(name, flags, method, crc, packed, size, offset + self.shift, position)


class ContainerFile:
    """An open container. Use it as a context manager; ``path`` is for messages and is not opened again."""

    def __init__(self, path: str, limits: Limits) -> None:
        self.path = path
        self.limits = limits
        self._descriptor = _open(path)
        self._window, self._window_at = b"", 0
        self.state, self.changed_ns = FileStat(0, 0, 0, 0), 0
        try:
            self.state = self._regular_file()
            self.directory = self._directory()
        except BaseException:
            os.close(self._descriptor)
            raise

    def __enter__(self) -> ContainerFile:
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._descriptor)

    def changed(self) -> bool:
        """Return True if the file was written to since it was opened."""
        return FileStat.of(os.fstat(self._descriptor)) != self.state

    def entry(self, name: bytes) -> ZipEntry | None:
        """Return the entry of this name; None if there is none. Raises FcstdError if there are two."""
        try:
            entries = list(self.directory.entries(name))
        except ValueError as error:
            raise self._error(str(error)) from error
        if len(entries) > 1:
            raise self._error(
                message(
                    "it holds {count} entries named {name}",
                    count=len(entries),
                    name=name.decode("ascii", "replace"),
                )
            )
        return entries[0] if entries else None

    def packed(self, entry: ZipEntry, most: int) -> bytes:
        """Read the packed bytes of an entry, at most ``most``."""
        self._check(entry, most)
        # With the local header in one go: its extra field is seldom longer than the directory's.
        length = LOCAL.size + len(entry.name) + entry.packed + 64
        whole = self._read(entry.offset, max(0, min(length, self.directory.offset - entry.offset)))
        begin = self._data_at(entry, whole)
        data = whole[begin : begin + entry.packed]
        return data if len(data) == entry.packed else self._read(entry.offset + begin, entry.packed)

    def data_offset(self, entry: ZipEntry) -> int:
        """Return the position in the file at which an entry's packed bytes begin."""
        return entry.offset + self._data_at(entry, self._read(entry.offset, LOCAL.size + len(entry.name)))

    def _data_at(self, entry: ZipEntry, local: bytes) -> int:
        """Read from the local header where the data begins. Raises FcstdError if it is not the header of this
        entry.
        """
        if len(local) < LOCAL.size or not local.startswith(_LOCAL_MARK):
            raise self._error(message("it is damaged: an entry lies outside its place"))
        fields = LOCAL.unpack_from(local)
        if local[LOCAL.size : LOCAL.size + fields[9]] != entry.name:
            raise self._error(message("it is damaged: its directory and its entries disagree"))
        begin: int = LOCAL.size + fields[9] + fields[10]
        if entry.offset + begin + entry.packed > self.directory.offset:
            raise self._error(message("it is damaged: an entry lies outside its place"))
        return begin

    def read(self, offset: int, length: int) -> bytes:
        """Read bytes of the file without unpacking them."""
        return self._read(offset, length)

    def _check(self, entry: ZipEntry, most: int) -> None:
        name = entry.name.decode("utf-8", "replace")
        if entry.flags & _ENCRYPTED:
            raise self._error(message("its {name} is encrypted", name=name))
        if entry.method not in (STORED, _DEFLATED):
            raise self._error(
                message(
                    "its {name} is packed by method {method}, which FreeCAD does not use",
                    name=name,
                    method=entry.method,
                )
            )
        if entry.packed > most:
            raise self._error(
                message(
                    "its {name} is too large: {packed} bytes packed, at most {most}",
                    name=name,
                    packed=entry.packed,
                    most=most,
                )
            )

    def _regular_file(self) -> FileStat:
        status = os.fstat(self._descriptor)
        if not stat.S_ISREG(status.st_mode):
            kind = message("a folder") if stat.S_ISDIR(status.st_mode) else message("no regular file")
            raise self._error(message("it is {kind}, not a FreeCAD document", kind=kind))
        self.changed_ns = status.st_ctime_ns
        return FileStat.of(status)

    def _directory(self) -> Directory:
        size = self.state.size
        # A small file is read at once. Of a larger one the end, where FreeCAD's comment of 16 bytes stands;
        # the longest comment that a zip may have is looked for after that.
        for most in (_SMALL,) if size <= _SMALL else (_USUAL_TAIL, _TAIL):
            begin = max(0, size - most)
            self._window, self._window_at = self._read(begin, size - begin), begin
            if (end := self._end_record()) is not None:
                return self._directory_at(*end)
        raise self._no_container()

    def _end_record(self) -> tuple[int, tuple[int, ...]] | None:
        """Find the last end record whose comment has the right length: its position, and its fields."""
        window = self._window
        position = window.rfind(_END_MARK)
        while position >= 0:
            if position + END.size <= len(window):
                fields = END.unpack_from(window, position)
                if position + END.size + fields[7] <= len(window):
                    return self._window_at + position, fields
            position = window.rfind(_END_MARK, 0, position)
        return None

    def _directory_at(self, end: int, fields: tuple[int, ...]) -> Directory:
        _, disk, first_disk, here, count, size, offset, _ = fields
        if 0xFFFFFFFF in (size, offset) or count == 0xFFFF:
            raise self._error(message("it is in the ZIP64 format, which FreeCAD does not write"))
        shift = end - size - offset
        sane = not disk and not first_disk and here == count and shift >= 0
        if not sane or count > self.limits.entries or size > self.limits.packed:
            raise self._error(message("its zip directory is damaged or absurdly large"))
        raw = self._read(end - size, size)
        return Directory(raw, count, end - size, shift, self._window[end - self._window_at :])

    def _no_container(self) -> FcstdError:
        if self._read(0, min(self.state.size, len(_LFS_MARK))) == _LFS_MARK:
            return FcstdError(
                self.path,
                message("it is a Git LFS pointer, not the file itself; fetch it with `git lfs pull`"),
                FindingCode.LFS_POINTER,
                self.state,
            )
        if self.state.size == 0:
            return self._error(message("it is empty"))
        if self._read(0, min(4, self.state.size)) == _LOCAL_MARK:
            return self._error(message("it is cut short: the end of its zip container is missing"))
        return self._error(message("it is not a FreeCAD document (no zip container)"))

    def _read(self, offset: int, length: int) -> bytes:
        begin = offset - self._window_at
        if begin >= 0 and begin + length <= len(self._window):
            return self._window[begin : begin + length]
        if offset + length > self.state.size:  # also keeps a claimed length from being allocated
            raise self._error(message("it is cut short"))
        try:
            os.lseek(self._descriptor, offset, os.SEEK_SET)
            data = os.read(self._descriptor, length)
            while len(data) < length and (more := os.read(self._descriptor, length - len(data))):
                data += more
        except OSError as error:
            raise self._error(message("it cannot be read: {error}", error=why_refused(error))) from error
        if len(data) < length:
            raise self._error(message("it is cut short"))
        return data

    def _error(self, reason: str) -> FcstdError:
        return FcstdError(self.path, reason, state=self.state)


def _open(path: str) -> int:
    try:
        return os.open(path, _FLAGS)
    except (FileNotFoundError, NotADirectoryError) as error:
        raise FcstdError(path, message("there is no such file"), FindingCode.MISSING_FILE) from error
    except (OSError, ValueError) as error:
        raise FcstdError(path, message("it cannot be opened: {error}", error=why_refused(error))) from error


class Inflater:
    """Unpacks one entry step by step, so that a reader can stop when it has seen what it wants.

    The last step checks length and checksum; a reader that stops earlier has what it read, unchecked.
    """

    def __init__(self, path: str, entry: ZipEntry, packed: bytes, most: int, limits: Limits) -> None:
        self._path, self._entry, self._packed = path, entry, packed
        self._most, self._limits = most, limits
        self._engine: Any = None
        self._rest = packed
        self._crc = 0
        self.produced = 0
        self.finished = False
        if entry.size > most:
            raise self._error(
                message("is too large: {size} bytes unpacked, at most {most}", size=entry.size, most=most)
            )

    def step(self, length: int) -> bytes:
        """Unpack up to ``length`` (> 0) more bytes; b"" and ``finished`` at the end. Raises FcstdError."""
        if self.finished:
            return b""
        data = self._stored(length) if self._entry.method == STORED else self._inflated(length)
        self._count(data)
        return data

    def whole(self) -> bytes:
        """Unpack all of an entry that was not begun; in one step if it cannot become too large."""
        highest = len(self._packed) * _HIGHEST_RATIO + 1
        if self._entry.method == STORED or highest > self._most:
            return self.rest()
        try:
            data = zlib.decompress(
                self._packed, -zlib.MAX_WBITS, bufsize=max(1, min(self._entry.size, highest))
            )
        except zlib.error as error:
            raise self._error(message("is damaged (it cannot be unpacked)")) from error
        self.finished = True
        self._count(data)
        return data

    def rest(self, end: int | None = None) -> bytes:
        """Unpack everything that remains, or what remains up to a position."""
        most = len(self._packed) + 1 if self._entry.method == STORED else _LONGEST_STEP
        parts = BytesIO()
        while not self.finished and (end is None or self.produced < end):
            # A little more than the stated size, so that the end is reached in this step.
            left = max(self._entry.size - self.produced + 1, 1 << 16) if end is None else end - self.produced
            parts.write(self.step(min(left, most)))
        return parts.getvalue()

    def _stored(self, length: int) -> bytes:
        data, self._rest = self._rest[:length], self._rest[length:]
        self.finished = not self._rest
        return data

    def _inflated(self, length: int) -> bytes:
        if self._engine is None:
            self._engine = zlib.decompressobj(-zlib.MAX_WBITS)
        engine = self._engine
        try:
            data: bytes = engine.decompress(self._rest, length)
        except zlib.error as error:
            raise self._error(message("is damaged (it cannot be unpacked)")) from error
        self._rest = engine.unconsumed_tail
        if engine.eof:
            self.finished = True
            self._engine = None  # its buffers are larger than most files, and many texts stay in memory
        elif not data and not self._rest:
            raise self._error(message("is damaged (it ends too early)"))
        return data

    def _count(self, data: bytes) -> None:
        produced = self.produced = self.produced + len(data)
        self._crc = zlib.crc32(data, self._crc)
        limits, size = self._limits, self._entry.size
        if produced > size:
            raise self._error(message("is damaged (it is longer than the directory says)"))
        if produced > limits.ratio_from and produced > limits.ratio * len(self._packed):
            raise self._error(
                message("is packed more than {ratio} times, as zip bombs are", ratio=limits.ratio)
            )
        if self.finished and (produced != size or self._crc != self._entry.crc):
            raise self._error(message("is damaged (its length or checksum is wrong)"))

    def _error(self, reason: str) -> FcstdError:
        return FcstdError(
            self._path,
            message("its {name} {reason}", name=self._entry.name.decode("utf-8", "replace"), reason=reason),
        )


def document_xml(container: ContainerFile, limits: Limits) -> tuple[ZipEntry, bytes]:
    """Return the entry Document.xml and its unpacked text. Raises DocumentError."""
    entry = container.entry(DOCUMENT_XML)
    if entry is None:
        raise FcstdError(
            container.path, message("it is not a FreeCAD document (there is no Document.xml in it)")
        )
    packed = container.packed(entry, limits.packed)
    return entry, Inflater(container.path, entry, packed, limits.document_xml, limits).whole()
