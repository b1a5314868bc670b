# SPDX-License-Identifier: LGPL-2.1-or-later
"""Part numbers: what one may look like, and how the next of a category is found."""

from __future__ import annotations

import re

from sqlalchemy import select, update
from sqlalchemy.dialects import postgresql, sqlite

from silo.bom.errors import RejectedError
from silo_server.db.bulk import one_of
from silo_server.db.engine import Tx
from silo_server.db.tables import items, number_counters
from silo_server.schema.catalog import Category, Schema, find_schema

# Words that stand where a part number stands in a path.
RESERVED = frozenset({"by-uuid", "search", "export.csv", "import", "new"})
# Two numbers that look the same must be the same number: what has no picture is refused. These are the
# blanks but the plain one, the bidirectional and zero-width characters (Cf, Zl, Zp), and others that readers
# may ignore.
UNSEEN = (
    "\\xa0\\xad\\u034f\\u0600-\\u0605\\u061c\\u06dd\\u070f\\u0890\\u0891\\u08e2\\u115f\\u1160\\u1680\\u17b4\\u17b5"
    "\\u180b-\\u180f\\u2000-\\u200f\\u2028-\\u202f\\u205f-\\u206f\\u2800\\u3000\\u3164\\ufe00-\\ufe0f\\ufeff\\uffa0"
    "\\ufff9-\\ufffb\U0001bca0-\U0001bca3\U0001d173-\U0001d17a\U000e0000-\U000e0fff"
)
_INSIDE = rf"/\\?#%\x00-\x1f\x7f-\x9f{UNSEEN}"
NUMBER_FORM = re.compile(rf"[^\s{_INSIDE}](?:[^{_INSIDE}]{{0,62}}[^\s{_INSIDE}])?")
_UNSEEN = re.compile(f"[{UNSEEN}]")


def check_number(number: str) -> str:
    """A part number as given, trimmed; RejectedError where it cannot stand in a path or a cell."""
    trimmed = number.strip()
    unseen = sorted({f"U+{ord(c):04X}" for c in _UNSEEN.findall(trimmed)})
    if unseen:
        raise RejectedError(
            f"part_number: wanted characters that can be seen, got {', '.join(unseen)} in {number!a}; "
            "type the number by hand instead of pasting it"
        )
    if not NUMBER_FORM.fullmatch(trimmed) or trimmed.casefold() in RESERVED or trimmed in (".", ".."):
        raise RejectedError(
            "part_number: wanted 1 to 64 characters without / \\ ? # % and control characters, "
            f"got {number!r}"
        )
    return trimmed


def preview_number(tx: Tx, schema_name: str | None, category: str) -> str:
    """The number the next item of the category would get; consumes nothing."""
    schema = find_schema(schema_name)
    found = schema.category(category)
    last = tx.conn.scalar(
        select(number_counters.c.last_serial).where(
            number_counters.c.schema_name == schema.name, number_counters.c.category == found.code
        )
    )
    return _next_free(tx, schema, found, last or 0)[0]


def take_number(tx: Tx, schema: Schema, category: Category) -> str:
    """The next free number of the category, taken."""
    where = (number_counters.c.schema_name == schema.name, number_counters.c.category == category.code)
    _ensure_counter(tx, schema.name, category.code)
    last = tx.conn.scalar(select(number_counters.c.last_serial).where(*where).with_for_update()) or 0
    number, serial = _next_free(tx, schema, category, last)
    tx.conn.execute(update(number_counters).where(*where).values(last_serial=serial))
    return number


def _ensure_counter(tx: Tx, schema: str, category: str) -> None:
    make = postgresql.insert if tx.postgres else sqlite.insert
    tx.conn.execute(
        make(number_counters)
        .values(schema_name=schema, category=category, last_serial=0)
        .on_conflict_do_nothing()
    )


def _next_free(tx: Tx, schema: Schema, category: Category, last: int) -> tuple[str, int]:
    # Explicit numbers may stand in the way; they are few, so that a page of candidates is looked at a time.
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
