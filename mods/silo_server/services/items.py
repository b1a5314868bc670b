# SPDX-License-Identifier: LGPL-2.1-or-later
"""Items: their stable UUIDs, their part numbers (which may be renamed), finding and changing them.

Part numbers: what one may look like, and how the next of a category is found.
"""

from __future__ import annotations

import json
import math
import re
import uuid as uuids
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from operator import itemgetter
from typing import Any

from sqlalchemy import ColumnElement, func, insert, select, update
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.exc import IntegrityError

from silo.api.wire import FACTS, FactSource, ItemTexts, Stated
from silo.bom.errors import ConflictError, NotFoundError, RejectedError, VersionConflictError
from silo.bom.message import Message, joined, message, template
from silo.bom.text import REFUSED_CHARACTERS, character_problem
from silo.bom.units import stored_unit
from silo.bom.walk.identity import as_uuid
from silo_server.db.answers import KeptAnswer, KeyedRequest, earlier_answer, keep_answer
from silo_server.db.rows import one_of
from silo_server.db.tables import items, number_counters
from silo_server.db.transaction import Tx
from silo_server.errors import DuplicateError
from silo_server.events import announce
from silo_server.fields import names_of
from silo_server.schema import ITEM_TYPES, Category, Schema
from silo_server.services import revisions
from silo_server.services.scheme import scheme_of
from silo_server.services.search import index_item, search_for
from silo_server.user_json import check_json, dumps, merge_patch
from silo_server.values import Item

LONGEST_UNIT = 32
# Two numbers that look the same must be the same number: what has no picture is refused. These are the
# blanks but the plain one, the bidirectional and zero-width characters (Cf, Zl, Zp), and others that readers
# may ignore.
UNSEEN = (
    "\\xa0\\xad\\u034f\\u0600-\\u0605\\u061c\\u06dd\\u070f\\u0890\\u0891\\u08e2\\u115f\\u1160\\u1680\\u17b4\\u17b5"
    "\\u180b-\\u180f\\u2000-\\u200f\\u2028-\\u202f\\u205f-\\u206f\\u2800\\u3000\\u3164\\ufe00-\\ufe0f\\ufeff\\uffa0"
    "\\ufff9-\\ufffb\U0001bca0-\U0001bca3\U0001d173-\U0001d17a\U000e0000-\U000e0fff"
)
_INSIDE = rf"\t\n\r{REFUSED_CHARACTERS}{UNSEEN}"
NUMBER_FORM = re.compile(rf"[^\s{_INSIDE}](?:[^{_INSIDE}]{{0,62}}[^\s{_INSIDE}])?")
_UNSEEN = re.compile(f"[{UNSEEN}]")


def check_number(number: str) -> str:
    """Check and trim a part number; RejectedError if it cannot be seen whole, or stand in one line."""
    if problem := character_problem(number):
        raise RejectedError(message("part_number: {problem}", problem=problem))
    trimmed = number.strip()
    unseen = sorted({f"U+{ord(c):04X}" for c in _UNSEEN.findall(trimmed)})
    if unseen:
        raise RejectedError(
            message(
                "part_number: wanted characters that can be seen, got {characters} in {number}; type the "
                "number by hand instead of pasting it",
                characters=", ".join(unseen),
                number=ascii(number),
            )
        )
    if not NUMBER_FORM.fullmatch(trimmed):
        raise RejectedError(
            message(
                "part_number: wanted 1 to 64 characters in one line, without tabs, got {got}",
                got=repr(number[:80]),
            )
        )
    return trimmed


def preview_number(tx: Tx, schema_name: str | None, category: str) -> str:
    """Find the number that the next item of the category would get; the number stays free."""
    schema = scheme_of(tx, schema_name)
    category_found = schema.category(category)
    last = tx.conn.scalar(
        select(number_counters.c.last_serial).where(
            number_counters.c.schema_name == schema.name, number_counters.c.category == category_found.code
        )
    )
    return _next_free(tx, schema, category_found, last or 0)[0]


