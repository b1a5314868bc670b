# SPDX-License-Identifier: LGPL-2.1-or-later
"""The search for items: an index of words, FTS5 on SQLite and ``tsvector`` on PostgreSQL, by the same rules.

The words are made here and not by the databases, so that both find the same: case and accents do not count,
everything but letters and digits parts words. A part number is found also without its dashes; in a number and
a name the middle of a word is enough ("schraube" finds "Zylinderschraube"), elsewhere its beginning is.

What is looked into: number, name, descriptions, suppliers with their numbers, texts among the properties and
the names of the uploaded files.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice
from typing import Any

from sqlalchemy import (
    ColumnElement,
    Integer,
    and_,
    case,
    column,
    func,
    literal_column,
    or_,
    select,
    table,
    text,
)
from sqlalchemy.dialects.postgresql import TSQUERY, TSVECTOR
from sqlalchemy.sql.expression import cast, literal

from silo.api.wire import ItemTexts
from silo.bom.text import folded, glued, name_key
from silo_server.db.rows import one_of
from silo_server.db.state import get_state, put_state
from silo_server.db.tables import items, revisions
from silo_server.db.transaction import Tx
from silo_server.schema import text_hints

# Counts up when the rules below change; the next start then makes the index again.
RULES = "2"
STATE = "search_index"
PAGE = 1000
# More than anybody searches for, and what keeps the index of one item small.
LONGEST_WORD = 64
MOST_WORDS = 500
LONGEST_PROPERTY = 200
# What a filter has read is kept for the next one, in some 10 MB.
LONGEST_KEPT = 200

_WORD = re.compile(r"[^\W_]+")
_RUNS = re.compile(r"(?<=[^\W\d_])\d+")
_SHA256 = re.compile(r"(?:sha256:)?([0-9a-f]{64})", re.IGNORECASE)
_fts = table("item_search", column("rowid", Integer))
_vectors = table("item_search", column("item_id", Integer), column("words", TSVECTOR))


def words_of(written: str) -> list[str]:
    """Split a text into words as the index has them."""
    return [word[:LONGEST_WORD] for word in _WORD.findall(folded(written))]


def fits(asked: str) -> Callable[..., bool]:
    """Make a test of texts: true if every word of ``asked`` is in one of them.

    Case and accents do not count.
    """
    wanted = words_of(asked)

    def test(*texts: str | None) -> bool:
        if not wanted:
            return True
        text = " ".join(filter(None, texts))
        written, joined = (_read if len(text) <= LONGEST_KEPT else _read.__wrapped__)(text)
        for word in wanted:  # noqa: SIM110 - in half the time of all()
            if word not in written and word not in joined:
                return False
        return True

    return test


@lru_cache(maxsize=16384)
def _read(text: str) -> tuple[str, str]:
    """Join the words of a text, with spaces between them and without; cached, as filters come again."""
    words = words_of(text)
    return " ".join(words), "".join(words)


def search_for(tx: Tx, written: str) -> tuple[ColumnElement[bool], ColumnElement[int]] | None:
    """Make the query for all words of ``written``: a condition on ``items``, and what to sort by.

    None if there is nothing to search for.

    A single letter or digit finds the numbers that begin with it. A SHA-256 finds the items that have, or
    had, the file with this content, or were registered from it. Best first: the very number, then the words
    in the number, then in number and name, then anywhere.
    """
    parts = folded(written).split()
    if not parts:
        return None
    conditions: list[ColumnElement[bool]] = []
    words: list[str] = []
    for part in parts:
        if digest := _SHA256.fullmatch(part):
            with_file = select(revisions.c.item_id).where(revisions.c.file_checksum == digest[1].lower())
            conditions.append(or_(items.c.id.in_(with_file), _matches(tx, [digest[1].lower()], "")))
        else:
            words += words_of(part)
    key = written.strip().casefold()
    if len(key) == 1 and key.isascii() and words:
        # Nearly every item has a word that begins so; of these only numbers are worth their time.
        begins = (items.c.part_number_key >= key) & (items.c.part_number_key < chr(ord(key) + 1))
        return begins, literal(0)
    if words:
        conditions.append(_matches(tx, words, ""))
    elif not conditions:
        conditions.append(literal(False))
    number = or_(
        items.c.part_number_key == key,
        func.replace(items.c.part_number_key, "-", "") == key.replace("-", ""),
    )
    rank: ColumnElement[int] = literal(0)
    if words:
        rank = case(
            (number, 0), (_matches(tx, words, "number"), 1), (_matches(tx, words, "number name"), 2), else_=3
        )
    return and_(*conditions), rank


def index_item(tx: Tx, item_id: int) -> None:
    """Bring the index up to date with an item that was made or changed, or has a new file."""
    _index(tx, [item_id])


def ensure_index(tx: Tx) -> int:
    """Make the index if there is none, or one of older rules; return how many items were indexed."""
    if get_state(tx, STATE) == RULES:
        return 0
    return rebuild_index(tx)


def rebuild_index(tx: Tx) -> int:
    """Make the whole index again; return how many items were indexed."""
    tx.conn.execute(text("DELETE FROM item_search"))
    count = last = 0
    while True:
        query = select(items.c.id).where(items.c.id > last).order_by(items.c.id).limit(PAGE)
        ids = list(tx.conn.scalars(query))
        if not ids:
            break
        _index(tx, ids, new=True)
        count, last = count + len(ids), ids[-1]
    put_state(tx, STATE, RULES)
    return count


# A choice or a unit is no word to search for: half of the items would be found.
_TEXTS = [
    name
    for name, field in ItemTexts.model_fields.items()
    if "options" not in (hints := text_hints(field)) and hints.get("word", True)
]


def _index(tx: Tx, ids: list[int], *, new: bool = False) -> None:
    names: dict[int, list[str]] = {}
    files = select(revisions.c.item_id, revisions.c.file_name).distinct()
    files = files.where(one_of(tx, revisions.c.item_id, ids), revisions.c.file_name.is_not(None))
    for item_id, name in tx.conn.execute(files):
        names.setdefault(item_id, []).append(name)
    index_rows = tx.conn.execute(
        select(
            items.c.id,
            items.c.part_number,
            items.c.name,
            items.c.description,
            *(items.c[name] for name in _TEXTS),
            items.c.properties,
            items.c.supplier_parts,
            items.c.made_from,
        ).where(one_of(tx, items.c.id, ids))
    ).all()
    rows = [
        {
            "id": row.id,
            "number": _inner({*words_of(row.part_number), _joined(row.part_number)}),
            "name": _inner({*words_of(row.name), *words_of(glued(folded(row.name)))}),
            "other": _limited(
                [
                    row.description,
                    *(getattr(row, name) or "" for name in _TEXTS),
                    *names.get(row.id, ()),
                    row.made_from or "",
                    *(
                        part[k]
                        for part in json.loads(row.supplier_parts or "[]")
                        for k in ("supplier", "number")
                    ),
                ],
                row.properties,
            ),
        }
        for row in index_rows
    ]
    if not rows:
        return
    if tx.postgres:
        vectors = [
            {"id": row["id"], "words": _vector((row["number"], "A"), (row["name"], "B"), (row["other"], "C"))}
            for row in rows
        ]
        tx.conn.execute(
            text(
                "INSERT INTO item_search (item_id, words) VALUES (:id, CAST(:words AS tsvector)) "
                "ON CONFLICT (item_id) DO UPDATE SET words = EXCLUDED.words"
            ),
            vectors,
        )
        return
    if not new:
        tx.conn.execute(text("DELETE FROM item_search WHERE rowid = :id"), [{"id": r["id"]} for r in rows])
    tx.conn.execute(
        text("INSERT INTO item_search (rowid, number, name, other) VALUES (:id, :number, :name, :other)"),
        [{k: v if k == "id" else " ".join(sorted(v)) for k, v in row.items()} for row in rows],
    )


def _matches(tx: Tx, words: Iterable[str], where: str) -> ColumnElement[bool]:
    """Make the condition that an item has all ``words`` or words that begin so.

    ``where`` names the columns of the index; "": in any.
    """
    if tx.postgres:
        weights = {"": "", "number": "A", "number name": "AB"}[where]
        query = " & ".join(f"'{word}':*{weights}" for word in words)
        return items.c.id.in_(
            select(_vectors.c.item_id).where(_vectors.c.words.bool_op("@@")(cast(literal(query), TSQUERY)))
        )
    query = " AND ".join(f'"{word}"*' for word in words)
    if where:
        query = f"{{{where}}} : ({query})"
    matching = literal_column("item_search").bool_op("MATCH")(query)
    return items.c.id.in_(select(_fts.c.rowid).where(matching))


def _vector(*parts: tuple[set[str], str]) -> str:
    # All words of a weight have one place: their order does not matter here.
    places: dict[str, list[str]] = {}
    for number, (words, weight) in enumerate(parts, start=1):
        for word in words:
            places.setdefault(word, []).append(f"{number}{weight}")
    return " ".join(f"'{word}':{','.join(where)}" for word, where in places.items())


def _joined(number: str) -> str:
    return "".join(_WORD.findall(folded(number)))[:LONGEST_WORD]


def _inner(words: Iterable[str]) -> set[str]:
    """Collect words and their ends: a search for beginnings then finds any part of a word."""
    ends: set[str] = set()
    for word in list(filter(None, words))[:MOST_WORDS]:  # a number of signs alone has no word
        ends |= _ends(word)
    return ends


@lru_cache(maxsize=4096)
def _ends(word: str) -> frozenset[str]:
    shortest = 3 if word.isascii() else 1
    return frozenset({word, *(word[start:] for start in range(1, len(word) - shortest + 1))})


def _limited(texts: Iterable[str], properties: str) -> set[str]:
    words_within: set[str] = set()
    for written in [*texts, *_texts(json.loads(properties))]:
        words = words_of(written)
        words_within.update(words, words_of(glued(folded(written))))
        for word in words:  # only the beginnings of these words are found: "iso4762" by its number too
            words_within.update(_RUNS.findall(word))
        if len(words) > 1 and len(written) <= LONGEST_WORD and any(c.isdigit() for c in written):
            words_within.add(_joined(written))  # a supplier's number, without its dashes too
        if len(words_within) > MOST_WORDS:
            break
    return set(sorted(words_within)[:MOST_WORDS])


def _texts(value: Any) -> Iterator[str]:
    waiting = [value]
    while waiting:
        part = waiting.pop()
        if isinstance(part, Mapping):
            waiting += part.values()
        elif isinstance(part, list):
            waiting += part
        elif isinstance(part, str) and len(part) <= LONGEST_PROPERTY:
            yield part


MOST_LOOK_ALIKES = 12


@dataclass(frozen=True, slots=True)
class LookAlike:
    """An item with the name of a component, or with its very file."""

    id: str
    part_number: str
    name: str
    same_file: bool


def find_look_alikes(tx: Tx, wanted: Sequence[tuple[str, str]]) -> list[list[LookAlike]]:
    """Find for each (name, SHA-256 of the file or "") what it may be already, the same file first.

    The index gives those that may fit; a name is compared as people read it, without suffix, in any case.
    """
    names: dict[str, list[Any]] = {name_key(name): [] for name, _ in wanted if name}
    files: dict[str, dict[int, Any]] = {digest.lower(): {} for _, digest in wanted if digest}
    columns = (items.c.id, items.c.uuid, items.c.part_number, items.c.name)
    live = items.c.archived_at.is_(None)
    for key, same in names.items():
        if words := words_of(key):
            near = select(*columns).where(live, _matches(tx, words, "number name"))
            rows = tx.conn.execute(near.order_by(items.c.part_number_key))
            same += islice((row for row in rows if name_key(row.name) == key), MOST_LOOK_ALIKES)
    for digest, having in files.items():
        if _SHA256.fullmatch(digest):
            near = select(*columns, items.c.made_from).where(live, _matches(tx, [digest], ""))
            having.update((row.id, row) for row in tx.conn.execute(near) if row.made_from == digest)
    query = select(*columns, revisions.c.file_checksum).join(items).where(live)
    for row in tx.conn.execute(query.where(one_of(tx, revisions.c.file_checksum, list(files)))):
        files[row.file_checksum][row.id] = row

    def of(name: str, digest: str) -> list[LookAlike]:
        same_file = files.get(digest.lower(), {})
        others = [row for row in names.get(name_key(name), ()) if row.id not in same_file]
        rows = [*((row, True) for row in same_file.values()), *((row, False) for row in others)]
        return [LookAlike(row.uuid, row.part_number, row.name, same) for row, same in rows[:MOST_LOOK_ALIKES]]

    return [of(name, digest) for name, digest in wanted]
