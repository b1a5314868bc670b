# SPDX-License-Identifier: LGPL-2.1-or-later
"""BOM exports: single level, indented or flat; CSV (RFC 4180), XLSX, JSON; for as many pieces as are
wanted.

Numbers are numbers, with the unit in the column's head, which mass and inertia tools read as well. Lines on
top say what a reader must know first: for how many pieces, and that the BOM is incomplete. A mass or a cost
with an unknown part is left empty, so that no incomplete sum looks whole.

A cell that a spreadsheet would run as a formula gets an apostrophe before it in CSV, and is marked as text in
XLSX.

BOM import from CSV: first what would happen, row by row; then, when nothing is wrong, all of it at once.

The columns are known by their names (:mod:`silo.bom.headers`); where they are not, a person says which column
is which (:class:`Layout`). Reading a file is pure: it needs no database.
Rows add manual lines or change lines that are there (by the rules of a person's edit); lines that the file
does not name stay as they are. Our own single-level export, imported again, changes nothing.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import chain, islice
from typing import IO, Any, NamedTuple

from sqlalchemy import select

from silo import workbook
from silo.bom.errors import InputError, RejectedError, listed
from silo.bom.headers import (
    Role,
    designators,
    find_clashes,
    find_roles,
    missing_columns,
    plain_cell,
    safe_cell,
    second_columns,
)
from silo.bom.numbers import Mark, as_decimal, common_mark, parse_number, plain, read_quantity, whole_number
from silo.bom.resolve import with_allowed_characters
from silo_server.db.engine import Tx, one_of
from silo_server.db.tables import items
from silo_server.services.bom.frozen import frozen_product
from silo_server.services.bom.history import moment, what_changed
from silo_server.services.bom.lines import (
    ChangeKind,
    ChangeNote,
    LineChange,
    apply_changes,
    check_no_cycle,
    find_rings,
    lines_of,
    new_line_id,
    parent_to_change,
)
from silo_server.services.bom.merge import in_sentences, last_syncs
from silo_server.services.bom.review import check_state, edited_state
from silo_server.services.bom.summary import OpenBom, Summary, Worth, own_worth, summaries, summary_of
from silo_server.services.bom.tree import (
    MAX_DEPTH,
    Exact,
    Occurrence,
    Part,
    expand,
    flatten,
    found_below,
    leading_to,
    load_graph,
    portions,
    some_parts,
    sought,
)
from silo_server.services.items import get_item
from silo_server.services.releases import get_release
from silo_server.settings import TooLargeError, wire
from silo_server.values import Item, Line, LineState, dumps


class View(StrEnum):
    """What an export shows."""

    SINGLE = "single"  # the direct children
    INDENTED = "indented"  # the whole tree, line by line
    FLAT = "flat"  # the leaf parts with their total quantities


COLUMNS = (
    *("Item", "Level", "Part number", "Name", "Description", "Item type", "Relation type", "Quantity"),
    *("Unit", "Total quantity", "Unit mass [kg]", "Overall mass [kg]", "Unit cost", "Overall cost"),
    *("Currency", "Supplier", "Supplier's part number", "Lead time [days]", "Manufacturer"),
    *("Manufacturer's part number", "Material", "Source", "Reference designators", "Find number", "Notes"),
    *("Revision", "Unreferenced since", "Incomplete", "Open"),
)
_FORMATS = {"Unit cost": "#,##0.00##", "Overall cost": "#,##0.00", "Unit mass [kg]": "0.0#####"}
_FORMATS["Overall mass [kg]"] = "0.0##"
_WIDTHS = {
    "Part number": 16,
    "Name": 32,
    "Description": 32,
    "Notes": 30,
    "Incomplete": 30,
    "Open": 24,
    "Supplier": 20,
}
MOST_TOLD = 20
_SIGNS = re.compile(r"[^a-z0-9]+")
PROPERTIES = {
    "Supplier": "supplier",
    "Supplier's part number": "supplier_part_number",
    "Lead time [days]": "lead_time_days",
    "Manufacturer": "manufacturer",
    "Manufacturer's part number": "manufacturer_part_number",
    "Material": "material",
}

Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Export:
    """A BOM to be written. ``notes`` stand on top.

    rows
        by column name, made one by one: in the transaction, which reads what they show.
    """

    root: Item
    view: View
    rows: Iterator[Row]
    notes: Sequence[str] = ()
    pieces: int = 1
    columns: Sequence[str] = COLUMNS


def export(
    tx: Tx,
    part_number: str,
    view: View,
    pieces: int = 1,
    words: str = "",
    item_type: str = "",
    release: str = "",
) -> Export:
    """The BOM of an item, with the totals for so many ``pieces`` of it.

    words, item_type
        the filter: only parts that it finds, and in the other views than the flat one what leads to them.
    release
        the label of a revision: the product as it was frozen.
    """
    root = get_item(tx, part_number, include_archived=bool(release))
    of = get_release(tx, root, release) if release else None
    frozen = frozen_product(tx, root, of) if of else None
    filtered = bool(words or item_type)
    levels = 1 if view is View.SINGLE and not filtered else None  # a filter shows what leads to its parts
    graph = frozen.graph if frozen else load_graph(tx, root, levels, bare=True)
    root, still = graph.root, frozen.open if frozen else summary_of(tx, root).open
    summed: Mapping[int, Summary] = {}
    if not frozen:
        below = [line.child_id for line in graph.lines.get(root.id, ())] if levels else graph.lines
        summed = summaries(tx, {*below} - {root.id})
    # What a sync left out has no number, supplier or type: a filter finds none of it.
    gaps = [] if filtered or of else _gap_rows(tx, root, still, view)
    fitting: Callable[[Line], bool] = lambda _line: True  # noqa: E731 - as what a filter gives
    if filtered and frozen:
        fitting = sought(words, item_type, frozen.parts)
    elif filtered:
        fitting = found_below(tx, graph, words, item_type)
    notes = [f"Revision {of.label}, {of.status}, frozen at {wire(of.frozen_at)}"] if of else []
    notes += [f"For {pieces} pieces of {root.part_number} {root.name}"] if pieces > 1 else []
    if filtered:
        asked = f"“{words}”" if words else ""
        notes.append(f"Only what fits {asked}{' of the type ' + item_type if item_type else ''}")
    for head, told_of in (("Incomplete", "incomplete"), ("Open", "questions")):
        open_ones = [(one.part_number, getattr(one, told_of)) for one in still.values()]
        said = sorted(f"{number} {told}" for number, told in open_ones if told)
        if said:
            more = f"; and {len(said) - MOST_TOLD} more" if len(said) > MOST_TOLD else ""
            notes.append(f"{head}: {'; '.join(said[:MOST_TOLD])}{more}")

    def dressed(bare: Iterable[_Bare]) -> Iterator[Row]:
        for some in portions(bare):
            parts = frozen.parts if frozen else some_parts(tx, {one.line.child_id for one in some})
            for one in some:
                child, amount = one.line.child_id, one.total * pieces
                part, known, said = parts[child], summed.get(child), still.get(child)
                worth = known.as_part if known else own_worth(part.properties)
                worth = frozen.worths[child] if frozen else worth
                told = {"Incomplete": said.incomplete or None if said else None}
                told["Open"] = ", ".join(one.doubts) or None
                yield _row(one, part, amount, of_a_line=view is not View.FLAT) | _values(worth, amount) | told

    bare: Iterator[_Bare]
    if view is View.FLAT:
        flat = enumerate((one for one in flatten(graph) if fitting(one.line)), start=1)
        bare = (
            _Bare(one.line, str(place), 1, one.total * pieces, one.total, one.doubts(pieces))
            for place, one in flat
        )
    else:
        depth = 1 if view is View.SINGLE else MAX_DEPTH
        hit = leading_to(graph, fitting) if filtered else fitting
        bare = (
            _Bare(one.line, item, one.depth, one.line.state.quantity, one.total, graph.doubts(one.line))
            for one, item in _numbered(expand(graph, depth, tx.settings.max_expanded_rows))
            if hit(one.line)
        )
    return Export(root, view, chain(dressed(bare), gaps), notes, pieces)


class _Bare(NamedTuple):
    """A row before it has what it shows of its part: the line, its place, and what is open about it."""

    line: Line
    item: str
    level: int
    quantity: Exact | float
    total: Exact
    doubts: Sequence[str]


_CHANGES = {"what": "What", "within": "In", "part_number": "Part number", "name": "Name"}
_CHANGES |= {"before": "Before", "after": "After", "at": "At", "username": "By"}


def export_changes(tx: Tx, part_number: str, since: str, until: str) -> Export:
    """What changed in a product between two moments, to be written as a table."""
    root = get_item(tx, part_number)
    first, last = moment(tx, root, since), moment(tx, root, until, end=True) if until else tx.stamp
    found = what_changed(tx, root, first, last)
    rows = ({title: getattr(one, name) for name, title in _CHANGES.items()} for one in found)
    notes = [f"{root.part_number} {root.name}: what changed from {wire(first)} to {wire(last)}"]
    return Export(root, View.INDENTED, rows, notes, columns=tuple(_CHANGES.values()))


def _values(worth: Worth, amount: Exact) -> Row:
    """Mass and cost, of one and of all, where nothing of them is unknown and there is one currency."""
    row: Row = {}
    count = as_decimal(amount)
    if worth.mass is not None and worth.mass_whole:
        row |= {"Unit mass [kg]": plain(worth.mass), "Overall mass [kg]": plain(worth.mass * count)}
    if worth.cost_whole and len(worth.costs) == 1:
        ((currency, cost),) = worth.costs.items()
        row |= {"Unit cost": plain(cost), "Overall cost": plain(cost * count), "Currency": currency}
    return row


def _gap_rows(tx: Tx, root: Item, open_ones: Mapping[int, OpenBom], view: View) -> list[Row]:
    """What the last syncs left out: rows without a part number, after all others; missing is a line too."""
    shown = {root.id} if view is View.SINGLE else open_ones.keys()
    ids = [one for one, said in open_ones.items() if said.incomplete and one in shown]
    return [
        {
            "Name": gap.get("name") or gap.get("object"),
            "Quantity": gap.get("quantity"),
            "Incomplete": f"{open_ones[one].part_number}: {sentence}",
        }
        for one, last in last_syncs(tx, ids).items()
        for gap, sentence in zip(last.gaps, in_sentences(last.gaps), strict=True)
    ]


def to_csv(made: Export, out: IO[bytes], *, semicolons: bool = False) -> None:
    """Write RFC 4180: CRLF, quotes doubled; UTF-8 with the mark by which Excel knows it.

    With ``semicolons``, and commas in numbers, it opens right in an Excel of a country that writes 1,5.
    """
    text = io.TextIOWrapper(out, "utf-8-sig", newline="")
    writer = csv.writer(text, lineterminator="\r\n", delimiter=";" if semicolons else ",")
    for note in made.notes:
        writer.writerow([safe_cell(note)])
    writer.writerow(made.columns)
    for row in made.rows:
        writer.writerow([_csv_cell(row.get(column), semicolons) for column in made.columns])
    text.detach()


def _csv_cell(value: Any, semicolons: bool) -> Any:
    if isinstance(value, float):
        written = f"{as_decimal(value):f}"
        return written.replace(".", ",") if semicolons else written
    return safe_cell(value)


def to_xlsx(made: Export, out: IO[bytes]) -> Callable[[], None]:
    """Write a workbook with one sheet; texts are texts, whatever they begin with.

    Returns what packs it once all rows are read: that takes seconds, in which no transaction should wait.
    """
    from xlsxwriter import Workbook

    # Each row goes to the disk when the next one begins.
    book = Workbook(out, {"constant_memory": True})
    title = "".join(c for c in made.root.part_number if c not in "[]:*?/\\'")[:31]
    sheet = book.add_worksheet(title or "BOM")
    head = len(made.notes)
    sheet.freeze_panes(head + 1, 0)
    sheet.repeat_rows(head)
    sheet.set_landscape()
    sheet.fit_to_pages(1, 0)
    for index, column in enumerate(made.columns):
        sheet.set_column(index, index, _WIDTHS.get(column, max(8, len(column) + 2)))
    bold, warning = book.add_format({"bold": True}), book.add_format({"bold": True, "font_color": "#A32020"})
    formats = {column: book.add_format({"num_format": form}) for column, form in _FORMATS.items()}

    def write(row: int, cells: Iterable[tuple[Any, Any]]) -> None:
        for index, (value, form) in enumerate(cells):
            if isinstance(value, str):
                # Excel takes no longer text. Older databases have characters that are refused now.
                sheet.write_string(row, index, with_allowed_characters(value)[:32767], form)
            elif value is not None:
                sheet.write_number(row, index, value, form)

    for place, note in enumerate(made.notes):
        write(place, [(note, warning)])
    write(head, ((column, bold) for column in made.columns))
    last = head
    for last, row in enumerate(made.rows, start=head + 1):
        write(
            last,
            ((row.get(c), None if isinstance(row.get(c), str) else formats.get(c)) for c in made.columns),
        )
    sheet.autofilter(head, 0, last, len(made.columns) - 1)

    def pack() -> None:
        book.close()

    return pack


def to_json(made: Export, out: IO[bytes]) -> None:
    """Write the rows under machine names: ``unit_mass_kg``, ``supplier_part_number``."""
    names = {column: _SIGNS.sub("_", column.lower().replace("'s", "")).strip("_") for column in COLUMNS}
    head = {
        "part_number": made.root.part_number,
        "name": made.root.name,
        "view": made.view.value,
        "version": made.root.bom_version,
        "pieces": made.pieces,
        "notes": list(made.notes),
    }
    out.write(dumps(head)[:-1].encode() + b',"lines":[')
    for number, row in enumerate(made.rows):
        line = dumps({names[column]: row.get(column) for column in COLUMNS})
        out.write((f",{line}" if number else line).encode())
    out.write(b"]}")


def _row(one: _Bare, part: Part, amount: Exact, *, of_a_line: bool) -> Row:
    """A row's cells; ``of_a_line`` False: not those of a line, as a part may be in the tree on several."""
    line, state, properties = one.line, one.line.state, part.properties
    row: Row = {
        "Item": one.item,
        "Level": one.level,
        "Part number": part.part_number,
        "Name": part.name,
        "Description": part.description,
        "Item type": line.child_item_type,
        "Quantity": plain(one.quantity),
        "Unit": state.unit,
        "Total quantity": plain(amount),
    }
    if of_a_line:
        row |= {
            "Relation type": state.rel_type,
            "Source": state.source,
            "Reference designators": " ".join(state.reference_designators) or None,
            "Find number": state.find_number,
            "Notes": state.notes,
            "Revision": state.child_revision,
            "Unreferenced since": wire(state.unreferenced_since),
        }
    for column, name in PROPERTIES.items():
        value = properties.get(name)
        row[column] = (
            value if isinstance(value, int | float) and not isinstance(value, bool) else _text(value)
        )
    return row


