# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod order``: what to order for so many pieces of a product."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

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
    from silo.api.wire import OrderList


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
    from silo.api.wire import SupplierPart

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
    titles = (
        message("Part number"),
        "Name",
        "Needed",
        "Ordered",
        "Quantity",
        "Supplier",
        message("Its number"),
        "Cost",
    )
    table = table_of("", *titles, "")
    empty = SupplierPart(supplier="", currency="")
    for part in sorted(order.parts, key=lambda part: (part.kind, (part.supplier_part or empty).supplier)):
        of = part.supplier_part or empty
        price = (
            message(
                "{needed} at {price} {currency}",
                needed=part.quantity or part.needed,
                price=part.price,
                currency=part.currency,
            )
            if part.price
            else ""
        )
        price = price or part.quantity or ""
        cells = (
            *(spoken(part.kind), part.part_number, part.name, f"{part.needed} {part.unit or ''}"),
            *(part.ordered, spoken(price), of.supplier, of.number),
            f"{part.cost or ''} {part.currency or ''}".strip(),
            "; ".join(
                filter(None, (*map(spoken, (part.cost_from, *part.remarks)), *(f.name for f in part.files)))
            ),
        )
        table.add_row(*(Text(plain(cell)) for cell in cells))
    if order.parts:
        out.print(table)
        days = message("not known") if order.lead_time_days is None else counted(order.lead_time_days, "day")
        for line in _sums(order):
            out.print(Text(plain(spoken(line))))
        out.print(Text(plain(spoken(message("Longest lead time: {days}", days=days)))))


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
