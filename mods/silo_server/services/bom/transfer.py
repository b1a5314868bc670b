# SPDX-License-Identifier: LGPL-2.1-or-later
"""BOM exports: single level, indented or flat; CSV (RFC 4180), XLSX, JSON; for as many pieces as are
wanted.

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
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from enum import StrEnum
from itertools import chain
from pathlib import Path
from typing import IO, Any, NamedTuple

from silo.api.wire import LineTexts
from silo.bom.headers import (
    safe_cell,
)
from silo.bom.quantities import as_decimal, plain
from silo.bom.text import with_allowed_characters
from silo.platform import scratch_folder
from silo_server.db.transaction import Tx
from silo_server.services.bom.frozen import changes_of, frozen_product
from silo_server.services.bom.last_sync import in_sentences, last_syncs
from silo_server.services.bom.summary import MassAndCost, OpenBom, Summary, own_worth, summaries, summary_of
from silo_server.services.items import (
    get_item,
)
from silo_server.services.product.amounts import Exact
from silo_server.services.product.flat import flatten
from silo_server.services.product.graph import MAX_DEPTH, load_graph
from silo_server.services.product.line_filter import found_below, leading_to, sought
from silo_server.services.product.parts import RolledItem, portions, some_parts
from silo_server.services.product.tree import Occurrence, expand
from silo_server.services.releases import get_release
from silo_server.services.thumbnails import png_size
from silo_server.times import wire_time
from silo_server.user_json import dumps
from silo_server.values import Item, Line


class View(StrEnum):
    """What an export shows."""

    SINGLE = "single"  # the direct children
    INDENTED = "indented"  # the whole tree, line by line
    FLAT = "flat"  # the leaf parts with their total quantities


# A unit belongs to the quantities.
_LINE_TEXTS = {name: field.title or name for name, field in LineTexts.model_fields.items() if name != "unit"}
COLUMNS = (
    *("Item", "Level", "Part number", "Name", "Description", "Item type", "Relation type", "Quantity"),
    *("Unit", "Total quantity", "Unit mass [kg]", "Overall mass [kg]", "Unit cost", "Overall cost"),
    *("Currency", "Bought", "Supplier", "Supplier's part number", "Lead time [days]", "Manufacturer"),
    *("Manufacturer's part number", "Material", "Source", "Reference designators", *_LINE_TEXTS.values()),
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
# A column of workbooks alone. So many rows have one, each in so many pixels.
PICTURE, MOST_PICTURED, PICTURED = "Picture", 2000, 48
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
    """Export the BOM of an item, with the totals for so many ``pieces`` of it.

    words, item_type
        the filter: only parts that match and, except in the flat view, what leads to them.
    release
        the label of a revision: the product as it was frozen.
    """
    root = get_item(tx, part_number, include_archived=bool(release))
    of = get_release(tx, root, release) if release else None
    frozen = frozen_product(tx, root, of) if of else None
    filtered = bool(words or item_type)
    levels = 1 if view is View.SINGLE and not filtered else None  # a filter shows what leads to its parts
    graph = frozen.graph if frozen else load_graph(tx, root, levels, bare=True)
    root, open_boms = graph.root, frozen.open if frozen else summary_of(tx, root).open
    summed: Mapping[int, Summary] = {}
    if not frozen:
        below = [line.child_id for line in graph.lines.get(root.id, ())] if levels else graph.lines
        summed = summaries(tx, {*below} - {root.id})
    # What a sync left out has no number, supplier or type: a filter finds none of it.
    gaps = [] if filtered or of else _gap_rows(tx, root, open_boms, view)
    fitting: Callable[[Line], bool] = lambda _line: True  # noqa: E731 - as what a filter gives
    if filtered and frozen:
        fitting = sought(words, item_type, frozen.parts)
    elif filtered:
        fitting = found_below(tx, graph, words, item_type)
    notes = [f"Revision {of.label}, {of.status}, frozen at {wire_time(of.frozen_at)}"] if of else []
    notes += [f"For {pieces} pieces of {root.part_number} {root.name}"] if pieces > 1 else []
    if filtered:
        asked = f"“{words}”" if words else ""
        notes.append(f"Only what fits {asked}{' of the type ' + item_type if item_type else ''}")
    for head, field in (("Incomplete", "incomplete"), ("Open", "questions")):
        open_ones = [(bom.part_number, getattr(bom, field)) for bom in open_boms.values()]
        sentences = sorted(f"{number} {open_words}" for number, open_words in open_ones if open_words)
        if sentences:
            more = f"; and {len(sentences) - MOST_TOLD} more" if len(sentences) > MOST_TOLD else ""
            notes.append(f"{head}: {'; '.join(sentences[:MOST_TOLD])}{more}")

    def dressed(bare: Iterable[_BareColumns]) -> Iterator[Row]:
        for portion in portions(bare):
            parts = frozen.parts if frozen else some_parts(tx, {cells.line.child_id for cells in portion})
            for cells in portion:
                child, amount = cells.line.child_id, cells.total * pieces
                part, summary, bom = parts[child], summed.get(child), open_boms.get(child)
                worth = summary.as_part if summary else own_worth(part.properties)
                worth = frozen.worths[child] if frozen else worth
                fields = {"Incomplete": bom.incomplete or None if bom else None}
                fields["Open"] = ", ".join(cells.doubts) or None
                fields[PICTURE] = part.thumbnail_key
                yield (
                    _row(cells, part, amount, of_a_line=view is not View.FLAT)
                    | _values(worth, amount)
                    | fields
                )

    bare: Iterator[_BareColumns]
    if view is View.FLAT:
        flat = enumerate((row for row in flatten(graph) if fitting(row.line)), start=1)
        bare = (
            _BareColumns(row.line, str(place), 1, row.total * pieces, row.total, row.doubts(pieces))
            for place, row in flat
        )
    else:
        depth = 1 if view is View.SINGLE else MAX_DEPTH
        hit = leading_to(graph, fitting) if filtered else fitting
        bare = (
            _BareColumns(
                occurrence.line,
                item,
                occurrence.depth,
                occurrence.line.state.quantity,
                occurrence.total,
                graph.doubts(occurrence.line),
            )
            for occurrence, item in _numbered(expand(graph, depth, tx.settings.max_expanded_rows))
            if hit(occurrence.line)
        )
    return Export(root, view, chain(dressed(bare), gaps), notes, pieces)


class _BareColumns(NamedTuple):
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
    """Export what changed in a product between two moments, as a table."""
    root = get_item(tx, part_number)
    first, last, happenings = changes_of(tx, root, since, until)
    rows = ({title: getattr(change, name) for name, title in _CHANGES.items()} for change in happenings)
    notes = [f"{root.part_number} {root.name}: what changed from {wire_time(first)} to {wire_time(last)}"]
    return Export(root, View.INDENTED, rows, notes, columns=tuple(_CHANGES.values()))


def _values(worth: MassAndCost, amount: Exact) -> Row:
    """Return mass and cost, of one and of all, if nothing of them is unknown and there is one currency."""
    row: Row = {}
    count = as_decimal(amount)
    if worth.mass is not None and worth.mass_whole:
        row |= {"Unit mass [kg]": plain(worth.mass), "Overall mass [kg]": plain(worth.mass * count)}
    if worth.cost_whole and len(worth.costs) == 1:
        ((currency, cost),) = worth.costs.items()
        row |= {"Unit cost": plain(cost), "Overall cost": plain(cost * count), "Currency": currency}
    return row


def _gap_rows(tx: Tx, root: Item, open_ones: Mapping[int, OpenBom], view: View) -> list[Row]:
    """Return a row for each gap of the last syncs; it has no part number, and is written after all others."""
    shown = {root.id} if view is View.SINGLE else open_ones.keys()
    ids = [item_id for item_id, bom in open_ones.items() if bom.incomplete and item_id in shown]
    return [
        {
            "Name": gap.get("name") or gap.get("object"),
            "Quantity": gap.get("quantity"),
            "Incomplete": f"{open_ones[item_id].part_number}: {sentence}",
        }
        for item_id, last in last_syncs(tx, ids).items()
        for gap, sentence in zip(last.gaps, in_sentences(last.gaps), strict=True)
    ]


def to_csv(made: Export, out: IO[bytes], *, semicolons: bool = False) -> None:
    """Write CSV (RFC 4180): CRLF, quotes doubled; UTF-8 with the mark by which Excel recognises it.

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


