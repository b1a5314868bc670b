# SPDX-License-Identifier: LGPL-2.1-or-later
"""Revisions: append-only snapshots of an item's properties, each with the file that was uploaded, if any.

A file is a document, with its revisions, the items that it holds, and what it links to. A file of exactly
one item is the item's document: it has the item's UUID and the item's revision numbers, and the item's
routes show it. A file of several items or of none (a part library, a spreadsheet) has a UUID that its first
upload names, and revision numbers of its own.

Uploaded files are kept by their SHA-256: written once, never changed, never run, never named by a client.
"""

from __future__ import annotations

import hashlib
import io
import json
import lzma
import os
import shutil
import struct
import tempfile
import uuid as uuids
import zipfile
import zlib
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from sqlalchemy import ColumnElement, Row, delete, func, insert, select, update

from silo.api.wire import FACTS, FactSource
from silo.bom.compare.base_revision import base_revision_of, would_undo
from silo.bom.errors import NewerRevisionError, NotFoundError, RejectedError
from silo.platform import no_device_name, remove_patiently, replace_patiently, sync_folder
from silo_server.db.rows import insert_rows, one_of
from silo_server.db.tables import document_items, document_links, documents, items, revisions
from silo_server.db.transaction import Tx
from silo_server.errors import DuplicateError
from silo_server.events import announce
from silo_server.fields import from_row, to_wire
from silo_server.services.search import index_item
from silo_server.times import spec_time
from silo_server.user_json import check_json, dumps
from silo_server.values import Document, Item, Revision


@dataclass(frozen=True, slots=True)
class ShownDocument:
    """A document as it is now, with the name and the place of its newest file.

    part_number
        of the item whose document it is; "" without one.
    holds
        the items in it: UUID, part number, and the object that each one is ("": the file as a whole).
    """

    id: str
    part_number: str
    revision_number: int
    file_name: str
    file_path: str | None
    file_checksum: str
    file_size: int
    comment: str
    created_at: str
    created_by: str
    holds: tuple[Mapping[str, str], ...] = ()


def find_document(tx: Tx, uuid: str, *, lock: bool = False) -> Document | None:
    """Find the document with this UUID; None if there is none.

    ``lock`` makes other writers of it wait until this transaction ends.
    """
    if lock:
        tx.lock(uuid)
    row = tx.conn.execute(select(documents).where(documents.c.uuid == uuid)).one_or_none()
    return None if row is None else from_row(Document, row)


def get_document(tx: Tx, uuid: str) -> Document:
    """Find the document with this UUID. Raises NotFoundError."""
    document = find_document(tx, uuid)
    if document is None:
        raise NotFoundError(f"no document has the UUID {uuid}")
    return document


def document_of(tx: Tx, item: Item) -> Document:
    """Find the document of an item, or make it. The caller holds the item's lock."""
    row = tx.conn.execute(select(documents).where(documents.c.item_id == item.id)).one_or_none()
    if row is not None:
        return from_row(Document, row)
    # A document without an item may have been given this UUID before; it keeps it.
    uuid = item.uuid if find_document(tx, item.uuid) is None else str(uuids.uuid4())
    return make_document(tx, uuid, item.id)


def make_document(tx: Tx, uuid: str, item_id: int | None = None) -> Document:
    """Make a document that has no revision yet."""
    row = {"uuid": uuid, "item_id": item_id, "current_revision": 0}
    tx.conn.execute(insert(documents).values(**row, created_at=tx.stamp, created_by=tx.actor.username))
    return get_document(tx, uuid)


