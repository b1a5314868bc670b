# SPDX-License-Identifier: LGPL-2.1-or-later
"""BOM exports: single level, indented or flat; CSV (RFC 4180), XLSX, JSON; for as many pieces as are wanted.

Numbers are numbers, with the unit in the column's head, which mass and inertia tools read as well. Lines on
top say what a reader must know first: for how many pieces, and that the BOM is incomplete. A mass or a cost
with an unknown part is left empty, so that no incomplete sum looks whole.

A cell that a spreadsheet would run as a formula gets an apostrophe before it in CSV, and is marked as text in
XLSX.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import chain
from typing import IO, Any

from silo.bom.headers import safe_cell
from silo.bom.numbers import as_decimal, plain
from silo_server.clock import wire
from silo_server.db.engine import Tx
from silo_server.services.bom.last_sync import in_sentences, last_syncs, marks
from silo_server.services.bom.rollup import Worth, parts_of, worths
from silo_server.services.bom.tree import MAX_DEPTH, Exact, Graph, expand, flatten, load_graph
from silo_server.services.items import get_item
from silo_server.values import Item, Line


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
    *("Revision", "Unreferenced since", "Incomplete"),
)
_FORMATS = {"Unit cost": "#,##0.00##", "Overall cost": "#,##0.00", "Unit mass [kg]": "0.0#####"}
_FORMATS["Overall mass [kg]"] = "0.0##"
_WIDTHS = {"Part number": 16, "Name": 32, "Description": 32, "Notes": 30, "Incomplete": 30, "Supplier": 20}
# What a line says of itself; the flat list has none of it.
OF_A_LINE = (
    *("Relation type", "Source", "Reference designators", "Find number", "Notes", "Revision"),
    "Unreferenced since",
)
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
    """A BOM to be written. ``notes`` stand on top; ``rows``, by column name, are made one by one."""

    root: Item
    view: View
    rows: Iterator[Row]
    notes: Sequence[str] = ()
    pieces: int = 1


def export(tx: Tx, part_number: str, view: View, pieces: int = 1) -> Export:
    """The BOM of an item, with the totals for so many ``pieces`` of it."""
    root = get_item(tx, part_number)
    graph = load_graph(tx, root)
    found, gaps = marks(tx, graph), _gap_rows(tx, graph, view)
    parts = parts_of(tx, graph)
    known = worths(graph, parts)
    notes = [f"For {pieces} pieces of {root.part_number} {root.name}"] if pieces > 1 else []
    if found:
        names = graph.names()
        said = [f"{names[one]} {words}" for one, words in list(found.items())[:MOST_TOLD]]
        more = f"; and {len(found) - MOST_TOLD} more" if len(found) > MOST_TOLD else ""
        notes.append(f"Incomplete: {'; '.join(said)}{more}")

    def row(line: Line, item: str, level: int, quantity: Exact | float, total: Exact) -> Row:
        amount = total * pieces
        part, worth = parts[line.child_id], known[line.child_id]
        values = _row(line, part.properties, item, level, plain(quantity), plain(amount))
        return values | _values(worth, amount) | {"Incomplete": found.get(line.child_id)}

    rows: Iterator[Row]
    if view is View.FLAT:
        # Not those of a line: a part may be in the tree on several.
        rows = (
            row(one.line, str(place), 1, one.total * pieces, one.total) | dict.fromkeys(OF_A_LINE)
            for place, one in enumerate(flatten(graph), start=1)
        )
    else:
        depth = 1 if view is View.SINGLE else MAX_DEPTH
        occurrences = expand(graph, depth, tx.settings.max_expanded_rows)
        numbered = zip(occurrences, _item_numbers([one.depth for one in occurrences]), strict=True)
        rows = (row(one.line, item, one.depth, one.line.state.quantity, one.total) for one, item in numbered)
    return Export(root, view, chain(rows, gaps), notes, pieces)


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


def _gap_rows(tx: Tx, graph: Graph, view: View) -> list[Row]:
    """What the last syncs left out: rows without a part number, after all others; missing is a line too."""
    names = graph.names()
    ids = [graph.root.id] if view is View.SINGLE else list(names)
    return [
        {
            "Name": gap.get("name") or gap.get("object"),
            "Quantity": gap.get("quantity"),
            "Incomplete": f"{names[one]}: {sentence}",
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
    writer.writerow(COLUMNS)
    for row in made.rows:
        writer.writerow([_csv_cell(row.get(column), semicolons) for column in COLUMNS])
    text.detach()


def _csv_cell(value: Any, semicolons: bool) -> Any:
    if isinstance(value, float):
        written = f"{as_decimal(value):f}"
        return written.replace(".", ",") if semicolons else written
    return safe_cell(value)


def to_xlsx(made: Export, out: IO[bytes]) -> None:
    """Write a workbook with one sheet; texts are texts, whatever they begin with."""
    from openpyxl import Workbook
    from openpyxl.cell import WriteOnlyCell
    from openpyxl.styles import Font
    from openpyxl.utils import get_column_letter

    book = Workbook(write_only=True)
    title = made.root.part_number
    sheet = book.create_sheet("".join(c for c in title if c not in "[]:*?/\\'")[:31] or "BOM")
    head = len(made.notes) + 1
    sheet.freeze_panes = f"A{head + 1}"
    sheet.print_title_rows = f"{head}:{head}"
    sheet.page_setup.orientation = "landscape"
    sheet.page_setup.fitToHeight = 0
    sheet.sheet_properties.pageSetUpPr.fitToPage = True
    for index, column in enumerate(COLUMNS, start=1):
        width = _WIDTHS.get(column, max(8, len(column) + 2))
        sheet.column_dimensions[get_column_letter(index)].width = width
    bold = Font(bold=True)

    def cell(value: Any, column: str = "", font: Any = None) -> Any:
        if isinstance(value, str):  # XML, and so XLSX, has no place for control characters
            value = "".join(c for c in value if c >= " " or c in "\t\n\r")
        made_ = WriteOnlyCell(sheet, value=value)
        if isinstance(value, str):
            made_.data_type = "s"
        elif column in _FORMATS and value is not None:
            made_.number_format = _FORMATS[column]
        if font is not None:
            made_.font = font
        return made_

    for note in made.notes:
        sheet.append([cell(note, font=Font(bold=True, color="A32020"))])
    sheet.append([cell(column, font=bold) for column in COLUMNS])
    last = head
    for row in made.rows:
        last += 1
        sheet.append([cell(row.get(column), column) for column in COLUMNS])
    sheet.auto_filter.ref = f"A{head}:{get_column_letter(len(COLUMNS))}{last}"
    book.save(out)


def to_json(made: Export) -> dict[str, Any]:
    """The rows under machine names: ``unit_mass_kg``, ``supplier_part_number``."""
    names = {column: _SIGNS.sub("_", column.lower().replace("'s", "")).strip("_") for column in COLUMNS}
    return {
        "part_number": made.root.part_number,
        "name": made.root.name,
        "view": made.view.value,
        "version": made.root.bom_version,
        "pieces": made.pieces,
        "notes": list(made.notes),
        "lines": [{names[column]: row.get(column) for column in COLUMNS} for row in made.rows],
    }


def _row(
    line: Line,
    properties: Mapping[str, Any],
    item: str,
    level: int,
    quantity: float | None,
    total: float | None,
) -> Row:
    state = line.state
    row: Row = {
        "Item": item,
        "Level": level,
        "Part number": line.child_part_number,
        "Name": line.child_name,
        "Description": line.child_description,
        "Item type": line.child_item_type,
        "Relation type": state.rel_type,
        "Quantity": quantity,
        "Unit": state.unit,
        "Total quantity": total,
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


def _item_numbers(depths: Sequence[int]) -> Iterator[str]:
    # 1, 1.1, 1.2, 2 …: the structure in one column, as CAD systems export it.
    counters: list[int] = []
    for depth in depths:
        del counters[depth:]
        if len(counters) < depth:
            counters.append(0)
        counters[-1] += 1
        yield ".".join(map(str, counters))