def take_number(tx: Tx, schema: Schema, category: Category) -> str:
    """Take the next free number of the category."""
    where = (number_counters.c.schema_name == schema.name, number_counters.c.category == category.code)
    make = postgresql.insert if tx.postgres else sqlite.insert
    first = {"schema_name": schema.name, "category": category.code, "last_serial": 0}
    tx.conn.execute(make(number_counters).values(first).on_conflict_do_nothing())
    last = tx.conn.scalar(select(number_counters.c.last_serial).where(*where).with_for_update()) or 0
    number, serial = _next_free(tx, schema, category, last)
    tx.conn.execute(update(number_counters).where(*where).values(last_serial=serial))
    return number


def _next_free(tx: Tx, schema: Schema, category: Category, last: int) -> tuple[str, int]:
    # Numbers that people chose may be in the way; they are few, so 64 candidates are checked at a time.
    serial = last
    while True:
        page = {schema.number(category.code, n): n for n in range(serial + 1, serial + 65)}
        keys = {number.casefold(): number for number in page}
        taken = set(
            tx.conn.scalars(select(items.c.part_number_key).where(one_of(tx, items.c.part_number_key, keys)))
        )
        for key, number in keys.items():
            if key not in taken:
                return number, page[number]
        serial += 64


@dataclass(frozen=True, kw_only=True)
class NewItem:
    """What a client says of an item to be made. With ``uuid`` or ``key`` a repeat makes no second item."""

    schema: str | None = None
    category: str | None = None
    part_number: str | None = None
    uuid: str | None = None
    name: str = ""
    description: str = ""
    item_type: str | None = None
    texts: Mapping[str, str | None] = field(default_factory=dict)  # of silo.api.wire.ItemTexts
    properties: Mapping[str, Any] = field(default_factory=dict)
    key: str | None = None


@dataclass(frozen=True, kw_only=True)
class ItemQuery:
    """Filters of the list.

    search
        words, as :func:`silo_server.services.search.search_for` finds them.
    sort
        a key of :data:`SORTS`, with ``-`` before it the largest first; "": the best first.
    archived
        the archived items only.
    """

    search: str = ""
    item_type: str | None = None
    category: str | None = None
    include_archived: bool = False
    limit: int = 100
    offset: int = 0
    sort: str = ""
    archived: bool = False


# By the key, then by part number. Names sort by code point, on both databases, as their index does.
SORTS: Mapping[str, Sequence[ColumnElement[Any]]] = {
    "number": (items.c.part_number_key,),
    "name": (items.c.name, items.c.part_number_key),
    "type": (items.c.item_type, items.c.part_number_key),
    "revision": (items.c.current_revision, items.c.part_number_key),
    "changed": (items.c.updated_at, items.c.part_number_key),
}


_TEXTS = tuple(ItemTexts.model_fields)
_MADE = ("schema_name", "properties", "supplier_parts", "origins")
_OWN = tuple(name for name in names_of(Item) if name not in ("schema", "texts", *_MADE))


def _columns(names: Sequence[str]) -> Callable[[Any], tuple[Any, ...]]:
    # By place: this takes a third of the time of reading attributes, and a page reads 10 000 items.
    return itemgetter(*map(items.c.keys().index, names))


_texts, _made, _own = map(_columns, (_TEXTS, _MADE, _OWN))


def to_item(row: Any) -> Item:
    """Make an item from its row, which has all columns in their order."""
    schema, properties, offers, origins = _made(row)
    return Item(
        **dict(zip(_OWN, _own(row), strict=True)),
        schema=schema,
        texts=dict(zip(_TEXTS, _texts(row), strict=True)),
        properties=json.loads(properties),
        supplier_parts=json.loads(offers) if offers else (),
        origins=json.loads(origins) if origins else {},
    )


