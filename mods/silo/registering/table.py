# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is to be registered as a table that people edit: CSV out, CSV in, orders or all that is wrong with it.

The columns ``register``, ``name``, ``type``, ``category`` and ``part_number`` are the person's; the others
say which component a row is, and how its file was when the table was written.
"""

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from silo.bom.document import relative
from silo.bom.errors import InputError, NotFoundError
from silo.bom.headers import plain_cell, safe_cell
from silo.registering.offer import ITEM_TYPES, Candidate, Contents, Offer, Similar, State, fingerprint
from silo.registering.orders import Order

COLUMNS = (
    *("register", "file", "object", "standard", "name", "type", "category", "part_number"),
    *("note", "fingerprint"),
)
_AS_THEY_ARE = ("file", "object", "standard")
_AS_UTF_8 = "save the table as CSV (UTF-8)"
_ANSWERS = {"yes": True, "y": True, "no": False, "n": False}
_FILES = {
    State.READ_ONLY: "the file is read-only",
    State.ELSEWHERE: "the file is open in FreeCAD",
    State.MISSING: "the file is missing",
}

# What a spreadsheet would take for a number, a date, a time or a truth: "00123" comes back as 123, "1E5" as
# 100000, "3-4" and "MAR1" as days. An apostrophe before it makes it text, as before a formula.
_MONTH = (
    "(?:jan|feb|fév|mar|mär|mrz|apr|abr|avr|may|mai|mag|jun|jui|giu|jul|lug|aug|aoû|ago|sep|set|oct|okt|ott|nov|"
    r"dec|dez|déc|dic|ene|gen)[^\W\d_]*"
)
_NO_TEXT = re.compile(
    r"'*(?:(?=\D*\d)[-+\d.,:/%$€ ]+(?:e[-+]?\d+)?(?: ?[ap]m?)?"
    rf"|\d{{1,4}}[-./ ]*{_MONTH}[-./ \d]*|{_MONTH}[-./ ]*\d{{1,4}}"
    r"|true|false|wahr|falsch|vrai|faux)",
    re.IGNORECASE,
)

# File and object, or the designation of a standard part.
Key = tuple[str, str]


def key_of(candidate: Candidate, base: str) -> Key:
    """How a table names a component."""
    entry = candidate.entry
    return ("", entry.standard) if entry.standard else (relative(entry.doc_path, base), entry.object_name)


def doubts(candidate: Candidate, earlier: Contents) -> list[str]:
    """Why it may be an item already; ``earlier``: the candidates before it, which get theirs first."""
    told = [
        f"Silo has this very file as {one.part_number}"
        if one.same_file
        else f"Silo has {one.part_number} with the same name"
        for one in candidate.similar
    ]
    if twin := earlier.twin(candidate):
        told.append(f"the same content as {twin.proposal.name}")
    if candidate.same_as:
        told.append(f"carries the identity of {candidate.same_as}, as another file does")
    if candidate.foreign:
        told.append("carries an identity of another server, or of another computer's run")
    return told


def remarks(candidate: Candidate, earlier: Contents) -> list[str]:
    """What a person should know of a row."""
    told = doubts(candidate, earlier)
    if candidate.proposal.is_guess:
        told.append("the category is a guess")
    if candidate.article is not None:
        told.append("modelled in the assembly's own file, not counted")
    if words := _FILES.get(candidate.state):
        told.append(words)
    return told


def write_table(offer: Offer, wanted: Callable[[Candidate], bool], base: str) -> bytes:
    """The table (RFC 4180, UTF-8 with a mark that spreadsheets want); ``wanted``: what says ``yes``."""
    out = io.StringIO()
    writer = csv.DictWriter(out, COLUMNS)
    writer.writeheader()
    earlier = Contents()
    for candidate in offer.candidates:
        earlier.add(candidate)
        if candidate.decided:
            continue
        proposal, entry = candidate.proposal, candidate.entry
        row = {
            "register": "yes" if wanted(candidate) else "no",
            "file": relative(entry.doc_path, base),
            "object": entry.object_name,
            "standard": entry.standard or "",
            "name": proposal.name,
            "type": proposal.item_type,
            "category": proposal.category,
            "part_number": "",
            "note": "; ".join(remarks(candidate, earlier)),
            "fingerprint": _fingerprint(candidate),
        }
        writer.writerow({column: _as_text(text) for column, text in row.items()})
    return b"\xef\xbb\xbf" + out.getvalue().encode("utf-8", "surrogateescape")


def _as_text(cell: str) -> str:
    return "'" + cell if _NO_TEXT.fullmatch(cell) else str(safe_cell(cell))


def _as_written(cell: str) -> str:
    """What :func:`_as_text` was given."""
    return cell[1:] if cell.startswith("'") and _NO_TEXT.fullmatch(cell) else plain_cell(cell)


def _fingerprint(candidate: Candidate) -> str:
    """A letter first: sixteen digits alone are a number to a spreadsheet, which rounds it."""
    found = "" if candidate.entry.is_standard else fingerprint(candidate.entry.doc_path)
    return found and f"x{found}"


@dataclass(frozen=True)
class Row:
    """One row of a table; ``line``: where it begins in the file (1 = first)."""

    line: int
    cells: Mapping[str, str]

    @property
    def key(self) -> Key:
        if standard := self.cells["standard"]:
            return "", standard
        return self.cells["file"], self.cells["object"]


def read_table(data: bytes, name: str) -> list[Row]:
    """The rows of a table, as a spreadsheet or an editor saved it. InputError lists all that is wrong."""
    text = _decoded(data, name)
    first = text.split("\n", 1)[0]
    delimiter = max(",;\t", key=first.count)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    begins, problems, rows = 1, [], []
    header: list[str] | None = None
    try:
        for cells in reader:
            line, begins = begins, reader.line_num + 1
            if not any(cell.strip() for cell in cells):
                continue
            if header is None:
                header = [cell.strip().lower() for cell in cells]
                continue
            while len(cells) > len(header) and not cells[-1].strip():
                cells.pop()  # what a spreadsheet leaves behind on the right
            if len(cells) != len(header):
                problems.append(f"line {line}: wanted {len(header)} cells as in the header, got {len(cells)}")
                continue
            # The name of a file may begin with a space; what people write does not.
            row = {c: _as_written(t) for c, t in zip(header, cells, strict=True)}
            rows.append(Row(line, {c: t if c in _AS_THEY_ARE else t.strip() for c, t in row.items()}))
    except csv.Error as error:
        raise InputError(f"{name}: the row of line {begins} cannot be read as CSV: {error}") from None
    lacking = [column for column in COLUMNS if column not in (header or ())]
    if lacking:
        raise InputError(f"{name} is no table of --plan: it has no column {', '.join(lacking)}")
    twice = sorted(column for column, count in Counter(header).items() if count > 1 and column)
    problems[:0] = [f"line 1: the column {column} is there more than once" for column in twice]
    if problems:
        raise InputError(f"{name} cannot be read; nothing was registered", problems)
    return rows


def _decoded(data: bytes, name: str) -> str:
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16", "replace")
    if b"\0" in data:
        raise InputError(f"{name} is no CSV file; save the table as CSV (UTF-8)")
    # Names of files may be no UTF-8; any other text that is none is a problem of its row.
    return data.decode("utf-8-sig", "surrogateescape")


@dataclass(frozen=True)
class Planned:
    """What a table means now.

    done
        rows whose component has its number by now.
    unlisted
        components without a number that the table does not know.
    """

    orders: tuple[Order, ...]
    done: int
    unlisted: tuple[Candidate, ...]


def orders_of(rows: Sequence[Row], offer: Offer, base: str, api: Any, name: str) -> Planned:
    """The orders of a table. InputError lists all problems with their lines; then nothing is registered."""
    candidates = {key_of(one, base): one for one in offer.candidates if not one.decided}
    registered = {(relative(path, base), obj): number for (path, obj), number in offer.registered.items()}
    counts = Counter(row.key for row in rows)
    problems: list[str] = []
    orders = []
    joined: dict[str, list[Order]] = {}
    done = 0
    for row in rows:
        told: list[str] = []
        wanted = _ANSWERS.get(row.cells["register"].lower())
        if wanted is None:
            told.append(f"register: wanted yes or no, got {row.cells['register']!r}")
        if counts[row.key] > 1:
            told.append("the component is there more than once")
        candidate = candidates.get(row.key)
        if candidate is not None and wanted:
            orders.append(order := _order(row, candidate, offer, api, told))
            if order is not None and order.existing is not None:
                told += _joined_before(order, joined.setdefault(order.existing.item_id, []))
        elif candidate is None and row.key in registered and wanted:
            done += 1
        elif candidate is None and wanted:
            what = row.cells["standard"] or f"{row.cells['file']}#{row.cells['object']}"
            hint = "" if what.isprintable() else f"; {_AS_UTF_8}"
            told.append(f"{what} is no component here{hint}")
        problems += [f"line {row.line}: {words}" for words in told]
    if problems:
        raise InputError(f"{name}: nothing was registered, for not all of it can be", problems)
    listed = {row.key for row in rows}
    unlisted = tuple(
        one
        for key, one in candidates.items()
        if key not in listed and one.article is None and not one.same_as
    )
    return Planned(tuple(order for order in orders if order is not None), done, unlisted)


def _order(row: Row, candidate: Candidate, offer: Offer, api: Any, told: list[str]) -> Order | None:
    cells = row.cells
    before = len(told)
    told += filter(None, [wrong_name(cells["name"], candidate)])
    if cells["type"] not in ITEM_TYPES:
        told.append(f"type: wanted {', '.join(ITEM_TYPES)}; got {cells['type']!r}")
    if cells["category"] not in offer.categories:
        told.append(f"category: there is no {cells['category']!r}; there are {', '.join(offer.categories)}")
    if not candidate.state.usable or candidate.state is State.ELSEWHERE:
        told.append(f"{cells['file']}: {_FILES.get(candidate.state, 'the file cannot be written')}")
    elif _changed(cells["fingerprint"], candidate):
        told.append(f"{cells['file']} has changed since the table was written; look at it, write a new one")
    existing = None
    if number := cells["part_number"]:
        try:
            existing = find_item(number, candidate, api)
        except InputError as error:
            told.append(f"part_number: {error}")
    if len(told) > before:
        return None
    return Order(candidate, cells["name"], cells["type"], cells["category"], existing)


def _joined_before(order: Order, earlier: list[Order]) -> list[str]:
    """A number that was copied down a column makes one item of several parts."""
    others = [one for one in earlier if one.candidate.sha256 != order.candidate.sha256]
    earlier.append(order)
    number = order.existing.part_number if order.existing else ""
    return [
        f"part_number: {number} is already for {one.name!r} above, another file; register one of them with it"
        for one in others[:1]
    ]


def _changed(before: str, candidate: Candidate) -> bool:
    return bool(before) and before != _fingerprint(candidate)


def wrong_name(name: str, candidate: Candidate) -> str:
    """What is wrong with an item's name; "" where nothing is."""
    if not name:
        return "name: it is empty"
    if candidate.entry.standard and name != candidate.entry.standard:
        return f"name: a standard part is called by its designation, {candidate.entry.standard}"
    try:
        name.encode("utf-8")
    except UnicodeEncodeError:
        return f"name: {name!r} is no UTF-8; {_AS_UTF_8}"
    if "\ufffd" in name:
        return f"name: {name!r} has lost letters (\ufffd); {_AS_UTF_8}"
    if len(name) > 200 or not name.isprintable():
        return f"name: wanted one line of at most 200 characters that can be seen, got {name[:50]!r}"
    return ""


def find_item(number: str, candidate: Candidate, api: Any) -> Similar:
    """The item that a component shall join. InputError where it cannot."""
    if candidate.entry.is_standard:
        raise InputError("a standard part has its item by its designation; leave this empty")
    try:
        item = api.get_item(number)
    except NotFoundError:
        raise InputError(f"there is no item {number}; leave it empty for a new one") from None
    if (item.item_type == "assembly") != (candidate.proposal.item_type == "assembly"):
        raise InputError(f"{number} is an item of type {item.item_type}; the file holds another type")
    return Similar(item.part_number, item.id, item.name)
