# SPDX-License-Identifier: LGPL-2.1-or-later
"""The table that users edit in a spreadsheet: CSV out, CSV in, requests or all that is wrong with it.

The user fills in the columns ``register``, ``name``, ``source``, ``supplier``, ``supplier_number``, ``type``,
``category`` and ``part_number``; the others say which component a row is, and how its file was when the table
was written.
"""

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from silo.bom.errors import InputError
from silo.bom.headers import plain_cell, safe_cell
from silo.bom.message import message
from silo.bom.walk.document import relative
from silo.registering.candidate import Candidate, CandidateFiles, ComponentState
from silo.registering.offer import Offer
from silo.registering.request import AS_UTF_8, ITEM_TYPES, RegistrationRequest, find_item, wrong_name
from silo.registering.saved_file import fingerprint
from silo.tables.kind import TableKind
from silo.tables.sheet import read_sheet
from silo.tables.yes_no import read_yes_no

COLUMNS = (
    *("register", "file", "object", "standard", "name", "source", "supplier", "supplier_number"),
    *("type", "category", "part_number", "note", "fingerprint"),
)

# A table need not have them.
_SUPPLY = ("source", "supplier", "supplier_number")

_AS_THEY_ARE = ("file", "object", "standard")

SOURCES = {"": "", "made": "manufactured", "bought": "purchased"}

_FILES = {
    ComponentState.READ_ONLY: message("the file is read-only"),
    ComponentState.ELSEWHERE: message("the file is open in FreeCAD"),
    ComponentState.MISSING: message("the file is missing"),
}

# What a spreadsheet would take for a number, a date, a time or a truth: "00123" comes back as 123, "1E5" as
# 100000, "3-4" and "MAR1" as days. An apostrophe before it makes it text, as before a formula.
_MONTH = (
    "(?:jan|feb|fév|mar|mär|mrz|apr|abr|avr|may|mai|mag|jun|jui|giu|jul|lug|aug|aoû|ago|sep|set|oct|okt|ott|nov|"
    r"dec|dez|déc|dic|ene|gen)[^\W\d_]*"
)

_NO_TEXT = re.compile(
    r"'*+(?:(?=\D*\d)[-+\d.,:/%$€ ]++(?:e[-+]?\d+)?(?: ?[ap]m?)?"
    rf"|\d{{1,4}}[-./ ]*{_MONTH}[-./ \d]*|{_MONTH}[-./ ]*\d{{1,4}}"
    r"|true|false|wahr|falsch|vrai|faux)",
    re.IGNORECASE,
)

# File and object, or the designation of a standard part.
Key = tuple[str, str]


def key_of(candidate: Candidate, base: str) -> Key:
    """Return the name of a component in a table."""
    entry = candidate.entry
    return ("", entry.standard) if entry.standard else (relative(entry.doc_path, base), entry.object_name)


def doubts(candidate: Candidate, earlier: CandidateFiles) -> list[str]:
    """List why a candidate may be an item already; ``earlier``: the candidates before it, which get their
    items first.
    """
    reasons: list[str] = [
        message("Silo has this very file as {part_number}", part_number=similar.part_number)
        if similar.same_file
        else message("Silo has {part_number} with the same name", part_number=similar.part_number)
        for similar in candidate.similar
    ]
    if twin := earlier.twin(candidate):
        reasons.append(message("the same content as {name}", name=twin.proposal.name))
    if candidate.same_as:
        reasons.append(
            message("carries the identity of {same_as}, as another file does", same_as=candidate.same_as)
        )
    if candidate.foreign:
        reasons.append(message("carries an identity of another server, or of another computer's run"))
    return reasons


def remarks(candidate: Candidate, earlier: CandidateFiles) -> list[str]:
    """List what the user should know about a row."""
    texts = doubts(candidate, earlier)
    if candidate.proposal.is_guess:
        texts.append(message("the category is a guess"))
    if candidate.learnt:
        texts.append(message("the category is the one chosen before in this folder"))
    if candidate.article is not None:
        texts.append(message("modelled in the assembly's own file, not counted"))
    if words := _FILES.get(candidate.state):
        texts.append(words)
    return texts