def get_item(tx: Tx, part_number: str, *, include_archived: bool = False, lock: bool = False) -> Item:
    """Find the item with this number, in upper or lower case.

    NotFoundError if there is none, or if it is archived.

    ``lock`` makes other writers of this item, and of its BOM, wait until this transaction ends, whose time
    is then later than that of the item's last change.
    """
    if problem := character_problem(part_number):
        raise NotFoundError(message("no item has this part number: {problem}", problem=problem))
    query = select(items).where(items.c.part_number_key == part_number.casefold())
    row = tx.conn.execute(query.with_for_update(key_share=True) if lock else query).one_or_none()
    if row is None or (row.archived_at and not include_archived):
        if row is None:
            raise NotFoundError(
                message("item {part_number} does not exist on this server", part_number=repr(part_number))
            )
        raise NotFoundError(message("item {part_number} is archived", part_number=repr(part_number)))
    if lock:
        tx.take_time(row.updated_at)
    return to_item(row)


def get_by_uuid(tx: Tx, uuid: str) -> Item:
    """Find the item with this UUID; NotFoundError if there is none or it is archived."""
    row = tx.conn.execute(select(items).where(items.c.uuid == normal_uuid(uuid))).one_or_none()
    if row is None or row.archived_at:
        raise NotFoundError(message("no item has the UUID {uuid}", uuid=uuid))
    return to_item(row)


def get_by_uuids(tx: Tx, wanted: Sequence[str], *, include_archived: bool = False) -> list[Item]:
    """Find the items with these UUIDs, each once, in the order asked; unknown ones are absent."""
    uuids_asked = [normal for uuid in wanted if (normal := as_uuid(uuid))]
    query = select(items).where(one_of(tx, items.c.uuid, uuids_asked))
    rows = tx.conn.execute(query if include_archived else query.where(items.c.archived_at.is_(None))).all()
    by_uuid = {row.uuid: to_item(row) for row in rows}
    return [by_uuid[uuid] for uuid in dict.fromkeys(uuids_asked) if uuid in by_uuid]


def get_by_numbers(tx: Tx, wanted: Sequence[str], *, include_archived: bool = False) -> dict[str, Item]:
    """Find items by part number, in upper or lower case; the keys are the numbers as they were given."""
    keys = {number: number.casefold() for number in wanted}
    query = select(items).where(one_of(tx, items.c.part_number_key, set(keys.values())))
    rows = tx.conn.execute(query if include_archived else query.where(items.c.archived_at.is_(None))).all()
    by_number = {row.part_number_key: to_item(row) for row in rows}
    return {number: by_number[key] for number, key in keys.items() if key in by_number}


def by_ids(tx: Tx, ids: Collection[int]) -> dict[int, Item]:
    """Read items by their internal ids, archived ones too."""
    rows = tx.conn.execute(select(items).where(one_of(tx, items.c.id, ids))).all()
    return {row.id: to_item(row) for row in rows}


def list_items(tx: Tx, query: ItemQuery) -> tuple[list[Item], int]:
    """Find a page of the items that match, best first, then by part number; and count all that match."""
    conditions: list[ColumnElement[bool]] = []
    if query.archived:
        conditions.append(items.c.archived_at.is_not(None))
    elif not query.include_archived:
        conditions.append(items.c.archived_at.is_(None))
    order: list[ColumnElement[Any]] = list(SORTS.get(query.sort.removeprefix("-"), SORTS["number"]))
    if query.sort.startswith("-"):
        order = [column.desc() for column in order]
    search = search_for(tx, query.search)
    if search is not None:
        condition, rank = search
        conditions.append(condition)
        if not query.sort:
            order.insert(0, rank)
    if query.item_type:
        conditions.append(items.c.item_type == query.item_type)
    if query.category:
        conditions.append(items.c.category == query.category.upper())
    total = tx.conn.scalar(select(func.count()).select_from(items).where(*conditions)) or 0
    rows = tx.conn.execute(
        select(items).where(*conditions).order_by(*order).limit(query.limit).offset(query.offset)
    ).all()
    return [to_item(row) for row in rows], total