def to_xlsx(made: Export, out: IO[bytes], picture: Callable[[str], Path] | None = None) -> Callable[[], None]:
    """Write a workbook with one sheet; texts are texts, whatever they begin with.

    Returns a function that packs it once all rows are read: that takes seconds, in which no transaction
    should wait.

    picture
        finds the file of a picture; if given, the first rows show their part.
    """
    from xlsxwriter import Workbook

    columns = [*made.columns[:2], PICTURE, *made.columns[2:]] if picture else made.columns

    with ExitStack() as kept:
        # Each row goes to the disk when the next one begins.
        folder = kept.enter_context(scratch_folder("silo-export-"))
        book = Workbook(out, {"constant_memory": True, "tmpdir": folder})
        title = "".join(c for c in made.root.part_number if c not in "[]:*?/\\'")[:31]
        sheet = book.add_worksheet(title or "BOM")
        kept.callback(sheet.row_data_fh.close)
        head = len(made.notes)
        sheet.freeze_panes(head + 1, 0)
        sheet.repeat_rows(head)
        sheet.set_landscape()
        sheet.fit_to_pages(1, 0)
        for index, column in enumerate(columns):
            sheet.set_column(index, index, _WIDTHS.get(column, max(8, len(column) + 2)))
        bold, warning = (
            book.add_format({"bold": True}),
            book.add_format({"bold": True, "font_color": "#A32020"}),
        )
        formats = {column: book.add_format({"num_format": form}) for column, form in _FORMATS.items()}

        def write(row: int, index: int, text: str, form: Any = None) -> None:
            # Excel takes no longer text. Older databases have characters that are refused now.
            text = text if text.isprintable() else with_allowed_characters(text)
            sheet.write_string(row, index, text[:32767], form)

        for place, note in enumerate(made.notes):
            write(place, 0, note, warning)
        for index, column in enumerate(columns):
            write(head, index, column, bold)
        last, places = head, [(n, column, formats.get(column)) for n, column in enumerate(columns)]

        def show(row: int, path: Path) -> None:
            with suppress(OSError):
                if size := png_size(path.read_bytes()):
                    scale = (PICTURED - 4) / max(size)
                    sheet.set_row_pixels(row, PICTURED)
                    place = {"x_scale": scale, "y_scale": scale, "x_offset": 2, "y_offset": 2}
                    sheet.insert_image(row, 2, str(path), place | {"object_position": 1})

        for last, row in enumerate(made.rows, start=head + 1):
            if picture and (key := row.pop(PICTURE, None)) and last - head <= MOST_PICTURED:
                show(last, picture(key))
            for index, column, form in places:
                if isinstance(value := row.get(column), str):
                    write(last, index, value)
                elif value is not None:
                    sheet.write_number(last, index, value, form)
        sheet.autofilter(head, 0, last, len(columns) - 1)
        packing = kept.pop_all()

    def pack() -> None:
        with packing:
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


def _row(bare: _BareColumns, part: RolledItem, amount: Exact, *, of_a_line: bool) -> Row:
    """Return the cells of a row. Not ``of_a_line``: without cells of a line, as a part may have several."""
    line, state, properties = bare.line, bare.line.state, part.properties
    row: Row = {
        "Item": bare.item,
        "Level": bare.level,
        "Part number": part.part_number,
        "Name": part.name,
        "Description": part.description,
        "Item type": line.child_item_type,
        "Quantity": plain(bare.quantity),
        "Unit": state.unit,
        "Total quantity": plain(amount),
        "Bought": "yes" if part.is_bought else None,
    }
    if of_a_line:
        row |= {
            "Relation type": state.rel_type,
            "Source": state.source,
            "Reference designators": " ".join(state.reference_designators) or None,
            **{title: getattr(state, name) for name, title in _LINE_TEXTS.items()},
            "Revision": state.child_revision,
            "Unreferenced since": wire_time(state.unreferenced_since),
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
