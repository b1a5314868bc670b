# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod import``: a BOM, a list of parts, prices or categories from a table into Silo, and back."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.text import Text

from silo import spoken
from silo.bom.errors import Exit, InputError
from silo.bom.message import message
from silo.bom.system_refusals import why_refused
from silo.cli.connection import client_of, named_item
from silo.cli.json_output import print_json
from silo.cli.options import add_options
from silo.cli.terminal import console, plain, table_of

KINDS = ("bom", "parts", "prices", "categories")
# The parameters of the options, by the kind of table.
_ASKED: Mapping[str, Mapping[str, str]] = {
    "bom": {
        "make": "make",
        "add_up": "add_up",
        "quantities": "quantities",
        "remove": "remove",
        "leave_out": "leave_out",
    },
    "parts": {"make": "category", "duplicates": "duplicates", "leave_out": "leave_out"},
    "prices": {"leave_out": "leave_out"},
    "categories": {},
}


def add_import(parser: argparse.ArgumentParser) -> None:
    """Add the command."""
    parser.add_argument("kind", choices=KINDS, help="what the table is")
    parser.add_argument("file", metavar="FILE", nargs="?", help="CSV, XLSX, ODS or XLS")
    parser.add_argument(
        "--duplicates",
        choices=("first", "new"),
        help="parts: of different rows with one number the first counts, or the others get new numbers",
    )
    parser.add_argument(
        "--undo", type=int, metavar="IMPORT", help="take the import with this number back, as a whole"
    )
    add_options(
        parser,
        {
            "--product NUMBER": message("bom: the part number of the assembly whose BOM this is"),
            "--check": message("show what would become of each row; change nothing"),
            "--make CODE": message(
                "make unknown parts in this category (parts: those whose own category is unknown)"
            ),
            "--add-up": message("bom: add up the rows of one part"),
            "--quantities": message("bom: the quantity counts where the designators name another number"),
            "--remove": message("bom: remove the lines that the file does not have"),
            "--leave-out": message("leave out the rows with problems, by name"),
        },
    )


def run_import(args: argparse.Namespace) -> int:
    """Import the file, or show what would happen. 1 if rows have problems, or if something was left out."""
    if args.undo is not None:
        return _undo(args)
    if args.file is None:
        raise InputError(message("name the file that is to be imported"))
    if (args.product is None) is (args.kind == "bom"):
        raise InputError(
            message("--product names the assembly of a BOM: give it with bom, and with bom alone")
        )
    asked = {"dry_run": "true"} if args.check else {}
    names = _ASKED[args.kind]
    for option in (*_ASKED["bom"], "duplicates"):
        value = getattr(args, option)
        if value and option not in names:
            raise InputError(
                message(
                    "--{option} does nothing with {kind}", option=option.replace("_", "-"), kind=args.kind
                )
            )
        if value:
            asked[names[option]] = value if isinstance(value, str) else "true"
    try:
        data = Path(args.file).read_bytes()
    except OSError as error:
        raise InputError(
            message("{file} cannot be read: {error}", file=repr(args.file), error=why_refused(error))
        ) from error
    with client_of(args) as client:
        if args.kind == "bom":
            answer = client.import_bom(named_item(client, args.product).part_number, data, **asked)
        else:
            answer = getattr(client, f"import_{args.kind}")(data, **asked)
    if args.json:
        print_json(answer)
    else:
        _print(args, answer)
    return Exit.UNDONE if _is_incomplete(answer) else Exit.DONE


def _undo(args: argparse.Namespace) -> int:
    """Take an import back."""
    with client_of(args) as client:
        answer = client.undo_import(args.undo)
    if args.json:
        print_json(answer)
    else:
        words = message("Import {number} is undone: {file}", number=args.undo, file=plain(answer["file"]))
        console().print(Text(spoken(words)))
    return Exit.DONE


def _is_incomplete(answer: Mapping[str, Any]) -> bool:
    rows = answer.get("rows", answer.get("items", ()))
    return bool(answer.get("left_out")) or any(row["status"] in ("error", "skip") for row in rows)


def _print(args: argparse.Namespace, answer: Mapping[str, Any]) -> None:
    out = console()
    rows = answer.get("rows", answer.get("items", ()))
    table = table_of("", "Row", "What", "Part number", "In words")
    shown = [row for row in rows if row["status"] != "same"]
    for row in shown:
        words = [*row["problems"], row.get("why", ""), *_differences(row)]
        place = str(row.get("row") or ", ".join(map(str, row.get("rows", ()))))
        cells = (
            place,
            row["status"],
            row["part_number"] or row.get("name", ""),
            "; ".join(filter(None, words)),
        )
        table.add_row(*(Text(plain(cell)) for cell in cells))
    if shown:
        out.print(table)
    counts = {status: sum(row["status"] == status for row in rows) for status in ("add", "change", "same")}
    left_out = sum(row["status"] == "skip" for row in rows) + len(answer.get("left_out", ()))
    wrong = sum(row["status"] == "error" for row in rows)
    sentence = message(
        "{added} added, {changed} changed, {same} the same, {left_out} left out",
        added=counts["add"],
        changed=counts["change"],
        same=counts["same"],
        left_out=left_out,
    )
    sentence += message(", {wrong} with problems", wrong=wrong) if wrong else ""
    out.print(
        Text(
            spoken(
                message("{sentence}. Nothing was written.", sentence=sentence)
                if args.check
                else sentence + "."
            )
        )
    )
    if answer.get("import"):
        undo = f"silo-mod import {args.kind} --undo {answer['import']}"
        out.print(Text(spoken(message("Take it back with: {command}", command=undo))))
    missing = answer.get("missing", ())
    if missing and not answer.get("removed"):
        names = ", ".join(line["part_number"] for line in missing)
        print(f"silo-mod: {plain(f'lines of Silo that the file does not have: {names}')}", file=sys.stderr)
    if answer.get("unused_columns"):
        names = ", ".join(answer["unused_columns"])
        print(f"silo-mod: {plain(f'columns that are not used: {names}')}", file=sys.stderr)
    for note in answer.get("notes", ()):
        print(f"silo-mod: {plain(note)}", file=sys.stderr)


def _differences(row: Mapping[str, Any]) -> list[str]:
    """Describe the changes of a row: an item's columns, an item's suppliers, or a line's fields."""
    changes = row.get("changes", ())
    if isinstance(changes, Mapping):
        return [f"{name}: {each['before'] or '–'} → {each['after']}" for name, each in changes.items()]
    before, after = row.get("before"), row.get("after")
    if before and after:
        pairs = [(name, before.get(name), after[name]) for name in after]
        return [f"{name}: {old} → {new}" for name, old, new in pairs if old != new]
    if after:
        return [f"{after['quantity']} {after.get('unit') or ''}".strip()]
    return list(changes)
