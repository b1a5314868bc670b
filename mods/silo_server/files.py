# SPDX-License-Identifier: LGPL-2.1-or-later
"""Uploaded files, kept by their SHA-256: written once, never changed, never run, never named by a client."""

from __future__ import annotations

import hashlib
import lzma
import os
import shutil
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import IO

from silo.bom.errors import NotFoundError
from silo.durable import remove_patiently, replace_patiently, sync_folder
from silo.platform import no_device_name
from silo_server.services.revisions import StoredFile

CHUNK = 1024 * 1024
THUMBNAIL = "thumbnails/Thumbnail.png"
MAX_THUMBNAIL = 1024 * 1024
# A zip's directory is read whole, and takes eight times its size in memory. FreeCAD writes some 100 bytes for
# each object.
MAX_DIRECTORY = 4 * 1024 * 1024
END_MARK = b"PK\x05\x06"
END_SIZE = 22
PNG = b"\x89PNG\r\n\x1a\n"


class FileStore:
    """The store below ``root``; a file lies at ``ab/cd/<sha256>``."""

    def __init__(self, root: Path) -> None:
        self.root = root

    def path_of(self, checksum: str) -> Path:
        """Where the file with this hash lies; NotFoundError where it does not."""
        path = self._place(checksum)
        if not path.is_file():
            raise NotFoundError(f"the file with SHA-256 {checksum} is not in this server's store")
        return path

    def keep(self, name: str, source: IO[bytes]) -> StoredFile:
        """Store an upload; the same content is stored once. Extracts the thumbnail of an FCStd file."""
        checksum, size = self._write(iter(lambda: source.read(CHUNK), b""))
        thumbnail = read_thumbnail(self._place(checksum))
        key = self._write([thumbnail])[0] if thumbnail else None
        return StoredFile(clean_name(name), checksum, size, key)

    def holds(self, checksum: str) -> bool:
        """True where the file with this hash is here and undamaged; reads all of it."""
        try:
            with self._place(checksum).open("rb") as file:
                return hashlib.file_digest(file, "sha256").hexdigest() == checksum
        except OSError:
            return False

    def renew(self, checksum: str) -> bool:
        """True where the file with this hash is here and undamaged; it counts as new then.

        For those who are about to refer to it: nobody collects it meanwhile as one that is old and unused.
        """
        try:
            os.utime(self._place(checksum))
        except OSError:
            return False
        return self.holds(checksum)

    def copy_from(self, other: FileStore, checksum: str) -> bool:
        """Take a file over from another store; False where it does not have it, or has it damaged."""
        try:
            source = other._place(checksum).open("rb")
        except OSError:
            return False
        with source:
            return self._write(iter(lambda: source.read(CHUNK), b""), wanted=checksum)[0] == checksum

    def older_than(self, before: float) -> list[Path]:
        """What came before this time (seconds since 1970), half-written uploads too."""
        if not self.root.is_dir():
            return []
        found = [path for path in self.root.glob("??/??/*") if _came_before(path, before)]
        for pattern in ("upload-*", "restore-*"):
            found += [path for path in self.root.glob(pattern) if _came_before(path, before)]
        return found

    def remove_old(self, path: Path, before: float) -> bool:
        """Delete what :meth:`older_than` named; False where the same content was uploaded again meanwhile."""
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
            return True
        # An upload puts a new file at this place before its revision is committed. What was moved away shows
        # whether it was the old one; deleting it by name could hit the new one.
        handle, name = tempfile.mkstemp(dir=self.root, prefix="upload-")
        os.close(handle)
        aside = Path(name)
        try:
            replace_patiently(path, aside)
        except FileNotFoundError:
            remove_patiently(aside)
            return False
        if _came_before(aside, before):
            remove_patiently(aside)
            return True
        replace_patiently(aside, path)
        return False

    def state(self, wanted: int) -> str:
        """``ok``; ``unwritable``; ``full`` where fewer than ``wanted`` bytes are free."""
        try:
            self.root.mkdir(mode=0o700, parents=True, exist_ok=True)
            free = shutil.disk_usage(self.root).free
        except OSError:
            return "unwritable"
        if not os.access(self.root, os.W_OK):
            return "unwritable"
        return "ok" if free >= wanted else "full"

    def free(self) -> float:
        """Free bytes on its disk; NaN where nobody can say."""
        try:
            return float(shutil.disk_usage(self.root).free)
        except OSError:
            return float("nan")

    def _place(self, checksum: str) -> Path:
        return self.root / checksum[:2] / checksum[2:4] / checksum

    def _write(self, chunks: Iterable[bytes], wanted: str | None = None) -> tuple[str, int]:
        """(hash, size); a content whose hash is not the one ``wanted`` is not kept."""
        self.root.mkdir(mode=0o700, parents=True, exist_ok=True)
        digest, size = hashlib.sha256(), 0
        handle, name = tempfile.mkstemp(dir=self.root, prefix="upload-")
        temporary = Path(name)
        try:
            with os.fdopen(handle, "wb") as out:
                for chunk in chunks:
                    digest.update(chunk)
                    size += len(chunk)
                    out.write(chunk)
                out.flush()
                os.fsync(out.fileno())
            if wanted not in (None, digest.hexdigest()):
                return digest.hexdigest(), size
            target = self._place(digest.hexdigest())
            target.parent.mkdir(parents=True, exist_ok=True)
            try:
                replace_patiently(temporary, target)
            except PermissionError:
                # Windows replaces no file that somebody reads. Its name is its hash, so it is the same one.
                if not target.is_file():
                    raise
            sync_folder(target.parent)
        finally:
            with suppress(OSError):  # what is left over is collected later
                remove_patiently(temporary)
        return digest.hexdigest(), size


def _came_before(path: Path, before: float) -> bool:
    try:
        return path.stat().st_mtime < before
    except FileNotFoundError:
        return False


def clean_name(name: str) -> str:
    """The last part of a file name without control characters; what a download is called."""
    last = name.replace("\\", "/").rpartition("/")[2]
    cleaned = "".join(c for c in last if c.isprintable()).strip(" .")
    # A person on Windows cannot save a download that is called CON.
    return no_device_name(cleaned)[:200] or "file"


def read_thumbnail(path: Path) -> bytes | None:
    """The picture inside an FCStd file, None where there is none. The file is not to be trusted."""
    try:
        if _directory_size(path) > MAX_DIRECTORY:
            return None
        with zipfile.ZipFile(path) as archive, archive.open(THUMBNAIL) as entry:
            data = entry.read(MAX_THUMBNAIL + 1)
    except (
        zipfile.BadZipFile,
        KeyError,
        OSError,
        RuntimeError,
        NotImplementedError,
        EOFError,
        zlib.error,
        lzma.LZMAError,
        ValueError,
    ):
        return None
    return data if data.startswith(PNG) and len(data) <= MAX_THUMBNAIL else None


def _directory_size(path: Path) -> int:
    """The bytes of a zip's directory by its end record; a huge number for ZIP64, 0 where this is no zip."""
    with path.open("rb") as source:
        length = source.seek(0, os.SEEK_END)
        source.seek(max(0, length - END_SIZE - 0xFFFF))
        tail = source.read()
    place = tail.rfind(END_MARK)
    if place < 0 or len(tail) - place < END_SIZE:
        return 0
    size: int = struct.unpack_from("<I", tail, place + 12)[0]
    return size