def _text(value: Any) -> str | None:
    return str(value) if isinstance(value, str | bool) and value != "" else None


def _numbered(rows: Iterable[Occurrence]) -> Iterator[tuple[Occurrence, str]]:
    # 1, 1.1, 1.2, 2 …: the structure in one column, as CAD systems export it.
    counters: list[int] = []
    for row in rows:
        del counters[row.depth :]
        if len(counters) < row.depth:
            counters.append(0)
        counters[-1] += 1
        yield row, ".".join(map(str, counters))


ROLES = (
    *(Role.PART_NUMBER, Role.QUANTITY, Role.UNIT, Role.REFERENCE_DESIGNATORS, Role.FIND_NUMBER, Role.NOTES),
    *(Role.TYPE, Role.REVISION, Role.LEVEL),
)
NEEDED = (Role.PART_NUMBER, Role.QUANTITY)
DELIMITERS = {",": "commas", ";": "semicolons", "\t": "tabs"}
HEADER_WITHIN = 40
"""The header must be among this many first lines (title blocks are a few lines long)."""
MAX_COLUMNS = 200

# Columns of silo_server.services.bom.transfer.
_INCOMPLETE, _SOURCE, _TOTAL = "Incomplete", "Source", "Total quantity"

# (row number, field → text)
Record = tuple[int, dict[str, str]]


