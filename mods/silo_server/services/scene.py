# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is drawn of files, and where each part of a product stands (decision 24).

Clients make geometry (GLB) and structure of a file's content; both lie packed in the store of contents. What
a client sends is looked at here and never run: each range of a GLB lies in its buffer, each number is finite.

A scene joins the structures of a product's files over the links of their revisions, when somebody asks.
"""

from __future__ import annotations

import gzip
import io
import json
import struct
import zlib
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from pydantic import BaseModel, ValidationError
from sqlalchemy import insert, select, update

from silo.api import wire
from silo.bom.errors import NotFoundError, RejectedError
from silo.bom.message import message
from silo.bom.text import character_problem
from silo.bounded_json import read_json
from silo.budget import Budget
from silo.file_kind import MODEL
from silo_server.db.rows import one_of
from silo_server.db.tables import document_items, documents, models, revisions
from silo_server.db.tables import items as item_rows
from silo_server.db.transaction import Tx
from silo_server.errors import TooLargeError
from silo_server.services import items
from silo_server.services.file_store import FileStore
from silo_server.services.revisions import get_revision, newest_file, with_file
from silo_server.settings import MIB
from silo_server.values import Item

Part = Literal["geometry", "structure"]
UNPACKED = {"geometry": 64 * MIB, "structure": 32 * MIB}
STRUCTURE = Budget(bytes=32 * MIB, objects=400_000, cells=4_000_000, depth=64, text=1000)
GLB = Budget(bytes=64 * MIB, objects=700_000, cells=4_000_000, depth=64, text=1000)
MAX_USES = 100_000
# Assemblies count as well.
MAX_OCCURRENCES = 50_000
MAX_LEVELS = 64
MAX_VERTICES = 10_000_000


def missing(tx: Tx, checksums: Collection[str]) -> list[str]:
    """Find which of these contents are files of revisions and lack geometry or structure."""
    where = select(models.c.file_checksum).where(
        models.c.geometry.is_not(None), models.c.structure.is_not(None)
    )
    query = select(revisions.c.file_checksum).where(one_of(tx, revisions.c.file_checksum, checksums))
    query = query.where(revisions.c.kind == MODEL)
    return list(tx.conn.scalars(query.where(revisions.c.file_checksum.not_in(where)).distinct()))


def unpacked(part: Part, body: bytes, packed: bool) -> bytes:
    """Unpack a body that may be gzip. Raises TooLargeError, RejectedError."""
    most = UNPACKED[part]
    if packed:
        reader = zlib.decompressobj(wbits=31)
        try:
            body = reader.decompress(body, most + 1)
        except zlib.error as error:
            raise RejectedError(
                message("{part}: wanted gzip, as Content-Encoding says, got damaged data", part=part)
            ) from error
        if len(body) <= most and (not reader.eof or reader.unused_data):
            raise RejectedError(
                message(
                    "{part}: wanted one whole gzip stream, got one that is cut off or has data after its end",
                    part=part,
                )
            )
    if len(body) > most:
        raise TooLargeError(
            message("{part}: wanted at most {most} MiB unpacked, got more", part=part, most=most // MIB)
        )
    return body


def keep(tx: Tx, store: FileStore, checksum: str, part: Part, body: bytes) -> None:
    """Store geometry or structure of a content, packed. Raises NotFoundError if no revision has it."""
    if tx.conn.scalar(select(revisions.c.id).where(revisions.c.file_checksum == checksum).limit(1)) is None:
        raise NotFoundError(
            message(
                "no revision has a file with the SHA-256 {checksum}; commit the file first", checksum=checksum
            )
        )
    stored = store.keep(part, io.BytesIO(gzip.compress(body, 6, mtime=0)))
    values: dict[str, Any] = {part: stored.checksum}
    if part == "geometry":
        values["geometry_size"] = stored.size
    if not tx.conn.execute(update(models).where(models.c.file_checksum == checksum).values(values)).rowcount:
        tx.conn.execute(insert(models).values(file_checksum=checksum, **values))
    if part == "structure":
        fill_in(tx, store, checksum)


# Items with the newest revisions of the documents that hold them.
_held = (
    item_rows.join(document_items, document_items.c.item_id == item_rows.c.id)
    .join(documents, documents.c.id == document_items.c.document_id)
    .join(
        revisions,
        (revisions.c.document_id == documents.c.id)
        & (revisions.c.revision_number == documents.c.current_revision),
    )
)


def with_model(tx: Tx, item_ids: Collection[int]) -> set[int]:
    """Find which of these items have a model."""
    of = _held.join(models, models.c.file_checksum == revisions.c.file_checksum)
    query = select(item_rows.c.id).select_from(of).where(models.c.structure.is_not(None))
    return set(tx.conn.scalars(query.where(one_of(tx, item_rows.c.id, item_ids))))


def fill_in(tx: Tx, store: FileStore, checksum: str) -> None:
    """Update the items whose newest file this is with what the file states of them."""
    kept = tx.conn.scalar(select(models.c.structure).where(models.c.file_checksum == checksum))
    structure = _structure(store, kept) if kept is not None else None
    held = (
        select(item_rows.c.part_number, document_items.c.object)
        .select_from(_held)
        .where(revisions.c.file_checksum == checksum, item_rows.c.archived_at.is_(None))
        .order_by(item_rows.c.id, document_items.c.object)
    )
    if structure is None:
        return
    for number, name in {row.part_number: row.object for row in tx.conn.execute(held)}.items():
        product = structure.products.get(name or next(iter(structure.roots), ""))
        if product is not None and product.stated is not None:
            items.fill_in(tx, number, product.stated, checksum)


def _structure(store: FileStore, checksum: str) -> wire.Structure | None:
    """Read a structure from the store; None if the store has lost it."""
    try:
        body = gzip.decompress(store.path_of(checksum).read_bytes())
    except (OSError, NotFoundError):
        return None
    return wire.Structure.model_validate_json(body)


def stored(tx: Tx, checksum: str, part: Part) -> str:
    """Find the hash of a part in the store. Raises NotFoundError."""
    value = tx.conn.scalar(select(models.c[part]).where(models.c.file_checksum == checksum))
    if value is None:
        raise NotFoundError(
            message("the file with the SHA-256 {checksum} has no {part} yet", checksum=checksum, part=part)
        )
    return str(value)


def check_structure(body: bytes) -> wire.Structure:
    """Read and check the structure of a file. Raises RejectedError."""
    try:
        data = read_json(body, STRUCTURE, "structure")
        structure = wire.Structure.model_validate(data)
    except (ValidationError, ValueError) as error:
        raise RejectedError(message("structure: {problem}", problem=_first(error))) from error
    if unknown := _unknown_key(data, structure):
        raise RejectedError(message("structure: {key} is no key of a structure", key=unknown[:200]))
    uses = [use for product in structure.products.values() for use in product.uses]
    if len(uses) > MAX_USES:
        raise RejectedError(
            message("structure: wanted at most {most} uses, got {uses}", most=MAX_USES, uses=len(uses))
        )
    texts = [part for usage in uses for part in (usage.member, usage.file, usage.target, usage.uuid)]
    texts += [
        part
        for key, model_product in structure.products.items()
        for part in (key, model_product.label, model_product.uuid)
    ]
    stated = [
        model_product.stated
        for model_product in structure.products.values()
        if model_product.stated is not None
    ]
    texts += [text for usage in stated for text in (usage.material, usage.description) if text]
    if problem := character_problem("".join([*texts, *structure.roots])):
        raise RejectedError(message("structure: {problem}", problem=problem))
    lost = [key for key in structure.roots if key not in structure.products]
    lost += [usage.target for usage in uses if not usage.file and usage.target not in structure.products]
    if lost:
        raise RejectedError(
            message("structure: wanted a product for each key, got none for {key}", key=repr(lost[0]))
        )
    return structure


def _unknown_key(data: Any, known: BaseModel) -> str:
    """Find a key that was sent and is not in the model; "" if there is none.

    What is stored is handed out again as it came. So nothing is in it that was not checked.
    """
    stack: list[tuple[str, Any, Any]] = [("", data, known)]
    while stack:
        where, sent, model = stack.pop()
        if isinstance(model, BaseModel) and isinstance(sent, Mapping):
            fields = {info.alias or name: name for name, info in type(model).model_fields.items()}
            fields |= {name: name for name in type(model).model_fields}
            for key, value in sent.items():
                if key not in fields:
                    return f"{where}{key}"
                stack.append((f"{where}{key}.", value, getattr(model, fields[key])))
        elif isinstance(model, Mapping) and isinstance(sent, Mapping):
            stack.extend((f"{where}{key}.", value, model.get(key)) for key, value in sent.items())
        elif isinstance(model, list) and isinstance(sent, list):
            stack.extend((f"{where}{i}.", *pair) for i, pair in enumerate(zip(sent, model, strict=True)))
    return ""


def _first(error: Exception) -> str:
    if not isinstance(error, ValidationError):
        return str(error)
    problem = error.errors(include_url=False, include_input=False)[0]
    return f"{'.'.join(map(str, problem['loc']))[:200]}: {problem['msg']}"


def check_glb(body: bytes) -> None:
    """Raise RejectedError for geometry that is no GLB as decision 24 has it."""
    try:
        problem = _glb_problem(body)
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError, struct.error) as error:
        problem = message(
            "it is no GLB that can be read ({kind}: {problem})", kind=type(error).__name__, problem=error
        )
    if problem:
        raise RejectedError(message("geometry: {problem}", problem=problem))


_SIZES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_PARTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_INDICES: Mapping[int, Literal["B", "H", "I"]] = {5121: "B", 5123: "H", 5125: "I"}
# A larger whole number is infinity to a browser.
MOST = 1e300
# Whatever else a glTF may hold makes a browser load or build something.
_KEYS = {"asset", "scene", "scenes", "nodes", "meshes", "materials", "accessors", "bufferViews", "buffers"}
_KEYS |= {"extensionsUsed", "extensionsRequired"}


# The keys of each kind of row, beside those that a writer may leave out.
_ROWS = {
    "asset": {"version", "generator"},
    "scenes": {"nodes", "name"},
    "nodes": {"mesh", "name", "extras", "children", "translation", "rotation", "scale", "matrix"},
    "meshes": {"primitives", "name"},
    "materials": {"pbrMetallicRoughness", "name", "alphaMode", "doubleSided"},
    "accessors": {
        *("bufferView", "byteOffset", "componentType", "count", "type", "min", "max", "normalized", "name"),
        "sparse",
    },
    "bufferViews": {"buffer", "byteOffset", "byteLength", "byteStride", "target", "name"},
    "buffers": {"byteLength", "uri", "name"},
}


def _unknown_parts(document: Mapping[str, Any]) -> Iterable[str]:
    """Name keys of rows that a drawn model does not have: what a browser would build is what was checked."""
    for kind, known in _ROWS.items():
        rows = document.get(kind, ())
        for row in [rows] if isinstance(rows, Mapping) else rows:
            yield from (f"{kind}.{key}" for key in set(row) - known)
    for mesh in document.get("meshes", ()):
        for primitive in mesh["primitives"]:
            drawn = {"attributes", "indices", "material", "mode"}
            yield from (f"primitives.{key}" for key in set(primitive) - drawn)
            yield from (f"attributes.{key}" for key in set(primitive["attributes"]) - {"POSITION", "NORMAL"})


def _glb_problem(body: bytes) -> str:
    magic, version, length, size, kind = struct.unpack_from("<4sIII4s", body)
    if (magic, version, length, kind) != (b"glTF", 2, len(body), b"JSON") or size > length - 20:
        return message("wanted a GLB of version 2 and of its own length, got another")
    document = read_json(body[20 : 20 + size], GLB, "geometry", lambda name: float("nan"))
    rest = body[20 + size :]
    blob = memoryview(rest)[8:]
    if rest and (struct.unpack_from("<I4s", rest) != (len(blob), b"BIN\0")):
        return message("wanted one binary chunk behind the JSON, got another")
    if unknown := sorted(set(document) - _KEYS) or sorted(_unknown_parts(document)):
        return message(
            "wanted nodes, meshes and materials only, got {unknown}", unknown=repr(unknown[0][:40])
        )
    if set(document.get("extensionsUsed", ())) - {"KHR_mesh_quantization"}:
        return message("wanted no extension but KHR_mesh_quantization")
    if any(buffer.get("uri") or buffer["byteLength"] > len(blob) for buffer in document.get("buffers", ())):
        return message("wanted one buffer inside the GLB, got another")
    if not all(abs(number) <= MOST for number in _numbers(document)):
        return message("wanted finite numbers, got NaN or infinity")
    views = document.get("bufferViews", ())
    for view in views:
        start, count, stride = view.get("byteOffset", 0), view["byteLength"], view.get("byteStride", 0)
        if view["buffer"] != 0 or min(start, count, stride) < 0 or start + count > len(blob) or stride > 252:
            return message("a view lies outside of the buffer")
    accessors = document.get("accessors", ())
    for accessor in accessors:
        view, count, start = (
            _at(views, accessor["bufferView"]),
            accessor["count"],
            accessor.get("byteOffset", 0),
        )
        each = _SIZES[accessor["componentType"]] * _PARTS[accessor["type"]]
        end = start + (count - 1) * (view.get("byteStride") or each) + each
        if "sparse" in accessor or count < 1 or start < 0 or end > view["byteLength"]:
            return message("an accessor lies outside of its view")
    if sum(accessor["count"] for accessor in accessors) > MAX_VERTICES:
        return message("wanted at most {most} vertices and indices, got more", most=MAX_VERTICES)
    nodes, meshes = document.get("nodes", ()), document.get("meshes", ())
    primitives = [primitive for mesh in meshes for primitive in mesh["primitives"]]
    if max(len(nodes), len(meshes)) > 20_000 or len(primitives) > 100_000:
        return "wanted at most 20 000 nodes and 100 000 primitives, got more"
    if sorted(document["scenes"][0].get("nodes", ())) != list(range(len(nodes))):
        return message("wanted each node once, below the scene")
    for node in nodes:
        if "children" in node or not isinstance(node["extras"]["key"], str):
            return message("wanted nodes without children, with the key of a product each")
        if "mesh" in node:
            _at(meshes, node["mesh"])
    for primitive in primitives:
        counts = {_at(accessors, each)["count"] for each in primitive["attributes"].values()}
        index = _at(accessors, primitive["indices"])
        view, form = views[index["bufferView"]], _INDICES[index["componentType"]]
        start = view.get("byteOffset", 0) + index.get("byteOffset", 0)
        values = blob[start : start + index["count"] * _SIZES[index["componentType"]]].cast(form)
        if (
            index["type"] != "SCALAR"
            or view.get("byteStride")
            or len(counts) != 1
            or max(values) >= min(counts)
        ):
            return message("an index names a vertex that is not there")
        if "material" in primitive:
            _at(document["materials"], primitive["material"])
    return ""


def _at(rows: Sequence[Any], number: int) -> Any:
    if number < 0:
        raise LookupError(message("a number of a row is negative"))
    return rows[number]


def _numbers(value: Any) -> Iterable[int | float]:
    stack = [value]
    while stack:
        part = stack.pop()
        if isinstance(part, dict | list):
            stack.extend(part.values() if isinstance(part, dict) else part)
        elif isinstance(part, int | float):
            yield part


# --- the scene ---

# Three rows of four numbers.
_Matrix = tuple[float, ...]
_STILL: _Matrix = (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)


@dataclass
class File:
    """A content in a scene. ``links``: path as recorded → the content that it leads to; None: not known."""

    checksum: str
    name: str
    links: dict[str, str | None] = field(default_factory=dict)
    products: Mapping[str, wire.ModelProduct] = field(default_factory=dict)
    roots: Sequence[str] = ()
    has_structure: bool = False
    geometry: str | None = None
    size: int = 0
    index: int | None = None


def scene(tx: Tx, store: FileStore, item: Item, number: int | None) -> dict[str, Any]:
    """Find the place of each part of an item, in the newest files or as revision ``number`` recorded it.

    Raises NotFoundError if the item has no such file, TooLargeError.
    """
    revision = newest_file(tx, item) if number is None else get_revision(tx, with_file(tx, item), number)
    if revision.file_checksum is None or not revision.is_model:
        raise NotFoundError(
            message(
                "revision {revision} of {subject} has no model",
                revision=revision.revision_number,
                subject=item.subject,
            )
        )
    files = _files(tx, store, revision.file_checksum, as_recorded=number is not None)
    joined = Joined(files)
    top = files[revision.file_checksum]
    held = select(document_items.c.object).join(documents, documents.c.id == document_items.c.document_id)
    mine = tx.conn.scalars(held.where(document_items.c.item_id == item.id, document_items.c.object != ""))
    named = [name for name in mine if name in top.products] if item.id else []
    root = named[0] if named else next(iter(top.roots), None)
    if not top.has_structure:
        joined.lacks("", top.name, message("its file has no model yet"))
    elif root is not None:
        joined.below(top, root)
    uuids = {uuid.lower() for occurrence in joined.found for uuid in occurrence["lines"] if uuid}
    uuids |= {lost["part_number"].lower() for lost in joined.missing}
    items_by_uuid = items.get_by_uuids(tx, sorted(uuids - {""}), include_archived=True)
    numbers = {part.uuid: part.part_number for part in items_by_uuid}
    for occurrence in joined.found:
        occurrence["lines"] = [numbers.get(uuid.lower(), "") for uuid in occurrence["lines"]]
        occurrence["part_number"] = occurrence["lines"][-1] if occurrence["lines"] else item.part_number
    shown = {number for occurrence in joined.found for number in occurrence["lines"]} | {item.part_number}
    bare = [each for each in (item, *items_by_uuid) if each.part_number in shown and not each.archived_at]
    for lost in joined.missing:
        lost["part_number"] = numbers.get(lost["part_number"].lower(), "")
    return {
        "part_number": item.part_number,
        "revision": revision.revision_number,
        "geometries": [
            {
                "id": file.checksum,
                "url": f"/api/models/{file.checksum}/geometry?v={(file.geometry or '')[:16]}",
                "bytes": file.size,
            }
            for file in joined.drawn
        ],
        "occurrences": joined.found,
        "without_picture": [each.part_number for each in bare if not each.thumbnail_key],
        "missing": list({tuple(occurrence.values()): occurrence for occurrence in joined.missing}.values()),
    }


def _files(tx: Tx, store: FileStore, top: str, *, as_recorded: bool) -> dict[str, File]:
    """Read the file with this content and all below it, a layer of links at a time."""
    files: dict[str, File] = {}
    layer = {top}
    while layer:
        rows: dict[str, Any] = {}
        query = select(revisions.c.file_checksum, revisions.c.file_name, revisions.c.links)
        for row in tx.conn.execute(
            query.where(one_of(tx, revisions.c.file_checksum, layer)).order_by(revisions.c.id)
        ):
            rows[row.file_checksum] = row
        parts: dict[str, Any] = {
            row.file_checksum: row
            for row in tx.conn.execute(select(models).where(one_of(tx, models.c.file_checksum, layer)))
        }
        for checksum, row in rows.items():
            files[checksum] = _read(store, row, parts.get(checksum))
        links = [(each, link) for each in rows for link in json.loads(rows[each].links or "[]")]
        newest = {} if as_recorded else _newest(tx, {_target(link) for _, link in links})
        for each, link in links:
            files[each].links[link["path"]] = newest.get(_target(link)) or link.get("sha256") or None
        layer = {path for each in rows for path in files[each].links.values() if path and path not in files}
    return files


def _target(link: Mapping[str, str]) -> str:
    return (link.get("document") or link.get("item") or "").lower()


def _newest(tx: Tx, uuids: set[str]) -> dict[str, str]:
    """Find the content of the newest file of each document, by the document's UUID."""
    query = (
        select(documents.c.uuid, revisions.c.file_checksum)
        .join(revisions, revisions.c.document_id == documents.c.id)
        .where(one_of(tx, documents.c.uuid, uuids - {""}))
        .where(revisions.c.revision_number == documents.c.current_revision)
    )
    return {row.uuid: row.file_checksum for row in tx.conn.execute(query) if row.file_checksum}


