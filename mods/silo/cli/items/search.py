# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod search`` and ``silo-mod show``: items of the server, and the BOM lines of an item."""

from __future__ import annotations

import argparse
from typing import Any

from rich.table import Table
from rich.text import Text

from silo import caption, spoken
from silo.bom.errors import Exit
from silo.bom.items.part_address import part_page
from silo.bom.message import message
from silo.bom.quantities import plain as plain_quantity
from silo.cli.connection import client_of, named_item
from silo.cli.json_output import print_json, print_json_list
from silo.cli.options import add_each
from silo.cli.terminal import console, plain


def add_search(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("words", metavar="WORD", nargs="+")


def add_show(parser: argparse.ArgumentParser) -> None:
    add_each(parser, "part_number", metavar="PART_NUMBER", help="the item")


def run_search(args: argparse.Namespace) -> int:
    """Print the items; 1 if there is none."""
    with client_of(args) as client:
        items = client.search_items(" ".join(args.words), limit=args.limit)
    rows = [{name: getattr(item, name) for name in ("part_number", "name", "item_type")} for item in items]
    if args.json:
        print_json_list(rows)
    else:
        _print(rows or [{"part_number": caption("No item has these words.")}])
    return Exit.DONE if rows else Exit.UNDONE


def run_show(args: argparse.Namespace) -> int:
    """Print the item and its lines."""
    with client_of(args) as client:
        item = named_item(client, args.part_number)
        lines = client.get_bom(item.part_number)
        page = client.web_url(part_page(item.part_number))
    head = {name: getattr(item, name) for name in ("part_number", "name", "item_type", "current_revision")}
    rows: list[dict[str, Any]] = [
        {
            "part_number": line.child_part_number,
            "name": line.child_name or line.child_description,
            "quantity": plain_quantity(line.quantity),
            "source": line.source,
        }
        for line in lines
    ]
    if args.json:
        print_json({**head, "page": page, "bom": rows})
        return Exit.DONE
    _print(
        [
            {
                **head,
                "current_revision": spoken(
                    message("revision {current_revision}", current_revision=item.current_revision)
                ),
            }
        ]
    )
    _print(rows)
    print(page)
    return Exit.DONE


def _print(rows: list[dict[str, Any]]) -> None:
    table = Table(box=None, pad_edge=False, show_header=False)
    for row in rows:
        table.add_row(*(Text(plain("" if value is None else str(value))) for value in row.values()))
    if rows:
        console().print(table)