@dataclass(frozen=True, slots=True)
class Layout:
    """How a file is read.

    header
        index of the header's line.
    columns
        index of each role's column.
    mark
        the decimal mark of its numbers, None = as the numbers themselves show.
    """

    delimiter: str
    header: int
    columns: Mapping[Role, int] = field(default_factory=dict)
    mark: Mark | None = None


def read_csv(data: bytes, max_rows: int, layout: Layout | None = None) -> list[Record]:
    """The rows that say anything; RejectedError where this is no BOM, TooLargeError beyond ``max_rows``.

    Needs no database: to be called before a transaction begins, which others would wait for.
    """
    text = _decode(data)
    chosen, layout = layout is not None, layout or guess(text)
    missing = [role for role in NEEDED if role not in layout.columns]
    if missing:
        names = " and ".join(f"'{role.replace('_', ' ').capitalize()}'" for role in missing)
        raise RejectedError(f"file: say which column is {names}")
    rows = _rows(text, layout.delimiter)
    try:
        table = list(islice(rows, layout.header + 1 + max_rows + 1))
    except csv.Error as error:
        raise RejectedError(f"file: wanted CSV, got something that does not read as such ({error})") from None
    if len(table) - layout.header - 1 > max_rows:
        raise TooLargeError(f"file: this server takes at most {max_rows} rows, got more")
    header, body = table[layout.header] if table else [], table[layout.header + 1 :]
    _refuse_flat(header, body, layout.columns[Role.PART_NUMBER])
    if not chosen:
        _refuse_clashes(header, body, layout)
    gap_column = _column(header, _INCOMPLETE)
    records = []
    for number, cells in enumerate(body, start=layout.header + 2):
        record = {role.value: _cell(cells, i) for role, i in layout.columns.items() if i < len(cells)}
        # Our own exports end with what a sync left out: rows that say so, and have no part number.
        if any(record.values()) and (record.get("part_number") or not _cell(cells, gap_column)):
            records.append((number, record))
    return _with_exact_quantities(records, layout)