def create_item(tx: Tx, new: NewItem) -> tuple[Item, bool]:
    """Make an item. Returns it, and False for the repeat of a request.

    Raises RejectedError for unusable values, DuplicateError for a taken part number, ConflictError for a
    UUID or key of another request.
    """
    # A repeat is judged like the first request: what is unusable is refused, whether or not the id is known.
    schema = scheme_of(tx, new.schema)
    category = schema.category(new.category) if new.category else None
    item_type = _item_type(new.item_type, category)
    number = check_number(new.part_number) if new.part_number else None
    if number is None and category is None:
        raise RejectedError(
            message("category: wanted a category (such as F01) or an explicit part_number, got neither")
        )
    check_json("properties", new.properties)
    uuid = normal_uuid(new.uuid, "id") if new.uuid is not None else None
    request = KeyedRequest.of("item", uuid or new.key, asdict(replace(new, uuid=uuid, key=None)))
    if request is not None:
        # A repeat that comes while the first request is under way waits for it, and finds its item.
        tx.lock(request.key)
    if (earlier := earlier_answer(tx, request)) is not None:
        return _made_before(tx, earlier.text), False
    if uuid is not None and (others := get_by_uuids(tx, [uuid], include_archived=True)):
        state = message(", which is archived") if others[0].archived_at else ""
        raise ConflictError(
            message(
                "id: {uuid} is that of {part_number}{state}; a new item needs a new id",
                uuid=uuid,
                part_number=others[0].part_number,
                state=state,
            )
        )
    if number is None and category is not None:
        number = take_number(tx, schema, category)
    assert number is not None  # given, or of the category
    # Older programs send the SHA-256 of the item's file among the properties.
    properties = {name: value for name, value in new.properties.items() if name != "file_sha256"}
    made_from = new.properties.get("file_sha256")
    name, description = new.name.strip(), new.description.strip()
    values = {
        "uuid": uuid or str(uuids.uuid4()),
        "schema_name": schema.name,
        "category": category.code if category else None,
        "item_type": item_type,
        "name": name or description or number,
        "description": description or name,
        **_stored_texts(new.texts),
        "properties": "{}",
        "made_from": made_from.lower() if isinstance(made_from, str) and len(made_from) <= 64 else None,
        "current_revision": 0,
        "bom_version": 0,
        "version": 1,
        "created_at": tx.stamp,
        "created_by": tx.actor.username,
    }
    _insert(tx, number, values)
    item = get_item(tx, number)
    if properties:
        revisions.add_revision(tx, item, comment="created", properties=properties)
        item = get_item(tx, number)
    else:
        index_item(tx, item.id)
    announce.item_created(tx, item)
    keep_answer(tx, request, KeptAnswer(item.uuid))
    return item, True


@dataclass(frozen=True, kw_only=True)
class ItemChange:
    """Fields to change; None leaves a field as it is. ``properties`` make a new revision.

    source
        where the properties come from (:class:`silo.api.wire.FactOrigin`).
    """

    part_number: str | None = None
    name: str | None = None
    description: str | None = None
    item_type: str | None = None
    category: str | None = None
    texts: Mapping[str, str | None] = field(default_factory=dict)  # of silo.api.wire.ItemTexts
    properties: Mapping[str, Any] | None = None
    comment: str = ""
    source: FactSource = "hand"


