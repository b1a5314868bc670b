# SPDX-License-Identifier: LGPL-2.1-or-later
"""The store of uploaded files.

A file is kept by its SHA-256: written once, never changed, never run, never named by a client.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from silo.bom.errors import NotFoundError
from silo.bom.message import message
from silo.file_kind import MODEL, kind_of
from silo.platform.device_names import no_device_name
from silo.platform.whole_files import remove_patiently, replace_patiently, sync_folder
from silo_server.services.thumbnails import read_thumbnail


@dataclass(frozen=True, slots=True)
class StoredFile:
    """A file in the store: what it was called, its SHA-256 and size, its thumbnail's SHA-256, and its kind by
    its content (:mod:`silo.file_kind`)."""

    name: str
    checksum: str
    size: int
    thumbnail_key: str | None = None
    kind: str = MODEL


CHUNK = 1024 * 1024


class FileStore:
    """The store below ``root``; a file lies at ``ab/cd/<sha256>``."""

    def __init__(self, root: Path) -> None:
        self.root = root

    def path_of(self, checksum: str) -> Path:
        """Return the path of the file with this hash; NotFoundError if it is not there."""
        path = self._place(checksum)
        if not path.is_file():
            raise NotFoundError(
                message("the file with SHA-256 {checksum} is not in this server's store", checksum=checksum)
            )
        return path

    def keep(self, name: str, source: IO[bytes]) -> StoredFile:
        """Store an upload; the same content is stored once. Extracts the thumbnail of a model."""
        checksum, size = self._write(iter(lambda: source.read(CHUNK), b""))
        kind = kind_of(self._place(checksum), name)
        thumbnail = read_thumbnail(self._place(checksum)) if kind == MODEL else None
        key = self._write([thumbnail])[0] if thumbnail else None
        return StoredFile(clean_name(name), checksum, size, key, kind)

    def holds(self, checksum: str) -> bool:
        """Return True if the file with this hash is here and undamaged; reads all of it."""
        try:
            with self._place(checksum).open("rb") as file:
                return hashlib.file_digest(file, "sha256").hexdigest() == checksum
        except OSError:
            return False

    def renew(self, checksum: str) -> bool:
        """Make the file with this hash count as new; return True if it is here and undamaged.

        For callers that are about to refer to it: meanwhile it is not deleted as old and unused.
        """
        try:
            os.utime(self._place(checksum))
        except OSError:
            return False
        return self.holds(checksum)

    def copy_from(self, other: FileStore, checksum: str) -> bool:
        """Copy a file from another store; False if it is missing or damaged there."""
        try:
            source = other._place(checksum).open("rb")
        except OSError:
            return False
        with source:
            return self._write(iter(lambda: source.read(CHUNK), b""), wanted=checksum)[0] == checksum

    def older_than(self, before: float) -> list[Path]:
        """Find all files that came before this time (seconds since 1970), half-written uploads too."""
        if not self.root.is_dir():
            return []
        paths = [path for path in self.root.glob("??/??/*") if _came_before(path, before)]
        for pattern in ("upload-*", "restore-*"):
            paths += [path for path in self.root.glob(pattern) if _came_before(path, before)]
        return paths

    def remove_old(self, path: Path, before: float) -> bool:
        """Delete a file of :meth:`older_than`; False if the same content was uploaded again meanwhile."""
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
        """Check the store: ``ok``; ``unwritable``; ``full`` if fewer than ``wanted`` bytes are free."""
        try:
            self.root.mkdir(mode=0o700, parents=True, exist_ok=True)
            free = shutil.disk_usage(self.root).free
        except OSError:
            return "unwritable"
        if not os.access(self.root, os.W_OK):
            return "unwritable"
        return "ok" if free >= wanted else "full"

    def free(self) -> float:
        """Return the free bytes on the store's disk; NaN if that is unknown."""
        try:
            return float(shutil.disk_usage(self.root).free)
        except OSError:
            return float("nan")

    def _place(self, checksum: str) -> Path:
        return self.root / checksum[:2] / checksum[2:4] / checksum

    def _write(self, chunks: Iterable[bytes], wanted: str | None = None) -> tuple[str, int]:
        """Store a content; return (hash, size). If its hash is not the one ``wanted``, it is not kept."""
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
    """Make the name of a download: the last part of a file name, without control characters."""
    last = name.replace("\\", "/").rpartition("/")[2]
    cleaned = "".join(c for c in last if c.isprintable()).strip(" .")
    # A user on Windows cannot save a download that is called CON.
    return no_device_name(cleaned)[:200] or "file"