def as_csv(data: bytes) -> bytes:
    """Return a table as CSV: of a workbook (XLSX, ODS, XLS) the one sheet that holds a BOM, else its first.

    RejectedError where several do, or where a person does not see in the workbook what would be read: lines
    that are hidden or struck out.
    """
    if not data.startswith(workbook.STARTS):
        return data
    try:
        sheets = [(grid, _sheet_text(grid)) for grid in workbook.read_workbook(data, "file")]
    except InputError as error:
        raise RejectedError(str(error)) from None
    known = [one for one in sheets if guess_of(one[1])]
    if known[1:]:
        names = listed([f"“{grid.name}”" for grid, _ in known])
        raise RejectedError(f"file: the sheets {names} each hold a BOM; save the one that is meant by itself")
    if not sheets:
        raise RejectedError("file: wanted a workbook with a table, got one without a sheet")
    grid, text = (known or sheets)[0]
    hidden = {row for row, _ in grid.cells} & grid.hidden_rows
    struck = {row for (row, _), cell in grid.cells.items() if cell.struck}
    for rows, what in ((hidden, "hidden"), (struck, "struck out")):
        if rows:
            lines = listed([str(row + 1) for row in sorted(rows)], 8)
            raise RejectedError(
                f"file: of sheet “{grid.name}” these lines are {what}: {lines}; show or delete them, for an "
                "import would take them like all others"
            )
    return text