def note_revision(
    tx: Tx,
    document: Document,
    number: int,
    links: Iterable[Mapping[str, str]],
    held: Iterable[Mapping[str, str]],
) -> None:
    """Note what a new revision of a document links to, and which items are in it.

    Unknown items are left out: the server may not have them yet. Pictures that a browser drew of the items in
    an older file are removed.
    """
    tx.conn.execute(update(documents).where(documents.c.id == document.id).values(current_revision=number))
    for table in (document_items, document_links):
        tx.conn.execute(delete(table).where(table.c.document_id == document.id))
    targets = dict.fromkeys(link.get("document") or link.get("item") or "" for link in links)
    rows = [
        {"document_id": document.id, "target": target} for target in targets if target and len(target) <= 36
    ]
    insert_rows(tx, document_links, rows)
    objects = {(holder["item"].lower(), holder.get("object", "")) for holder in held}
    where = select(items.c.uuid, items.c.id).where(one_of(tx, items.c.uuid, {uuid for uuid, _ in objects}))
    ids = {row.uuid: row.id for row in tx.conn.execute(where)}
    pairs = {(ids[uuid], name) for uuid, name in objects if uuid in ids}
    if document.item_id is not None and document.item_id not in {item for item, _ in pairs}:
        pairs.add((document.item_id, ""))
    rows = [{"document_id": document.id, "item_id": holder, "object": name} for holder, name in sorted(pairs)]
    insert_rows(tx, document_items, rows)
    # What a browser drew of an older file is out of date; the picture of an item's own file stays.
    with_picture = (revisions.c.item_id == items.c.id) & (revisions.c.thumbnail_key == items.c.thumbnail_key)
    own = select(revisions.c.id).where(with_picture).exists()
    drawn = one_of(tx, items.c.id, {item for item, _ in pairs}) & items.c.thumbnail_key.is_not(None) & ~own
    tx.conn.execute(update(items).where(drawn).values(thumbnail_key=None))


def keep_picture(tx: Tx, store: FileStore, item: Item, picture: bytes) -> None:
    """Store a PNG that a browser drew, for an item without a picture. RejectedError, DuplicateError."""
    size = png_size(picture)
    if len(picture) > MAX_DRAWN or not size:
        raise RejectedError(f"picture: wanted a whole PNG of at most {MAX_DRAWN // 1024} KiB, got another")
    if not 16 <= min(size) <= max(size) <= 512:
        raise RejectedError(f"picture: wanted 16 to 512 pixels each way, got {size[0]} × {size[1]}")
    kept = store.keep("picture.png", io.BytesIO(picture)).checksum
    bare = (items.c.id == item.id) & items.c.thumbnail_key.is_(None)
    if not tx.conn.execute(update(items).where(bare).values(thumbnail_key=kept)).rowcount:
        raise DuplicateError(f"{item.subject} has a picture already; a new file takes it away")


def documents_holding(tx: Tx, item: Item) -> list[Document]:
    """Find the documents whose newest revision holds an item, its own first."""
    holding = select(document_items.c.document_id).where(document_items.c.item_id == item.id)
    found = _documents(tx, documents.c.id.in_(holding))
    return sorted(found, key=lambda document: document.item_id != item.id)


def linking_to(tx: Tx, document: Document) -> list[Document]:
    """Find the documents whose newest revision links to this one."""
    sources = select(document_links.c.document_id).where(document_links.c.target == document.uuid)
    return _documents(tx, documents.c.id.in_(sources))


def linked_from(tx: Tx, document: Document) -> list[Document]:
    """Find the documents that the newest revision of this one links to."""
    targets = select(document_links.c.target).where(document_links.c.document_id == document.id)
    return _documents(tx, documents.c.uuid.in_(targets))


def documents_by_uuid(tx: Tx, wanted: Sequence[str]) -> list[Document]:
    """Find the documents with these UUIDs; unknown ones are absent."""
    return _documents(tx, one_of(tx, documents.c.uuid, {uuid.lower() for uuid in wanted}))


def _documents(tx: Tx, which: ColumnElement[bool]) -> list[Document]:
    query = select(documents).where(which).order_by(documents.c.id)
    return [from_row(Document, row) for row in tx.conn.execute(query)]


def shown(tx: Tx, several: Sequence[Document]) -> list[ShownDocument]:
    """Read documents as they are now, in the order given; documents without a file are left out."""
    ids = [holder.id for holder in several]
    newest = (
        select(documents.c.id.label("of"), documents.c.uuid, items.c.part_number, revisions)
        .join(revisions, revisions.c.document_id == documents.c.id)
        .outerjoin(items, items.c.id == documents.c.item_id)
        .where(one_of(tx, documents.c.id, ids))
        .where(revisions.c.revision_number == documents.c.current_revision)
    )
    held: dict[int, list[Mapping[str, str]]] = {}
    query = (
        select(document_items, items.c.uuid, items.c.part_number)
        .join(items, items.c.id == document_items.c.item_id)
        .where(one_of(tx, document_items.c.document_id, ids))
    )
    for each in tx.conn.execute(query.order_by(document_items.c.object, items.c.part_number_key)):
        document = {"item": each.uuid, "part_number": each.part_number, "object": each.object}
        held.setdefault(each.document_id, []).append(document)
    by_item: dict[int, Any] = {each.of: each for each in tx.conn.execute(newest)}
    return [
        from_row(
            ShownDocument,
            row,
            id=row.uuid,
            part_number=row.part_number or "",
            holds=tuple(held.get(row.of, ())),
        )
        for row in map(by_item.get, ids)
        if row is not None
    ]


