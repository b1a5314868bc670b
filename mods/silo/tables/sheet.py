# SPDX-License-Identifier: LGPL-2.1-or-later
"""The table in a CSV export or a workbook: its heading, and its rows with their line numbers.

A separator is right if a line under it reads as the heading of such a table; nothing is concluded from
counting commas. A heading may have two lines ("Price" over "EUR"; "Part" over "Number" and "Name"). A row
of a CSV file with more cells than the heading is refused with its line, since a mark without quotes shifted
its columns; cells that are missing at the end are empty.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import zip_longest

from silo.bom.errors import InputError, counted
from silo.bom.headers import Heading, missing_columns
from silo.bom.message import Message, joined, message
from silo.bom.numbers import Mark, parse_number
from silo.tables import limits
from silo.tables.as_shown import as_shown
from silo.tables.columns import Assigned, Columns, find_columns
from silo.tables.csv_text import DELIMITERS, decodings, first_records, read_records
from silo.tables.heading_detail import price_heading, quantity_unit
from silo.tables.kind import TableKind
from silo.workbook.encoding import STARTS
from silo.workbook.read import read_workbook
from silo.workbook.sheet import Grid, SheetRow

_BRACKETS = " ()[]{}"
Continues = Callable[[SheetRow, Columns, SheetRow], bool]
"""Says if the line below a heading belongs to it."""


@dataclass(frozen=True, slots=True)
class Sheet:
    """A decoded table; a workbook has no ``delimiter``.

    header, header_line
        the heading, both lines of it joined, and the line of the file on which it begins.
    notes
        what had to be assumed to read it.
    hidden, struck, sheets
        lines of the workbook that are hidden or struck out; names of its sheets with such a table.
    """

    header: tuple[str, ...]
    header_line: int
    columns: Columns
    rows: tuple[SheetRow, ...]
    delimiter: str
    notes: tuple[str, ...] = ()
    hidden: tuple[int, ...] = ()
    struck: tuple[int, ...] = ()
    sheets: tuple[str, ...] = ()

    @property
    def unused(self) -> list[str]:
        """Return the titles of the columns that hold something and have no role."""
        used = self.columns.used
        filled = {i for row in self.rows for i, cell in enumerate(row.cells) if cell and not cell.isspace()}
        filled |= {index for index, title in enumerate(self.header) if title.strip()}
        unused = []
        for index in sorted(filled - used):
            title = self.header[index].strip() if index < len(self.header) else ""
            unused.append(title or message("column {index}, which has no heading", index=index + 1))
        return unused


@dataclass(frozen=True, slots=True)
class Layout:
    """How the user says that a file is read.

    header
        index of the heading among the file's records.
    columns
        role → index of its column.
    mark
        the decimal mark of its numbers; None: as the numbers themselves show.
    """

    delimiter: str
    header: int
    columns: Assigned = field(default_factory=dict)
    mark: Mark | None = None


@dataclass(frozen=True, slots=True)
class _Header:
    delimiter: str
    index: int
    lines: int
    header: SheetRow
    columns: Columns


def read_sheet(
    data: bytes,
    source: str,
    kind: TableKind,
    *,
    columns: Assigned | None = None,
    layout: Layout | None = None,
    encoding: str | None = None,
    delimiter: str | None = None,
    continues: Continues | None = None,
) -> Sheet:
    """Decode a CSV export, or the first sheet of a workbook that holds such a table.

    ``columns``, ``layout``, ``encoding``, ``delimiter``: given by the user, else detected. ``continues``: see
    :data:`Continues`.

    Raises InputError if there is no heading, if a row is longer than the heading, if quotes do not match,
    or if the given encoding does not fit.
    """
    limits.TABLE.account(source).take_bytes(len(data))
    if delimiter is not None and len(delimiter) != 1:
        raise InputError(message("a delimiter is one character, got “{delimiter}”", delimiter=delimiter))
    if data.startswith(STARTS):
        return _from_workbook(data, source, kind, columns, layout, continues)
    first_lines: list[str] = []
    near = ""
    for name, text in decodings(data, encoding, source, kind.code_pages):
        if text.lstrip()[:1] == "<":
            raise InputError(
                message("{source}: this is HTML or XML and no table; export it as CSV or XLSX", source=source)
            )
        first_lines = first_lines or text.splitlines()
        if layout is not None:
            records = read_records(text, layout.delimiter, source)
            best = _chosen(records, kind, layout, source)
        else:
            tables = [(mark, first_records(text, mark)) for mark in delimiter or DELIMITERS]
            found = _best_header(tables, kind, columns)
            if found is None:
                near = near or _near(tables, kind)
                continue
            best, records = found, read_records(text, found.delimiter, source)
        notes: list[str] = []
        if name in kind.code_pages and not data.isascii():
            notes.append(
                message(
                    "the file is not UTF-8; it was read as {name}. If names look wrong, export it as UTF-8 "
                    "or say which encoding it has",
                    name=name,
                )
            )
        return _sheet(records, best, kind, columns, notes, source, continues)
    raise InputError(message("{source}: {kind}", source=source, kind=near or _no_header(first_lines, kind)))


def _from_workbook(
    data: bytes,
    source: str,
    kind: TableKind,
    columns: Assigned | None,
    layout: Layout | None,
    continues: Continues | None,
) -> Sheet:
    sheets = [(grid, grid.rows()) for grid in read_workbook(data, source)]
    usable = [
        (grid, rows, best)
        for grid, rows in sheets
        if (best := _best_header([("", rows[: limits.HEADER_WITHIN])], kind, columns)) is not None
    ]
    if layout is not None:
        if not sheets:
            raise InputError(
                message("{source}: wanted a workbook with a table, got one without a sheet", source=source)
            )
        grid, rows = usable[0][:2] if usable else sheets[0]
        usable = [(grid, rows, _chosen(rows, kind, layout, source)), *usable[1:]]
    if not usable:
        near = _near([("", rows[: limits.HEADER_WITHIN]) for _, rows in sheets], kind)
        lines = [", ".join(row.cells) for _, rows in sheets for row in rows]
        raise InputError(message("{source}: {kind}", source=source, kind=near or _no_header(lines, kind)))
    notes: list[str] = []
    sheets_read = tuple(grid.name for grid, _, _ in usable) if usable[1:] else ()
    if sheets_read:
        others = joined(", ", (message("sheet “{name}”", name=name) for name in sheets_read[1:]))
        notes = [
            message(
                "sheet “{name}” of the workbook was read; not read: {others}",
                name=usable[0][0].name,
                others=others,
            )
        ]
    grid, rows, best = usable[0]
    return _sheet(rows, best, kind, columns, notes, source, continues, grid, sheets_read)


def _chosen(records: Sequence[SheetRow], kind: TableKind, layout: Layout, source: str) -> _Header:
    header = records[layout.header] if layout.header < len(records) else SheetRow(1, ())
    columns = find_columns(header.cells, kind, layout.columns)
    if missing := kind.lacking(columns.at.keys() | {*kind.instead.get(kind.naming[0], ())} & _named(columns)):
        words = joined(", ", map(_title, missing))
        raise InputError(message("{source}: choose the column of {words}", source=source, words=words))
    return _Header(layout.delimiter, layout.header, 1, header, columns)


def _named(columns: Columns) -> set[str]:
    """Return what the user may choose in place of a number: the names of the parts."""
    return {Heading.MANUFACTURER_NUMBER, Heading.VALUE} if Heading.NAME in columns.at else set()


def _with_its_name_on_one_line(row: SheetRow, column: int | None) -> SheetRow:
    """Drop the line breaks of a name, which a workbook has where its column is narrow."""
    if column is None or column >= len(row.cells) or "\n" not in row.cells[column]:
        return row
    cells = [*row.cells]
    cells[column] = " ".join(cells[column].splitlines())
    return row._replace(cells=tuple(cells))


def _sheet(
    records: list[SheetRow],
    best: _Header,
    kind: TableKind,
    given: Assigned | None,
    notes: list[str],
    source: str,
    continues: Continues | None,
    grid: Grid | None = None,
    named: tuple[str, ...] = (),
) -> Sheet:
    header, columns, first = best.header, best.columns, best.index + best.lines
    below = records[first] if first < len(records) else None
    is_single = best.lines == 1 and not columns.chosen
    if (
        below is not None
        and is_single
        and (
            _is_second_line(header, columns, below, kind) or (continues and continues(header, columns, below))
        )
    ):
        header = _joined(header, below, brackets=True)
        columns, first = find_columns(header.cells, kind, given), first + 1
    seen = ", ".join(cell.strip() for cell in header.cells if cell.strip())
    notes += [
        message(
            "there is no column “{text}” for {role} in line {line} ({seen})",
            text=text,
            role=role,
            line=header.line,
            seen=seen,
        )
        for role, text in (given or {}).items()
        if role not in columns.at
    ]
    hidden: tuple[int, ...] = ()
    struck: tuple[int, ...] = ()
    if grid is not None:
        shown = as_shown(records, grid, header, sorted(columns.used))
        records, hidden, struck = shown.records, shown.hidden, shown.struck
        records = [_with_its_name_on_one_line(row, columns.at.get(Heading.NAME)) for row in records]
        notes += shown.notes
    rows = tuple(
        row
        for row in records[first:]
        if any(map(str.strip, row.cells)) and row.cells != records[best.index].cells
    )
    if grid is None:
        _refuse_long(rows, len(header.cells), source)
    return Sheet(
        header.cells, header.line, columns, rows, best.delimiter, tuple(notes), hidden, struck, named
    )


def _refuse_long(rows: Sequence[SheetRow], width: int, source: str) -> None:
    long = [row for row in rows if any(cell.strip() for cell in row.cells[width:])]
    if long:
        problems = [
            message(
                "line {line}: wanted {width} as in the heading, got {cells}; a comma or semicolon "
                "without quotes shifts the columns",
                line=row.line,
                width=counted(width, "cell"),
                cells=counted(len(row.cells), "cell"),
            )
            for row in long
        ]
        raise InputError(message("{source}: {problems}", source=source, problems=problems[0]), problems)


def _is_second_line(header: SheetRow, columns: Columns, below: SheetRow, kind: TableKind) -> bool:
    """Return True if the line below says more about columns above it, and names no part: units, prices'
    quantities.
    """
    if any(columns.cell(below.cells, role) for role in kind.naming):
        return False
    joined = _joined(header, below, brackets=True).cells
    texts = [(index, cell.strip()) for index, cell in enumerate(below.cells) if cell.strip()]
    return bool(texts) and all(_understood(joined[index], kind) for index, _ in texts)


def _understood(title: str, kind: TableKind) -> bool:
    price = price_heading(title) if Heading.PRICE in kind.roles else None
    if price is not None:
        return not price.strange
    role = kind.role_of(title)
    return role is not None and role[0] == Heading.QUANTITY and bool(quantity_unit(title))


def _joined(header: SheetRow, below: SheetRow, *, brackets: bool) -> SheetRow:
    """Join two lines of a heading: a merged cell has its text in the first of its columns."""
    filled = [next(filter(None, reversed(header.cells[: i + 1])), "") for i in range(len(header.cells))]
    filled += [filled[-1] if filled else ""] * (len(below.cells) - len(filled))
    cells = [
        (
            message("{above} ({brackets})", above=above, brackets=under.strip(_BRACKETS))
            if brackets
            else f"{above} {under}".strip()
        )
        if under.strip()
        else own
        for above, own, under in zip_longest(filled, header.cells, below.cells, fillvalue="")
    ]
    return SheetRow(header.line, tuple(cells))


def _best_header(
    tables: Iterable[tuple[str, Sequence[SheetRow]]], kind: TableKind, given: Assigned | None
) -> _Header | None:
    """Find the (delimiter, line) that names most roles; None if no line names what the table needs."""
    best: _Header | None = None
    score = (0, 0, 0)
    for delimiter, rows in tables:
        for index, row in enumerate(rows):
            if any(len(cell) > limits.LONGEST_HEADING for cell in row.cells):
                continue
            columns = find_columns(row.cells, kind, given)
            # A column of its own beside the name keeps a title ("Name") from passing as a header, unless
            # the file has that one column only.
            single = len([cell for cell in row.cells if cell.strip()]) == 1
            if kind.complete(columns.at.keys()):
                here = (1, len(columns.at), -index)
                if here > score and (len(columns.at) > 1 or single):
                    best, score = _Header(delimiter, index, 1, row, columns), here
            if pair := _two_lines(rows[index : index + 2], kind, given):
                here = (int(kind.complete(columns.at.keys())), len(pair[1].at), -index)
                if here > score:
                    best, score = _Header(delimiter, index, 2, *pair), here
    return best


def _two_lines(
    rows: Sequence[SheetRow], kind: TableKind, given: Assigned | None
) -> tuple[SheetRow, Columns] | None:
    """Read two lines as one heading, if both say more than either: "Part" over "Number" and "Name"."""
    if len(rows) < 2 or any(parse_number(cell) for cell in rows[1].cells):
        return None
    first, second = (find_columns(row.cells, kind, given).at for row in rows)
    if len(second) < 2 and kind.complete(first.keys()):
        return None  # a row of the table
    header = _joined(rows[0], rows[1], brackets=False)
    alone = [cell if kind.role_of(cell) else under or cell for cell, under in zip_longest(
        header.cells, rows[1].cells, fillvalue="")]  # fmt: skip
    columns = find_columns(alone, kind, given)
    is_more = len(columns.at) > max(len(first), len(second))
    return (SheetRow(header.line, tuple(alone)), columns) if is_more and kind.complete(columns.at) else None


def _title(role: str) -> Message:
    return Message(role.replace("_", " ").capitalize())


def _near(tables: Iterable[tuple[str, Sequence[SheetRow]]], kind: TableKind) -> str:
    """Say which needed column a line lacks that has another needed one; "" if no line does."""
    for _, rows in tables:
        for row in rows:
            at = find_columns(row.cells, kind).at
            if len(row.cells) > 1 and {*kind.needed} & at.keys():
                lacking = kind.lacking(at)
                if not {*lacking} <= {*Heading}:
                    return message(
                        "in line {line}, there is no column {lacking}",
                        line=row.line,
                        lacking=joined(", ", map(Message, lacking)),
                    )
                known = {Heading(role): place for role, place in at.items()}
                missing = missing_columns(row.cells, known, [Heading(role) for role in lacking])
                return message("in line {line}, {missing}", line=row.line, missing=missing)
    return ""


def _no_header(text: Sequence[str], kind: TableKind) -> str:
    lines = [line.strip() for line in text if line.strip()][:3]
    needed = joined(", ", map(_title, kind.needed))
    wanted = (
        message("header line with {needed}", needed=needed)
        if needed
        else message("header line with a column of names or part numbers")
    )
    if not lines:
        return message("the file is empty; wanted a {wanted}, and rows", wanted=wanted)
    seen = "; ".join(f"“{line[:80]}”" for line in lines)
    words = message(
        "found no {wanted} among the first {header_within} lines. The file begins with {seen}",
        wanted=wanted,
        header_within=limits.HEADER_WITHIN,
        seen=seen,
    )
    if kind.any_name:
        words += message(
            ". Name the columns yourself, for example: --column name=Bauteil --column mass=Gewicht"
        )
    return words


def guess_layout(data: bytes, source: str, kind: TableKind) -> Layout | None:
    """Find how a file is read if the user says nothing; None if it has no heading that we know."""
    if data.startswith(STARTS):
        tables = [[("", grid.rows()[: limits.HEADER_WITHIN])] for grid in read_workbook(data, source)]
    else:
        texts = decodings(data, None, source, kind.code_pages)
        tables = [[(mark, first_records(text, mark)) for mark in DELIMITERS] for _, text in texts]
    best = next((found for table in tables if (found := _best_header(table, kind, None))), None)
    return None if best is None else Layout(best.delimiter, best.index, dict(best.columns.at))


def first_lines(
    data: bytes, source: str, kind: TableKind, delimiter: str | None = None
) -> tuple[str, list[tuple[str, ...]]]:
    """Read the first lines of a file as cells, as far as possible, for a user to name the columns.

    Returns the separator ("" for a workbook): the given one, else the one that makes most columns.
    """
    if data.startswith(STARTS):
        sheets = [grid.rows()[: limits.HEADER_WITHIN] for grid in read_workbook(data, source)]
        likely = [rows for rows in sheets if _best_header([("", rows)], kind, None)]
        return "", [row.cells for row in next(iter([*likely, *sheets]), [])]
    _, text = next(decodings(data, None, source, kind.code_pages))
    tables = [(mark, first_records(text, mark)) for mark in delimiter or DELIMITERS]
    best = _best_header(tables, kind, None)
    widths = {mark: max((len(row.cells) for row in rows), default=0) for mark, rows in tables}
    mark = best.delimiter if best else max(widths, key=lambda each: widths[each])
    return mark, [row.cells for row in dict(tables)[mark]]