def change_item(tx: Tx, part_number: str, change: ItemChange, expected: int | None = None) -> Item:
    """Change an item in place; only new ``properties`` that differ make a revision.

    Raises VersionConflictError unless the item has the ``expected`` version, if that is given.
    """
    item = get_item(tx, part_number, lock=True)
    check_item_version(item, expected)
    values = _changed_values(tx, item, change)
    if "description" in values and "description" in item.origins:  # it was CAD's until now
        item = replace(item, origins={n: origin for n, origin in item.origins.items() if n != "description"})
        tx.conn.execute(update(items).where(items.c.id == item.id).values(origins=dumps(item.origins)))
    given = change.properties
    if given is not None and change.source == "cad":
        given = dict(given) | {name: item.properties[name] for name in _kept_from_cad(item)}
    if given is not None and dict(given) != dict(item.properties):
        revisions.add_revision(tx, item, comment=change.comment, properties=given, source=change.source)
    elif not values:
        return item
    steps = 1 if values else 0  # a revision has counted itself
    number = values.pop("part_number", item.part_number)
    try:
        tx.conn.execute(
            update(items)
            .where(items.c.id == item.id)
            .values(
                **values,
                part_number=number,
                part_number_key=number.casefold(),
                version=items.c.version + steps,
                updated_at=tx.stamp,
                updated_by=tx.actor.username,
            )
        )
    except IntegrityError as error:
        raise DuplicateError(
            message("part number {part_number} is taken by another item", part_number=number)
        ) from error
    index_item(tx, item.id)
    after = get_item(tx, number)
    announce.item_updated(tx, after)
    return after


def _kept_from_cad(item: Item) -> list[str]:
    """List the facts that a user typed, or read from a scale: CAD does not replace them."""
    return [n for n in FACTS if n in item.properties and item.origins.get(n, {}).get("source") != "cad"]


_FACT_WORDS = {
    "mass_kg": "mass",
    "size_m": "size",
    "volume_m3": "volume",
    "com_m": template("centre of mass"),
}


def fill_in(tx: Tx, part_number: str, stated: Stated, checksum: str) -> None:
    """Update an item with what its file states.

    What a user typed or a scale measured stays. A value that came from CAD is removed if the file does not
    state it any more, but not if size and material are still the same.
    """
    item = get_item(tx, part_number, lock=True)
    mine = set(FACTS) - set(_kept_from_cad(item))
    before = {name: value for name, value in item.properties.items() if name in mine}
    stated_fields = stated.model_dump(include=mine, exclude_none=True)
    changed_fields = {
        n: before[n] if _about_same(before.get(n), value) else value for n, value in stated_fields.items()
    }
    if all(before.get(name) in (None, changed_fields.get(name)) for name in ("size_m", "material")):
        changed_fields = before | changed_fields
    properties = {n: value for n, value in item.properties.items() if n not in mine} | changed_fields
    about, changed = stated.description, {}
    is_free = item.description in ("", item.name) or "description" in item.origins
    if about and about != item.description and is_free:
        changed["description"] = about
    given = [n for n in FACTS if properties.get(n) != item.properties.get(n)] + [*changed]
    if given:
        revisions.complete(tx, item, checksum, properties, changed)
        words = joined(", ", [Message(_FACT_WORDS.get(name, name)) for name in given])
        announce.item_updated(
            tx, get_item(tx, part_number), message("{fields} taken from its file", fields=words)
        )


def _about_same(value: Any, other: Any) -> bool:
    """Report whether two geometry kernels may mean the same number, or the same three."""
    if isinstance(value, list) and isinstance(other, list):
        return len(value) == len(other) and all(map(_about_same, value, other))
    is_number = isinstance(value, int | float) and isinstance(other, float)
    return is_number and math.isclose(value, other, rel_tol=1e-6, abs_tol=1e-9)


def check_item_version(item: Item, expected: int | None) -> None:
    """Raise VersionConflictError unless the item still has the version that the request was made from."""
    if expected is not None and expected != item.version:
        raise VersionConflictError(
            message(
                "item {part_number} has version {version}, the request was made from version {expected}; "
                "read it again and repeat",
                part_number=item.part_number,
                version=item.version,
                expected=expected,
            )
        )


def patch_properties(
    tx: Tx,
    part_number: str,
    patch: Mapping[str, Any],
    comment: str = "",
    expected: int | None = None,
    source: FactSource = "hand",
) -> Item:
    """Change the properties that a JSON merge patch (RFC 7386) names; a new revision if one differs."""
    check_json("properties", patch)
    item = get_item(tx, part_number, lock=True)
    merged = merge_patch(dict(item.properties), dict(patch))
    change = ItemChange(properties=merged, comment=comment, source=source)
    return change_item(tx, part_number, change, expected)