@dataclass(frozen=True, slots=True)
class StoredFile:
    """A file in the store: what it was called, its SHA-256 and size, and its thumbnail's SHA-256."""

    name: str
    checksum: str
    size: int
    thumbnail_key: str | None = None


@dataclass(frozen=True, slots=True)
class RevisionOrigin:
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
    origin: RevisionOrigin = RevisionOrigin(),
    source: FactSource = "hand",
) -> Revision:
    """Append a revision to an item, or to a document without an item.

    Without ``properties`` it has those of the revision before.

    source
        where mass, material and the like come from, if they differ.

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
        document = document_of(tx, item)
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
        note_revision(tx, document, number, origin.links or (), origin.items or ())
    if item is not None:
        changed: dict[str, Any] = {"current_revision": number}
        if file and file.thumbnail_key:
            changed["thumbnail_key"] = file.thumbnail_key
        _keep(tx, item, snapshot, source, changed)
    revision = get_revision(tx, of, number)
    announce.revision_created(tx, of, revision)
    return revision


def _keep(
    tx: Tx, item: Item, properties: Mapping[str, Any], source: FactSource, changed: Mapping[str, Any]
) -> None:
    """Store the properties of an item, with where they come from, and other values that changed."""
    now = {**properties, **changed}
    new = {name for name in FACTS if properties.get(name) != item.properties.get(name)}
    new |= {"description"} & changed.keys()
    origins = {name: origin for name, origin in item.origins.items() if name not in new}
    origins |= {name: {"source": source, "at": spec_time(tx.stamp)} for name in new if name in now}
    values = {**changed, "properties": dumps(properties), "origins": dumps(origins) if origins else None}
    stamped = {"version": items.c.version + 1, "updated_at": tx.stamp, "updated_by": tx.actor.username}
    tx.conn.execute(update(items).where(items.c.id == item.id).values(**values, **stamped))
    index_item(tx, item.id)


def complete(
    tx: Tx, item: Item, checksum: str, properties: Mapping[str, Any], changed: Mapping[str, Any]
) -> None:
    """Store what an item's file states: in the file's revision or, if there is a later one, in a new one."""
    last = get_revision(tx, item, item.current_revision) if item.current_revision else None
    if last is not None and last.file_checksum != checksum and properties != item.properties:
        add_revision(tx, item, comment="as its file states", properties=properties, source="cad")
    elif last is not None:
        mine = _of(item) & (revisions.c.revision_number == last.revision_number)
        tx.conn.execute(update(revisions).where(mine).values(properties=dumps(dict(properties))))
    _keep(tx, item, properties, "cad", changed)


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
    """Raise :class:`NewerRevisionError` if a BOM is that of an older file and would undo the newest one's,
    :class:`MissingRevisionError` if its file is not here (:mod:`silo.bom.compare.base_revision`)."""
    same = select(func.max(revisions.c.revision_number)).where(
        revisions.c.item_id == item.id, revisions.c.file_checksum == checksum
    )
    made_from = base_revision_of(base, checksum, tx.conn.scalar(same) if checksum else None)
    _check_base(tx, item, made_from, checksum)


def list_revisions(
    tx: Tx,
    of: Item | Document,
    limit: int = 100,
    *,
    before: int | None = None,
    after: int = 0,
    skip: int = 0,
) -> tuple[list[Revision], int]:
    """Read revisions below ``before`` and above ``after``, newest first.

    At most ``limit`` of them, without the first ``skip``. Also returns how many revisions above ``after``
    there are in all.
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
    """Read one revision; NotFoundError if there is none."""
    row = tx.conn.execute(
        select(revisions).where(_of(of), revisions.c.revision_number == number)
    ).one_or_none()
    if row is None:
        raise NotFoundError(f"{of.subject} has no revision {number}")
    return _to_revision(row)