def _read(store: FileStore, row: Any, part: Any | None) -> File:
    file = File(row.file_checksum, row.file_name or "")
    if part is None:
        return file
    file.geometry, file.size = part.geometry, part.geometry_size or 0
    structure = _structure(store, part.structure) if part.structure is not None else None
    if structure is not None:
        file.products, file.roots, file.has_structure = structure.products, structure.roots, True
    return file


class Joined:
    """The structures of files, put together. ``lines`` and ``part_number`` hold UUIDs here."""

    def __init__(self, files: Mapping[str, File]) -> None:
        self.files = files
        self.found: list[dict[str, Any]] = []
        self.missing: list[dict[str, str]] = []
        self.drawn: list[File] = []
        self._steps = 0
        self._open: set[tuple[str, str]] = set()

    def lacks(self, uuid: str, label: str, why: str) -> None:
        """Note a part that cannot be shown, and why."""
        self.missing.append({"part_number": uuid, "label": label, "why": why})

    def below(
        self,
        file: File,
        key: str,
        place: _Matrix = _STILL,
        path: tuple[str, ...] = (),
        lines: tuple[str, ...] = (),
        color: list[float] | None = None,
    ) -> None:
        """Note the shape of a product itself, and each occurrence below it."""
        product = file.products[key]
        self._steps += 1
        if self._steps > MAX_OCCURRENCES:
            raise TooLargeError(
                message("a scene has at most {most} parts; open one of its assemblies", most=MAX_OCCURRENCES)
            )
        uuid = lines[-1] if lines else product.uuid
        if (file.checksum, key) in self._open:
            self.lacks(
                uuid, product.label, message("it contains itself; it is left out where the ring closes")
            )
            return
        if len(path) > MAX_LEVELS:
            self.lacks(uuid, product.label, message("it lies more than {most} levels deep", most=MAX_LEVELS))
            return
        if not all(abs(coordinate) <= 1e6 for coordinate in place):
            self.lacks(uuid, product.label, message("its place or its scale is beyond all bounds"))
            return
        if product.shape:
            self._draw(file, key, place, path, lines, color)
        elif not product.uses:
            self.lacks(uuid, product.label, message("its file holds no shape of it"))
        self._open.add((file.checksum, key))
        for use in product.uses:
            target: File | None = file
            for hop in use.file.split("|") if use.file else ():
                target = self.files.get(target.links.get(hop) or "") if target is not None else None
            uuid = use.uuid
            if target is None:
                self.lacks(uuid, use.target, message("its file {file} is not in Silo", file=use.file))
            elif not target.has_structure:
                self.lacks(uuid, target.name, message("its file has no model yet"))
            elif use.target not in target.products:
                self.lacks(uuid, use.target, message("{part} has no such part any more", part=target.name))
            else:
                uuid = uuid or target.products[use.target].uuid
                here = _times(place, use.matrix)
                self.below(target, use.target, here, (*path, use.member), (*lines, uuid), color or use.color)
        self._open.discard((file.checksum, key))

    def _draw(
        self,
        file: File,
        key: str,
        place: _Matrix,
        path: tuple[str, ...],
        lines: tuple[str, ...],
        color: list[float] | None,
    ) -> None:
        if file.geometry is not None and file.index is None:
            file.index = len(self.drawn)
            self.drawn.append(file)
        if file.geometry is None:
            self.lacks(
                lines[-1] if lines else "", file.products[key].label, message("its file has no geometry yet")
            )
        columns = [*(round(place[4 * row + col], 9) for col in range(4) for row in range(3))]
        matrix = [column for col in range(4) for column in (*columns[3 * col : 3 * col + 3], float(col == 3))]
        self.found.append(
            {
                "path": path,
                "lines": lines,
                "part_number": "",
                "label": file.products[key].label,
                "geometry": file.index,
                "key": key,
                "matrix": matrix,
                "color": color,
            }
        )


def _times(a: _Matrix, b: Sequence[float]) -> _Matrix:
    return tuple(
        a[row] * b[col]
        + a[row + 1] * b[col + 4]
        + a[row + 2] * b[col + 8]
        + (a[row + 3] if col == 3 else 0.0)
        for row in (0, 4, 8)
        for col in range(4)
    )