def archive_item(tx: Tx, part_number: str, expected: int | None = None) -> None:
    """Archive an item: it keeps its number, history and places in BOMs, but lists do not show it any more."""
    item = get_item(tx, part_number, lock=True)
    check_item_version(item, expected)
    archived = {"archived_at": tx.stamp, "version": items.c.version + 1}
    tx.conn.execute(update(items).where(items.c.id == item.id).values(archived))
    announce.item_deleted(tx, item)


def unarchive_item(tx: Tx, part_number: str) -> Item:
    """Bring an archived item back."""
    item = get_item(tx, part_number, include_archived=True, lock=True)
    if item.archived_at:
        tx.conn.execute(
            update(items).where(items.c.id == item.id).values(archived_at=None, version=items.c.version + 1)
        )
        announce.item_updated(tx, item, message("brought back"))
    return get_item(tx, part_number)


def normal_uuid(uuid: str, field: str = "uuid") -> str:
    """Write a UUID in its one form; RejectedError, naming the field, if it is none."""
    normal = as_uuid(uuid)
    if not normal:
        raise RejectedError(
            message(
                "{field}: wanted a UUID such as 6f9619ff-8b86-4011-b42d-00cf4fc964ff, got {uuid}",
                field=field,
                uuid=repr(uuid),
            )
        )
    return normal


def _made_before(tx: Tx, uuid: str) -> Item:
    """Find the item that the same request made before; it may have changed since."""
    (item,) = get_by_uuids(tx, [uuid], include_archived=True)
    if item.archived_at:
        raise ConflictError(
            message(
                "id: {uuid} is that of {part_number}, which is archived; bring it back, or give a new item "
                "a new id",
                uuid=item.uuid,
                part_number=item.part_number,
            )
        )
    return item


def _insert(tx: Tx, number: str, values: Mapping[str, Any]) -> None:
    try:
        tx.conn.execute(
            insert(items).values(
                **values,
                part_number=number,
                part_number_key=number.casefold(),
                updated_at=values["created_at"],
                updated_by=values["created_by"],
            )
        )
    except IntegrityError as error:
        raise DuplicateError(
            message(
                "part number {part_number} is taken; numbers that differ only in upper and lower case "
                "count as equal",
                part_number=number,
            )
        ) from error


def _item_type(given: str | None, category: Category | None) -> str:
    if given is None:
        return category.item_type if category else "part"
    if given not in ITEM_TYPES:
        raise RejectedError(
            message(
                "item_type: wanted one of {known}, got {item_type}",
                known=", ".join(ITEM_TYPES),
                item_type=repr(given),
            )
        )
    return given


def _stored_texts(texts: Mapping[str, str | None]) -> dict[str, str | None]:
    """Return texts as they are stored: a unit in its one form. RejectedError for what is no unit."""
    if (unit := texts.get("unit")) is None:
        return dict(texts)
    if problem := character_problem(unit) or (
        "" if len(unit.strip()) <= LONGEST_UNIT else message("it is too long")
    ):
        raise RejectedError(
            message(
                "unit: wanted a word such as m or kg, at most {most} characters: {problem}",
                most=LONGEST_UNIT,
                problem=problem,
            )
        )
    return {**texts, "unit": stored_unit(unit) or ""}


def _changed_values(tx: Tx, item: Item, change: ItemChange) -> dict[str, Any]:
    number = change.part_number
    if number not in (None, item.part_number):  # a number that is older than a rule may stay
        number = check_number(number)
    given = {
        "part_number": number,
        "name": change.name,
        "description": change.description,
        "item_type": _item_type(change.item_type, None) if change.item_type is not None else None,
        "category": scheme_of(tx).category(change.category).code if change.category else None,
    }
    changed = {key: value for key, value in given.items() if value != getattr(item, key)}
    changed |= {key: value for key, value in _stored_texts(change.texts).items() if value != item.texts[key]}
    return {key: value for key, value in changed.items() if value is not None}