def with_file(tx: Tx, of: Item | Document) -> Item | Document:
    """Find what has the file: the item or document itself, or the document that holds it. NotFoundError."""
    holders = documents_holding(tx, of) if isinstance(of, Item) else []
    for holder in (of, *holders):
        if _newest_file(tx, holder) is not None:
            return holder
    raise NotFoundError(f"{of.subject} has no file yet")


def has_file(tx: Tx, item: Item) -> bool:
    """Report whether a file shows an item: its own, or a file of several items."""
    return bool(files_until(tx, item, tx.stamp))


def newest_file(tx: Tx, of: Item | Document) -> Revision:
    """Read the newest revision with a file. Raises NotFoundError."""
    newest = _newest_file(tx, with_file(tx, of))
    assert newest is not None
    return newest


def files_until(tx: Tx, item: Item, until: str, limit: int = 1) -> list[int]:
    """Find the numbers of the ``limit`` newest revisions with a file that were there at a time."""
    try:
        of = with_file(tx, item)
    except NotFoundError:
        return []
    row = revisions.c
    where = select(row.revision_number).where(
        _of(of), row.file_checksum.is_not(None), row.created_at <= until
    )
    return list(tx.conn.scalars(where.order_by(row.revision_number.desc()).limit(limit)))


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
    """Return a revision as the API sends it; its links only if wanted, as there may be many."""
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
PNG_HEAD, PNG_END = b"\0\0\0\rIHDR", b"\0\0\0\0IEND\xaeB`\x82"
MAX_DRAWN = 256 * 1024
# Width and height in a PNG. Without a 3D view FreeCAD saves its icon, smaller than any picture that it takes.
ICON = (64).to_bytes(4) * 2


class FileStore:
    """The store below ``root``; a file lies at ``ab/cd/<sha256>``."""

    def __init__(self, root: Path) -> None:
        self.root = root

    def path_of(self, checksum: str) -> Path:
        """Return the path of the file with this hash; NotFoundError if it is not there."""
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
        """Return True if the file with this hash is here and undamaged; reads all of it."""
        try:
            with self._place(checksum).open("rb") as file:
                return hashlib.file_digest(file, "sha256").hexdigest() == checksum
        except OSError:
            return False

    def renew(self, checksum: str) -> bool:
        """Make the file with this hash count as new; return True if it is here and undamaged.

        For callers that are about to refer to it: meanwhile nobody deletes it as old and unused.
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
    # A person on Windows cannot save a download that is called CON.
    return no_device_name(cleaned)[:200] or "file"


def read_thumbnail(path: Path) -> bytes | None:
    """Read the picture in an untrusted FCStd file; None if there is none, or only FreeCAD's icon."""
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
        EOFError,
        zlib.error,
        lzma.LZMAError,
        ValueError,
    ):
        return None
    return data if data.startswith(PNG) and data[16:24] != ICON and len(data) <= MAX_THUMBNAIL else None


def png_size(picture: bytes) -> tuple[int, int] | None:
    """Read width and height of a PNG [pixels]; None if it is no PNG, or its parts do not fill it."""
    if not picture.startswith(PNG + PNG_HEAD) or not picture.endswith(PNG_END):
        return None
    place = len(PNG)
    while place < len(picture) - len(PNG_END):
        place += 12 + struct.unpack_from(">I", picture, place)[0]
    width, height = struct.unpack_from(">II", picture, 16)
    return (width, height) if place == len(picture) - len(PNG_END) and width and height else None


def _directory_size(path: Path) -> int:
    """Read the size of a zip's directory [bytes]; a huge number for ZIP64, 0 if this is no zip."""
    with path.open("rb") as source:
        length = source.seek(0, os.SEEK_END)
        source.seek(max(0, length - END_SIZE - 0xFFFF))
        tail = source.read()
    place = tail.rfind(END_MARK)
    if place < 0 or len(tail) - place < END_SIZE:
        return 0
    size: int = struct.unpack_from("<I", tail, place + 12)[0]
    return size
