# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod order``: what to order for so many pieces of a product."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rich.text import Text

from silo import spoken
from silo.bom.errors import Exit, counted
from silo.bom.message import Message, counted_message, message
from silo.cli.connection import client_of, named_item
from silo.cli.json_output import print_json
from silo.cli.options import above_zero, add_each, add_old_name, add_options, only_with
from silo.cli.outputs import add_outputs
from silo.cli.terminal import console, plain, table_of
from silo.output_files import csv_table, workbook

if TYPE_CHECKING:
    from rich.table import Table

    from silo.api.wire import OrderList, OrderPart, SupplierPart


def add_order(parser: argparse.ArgumentParser) -> None:
    add_each(parser, "part_number", "--release", "--csv", "--xlsx", metavar="PRODUCT", help="its part number")
    parser.add_argument("--quantity", metavar="N", type=above_zero, default=1, help="for so many pieces (1)")
    add_options(
        parser,
        {
            "--release LABEL": message("of a released revision, such as B (else of the draft)"),
            "--spares PERCENT": message("so many percent more of each part"),
            "--rest": message("without what was ordered already"),
            "--supplier NAME": message("only what this supplier sells"),
        },
    )
    headings = (message("Part number"), "Name", "Needed", "Unit", "Remarks")
    add_outputs(
        parser, {"--csv FILE": message("write a table as CSV (- for standard output)")}, csv_table(*headings)
    )
    add_outputs(parser, {"--xlsx FILE": message("write a table as a workbook")}, workbook(*headings))
    parser.set_defaults(to_standard_output=("--csv",))
    add_old_name(parser, "--revision", "--release")
    kinds = ("bought", "made", "unsaid")
    parser.add_argument("--kind", choices=kinds, default="bought", help="only these parts (bought)")
    layouts = ("silo", "odoo", "inventree")
    words = "the columns that this program imports, with what is bought (silo)"
    parser.add_argument("--layout", choices=layouts, default="silo", help=words)
    only_with(parser, "--csv --xlsx", "--kind", "--supplier", "--layout")


def run_order(args: argparse.Namespace) -> int:
    """Print what to order, or write it as a table."""
    from silo.platform.whole_files import replacing

    asked = {"pieces": args.quantity, "spares": args.spares, "release": args.release, "rest": args.rest}
    given = {name: str(value) for name, value in asked.items() if value}
    table = {"kind": args.kind} | ({"supplier": args.supplier} if args.supplier else {})
    table |= {"layout": args.layout} if args.layout != "silo" else {}
    with client_of(args) as client:
        number = named_item(client, args.part_number).part_number
        for end, path in (("csv", args.csv), ("xlsx", args.xlsx)):
            data = client.get_order_table(number, end, **given, **table) if path else b""
            if end == "csv" and path == "-":
                sys.stdout.write(data.decode("utf-8-sig").replace("\r\n", "\n"))
            elif path:
                with replacing(Path(path)) as file:
                    file.write(data)
        if args.json:
            print_json(client.get_order(number, **given).model_dump(mode="json"))
        elif args.csv != "-":
            _print_order(client.get_order(number, **given))
    return Exit.DONE


def _print_order(order: OrderList) -> None:
    out = console()
    head = message(
        "{part_number}: what to order for {pieces} with {spares} % spares. {state}",
        part_number=order.part_number,
        pieces=order.pieces,
        spares=order.spares,
        state=order.state,
    )
    out.print(Text(plain(spoken(head)), "bold"))
    for warning in order.warnings:
        out.print(Text(f"⚠ {plain(spoken(warning))}", "yellow"))
    rows = [
        _Row(*(plain(cell) for cell in _cells(part)))
        for part in sorted(order.parts, key=lambda part: (part.kind, _source(part).supplier))
    ]
    table = _wide_table(rows, out.is_terminal) if out.width >= _WIDE else _narrow_table(rows)
    if order.parts:
        out.print(table)
        days = message("not known") if order.lead_time_days is None else counted(order.lead_time_days, "day")
        for line in _sums(order):
            out.print(Text(plain(spoken(line))))
        out.print(Text(plain(spoken(message("Longest lead time: {days}", days=days)))))


class _Row(NamedTuple):
    """A part as it is shown, in the order of the columns."""

    kind: str
    number: str
    name: str
    needed: str
    ordered: str
    quantity: str
    supplier: str
    its_number: str
    cost: str
    remarks: str


_TITLES = _Row(
    "",
    message("Part number"),
    "Name",
    "Needed",
    "Ordered",
    "Quantity",
    "Supplier",
    message("Its number"),
    "Cost",
    "",
)

# [columns] What all columns take with names of a usual length.
_WIDE = 120


def _source(part: OrderPart) -> SupplierPart:
    """Return what is bought of a part; an empty one if that is not known."""
    from silo.api.wire import SupplierPart

    return part.supplier_part or SupplierPart(supplier="", currency="")


def _cells(part: OrderPart) -> Iterator[str]:
    quantity = part.quantity or ""
    if part.price:
        quantity = spoken(
            message(
                "{needed} at {price} {currency}",
                needed=part.quantity or part.needed,
                price=part.price,
                currency=part.currency,
            )
        )
    yield from (spoken(part.kind), part.part_number, part.name, f"{part.needed} {part.unit or ''}".strip())
    yield from (str(part.ordered), str(quantity), _source(part).supplier, _source(part).number)
    yield f"{part.cost} {part.currency or ''}".strip() if part.cost else spoken(message("not priced"))
    source = part.cost_from if part.cost else ""
    names = (file.name for file in part.files)
    yield "; ".join(filter(None, (*map(spoken, (source, *part.remarks)), *names)))


def _wide_table(rows: Sequence[_Row], for_eyes: bool) -> Table:
    """Show a part in a line. For eyes a column in which no part has anything is left out; a pipe has all."""
    kept = [
        place
        for place in range(len(_TITLES))
        if not for_eyes or any(row[place] not in ("", "0") for row in rows)
    ]
    table = table_of(*(_TITLES[place] for place in kept))
    for row in rows:
        table.add_row(*(Text(row[place]) for place in kept))
    return table


def _narrow_table(rows: Sequence[_Row]) -> Table:
    """Show a part with its supplier and its remarks below its name, so that no word breaks."""
    table = table_of("", _TITLES.number, _TITLES.needed, _TITLES.cost, _TITLES.name)
    for row in rows:
        about = Text(row.name)
        ordered = (
            "" if row.ordered == "0" else spoken(message("{ordered} ordered already", ordered=row.ordered))
        )
        bought = " ".join(filter(None, (row.quantity, row.supplier, row.its_number)))
        for more in filter(None, (bought, ordered, row.remarks)):
            about.append(f"\n{more}", "dim")
        table.add_row(row.kind, Text(row.number), Text(row.needed), Text(row.cost), about)
    return table


def _sums(order: OrderList) -> list[Message]:
    """Say what the parts cost, for how many that is not known, and what is paid for whole packs."""
    if not order.costs:
        return [message("Cost: not priced")]
    cost = message("Cost: {cost}", cost=_money(order.costs))
    if order.unpriced:
        cost = counted_message(
            order.unpriced,
            "Cost: {cost}, not known for {n} part",
            "Cost: {cost}, not known for {n} parts",
            cost=_money(order.costs),
        )
    if not order.order_costs or order.order_costs == order.costs:
        return [cost]
    return [cost, message("To be paid, in whole packs: {cost}", cost=_money(order.order_costs))]


def _money(costs: Mapping[str, str]) -> str:
    return " + ".join(f"{cost} {currency}" for currency, cost in costs.items())