def _sheet_text(grid: workbook.Grid) -> bytes:
    out = io.StringIO()
    writer, line = csv.writer(out), 1
    for row in grid.rows():
        out.write("\n" * (row.line - line))  # lines keep their numbers
        writer.writerow(row.cells)
        line = row.line + 1
    return out.getvalue().encode()


def first_lines(data: bytes, delimiter: str, count: int = 8) -> list[list[str]]:
    """The first lines of a file as cells, as far as they can be read; for a person to say what each is."""
    lines: list[list[str]] = []
    with suppress(csv.Error):
        lines.extend(row[:MAX_COLUMNS] for row in islice(_rows(_decode(data), delimiter), count))
    return lines


def likely_delimiter(data: bytes) -> str:
    """The separator that makes the most columns of the first lines."""
    widths = {mark: max(map(len, first_lines(data, mark)), default=0) for mark in DELIMITERS}
    return max(widths, key=lambda mark: widths[mark])


def guess(text: str) -> Layout:
    """Header and columns by the delimiter with which there is a header; RejectedError where there is none."""
    broken: csv.Error | None = None
    near = ""
    for delimiter in DELIMITERS:
        try:
            for index, row in enumerate(islice(_rows(text, delimiter), HEADER_WITHIN)):
                at = find_roles(row[:MAX_COLUMNS], ROLES)
                missing = missing_columns(row[:MAX_COLUMNS], at, NEEDED)
                if not missing:
                    return Layout(delimiter, index, at)
                # A line with one of the two, and another cell beside it, is a header that lacks the other.
                if len(row) > 1 and set(NEEDED) & at.keys():
                    near = near or f"file: in line {index + 1}, {missing}"
        except csv.Error as error:
            broken = error
    if near:
        raise RejectedError(near)
    if broken is not None:
        raise RejectedError(f"file: wanted CSV, got something that does not read as such ({broken})")
    raise RejectedError(
        f"file: wanted a header row with 'Part number' and 'Quantity' among the first {HEADER_WITHIN} rows, "
        "found none"
    )


