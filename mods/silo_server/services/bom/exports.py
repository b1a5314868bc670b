# SPDX-License-Identifier: LGPL-2.1-or-later
"""BOM exports: single level, indented or flat; CSV (RFC 4180), XLSX, JSON.

A cell that a spreadsheet would run as a formula gets an apostrophe before it in CSV, and is marked as text in
XLSX. ``Material`` and ``Mass`` make the CSV readable for mass and inertia tools.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from enum import StrEnum
from itertools import chain
from typing import IO, Any

from silo_server.clock import wire
from silo_server.db.engine import Tx
from silo_server.services.bom.last_sync import in_sentences, last_syncs, marks
from silo_server.services.bom.rollup import positive_number
from silo_server.services.bom.tree import MAX_DEPTH, Graph, expand, flatten, load_graph
from silo_server.services.items import by_ids, get_item
from silo_server.values import Item, Line, number


class View(StrEnum):
    """What an export shows."""

    SINGLE = "single"  # the direct children
    INDENTED = "indented"  # the whole tree, line by line
    FLAT = "flat"  # the leaf parts with their total quantities


COLUMNS = (
    "Item",
    "Level",
    "Part number",
    "Name",
    "Description",
    "Quantity",
    "Unit",
    "Total quantity",
    "Source",
    "Type",
    "Reference designators",
    "Find number",
    "Notes",
    "Revision",
    "Unreferenced since",
    "Material",
    "Mass",
    "Incomplete",
)
# What Excel, LibreOffice and Google Sheets take for the beginning of a formula (OWASP, CSV injection).
FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r", "\n", "＝", "＋", "－", "＠")

Row = dict[str, Any]


def export_rows(tx: Tx, part_number: str, view: View) -> tuple[Item, Iterator[Row]]:
    """The item, and its BOM's rows by column name, made one by one."""
    root = get_item(tx, part_number)
    graph = load_graph(tx, root, 1 if view is View.SINGLE else None)
    found, gaps = marks(tx, graph), _gap_rows(tx, graph, view)
    if view is View.FLAT:
        flat = flatten(graph)
        children = by_ids(tx, {row.line.child_id for row in flat})
        return root, chain(
            (
                _row(row.line, children, str(n), 1, number(row.total), number(row.total), flat=True)
                | {"Incomplete": found.get(row.line.child_id)}
                for n, row in enumerate(flat, start=1)
            ),
            gaps,
        )
    occurrences = expand(graph, 1 if view is View.SINGLE else MAX_DEPTH, tx.settings.max_expanded_rows)
    children = by_ids(tx, {o.line.child_id for o in occurrences})
    numbers = _item_numbers([o.depth for o in occurrences])
    return root, chain(
        (
            _row(o.line, children, item, o.depth, number(o.line.state.quantity), number(o.total))
            | {"Incomplete": found.get(o.line.child_id)}
            for o, item in zip(occurrences, numbers, strict=True)
        ),
        gaps,
    )


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


def to_csv(rows: Iterable[Row], out: IO[bytes]) -> None:
    """Write RFC 4180: commas, CRLF, quotes doubled; UTF-8."""
    text = io.TextIOWrapper(out, "utf-8", newline="")
    writer = csv.writer(text, lineterminator="\r\n")
    writer.writerow(COLUMNS)
    for row in rows:
        writer.writerow([safe_cell(row.get(column)) for column in COLUMNS])
    text.detach()


def to_xlsx(rows: Iterable[Row], title: str, out: IO[bytes]) -> None:
    """Write a workbook with one sheet; texts are texts, whatever they begin with."""
    from openpyxl import Workbook
    from openpyxl.cell import WriteOnlyCell

    book = Workbook(write_only=True)
    sheet = book.create_sheet("".join(c for c in title if c not in "[]:*?/\\'")[:31] or "BOM")
    sheet.freeze_panes = "A2"

    def cell(value: Any) -> Any:
        made = WriteOnlyCell(sheet, value=_printable(value) if isinstance(value, str) else value)
        if isinstance(value, str):
            made.data_type = "s"
        return made

    sheet.append([cell(column) for column in COLUMNS])
    for row in rows:
        sheet.append([cell(row.get(column)) for column in COLUMNS])
    book.save(out)


def to_json(root: Item, view: View, rows: Iterable[Row]) -> dict[str, Any]:
    """The rows under machine names."""
    names = {column: column.lower().replace(" ", "_") for column in COLUMNS}
    return {
        "part_number": root.part_number,
        "name": root.name,
        "view": view.value,
        "version": root.bom_version,
        "lines": [{names[column]: row.get(column) for column in COLUMNS} for row in rows],
    }


def safe_cell(value: Any) -> Any:
    """A cell for CSV: what would be run as a formula is made text; numbers stay numbers."""
    if isinstance(value, str) and value.startswith(FORMULA_STARTS):
        return "'" + value
    return value


def plain_cell(text: str) -> str:
    """What :func:`safe_cell` was given."""
    return text[1:] if text.startswith("'") and text[1:].startswith(FORMULA_STARTS) else text


def _row(
    line: Line,
    children: dict[int, Item],
    item: str,
    level: int,
    quantity: float | None,
    total: float | None,
    *,
    flat: bool = False,
) -> Row:
    state, properties = line.state, children[line.child_id].properties
    mass = positive_number(properties, "mass_kg")
    row: Row = {
        "Item": item,
        "Level": level,
        "Part number": line.child_part_number,
        "Name": line.child_name,
        "Description": line.child_description,
        "Quantity": quantity,
        "Unit": state.unit,
        "Total quantity": total,
        "Material": str(properties["material"]) if properties.get("material") else None,
        "Mass": f"{mass!r} kg" if mass is not None else None,
    }
    if not flat:
        row |= {
            "Source": state.source,
            "Type": state.rel_type,
            "Reference designators": " ".join(state.reference_designators) or None,
            "Find number": state.find_number,
            "Notes": state.notes,
            "Revision": state.child_revision,
            "Unreferenced since": wire(state.unreferenced_since),
        }
    return row


def _item_numbers(depths: Sequence[int]) -> Iterator[str]:
    # 1, 1.1, 1.2, 2 …: the structure in one column, as CAD systems export it.
    counters: list[int] = []
    for depth in depths:
        del counters[depth:]
        if len(counters) < depth:
            counters.append(0)
        counters[-1] += 1
        yield ".".join(map(str, counters))


def _printable(text: str) -> str:
    # XML, and so XLSX, has no place for control characters.
    return "".join(c for c in text if c >= " " or c in "\t\n\r")
