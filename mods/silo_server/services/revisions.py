# SPDX-License-Identifier: LGPL-2.1-or-later
"""Revisions: append-only snapshots of an item's properties, each with the file that was uploaded, if any.

A file is a document (:mod:`silo_server.services.documents`). A revision with a file is one of its document;
it is one of an item too if the document is the item's.

Uploaded files, kept by their SHA-256: written once, never changed, never run, never named by a client.
"""

from __future__ import annotations

import hashlib
import json
import lzma
import os
import shutil
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from sqlalchemy import ColumnElement, Row, func, insert, select, update

from silo.bom.compare import base_of, would_undo
from silo.bom.errors import NewerRevisionError, NotFoundError
from silo.platform import no_device_name, remove_patiently, replace_patiently, sync_folder
from silo_server import events
from silo_server.db.engine import Tx
from silo_server.db.tables import items, revisions
from silo_server.services import documents
from silo_server.services.search import index_item
from silo_server.values import Document, Item, Revision, check_json, dumps, from_row, to_wire


@dataclass(frozen=True, slots=True)
class StoredFile:
    """A file in the store: what it was called, its SHA-256 and size, and its thumbnail's SHA-256."""

    name: str
    checksum: str
    size: int
    thumbnail_key: str | None = None


@dataclass(frozen=True, slots=True)
class Origin:
    """What the client says of a file: the revision that it was made from, its place, what it links to, and
    which items (UUID and object) are in it."""

    base_revision: int | None = None
    path: str | None = None
    links: Sequence[Mapping[str, str]] | None = None
    items: Sequence[Mapping[str, str]] | None = None


def _of(holder: Item | Document) -> ColumnElement[bool]:
    column = revisions.c.item_id if isinstance(holder, Item) else revisions.c.document_id
    return column == holder.id


def add_revision(
    tx: Tx,
    of: Item | Document,
    *,
    comment: str = "",
    properties: Mapping[str, Any] | None = None,
    file: StoredFile | None = None,
    origin: Origin = Origin(),
) -> Revision:
    """Append a revision of an item, or of a document without one. Without ``properties`` it carries those of
    the one before on.

    A file that was made from an older revision than the newest is refused (:class:`NewerRevisionError`).

    The caller holds the item's lock; the unique key on (item, number) guards the rest.
    """
    if properties is not None:
        check_json("properties", properties)
    if file is not None:
        _check_base(tx, of, origin.base_revision, file.checksum)
    last = tx.conn.scalar(select(func.max(revisions.c.revision_number)).where(_of(of)))
    number = (last or 0) + 1
    item, document = (of, None) if isinstance(of, Item) else (None, of)
    if item is not None and file is not None:
        document = documents.of_item(tx, item)
    before = item.properties if item is not None else {}
    snapshot = dict(before) if properties is None else dict(properties)
    tx.conn.execute(
        insert(revisions).values(
            item_id=item.id if item is not None else None,
            document_id=document.id if document is not None else None,
            revision_number=number,
            properties=dumps(snapshot),
            comment=comment,
            status="draft",
            file_name=file.name if file else None,
            file_checksum=file.checksum if file else None,
            file_size=file.size if file else None,
            thumbnail_key=file.thumbnail_key if file else None,
            created_at=tx.stamp,
            created_by=tx.actor.username,
            base_revision=origin.base_revision,
            file_path=origin.path,
            links=None if origin.links is None else dumps([dict(link) for link in origin.links]),
        )
    )
    if document is not None:
        documents.revised(tx, document, number, origin.links or (), origin.items or ())
    if item is not None:
        changed: dict[str, Any] = {"current_revision": number, "properties": dumps(snapshot)}
        if file and file.thumbnail_key:
            changed["thumbnail_key"] = file.thumbnail_key
        tx.conn.execute(
            update(items)
            .where(items.c.id == item.id)
            .values(**changed, version=items.c.version + 1, updated_at=tx.stamp, updated_by=tx.actor.username)
        )
        index_item(tx, item.id)
    revision = get_revision(tx, of, number)
    events.revision_created(tx, of, revision)
    return revision


def _check_base(tx: Tx, of: Item | Document, base: int | None, checksum: str | None) -> None:
    newest = _newest_file(tx, of) if base is not None else None
    if newest is None or not would_undo(newest, base, checksum):
        return
    raise NewerRevisionError(
        f"{newest.created_by} committed revision {newest.revision_number} of {of.subject}, and this "
        f"was made from revision {base}. Fetch the newer one first (silo-mod pull, Open from Silo), or "
        "commit this on top of it in FreeCAD",
        revision_to_wire(of, newest),
    )


def check_document(tx: Tx, item: Item, base: int | None, checksum: str | None) -> None:
    """Raise :class:`NewerRevisionError` where a BOM is that of an older file and would undo the newest one's,
    :class:`MissingRevisionError` where its file is not here (:func:`silo.bom.compare.base_of`)."""
    same = select(func.max(revisions.c.revision_number)).where(
        revisions.c.item_id == item.id, revisions.c.file_checksum == checksum
    )
    _check_base(tx, item, base_of(base, checksum, tx.conn.scalar(same) if checksum else None), checksum)


def list_revisions(
    tx: Tx,
    of: Item | Document,
    limit: int = 100,
    *,
    before: int | None = None,
    after: int = 0,
    skip: int = 0,
) -> tuple[list[Revision], int]:
    """``limit`` of the revisions below ``before`` and above ``after``, newest first, without ``skip`` ones.

    And how many revisions above ``after`` there are in all.
    """
    wanted = _of(of) & (revisions.c.revision_number > after)
    total = tx.conn.scalar(select(func.count()).select_from(revisions).where(wanted)) or 0
    if before is not None:
        wanted &= revisions.c.revision_number < before
    rows = tx.conn.execute(
        select(revisions).where(wanted).order_by(revisions.c.revision_number.desc()).limit(limit).offset(skip)
    ).all()
    return [_to_revision(row) for row in rows], total


def get_revision(tx: Tx, of: Item | Document, number: int) -> Revision:
    """One revision; NotFoundError where there is none."""
    row = tx.conn.execute(
        select(revisions).where(_of(of), revisions.c.revision_number == number)
    ).one_or_none()
    if row is None:
        raise NotFoundError(f"{of.subject} has no revision {number}")
    return _to_revision(row)


def newest_file(tx: Tx, of: Item | Document) -> Revision:
    """The newest revision with a file: the item's own, else that of the document that holds the item.

    NotFoundError if there is none.
    """
    newest = _newest_file(tx, of)
    if newest is None and isinstance(of, Item):
        newest = next(filter(None, (_newest_file(tx, one) for one in documents.holding(tx, of))), None)
    if newest is None:
        raise NotFoundError(f"{of.subject} has no file yet")
    return newest


def _newest_file(tx: Tx, of: Item | Document) -> Revision | None:
    row = tx.conn.execute(
        select(revisions)
        .where(_of(of), revisions.c.file_checksum.is_not(None))
        .order_by(revisions.c.revision_number.desc())
        .limit(1)
    ).one_or_none()
    return None if row is None else _to_revision(row)


def _to_revision(row: Row[Any]) -> Revision:
    links = json.loads(row.links) if row.links else ()
    return from_row(Revision, row, properties=json.loads(row.properties), links=links)


def revision_to_wire(of: Item | Document, revision: Revision, *, links: bool = False) -> dict[str, Any]:
    """A revision, under the contract's names; its links only where they are wanted, there may be many."""
    number = of.part_number if isinstance(of, Item) else ""
    return {"part_number": number, **to_wire(revision, *(() if links else ("links",)))}


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
