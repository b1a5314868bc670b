# SPDX-License-Identifier: LGPL-2.1-or-later
"""The rows of a BOM as a table has them: what each line is, its quantity with its unit, and the row above it.

Left out, with the reason: parts that are not fitted, sums, and the gaps that Silo's own exports name. A
column is used only if its cells can be what its heading says: "Type" of a foreign table is no kind of line,
and "A" is no revision of Silo.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal

from silo.bom.errors import InputError
from silo.bom.headers import Heading, designators, normal
from silo.bom.message import joined, message
from silo.bom.numbers import Mark, whole_number
from silo.bom.quantities import LARGEST_QUANTITY
from silo.bom.units import PIECES, unit_of
from silo.tables import structure
from silo.tables.clashes import find_clashes
from silo.tables.columns import cell_at
from silo.tables.heading_detail import quantity_unit
from silo.tables.kind import TableKind
from silo.tables.numerals import Numerals
from silo.tables.sheet import Sheet
from silo.tables.totals import is_total
from silo.tables.yes_no import empty_means_fitted, is_fitted, read_yes_no
from silo.workbook.sheet import SheetRow

# What a line says; then what identifies a part without a number, or describes a new one.
LINE_ROLES = (
    Heading.PART_NUMBER,
    Heading.QUANTITY,
    Heading.REFERENCE_DESIGNATORS,
    Heading.UNIT,
    Heading.FIND_NUMBER,
    Heading.NOTES,
    Heading.TYPE,
    Heading.REVISION,
    Heading.LEVEL,
    Heading.ITEM,
    Heading.NOT_FITTED,
    Heading.FITTED,
)
BOUGHT = (Heading.MANUFACTURER, Heading.MANUFACTURER_NUMBER, Heading.SUPPLIER, Heading.SUPPLIER_NUMBER)
NAMING = (Heading.PART_NUMBER, Heading.NAME, Heading.DESCRIPTION, Heading.VALUE, Heading.MANUFACTURER_NUMBER)
BOM = TableKind(
    roles=(*LINE_ROLES, Heading.NAME, Heading.DESCRIPTION, Heading.VALUE, Heading.FOOTPRINT, *BOUGHT),
    naming=NAMING,
    needed=(Heading.PART_NUMBER, Heading.QUANTITY),
    # In place of a needed column, if the file has none.
    instead={
        Heading.PART_NUMBER: (Heading.MANUFACTURER_NUMBER, Heading.VALUE),
        Heading.QUANTITY: (Heading.REFERENCE_DESIGNATORS,),
    },
    single=LINE_ROLES,
)
# Roles whose cells are words of their own, never yes or no.
_NAMES = (Heading.NAME, Heading.PART_NUMBER, Heading.DESCRIPTION)
LINE_KINDS = ("component", "alternate", "reference")
_RANGE = re.compile(r"([A-Za-z]{1,20})([0-9]{1,9})-([A-Za-z]{0,20})([0-9]{1,9})")
# Columns of our own exports.
_INCOMPLETE, _SOURCE, _TOTAL = "Incomplete", "Source", message("Total quantity")
# Headings that number the lines of a file, and are no find numbers.
_COUNTERS = frozenset(("index", "row", "line", "nr", "no", "lfd nr", "item", "item no", "序号", "番号"))


@dataclass(frozen=True, slots=True)
class BomRow:
    """A row of a BOM.

    texts
        role → text of the cell; a role without a column is absent.
    quantity
        None if it cannot be read, which ``problems`` say.
    parent
        index of the row above it in the structure, None at the top.
    left_out
        why it is no line; "" if it is one.
    doubt
        quantity and designators disagree, in words.
    means_part
        false for a row that means no part at all: a sum, an empty row, what an export left out.
    """

    line: int
    texts: Mapping[str, str]
    quantity: Decimal | None
    parent: int | None = None
    problems: tuple[str, ...] = ()
    left_out: str = ""
    doubt: str = ""
    means_part: bool = True


@dataclass(frozen=True, slots=True)
class BomRows:
    """The rows of a table; the titles of its columns that are not used; what was assumed to read it."""

    rows: tuple[BomRow, ...]
    unused: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    columns: Mapping[str, str] = field(default_factory=dict)


def bom_rows(sheet: Sheet, mark: Mark | None = None) -> BomRows:
    """Read the rows. InputError if two columns of one meaning differ, or if this is a flat export."""
    refuse_clashes(sheet, BOM)
    _refuse_flat(sheet)
    at = {role: index for role, index in sheet.columns.at.items() if not _is_other(sheet, role, index)}
    quantities = Numerals.of(sheet, at.get(Heading.QUANTITY), mark)
    heading_unit = quantity_unit(sheet.header[at[Heading.QUANTITY]]) if Heading.QUANTITY in at else ""
    gap = next((i for i, cell in enumerate(sheet.header) if cell.strip() == _INCOMPLETE), None)
    why = {row.line: _no_line(row, at, gap) for row in sheet.rows}
    places = [row for row in sheet.rows if not why[row.line]]
    tree = structure_of(sheet, places, at)
    numbered = _takes_positions(sheet, at, tree.by)
    empty_is_fitted = empty_means_fitted([cell_at(row.cells, at.get(Heading.FITTED)) for row in places])
    rows: list[BomRow] = []
    for index, row in enumerate(places):
        texts = {role: cell_at(row.cells, place) for role, place in at.items()}
        if numbered:
            texts[Heading.FIND_NUMBER] = texts[Heading.ITEM]
        problems = [tree.problems[index]] if index in tree.problems else []
        left_out = _not_fitted(sheet, at, texts, problems, empty_is_fitted=empty_is_fitted)
        quantity, unit = _quantity(row, quantities, texts, problems)
        unit = unit or (heading_unit if not texts.get(Heading.UNIT) else "")
        if unit and texts.get(Heading.UNIT) and unit_of(unit) != unit_of(texts[Heading.UNIT]):
            problems.append(
                message(
                    "Quantity: is in {unit}, and the unit is {other_unit}",
                    unit=unit,
                    other_unit=repr(texts[Heading.UNIT]),
                )
            )
        if unit:
            texts[Heading.UNIT] = unit
        doubt = _doubt(quantity, texts) if Heading.QUANTITY in at else ""
        rows.append(BomRow(row.line, texts, quantity, tree.parents[index], tuple(problems), left_out, doubt))
    others = [
        BomRow(
            row.line,
            {role: cell_at(row.cells, place) for role, place in at.items()},
            None,
            left_out=why[row.line],
            means_part=False,
        )
        for row in sheet.rows
        if why[row.line]
    ]
    dropped = [sheet.header[index].strip() for role, index in sheet.columns.at.items() if role not in at]
    if Heading.ITEM in at and tree.by != "position" and not numbered:
        dropped.append(sheet.header[at[Heading.ITEM]].strip())
    used = {role: sheet.header[index].strip() for role, index in at.items() if index < len(sheet.header)}
    return BomRows((*rows, *others), (*sheet.unused, *dropped), sheet.notes, used)


def refuse_clashes(sheet: Sheet, kind: TableKind) -> None:
    """Refuse two columns of one role that differ: a user says which one counts, not the order of the file."""
    cells = [row.cells for row in sheet.rows]
    seconds = [
        (role, index)
        for role, index in sheet.columns.others
        if role in kind.single and not (role in _NAMES and _answers_yes_or_no(cells, index))
    ]
    problems = [
        message(
            "the columns '{ours}' and '{other}' both mean the {role}, and in row {line} they say "
            "{used} and {unused}",
            ours=clash.ours,
            other=clash.other,
            role=clash.role.replace("_", " "),
            line=sheet.rows[clash.row].line,
            used=repr(clash.used[:40]),
            unused=repr(clash.unused[:40]),
        )
        for clash in find_clashes(sheet.header, cells, sheet.columns.at, seconds)
    ]
    if problems:
        raise InputError(
            message("file: {problems}; choose one, or rename the other", problems=joined("; ", problems)),
            problems,
        )


def _answers_yes_or_no(rows: Sequence[Sequence[str]], index: int) -> bool:
    """Return True if all cells of a column say yes or no: "Component" of an export is no name then."""
    said = {cell_at(cells, index) for cells in rows} - {""}
    return bool(said) and all(read_yes_no(text) is not None for text in said)


def _no_line(row: SheetRow, at: Mapping[str, int], gap: int | None) -> str:
    """Say why a row is no line of the BOM; "" if it is one."""
    if not any(cell_at(row.cells, index) for index in at.values()):
        return message("no cell in a column that is used")
    if is_total([cell_at(row.cells, at.get(role)) for role in NAMING], row.cells):
        return message("a sum, no part")
    if cell_at(row.cells, gap) and not cell_at(row.cells, at.get(Heading.PART_NUMBER)):
        return message("what the export left out: {gap}", gap=cell_at(row.cells, gap)[:80])
    return ""


def _refuse_flat(sheet: Sheet) -> None:
    """Refuse our flat export: its totals over all levels would be wrong as the lines of one level."""
    titles = [cell.strip() for cell in sheet.header]
    if _SOURCE not in titles or _TOTAL not in titles:
        return
    number = sheet.columns.at.get(Heading.PART_NUMBER)
    lines = [row.cells for row in sheet.rows if cell_at(row.cells, number)]
    if lines and not any(cell_at(cells, titles.index(_SOURCE)) for cells in lines):
        raise InputError(
            message(
                "file: this is a flat export, whose quantities are totals over all levels, not the lines "
                "of this BOM. Export “these lines” instead, change them, and import that"
            )
        )


def count_designators(cell: str) -> int:
    """Count the places that reference designators name: three in ``R1, R3-R4``."""
    spans = [(designator, _RANGE.fullmatch(designator)) for designator in designators(cell)]
    return sum(
        max(1, int(span[4]) - int(span[2]) + 1) if span and span[3] in ("", span[1]) else 1
        for _, span in spans
    )


def structure_of(sheet: Sheet, rows: Sequence[SheetRow], at: Mapping[str, int]) -> structure.RowTree:
    """Find which row stands below which."""

    def column(role: str) -> list[str]:
        return [cell_at(row.cells, at.get(role)) for row in rows]

    for role in (Heading.ITEM, Heading.FIND_NUMBER, Heading.LEVEL):
        if role in at and structure.is_position_column(column(role)):
            return structure.by_positions([structure.position(text) for text in column(role)])
    if Heading.LEVEL in at and any(column(Heading.LEVEL)):
        return structure.by_levels([structure.level(text) for text in column(Heading.LEVEL)])
    named = next((at[role] for role in NAMING if role in at), None)
    raw = [row.cells[named] if named is not None and named < len(row.cells) else "" for row in rows]
    levels = structure.indent_levels(raw)
    return structure.flat(len(rows)) if levels is None else structure.RowTree(
        structure.by_levels(levels).parents, "indent"
    )  # fmt: skip


def _is_other(sheet: Sheet, role: str, index: int) -> bool:
    """Return True if a column has the heading of a role, and none of its values."""
    if sheet.columns.chosen:
        return False
    texts = {cell_at(row.cells, index) for row in sheet.rows} - {""}
    if role == Heading.TYPE:
        return bool(texts) and not any(text.casefold() in LINE_KINDS for text in texts)
    if role == Heading.REVISION:
        return bool(texts) and all(whole_number(text, 6) is None for text in texts)
    return False


def _takes_positions(sheet: Sheet, at: Mapping[str, int], by: str) -> bool:
    """Return True if the positions of a flat table are the find numbers of its lines."""
    if Heading.ITEM not in at or Heading.FIND_NUMBER in at or by == "position":
        return False
    return normal(sheet.header[at[Heading.ITEM]]) not in _COUNTERS


def _not_fitted(
    sheet: Sheet,
    at: Mapping[str, int],
    texts: Mapping[str, str],
    problems: list[str],
    *,
    empty_is_fitted: bool,
) -> str:
    for role in (Heading.NOT_FITTED, Heading.FITTED):
        if role not in at:
            continue
        title, text = sheet.header[at[role]].strip(), texts[role]
        if not text and role is Heading.FITTED:
            if not empty_is_fitted:
                problems.append(
                    message("{title}: is empty here and says yes elsewhere; write yes or no", title=title)
                )
            continue
        fitted = is_fitted(text, by_absence=role is Heading.NOT_FITTED)
        if fitted is None:
            problems.append(
                message("{title}: wanted yes or no, got {text}", title=title, text=repr(text[:40]))
            )
        elif not fitted:
            return message("not fitted: {title} is {text}", title=title, text=repr(text[:40]))
    return ""


def _quantity(
    row: SheetRow, quantities: Numerals, texts: Mapping[str, str], problems: list[str]
) -> tuple[Decimal | None, str]:
    if quantities.index is None:
        count = count_designators(texts.get(Heading.REFERENCE_DESIGNATORS, ""))
        if not count:
            problems.append(
                message("Quantity: there is no column of quantities, and the row has no designators")
            )
        return Decimal(count) or None, ""
    amount = quantities.read(row)
    text = texts[Heading.QUANTITY][:40]
    if amount.value is None:
        problems.append(message("Quantity: {problem}", problem=amount.problem))
    elif amount.currency:
        problems.append(message("Quantity: wanted a number such as 4 or 2.5, got {text}", text=repr(text)))
    elif not 0 < amount.value <= Decimal(LARGEST_QUANTITY):
        problems.append(
            message("Quantity: wanted a number above 0 and at most 1e9, got {text}", text=repr(text))
        )
    else:
        return amount.value, amount.unit
    return None, ""


def _doubt(quantity: Decimal | None, texts: Mapping[str, str]) -> str:
    named = count_designators(texts.get(Heading.REFERENCE_DESIGNATORS, ""))
    if quantity is None or not named or quantity == named or unit_of(texts.get(Heading.UNIT)) != PIECES:
        return ""
    return message(
        "Quantity: is {quantity}, and the reference designators name {named}",
        quantity=f"{quantity:f}",
        named=named,
    )
