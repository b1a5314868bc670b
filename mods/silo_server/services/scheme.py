# SPDX-License-Identifier: LGPL-2.1-or-later
"""The site's own scheme: its categories, and how the part numbers of each are written.

A site has one scheme. Until a file brings another, it is the one that comes with the server. The list of
categories goes out as a table and comes in as a table, as a whole: a new list takes the place of the one
before. Items keep their numbers and categories: a category that holds items stays, also if the list lacks it.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache

from sqlalchemy import func, select

from silo.bom.errors import InputError, NotFoundError, RejectedError, listed
from silo.bom.headers import safe_cell
from silo.bom.items.standard_kind import KINDS
from silo.bom.message import message
from silo.bom.numbers import whole_number
from silo.bom.text import character_problem
from silo.tables.category_rows import CATEGORIES, CategoryRow, CategoryRows, category_rows
from silo.tables.sheet import Layout
from silo_server.db.state import get_state, put_state
from silo_server.db.tables import items
from silo_server.db.transaction import Tx
from silo_server.schema import DEFAULT_SCHEMA, ITEM_TYPES, Category, Schema, find_schema
from silo_server.services import audit
from silo_server.services.import_file import read_import
from silo_server.user_json import dumps

SITE = "site"
"""The name of the site's own scheme."""
MOST_CATEGORIES = 2000
COLUMNS: Mapping[str, str] = {
    "code": "Code",
    "name": "Name",
    "prefix": "Prefix",
    "digits": "Digits",
    "parent": "Parent",
    "item_type": "Item type",
    "standard": "Standard parts",
}
_STATE = "scheme"
_LONGEST_CODE, _LONGEST_PREFIX, _LONGEST_NAME, _MOST_DIGITS = 32, 40, 200, 12


def scheme_of(tx: Tx, name: str | None = None) -> Schema:
    """Find the scheme by which items get their numbers, or the one called ``name``. NotFoundError."""
    text = get_state(tx, _STATE)
    own = _read(text) if text else None
    if own is None or (name and name != own.name):
        if name and name not in (DEFAULT_SCHEMA, SITE):
            known = ", ".join([*([own.name] if own else []), DEFAULT_SCHEMA])
            raise NotFoundError(
                message("schema: there is no {schema}; known are {known}", schema=repr(name), known=known)
            )
        return find_schema(None)
    return own


@lru_cache(maxsize=4)
def _read(text: str) -> Schema:
    return _schema([Category(**{**each, "standard": tuple(each["standard"])}) for each in json.loads(text)])


def _schema(categories: Sequence[Category]) -> Schema:
    by_code = {category.code: category for category in categories}

    def top(category: Category) -> str:
        return top(by_code[category.parent]) if category.parent else category.code

    shipped = find_schema(None)
    return Schema(
        name=SITE,
        version=shipped.version,
        description="The part numbers of this site",
        separator="",
        serial_digits=shipped.serial_digits,
        domains={each.code: each.name for each in categories if not each.parent},
        categories={code: replace(each, domain=top(each)) for code, each in by_code.items()},
        fields=tuple(replace(each, categories=()) for each in shipped.fields),
    )


@dataclass(frozen=True, slots=True)
class ImportedCategory:
    """What becomes of a row. ``status``: add change same skip error; ``changes``: (title, before, after)."""

    row: int
    code: str
    name: str
    status: str
    problems: Sequence[str] = ()
    changes: Sequence[tuple[str, str, str]] = ()
    why: str = ""
    category: Category | None = None


@dataclass(frozen=True, slots=True)
class SchemePlan:
    """What a list of categories would change.

    removed, kept
        the codes that the list does not have: without items, and with items.
    refused
        what is wrong with the list as a whole.
    """

    rows: Sequence[ImportedCategory]
    removed: Sequence[str] = ()
    kept: Sequence[Category] = ()
    refused: Sequence[str] = ()

    @property
    def problems(self) -> list[str]:
        """List what is wrong with the rows, and with the list as a whole."""
        wrong = [
            message("row {row}: {problem}", row=row.row, problem=problem)
            for row in self.rows
            for problem in row.problems
        ]
        return [*wrong, *self.refused]

    @property
    def changed(self) -> int:
        """Count what would change."""
        return len(self.removed) + sum(row.status in ("add", "change") for row in self.rows)


def read_categories(data: bytes, layout: Layout | None = None) -> CategoryRows:
    """Read the rows of a list of categories. RejectedError if it is none."""
    sheet = read_import(data, CATEGORIES, MOST_CATEGORIES, layout)
    try:
        return category_rows(sheet)
    except InputError as error:
        raise RejectedError(str(error), list(error.problems)) from None


def plan_scheme(tx: Tx, read: CategoryRows) -> SchemePlan:
    """Plan the change of the scheme to a list; change nothing."""
    now = scheme_of(tx)
    made: dict[str, ImportedCategory] = {}
    rows = []
    for row in read.rows:
        planned = _planned(row, now)
        if planned.category is not None and planned.code in made:
            before = made[planned.code].row
            problem = message("Code: {code} stands in row {before} too", code=planned.code, before=before)
            planned = replace(planned, status="error", problems=(*planned.problems, problem), category=None)
        elif planned.category is not None:
            made[planned.code] = planned
        rows.append(planned)
    codes = {code: each.category for code, each in made.items() if each.category is not None}
    names = {each.name.casefold(): code for code, each in codes.items()}
    rows = [_with_parent(each, codes, names, now) for each in rows]
    kinds: dict[str, str] = {}
    for index, each in enumerate(rows):
        for kind in each.category.standard if each.category else ():
            if kinds.setdefault(kind, each.code) != each.code:
                problem = message(
                    "Standard parts: {kind} are of {other} already", kind=kind, other=kinds[kind]
                )
                rows[index] = replace(each, status="error", problems=(*each.problems, problem))
    gone = [code for code in now.categories if code not in codes] if not any(r.problems for r in rows) else []
    held = _held(tx, gone)
    kept = [replace(now.categories[code], parent="") for code in held]
    refused = [] if codes else [message("the list has no category")]
    return SchemePlan(rows, [code for code in gone if code not in held], kept, refused)