def guess_of(data: bytes) -> Layout | None:
    """As :func:`guess`, None where there is no header that we know."""
    try:
        return guess(_decode(data))
    except RejectedError:
        return None


def _refuse_flat(header: Sequence[str], body: Sequence[Sequence[str]], part_number: int) -> None:
    """Our flat export has totals over all levels; as the lines of one level they would be wrong."""
    source, total = _column(header, _SOURCE), _column(header, _TOTAL)
    lines = [cells for cells in body if _cell(cells, part_number)]
    if source is None or total is None or not lines:
        return
    if not any(_cell(cells, source) for cells in lines):
        raise RejectedError(
            "file: this is a flat export, whose quantities are totals over all levels, not the lines of this "
            "BOM. Export “these lines” instead, change them, and import that"
        )


def _refuse_clashes(header: Sequence[str], body: Sequence[Sequence[str]], layout: Layout) -> None:
    """Which of two columns counts is a person's to say, not the order of the file."""
    header = header[:MAX_COLUMNS]
    seconds = second_columns(header, ROLES, layout.columns)
    problems = [
        f"the columns '{one.ours}' and '{one.other}' both mean the {one.role.replace('_', ' ')}, and in row "
        f"{layout.header + 2 + one.row} they say {one.used[:40]!r} and {one.unused[:40]!r}"
        for one in find_clashes(header, body, layout.columns, seconds)
    ]
    if problems:
        raise RejectedError(f"file: {'; '.join(problems)}; choose one, or rename the other", problems)


