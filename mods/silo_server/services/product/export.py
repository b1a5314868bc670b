# SPDX-License-Identifier: LGPL-2.1-or-later
"""What an export of a BOM shows: single level, indented or flat, for as many pieces as are wanted.

Lines on top say what a reader must know first: for how many pieces, and that the BOM is incomplete. A mass or
a cost with an unknown part is left empty, so that no incomplete sum looks whole.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import chain
from typing import Any, NamedTuple

from silo.api.wire import LineTexts
from silo.bom.quantities import as_decimal, plain
from silo_server.db.transaction import Tx
from silo_server.services.bom.last_sync import in_sentences, last_syncs
from silo_server.services.items import get_item
from silo_server.services.product.amounts import Exact, product
from silo_server.services.product.cost import PartCost, own_worth, prices_in, shown_worth, with_costs
from silo_server.services.product.flat import flatten
from silo_server.services.product.frozen import changes_of, frozen_product
from silo_server.services.product.graph import MAX_DEPTH, load_graph
from silo_server.services.product.line_filter import found_below, leading_to, sought
from silo_server.services.product.parts import RolledItem, portions, some_parts
from silo_server.services.product.summary import OpenBom, Summary
from silo_server.services.product.summary_read import prices_besides, product_cost, summaries, summary_of
from silo_server.services.product.tree import Occurrence, expand
from silo_server.services.product.worth import MassAndCost, in_unit_of
from silo_server.services.releases import get_release
from silo_server.services.suppliers import rates_of
from silo_server.times import wire_time
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

MOST_TOLD = 20

# A column of workbooks alone.
PICTURE = "Picture"

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
    root, summed = graph.root, dict[int, Summary]()
    open_boms: Mapping[int, OpenBom]
    prices: Mapping[int, PartCost]
    worths: Mapping[int, MassAndCost] = {}
    if frozen:
        open_boms, prices = frozen.open, prices_in(graph, frozen.parts, rates_of(tx), pieces)
        worths = with_costs(graph, frozen.parts, frozen.worths, prices)
    else:
        whole = summary_of(tx, root)
        open_boms, prices = whole.open, product_cost(tx, whole, pieces).prices
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
            found, known = worths, prices
            if not frozen:
                found = {
                    part_id: summed[part_id].as_part if part_id in summed else own_worth(part_id, part)
                    for part_id, part in parts.items()
                }
                known = prices_besides(tx, found.values(), prices)
            for cells in portion:
                child = cells.line.child_id
                amount = None if cells.total is None else product(cells.total, pieces)
                part, bom = parts[child], open_boms.get(child)
                worth = found[child]
                if view is not View.FLAT:
                    worth = in_unit_of(cells.line, shown_worth(worth, known))
                else:
                    worth = shown_worth(worth, known, cells.doubts)
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
            _BareColumns(
                row.line, str(place), 1, product(row.total, pieces), row.total, row.doubts(pieces), row.unit
            )
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
                occurrence.line.unit,
            )
            for occurrence, item in _numbered(expand(graph, depth, tx.settings.max_expanded_rows))
            if hit(occurrence.line)
        )
    return Export(root, view, chain(dressed(bare), gaps), notes, pieces)


class _BareColumns(NamedTuple):
    """A row before it has what it shows of its part: the line, its place, and what is open about it.

    total
        of one root, in ``unit``; None below a line whose unit is open.
    """

    line: Line
    item: str
    level: int
    quantity: Exact | float
    total: Exact | None
    doubts: Sequence[str]
    unit: str | None


_CHANGES = {"what": "What", "within": "In", "part_number": "Part number", "name": "Name"}

_CHANGES |= {"before": "Before", "after": "After", "at": "At", "username": "By"}


def export_changes(tx: Tx, part_number: str, since: str, until: str) -> Export:
    """Export what changed in a product between two moments, as a table."""
    root = get_item(tx, part_number)
    first, last, happenings = changes_of(tx, root, since, until)
    rows = ({title: getattr(change, name) for name, title in _CHANGES.items()} for change in happenings)
    notes = [f"{root.part_number} {root.name}: what changed from {wire_time(first)} to {wire_time(last)}"]
    return Export(root, View.INDENTED, rows, notes, columns=tuple(_CHANGES.values()))


def _values(worth: MassAndCost, amount: Exact | None) -> Row:
    """Return mass and cost, of one and of all, if nothing of them is unknown and there is one currency."""
    row: Row = {}
    if amount is None:
        return row
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


def _row(bare: _BareColumns, part: RolledItem, amount: Exact | None, *, of_a_line: bool) -> Row:
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
        "Unit": bare.unit,
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