def write_table(offer: Offer, wanted: Callable[[Candidate], bool], base: str) -> bytes:
    """Write the table (RFC 4180, UTF-8 with the mark that spreadsheets need); ``wanted``: True for rows with
    ``yes``.
    """
    out = io.StringIO()
    writer = csv.DictWriter(out, COLUMNS)
    writer.writeheader()
    earlier = CandidateFiles()
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
            "source": next(word for word, kind in SOURCES.items() if kind == proposal.sourcing),
            "supplier": proposal.supplier,
            "supplier_number": proposal.supplier_part_number,
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
    """Return the text from which :func:`_as_text` made a cell."""
    return cell[1:] if cell.startswith("'") and _NO_TEXT.fullmatch(cell) else plain_cell(cell)


def _fingerprint(candidate: Candidate) -> str:
    """Return the fingerprint after a letter: a spreadsheet takes sixteen digits for a number, and
    rounds it.
    """
    checksum = "" if candidate.entry.is_standard else fingerprint(candidate.entry.doc_path)
    return checksum and f"x{checksum}"


@dataclass(frozen=True)
class TableRow:
    """One row of a table; ``line``: where it begins in the file (1 = first)."""

    line: int
    cells: Mapping[str, str]

    @property
    def key(self) -> Key:
        if standard := self.cells["standard"]:
            return "", standard
        return self.cells["file"], self.cells["object"]


def _column(cell: str) -> tuple[str, int] | None:
    name = cell.strip().lower()
    return (name, 0) if name in COLUMNS else None


# Names of files may be no UTF-8; any other text that is none is a problem of its row.
PLAN = TableKind(
    roles=COLUMNS,
    naming=("register", "file", "standard"),
    needed=tuple(column for column in COLUMNS if column not in _SUPPLY),
    single=COLUMNS,
    role_of=_column,
    code_pages=(),
)
"""The table of ``--plan``."""


@dataclass(frozen=True)
class TableRows:
    """The rows of a table, and the titles of the columns that are not used."""

    rows: tuple[TableRow, ...]
    unused: tuple[str, ...]


def read_table(data: bytes, name: str) -> TableRows:
    """Read the rows of a table, as a spreadsheet or an editor saved it. InputError lists all that is
    wrong.
    """
    sheet = read_sheet(data, name, PLAN)
    twice = sorted({role for role, _ in sheet.columns.others})
    problems = [
        message(
            "line {header_line}: the column {column} is there more than once",
            header_line=sheet.header_line,
            column=column,
        )
        for column in twice
    ]
    if problems:
        raise InputError(message("{name} cannot be read; nothing was registered", name=name), problems)
    rows = []
    for row in sheet.rows:
        cells = dict.fromkeys(COLUMNS, "")
        for column, index in sheet.columns.at.items():
            text = _as_written(row.cells[index] if index < len(row.cells) else "")
            # The name of a file may begin with a space; a text that the user writes does not.
            cells[column] = text if column in _AS_THEY_ARE else text.strip()
        rows.append(TableRow(row.line, cells))
    return TableRows(tuple(rows), tuple(sheet.unused))


@dataclass(frozen=True)
class Planned:
    """What a table means now.

    done
        rows whose component has its number by now.
    unlisted
        components without a number that the table does not know.
    """

    requests: tuple[RegistrationRequest, ...]
    done: int
    unlisted: tuple[Candidate, ...]


