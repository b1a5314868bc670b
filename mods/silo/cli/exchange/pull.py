# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod pull``: the file of an item with all that it links to, from Silo into a folder."""

from __future__ import annotations

import argparse
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

from silo import spoken
from silo.bom.errors import Exit, counted
from silo.bom.message import message
from silo.cli.connection import client_of, named_item
from silo.cli.json_output import print_json
from silo.cli.options import above_zero, add_each, add_options
from silo.cli.progress import set_step
from silo.outbox.store import KEPT_ASIDE_DAYS

if TYPE_CHECKING:
    from silo.vault.pull import Pulled


def _revision(text: str) -> int | str:
    from silo.api.wire import RELEASE_LABEL

    if re.fullmatch(RELEASE_LABEL, text, re.ASCII):
        return text
    if not text.isdigit():
        raise argparse.ArgumentTypeError(
            message("{text} is neither a number above 0 nor a label such as B", text=repr(text[:50]))
        )
    return above_zero(text)


def add_pull(parser: argparse.ArgumentParser) -> None:
    add_each(parser, "part_number", "--revision", metavar="PART_NUMBER", help="the item")
    parser.add_argument(
        "--revision",
        metavar="REVISION",
        type=_revision,
        help="the number of a revision of the file, with the linked files as they were then; or the label of "
        "a released revision, such as B, with all files as they were frozen; else the newest of all",
    )
    add_options(
        parser,
        {
            "--attachments": message(
                "also the drawings, STEP files and other attachments, beside the models"
            ),
            "--replace": message("replace files with edits that are not in Silo; a copy of each is kept"),
        },
    )


def run_pull(args: argparse.Namespace) -> int:
    """Fetch an item's files into a folder. Returns 1 if a file was left alone, or is not in Silo."""
    from silo.freecads.open_documents import open_in_any
    from silo.outbox.store import Store
    from silo.vault.pull import place, pulled_json, rules_of
    from silo.vault.tree import fetched

    store, into = Store(), Path(args.into)
    opened = open_in_any()
    with client_of(args) as client:
        rules = rules_of(
            store,
            client,
            overwrite=args.replace,
            is_open=lambda path: not args.even_if_open and opened.has_file(path),
        )
        number = named_item(client, args.part_number).part_number
        progress = lambda name, count: set_step(  # noqa: E731
            message("fetching {name}, {count} so far", name=name, count=counted(count, "file"))
        )
        wanted = {"progress": progress, "attachments": args.attachments}
        with fetched(client, number, args.revision, **wanted) as tree:
            into.mkdir(parents=True, exist_ok=True)
            pulled = place(tree, into, rules)
    if args.json:
        print_json(pulled_json(pulled, Path(os.path.realpath(into))))
    else:
        _show_pulled(pulled, into)
    return Exit.DONE if pulled.complete else Exit.UNDONE


_MARKS = {
    "new": ("+", "green", ""),
    "same": ("=", "dim", message("up to date")),
    "updated": ("~", "yellow", "updated"),
    "edited": ("✗", "red", message("has edits that are not in Silo; left alone (--replace replaces it)")),
    "overwritten": (
        "~",
        "yellow",
        message("replaced; your file is kept for {kept_aside_days} days at", kept_aside_days=KEPT_ASIDE_DAYS),
    ),
    "waiting": (
        "✗",
        "red",
        message("waits in the queue; left alone (silo-mod queue, or --replace replaces it)"),
    ),
    "server set back": (
        "✗",
        "red",
        message(
            "is newer than the server, which was restored; left alone (silo-mod commit --on-top sends it)"
        ),
    ),
    "open": ("✗", "red", message("is open in FreeCAD; left alone (close it, or --even-if-open)")),
}


def _show_pulled(pulled: Pulled, into: Path) -> None:
    from rich.text import Text

    from silo.cli.terminal import console, plain

    out = console()
    for file in pulled.files:
        mark, style, words = _MARKS[file.state.value]
        text = Text(f"{mark} ", style).append(plain(os.path.relpath(file.path, os.path.realpath(into))))
        text.append(
            spoken(
                message(
                    "  {part_number}, revision {revision}",
                    part_number=file.part_number,
                    revision=file.revision,
                )
            ),
            "dim",
        )
        if words:
            text.append(f"  {spoken(words)}{f' {file.kept}' if file.kept else ''}", style)
        out.print(text)
    for lost in pulled.lost:
        line = message(
            "{position}: {path} was not fetched: {reason}",
            position=lost.position,
            path=lost.path,
            reason=lost.reason,
        )
        out.print(Text("✗ ", "bold red").append(plain(spoken(line)), ""))
    for remark in pulled.remarks:
        out.print(Text("! ", "yellow").append(plain(spoken(remark)), ""))
    out.print(Text(plain(spoken(message("Open {top}", top=pulled.top))), "bold"))