def _column(header: Sequence[str], name: str) -> int | None:
    return next((index for index, cell in enumerate(header) if cell.strip() == name), None)


def _cell(cells: Sequence[str], index: int | None) -> str:
    return plain_cell(cells[index].strip()) if index is not None and index < len(cells) else ""


def _with_exact_quantities(records: list[Record], layout: Layout) -> list[Record]:
    """Quantities as plain numerals where they can be read; what is wrong with one stands beside it.

    The whole column decides what "1,234" means; in a file separated by commas, a point is a decimal point.
    """
    texts = [record.get("quantity", "") for _, record in records]
    mark = layout.mark or common_mark(number.mark for text in texts if (number := parse_number(text)))
    decimal = layout.mark is None and layout.delimiter == ","
    for (_, record), text in zip(records, texts, strict=True):
        reading = read_quantity(text, mark, points_are_decimal=decimal)
        record["quantity"] = "" if reading.value is None else str(reading.value)
        if reading.problem:
            record["quantity_problem"] = reading.problem
    return records


def _rows(text: str, delimiter: str) -> Iterator[list[str]]:
    return csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)


def _decode(data: bytes) -> str:
    for mark, encoding in ((b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"), (b"", "utf-8-sig")):
        if data.startswith(mark):
            try:
                return data.decode(encoding)
            except UnicodeDecodeError:
                break
    # What spreadsheets in western Europe and America write when they are not asked for Unicode.
    return data.decode("cp1252", errors="replace")


@dataclass(frozen=True, slots=True)
class ImportRow:
    """What becomes of one row of the file. ``status``: add change same skip error."""

    row: int
    part_number: str
    status: str
    problems: Sequence[str] = ()
    before: LineState | None = None
    after: LineState | None = None
    child_id: int | None = None
    line: Line | None = None


@dataclass(frozen=True, slots=True)
class ImportPlan:
    """What an import would do; ``problems`` are those of all rows."""

    rows: Sequence[ImportRow]

    @property
    def problems(self) -> list[str]:
        return [f"row {row.row}: {problem}" for row in self.rows for problem in row.problems]

    def count(self, status: str) -> int:
        """How many rows have this status."""
        return sum(row.status == status for row in self.rows)


def plan_import(tx: Tx, part_number: str, records: Sequence[Record]) -> ImportPlan:
    """Say what an import of the rows of :func:`read_csv` would do, row by row; changes nothing."""
    parent = get_item(tx, part_number)
    lines = {(line.child_part_number.casefold(), line.state.rel_type): line for line in lines_of(tx, parent)}
    keys = {record.get("part_number", "").casefold() for _, record in records}
    query = select(items.c.id, items.c.part_number_key, items.c.archived_at)
    known = {
        row.part_number_key: (row.id, row.archived_at is not None)
        for row in tx.conn.execute(query.where(one_of(tx, items.c.part_number_key, keys)))
    }
    new = {known[key][0] for key in keys if key in known}
    rings = find_rings(tx, parent, new - {line.child_id for line in lines.values()})
    rows: list[ImportRow] = []
    seen: set[tuple[str, str]] = set()
    for number, record in records:
        row = _plan_row(number, record, lines, known)
        key = (row.part_number.casefold(), row.after.rel_type if row.after else "")
        if row.status not in ("error", "skip") and key in seen:
            row = ImportRow(number, row.part_number, "error", (f"{row.part_number} stands here twice",))
        seen.add(key)
        if row.status == "add" and row.child_id in rings:
            row = ImportRow(number, row.part_number, "error", (_in_a_ring(parent, rings[row.child_id]),))
        rows.append(row)
    return ImportPlan(rows)


def apply_import(
    tx: Tx, part_number: str, records: Sequence[Record], file_name: str | None, expected: int | None
) -> tuple[ImportPlan, int, int]:
    """Import the rows of :func:`read_csv` as one change. Returns (what was done, change, version).

    RejectedError lists every problem, and then nothing was changed.
    """
    parent = parent_to_change(tx, part_number, expected)
    plan = plan_import(tx, part_number, records)
    if plan.problems:
        raise RejectedError(
            f"{len(plan.problems)} problems in the file, so nothing was imported: {plan.problems[0]}",
            plan.problems,
        )
    changes = []
    for row in plan.rows:
        if row.status == "add" and row.child_id is not None:
            changes.append(LineChange(new_line_id(), row.child_id, None, row.after))
        elif row.status == "change" and row.line is not None:
            changes.append(
                LineChange(row.line.id, row.line.child_id, row.before, row.after, row.line.position)
            )
    check_no_cycle(tx, parent, [c.child_id for c in changes if c.before is None])
    text = f"imported: {plan.count('add')} added, {plan.count('change')} changed"
    note = ChangeNote(kind=ChangeKind.IMPORT, summary=text, document_file=file_name)
    change_id, version = apply_changes(tx, parent, changes, note)
    return plan, change_id, version


def _in_a_ring(parent: Item, ring: Sequence[str]) -> str:
    if len(ring) <= 2:
        return f"Part number: {parent.part_number} is the assembly itself, which cannot be a part of itself"
    return f"Part number: {ring[1]} contains {parent.part_number} itself ({' → '.join(ring)})"


def _plan_row(
    number: int,
    record: Mapping[str, str],
    lines: Mapping[tuple[str, str], Line],
    known: Mapping[str, tuple[int, bool]],
) -> ImportRow:
    name = record.get("part_number", "")
    if record.get("level", "1") not in ("", "1"):
        return ImportRow(number, name, "skip")
    problems: list[str] = []
    changes = _changes(record, problems)
    key = name.casefold()
    line = lines.get((key, changes.get("rel_type", "component")))
    child = known.get(key)
    if not name:
        problems.append("Part number: is empty")
    elif child is None:
        problems.append(f"Part number: {name!r} does not exist on this server")
    elif child[1] and line is None:
        problems.append(f"Part number: {name!r} is archived")
    before = line.state if line else None
    after = None
    if not problems:
        if before:
            changes = {
                field: value for field, value in changes.items() if not _as_written(before, field, value)
            }
            after = edited_state(before, changes)
        else:
            after = LineState(**{"source": "manual", **changes})
        try:
            check_state(after)
        except RejectedError as error:
            problems.extend(error.problems)
    if problems or child is None:
        return ImportRow(number, name, "error", problems)
    status = "add" if before is None else "same" if after == before else "change"
    return ImportRow(number, name, status, (), before, after, child[0], line)


def _as_written(before: LineState, field: str, value: Any) -> bool:
    """True where a file says what the line says; it drops spaces at the ends, and parts designators."""
    known = getattr(before, field)
    if field == "reference_designators":
        return bool(designators(" ".join(known)) == value)
    return isinstance(known, str) and known.strip() == (value or "")


def _changes(record: Mapping[str, str], problems: list[str]) -> dict[str, Any]:
    changes: dict[str, Any] = {}
    if "quantity_problem" in record:
        problems.append(f"Quantity: {record['quantity_problem']}")
    else:
        changes["quantity"] = float(record["quantity"])
    for name in ("unit", "find_number", "notes"):
        if name in record:
            changes[name] = record[name] or None
    if record.get("rel_type"):
        changes["rel_type"] = record["rel_type"].lower()
    if "reference_designators" in record:
        changes["reference_designators"] = designators(record["reference_designators"])
    if "child_revision" in record:
        revision = record["child_revision"]
        changes["child_revision"] = whole_number(revision, 6)
        if revision and changes["child_revision"] is None:
            problems.append(f"Revision: wanted a whole number, got {revision[:40]!r}")
    return changes