def requests_of(rows: Sequence[TableRow], offer: Offer, base: str, api: Any, name: str) -> Planned:
    """Make the requests of a table. InputError lists all problems with their lines; then nothing is
    registered.
    """
    candidates = {
        key_of(component, base): component for component in offer.candidates if not component.decided
    }
    registered = {(relative(path, base), obj): number for (path, obj), number in offer.registered.items()}
    counts = Counter(row.key for row in rows)
    problems: list[str] = []
    requests = []
    joined: dict[str, list[RegistrationRequest]] = {}
    done = 0
    for row in rows:
        row_problems: list[str] = []
        wanted = read_yes_no(row.cells["register"])
        if wanted is None:
            row_problems.append(
                message("register: wanted yes or no, got {cells}", cells=repr(row.cells["register"]))
            )
        if counts[row.key] > 1:
            row_problems.append(message("the component is there more than once"))
        candidate = candidates.get(row.key)
        if candidate is not None and wanted:
            requests.append(request := _request(row, candidate, offer, api, row_problems))
            if request is not None and request.existing is not None:
                row_problems += _joined_before(request, joined.setdefault(request.existing.item_id, []))
        elif candidate is None and row.key in registered and wanted:
            done += 1
        elif candidate is None and wanted:
            what = row.cells["standard"] or f"{row.cells['file']}#{row.cells['object']}"
            hint = "" if what.isprintable() else message("; {advice}", advice=AS_UTF_8)
            row_problems.append(message("{what} is no component here{hint}", what=what, hint=hint))
        problems += [message("line {line}: {words}", line=row.line, words=words) for words in row_problems]
    if problems:
        raise InputError(
            message("{name}: nothing was registered, because some rows have problems", name=name), problems
        )
    listed = {row.key for row in rows}
    unlisted = tuple(
        component
        for key, component in candidates.items()
        if key not in listed and component.article is None and not component.same_as
    )
    return Planned(tuple(request for request in requests if request is not None), done, unlisted)


def _request(
    row: TableRow, candidate: Candidate, offer: Offer, api: Any, row_problems: list[str]
) -> RegistrationRequest | None:
    cells = row.cells
    before = len(row_problems)
    row_problems += filter(None, [wrong_name(cells["name"], candidate)])
    if cells["source"] not in SOURCES:
        row_problems.append(
            message("source: wanted made, bought or nothing; got {cells}", cells=repr(cells["source"]))
        )
    elif cells["source"] != "bought" and (cells["supplier"] or cells["supplier_number"]):
        row_problems.append(
            message("source: a part with a supplier is bought; say bought, or leave the supplier empty")
        )
    if cells["type"] not in ITEM_TYPES:
        row_problems.append(
            message(
                "type: wanted {item_types}; got {cells}",
                item_types=", ".join(ITEM_TYPES),
                cells=repr(cells["type"]),
            )
        )
    if cells["category"] not in offer.categories:
        row_problems.append(
            message(
                "category: there is no {cells}; there are {categories}",
                cells=repr(cells["category"]),
                categories=", ".join(offer.categories),
            )
        )
    if not candidate.state.usable or candidate.state is ComponentState.ELSEWHERE:
        row_problems.append(
            message(
                "{cells}: {state}",
                cells=cells["file"],
                state=_FILES.get(candidate.state, message("the file cannot be written")),
            )
        )
    elif cells["fingerprint"] not in ("", _fingerprint(candidate)):
        row_problems.append(
            message(
                "{cells} has changed since the table was written; look at it, write a new one",
                cells=cells["file"],
            )
        )
    existing = None
    if number := cells["part_number"]:
        try:
            existing = find_item(number, candidate, api)
        except InputError as error:
            row_problems.append(message("part_number: {error}", error=error))
    if len(row_problems) > before:
        return None
    supply = (SOURCES[cells["source"]], cells["supplier"], cells["supplier_number"])
    return RegistrationRequest(
        candidate, cells["name"], cells["type"], cells["category"], existing, False, *supply
    )


def _joined_before(request: RegistrationRequest, earlier: list[RegistrationRequest]) -> list[str]:
    """Find a number that was copied down a column, which would make one item of several parts."""
    others = [other for other in earlier if other.candidate.sha256 != request.candidate.sha256]
    earlier.append(request)
    number = request.existing.part_number if request.existing else ""
    return [
        message(
            "part_number: {number} is already for {name} above, another file; register one of them with it",
            number=number,
            name=repr(other.name),
        )
        for other in others[:1]
    ]