def _held(tx: Tx, codes: Sequence[str]) -> list[str]:
    """Find the categories that hold items."""
    query = select(items.c.category, func.count()).group_by(items.c.category)
    counts = {row[0]: row[1] for row in tx.conn.execute(query)}
    return [code for code in codes if counts.get(code)]


def _planned(row: CategoryRow, now: Schema) -> ImportedCategory:
    texts = {role: text.strip() for role, text in row.texts.items()}
    name = texts["name"]
    code = (texts["code"] or texts["prefix"].rstrip("-_./ ") or name).upper()
    if row.left_out:
        return ImportedCategory(row.line, code, name, "skip", why=row.left_out)
    problems: list[str] = []
    if not name:
        problems.append(message("Name: is empty"))
    for title, text, longest in (
        (message("Code"), code, _LONGEST_CODE),
        (message("Name"), name, _LONGEST_NAME),
    ):
        problem = character_problem(text) or (
            message("has more than {longest} characters", longest=longest) if len(text) > longest else ""
        )
        if problem:
            problems.append(message("{column}: {problem}", column=title, problem=problem))
    old = now.categories.get(code)
    prefix = texts["prefix"] or (old.prefix if old else f"{code}-")
    digits = whole_number(texts["digits"], 2) if texts["digits"] else (old.digits if old else 4)
    if digits is None or not 1 <= digits <= _MOST_DIGITS:
        problems.append(
            message(
                "Digits: wanted a number from 1 to {most}, got {got}",
                most=_MOST_DIGITS,
                got=repr(texts["digits"][:20]),
            )
        )
    too_long = message("is too long") if len(prefix) > _LONGEST_PREFIX else ""
    if problem := character_problem(prefix) or too_long:
        problems.append(message("Prefix: {problem}", problem=problem))
    kind = texts["item_type"].casefold() or (old.item_type if old else "part")
    if kind not in ITEM_TYPES:
        problems.append(
            message(
                "Item type: wanted {known}, got {item_type}",
                known=", ".join(ITEM_TYPES),
                item_type=repr(kind[:40]),
            )
        )
    standard = tuple(word.strip().casefold() for word in texts["standard"].replace(";", ",").split(","))
    standard = tuple(word for word in standard if word)
    if wrong := [word for word in standard if word not in KINDS]:
        problems.append(
            message(
                "Standard parts: wanted some of {kinds}, got {wrong}",
                kinds=", ".join(KINDS),
                wrong=listed(wrong, 5),
            )
        )
    if problems:
        return ImportedCategory(row.line, code, name, "error", problems)
    category = Category(code, name, kind, code, prefix, digits or 4, texts["parent"], standard)
    return ImportedCategory(row.line, code, name, "same", category=category)


def _with_parent(
    row: ImportedCategory, codes: Mapping[str, Category], names: Mapping[str, str], now: Schema
) -> ImportedCategory:
    """Find the parent of a row by code or name, and compare the row with what there is."""
    made = row.category
    if made is None:
        return row
    above = made.parent
    parent = above.upper() if above.upper() in codes else names.get(above.casefold(), "")
    problem = ""
    if above and not parent:
        problem = message("Parent: there is no category {category} in the file", category=repr(above[:60]))
    seen, at = {row.code}, parent
    while at and not problem:
        if at in seen:
            problem = message("Parent: {code} stands below itself", code=row.code)
        seen.add(at)
        over = codes[at].parent
        at = over.upper() if over.upper() in codes else names.get(over.casefold(), "")
    if problem:
        return replace(row, status="error", problems=(problem,), category=None)
    made = replace(made, parent=parent)
    old = now.categories.get(row.code)
    if old is None:
        return replace(row, status="add", category=made)
    before, after = cells_of(old), cells_of(made)
    changes = [(COLUMNS[n], before[n], after[n]) for n in COLUMNS if before[n] != after[n]]
    return replace(row, status="change" if changes else "same", changes=changes, category=made)


def apply_scheme(tx: Tx, read: CategoryRows) -> SchemePlan:
    """Let a list of categories be the scheme. RejectedError lists all problems; then nothing was changed."""
    tx.lock(_STATE)
    plan = plan_scheme(tx, read)
    if plan.problems:
        raise RejectedError(
            message(
                "{n} problems in the file, so nothing was imported: {problem}",
                n=len(plan.problems),
                problem=plan.problems[0],
            ),
            plan.problems,
        )
    if plan.changed:
        made = [*(row.category for row in plan.rows if row.category is not None), *plan.kept]
        put_state(tx, _STATE, dumps([asdict(category) for category in made]))
        audit.note(tx, "scheme.set", SITE, f"{len(made)} categories, {plan.changed} changed")
    return plan


def cells_of(category: Category) -> dict[str, str]:
    """Return a category as the cells of its row."""
    return {
        **{name: str(getattr(category, name)) for name in COLUMNS if name != "standard"},
        "standard": ", ".join(category.standard),
    }


def export_scheme(tx: Tx) -> str:
    """Write the list of categories as CSV (RFC 4180). The import takes it back and changes nothing."""
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(COLUMNS.values())
    for category in scheme_of(tx).categories.values():
        writer.writerow(map(safe_cell, cells_of(category).values()))
    return out.getvalue()
