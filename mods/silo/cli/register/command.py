# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod register``: items for components without a number, and the identity into their files.

Asked one by one, as a table to edit (``--plan``, ``--apply``), or all at once (``--yes``). ``--adopt`` takes
over what another server knows.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Set
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from silo.bom.entry import Extraction, walk_entries
from silo.bom.errors import Exit, InputError
from silo.bom.message import message
from silo.bom.view.folders import base_folder
from silo.bom.walk.document import relative
from silo.cli.connection import client_of
from silo.cli.options import add_options, add_top, not_with, only_with
from silo.cli.outputs import declare_output
from silo.cli.reading import plan_of, read_tops
from silo.cli.register.declaring import decide_hidden, declare, undeclare
from silo.cli.register.orphans import orphans
from silo.cli.register.run import RegisterProgress, RegisterRun, warn_of_rules
from silo.output_files import NEW
from silo.registering.closed_files import seen_on_disk, whole_folder
from silo.registering.journal import Journal
from silo.registering.offer import Offer, offer
from silo.registering.table import TableRow, read_table

if TYPE_CHECKING:
    from silo.api.client import SiloClient


def add_register(parser: argparse.ArgumentParser) -> None:
    """Add the command."""
    add_top(
        parser,
        "--plan",
        "--apply",
        "--declare",
        "--undeclare",
        "--not-a-part",
        "--count-hidden",
        "--reference",
    )
    how = parser.add_mutually_exclusive_group()
    add_options(
        how,
        {
            "--yes": message("take every proposal without asking"),
            "--adopt": (
                message(
                    "take over what was registered on another server: an item for each identity that "
                    "this server does not know, with the same UUID"
                )
            ),
        },
    )
    how.add_argument(
        "--orphans",
        choices=("list", "archive"),
        help="the items of interrupted registrations, which no file names: list or archive them",
    )
    add_options(
        how,
        {
            "--plan FILE": message(
                "write the proposals as a table (CSV) to edit; no more (- for standard output)"
            ),
            "--apply FILE": message("register what an edited table says"),
        },
    )
    declare_output(parser, "--plan", NEW)
    parser.set_defaults(to_standard_output=("--plan",))
    parser.add_argument(
        "--duplicates",
        choices=("leave", "join", "new"),
        default="leave",
        help="with --yes, what Silo seems to have already: leave it out and say so (default), join the one "
        "item that it seems to be, or make a new item",
    )
    parser.add_argument(
        "--unclear",
        choices=("ask", "take", "new"),
        default="ask",
        help="an item may be that of a part: made by an interrupted run, or registered from this document "
        "before (which may be a copy now): ask (default), take it where only one fits, or make a new one",
    )
    add_options(
        parser,
        {
            "--declare OBJECT...": (
                message(
                    "count what is modelled in the assembly's own file (name or label); equal copies "
                    "are one item"
                )
            ),
            "--apart": message("with --declare: an item for each copy"),
            "--undeclare OBJECT...": (
                message(
                    "take back a decision about an object in the assembly's own file: its identity, "
                    "whose item stays, or that it is no part"
                )
            ),
            "--not-a-part OBJECT...": (
                message(
                    "say of what is modelled in the assembly's own file that it is no part; the file "
                    "keeps that"
                )
            ),
            "--count-hidden OBJECT...": message("count a hidden object (name or label); the file keeps that"),
            "--reference OBJECT...": message(
                "say of a hidden object that it counts nowhere; the file keeps that"
            ),
        },
    )
    parser.add_argument("--category", help="this category for every part (assemblies keep theirs)")
    only_with(parser, "--yes", "--duplicates")
    only_with(parser, "--declare", "--apart")
    not_with(parser, "--undeclare", "--declare", "--category", "--not-a-part")
    not_with(parser, "--not-a-part", "--declare", "--category")
    not_with(parser, "--apply", "--category")
    for option in ("--count-hidden", "--reference"):
        not_with(parser, option, "--declare", "--undeclare", "--not-a-part", "--category")


def run_register(args: argparse.Namespace) -> int:
    """Register what is unregistered; returns 1 if something was skipped or failed."""
    taken = args.undeclare or args.not_a_part
    if args.orphans:
        return orphans(args)
    decided = args.count_hidden or args.reference
    if not (args.yes or args.adopt or args.plan or args.apply or taken or decided or sys.stdin.isatty()):
        raise InputError(
            message(
                "register asks before it creates items, and there is nobody to ask here; say "
                "--yes, or write a table with --plan FILE, edit it, and use it with --apply FILE"
            )
        )
    if args.plan and args.json:
        raise InputError(message("--plan writes a table and no JSON; leave out --json"))
    if (args.declare or taken or decided) and (args.plan or args.apply or os.path.isdir(args.top)):
        raise InputError(
            message(
                "--declare, --undeclare, --not-a-part, --count-hidden and --reference are for one file, "
                "and not for a table"
            )
        )
    if decided:
        return decide_hidden(args)
    if taken:
        return undeclare(args)
    if args.declare:
        return declare(args)
    rows: tuple[TableRow, ...] = ()
    if args.apply:
        table = read_table(Path(args.apply).read_bytes(), args.apply)
        rows = table.rows
        if table.unused:
            from silo.cli.terminal import plain

            words = message(
                "{apply}: these columns are not used: {unused}",
                apply=args.apply,
                unused=", ".join(table.unused),
            )
            print(f"silo-mod: {plain(words)}", file=sys.stderr)
    extraction, unused, unread = _read(args)
    base = os.path.realpath(args.top) if os.path.isdir(args.top) else base_folder(extraction)
    with client_of(args) as client:
        schema = client.find_schema(args.schema)
        offer_made = _offer(extraction, client, schema, args)
        warn_of_rules(offer_made.categories)
        if args.category and args.category not in offer_made.categories:
            text = ", ".join(offer_made.categories)
            raise InputError(
                message(
                    "--category: schema {schema} has no {category}; it has {text}",
                    schema=schema,
                    category=args.category,
                    text=text,
                )
            )
        code = RegisterRun(args, client, schema, offer_made, base).as_asked(rows, unused)
        return code or (Exit.UNDONE if unread else Exit.DONE)


def _read(args: argparse.Namespace) -> tuple[Extraction, frozenset[str], bool]:
    """Read the components, the files that no assembly uses, and if any file cannot be read."""
    if not os.path.isdir(args.top):
        extraction = read_tops(args)[0]
        return extraction, frozenset(), _tell_missing(extraction, base_folder(extraction))
    with plan_of(args) as (plan, reading, base):
        for path, error in plan.errors.items():
            print(
                message("silo-mod: {base} is left out: {error}", base=relative(path, base), error=error),
                file=sys.stderr,
            )
        extraction, unused = whole_folder(plan, reading, base, hardware=not args.no_hardware)
        return extraction, unused, _tell_missing(extraction, base, set(plan.errors)) or bool(plan.errors)


def _tell_missing(extraction: Extraction, base: str, unread: Set[str] = frozenset()) -> bool:
    """Report the missing files, which cannot be registered; ``unread``: what was reported before."""
    from silo.cli.terminal import plain

    missing = {entry.doc_path for entry in walk_entries(extraction.entries) if entry.missing}
    said = {relative(path, base) for path in unread}
    missing = {path for path in missing if relative(path, base) not in said}
    for path in sorted(missing):
        print(
            message("silo-mod: {base} is left out: it is not there", base=plain(relative(path, base))),
            file=sys.stderr,
        )
    return bool(missing)


def _offer(extraction: Extraction, client: SiloClient, schema: str, args: argparse.Namespace) -> Offer:
    folder = os.path.isdir(args.top)
    paths = {entry.doc_path for entry in walk_entries((extraction.assembly, *extraction.entries))}
    seen = seen_on_disk(paths, even_if_open=args.even_if_open)
    journal = Journal()
    offer_made = offer(
        extraction,
        seen,
        client,
        schema,
        RegisterProgress(),
        journal.pending(),
        most=None,
        own_file=not folder,
    )
    if offer_made.unsearched:
        print(
            message(
                "silo-mod: Silo was not searched for probable duplicates: {unsearched}",
                unsearched=offer_made.unsearched,
            ),
            file=sys.stderr,
        )
    candidates = [
        candidate
        for candidate in offer_made.candidates
        if not folder or candidate.entry.key != extraction.assembly.key
    ]
    if args.category:
        candidates = [
            candidate
            if candidate.entry.is_assembly
            else replace(
                candidate, proposal=replace(candidate.proposal, category=args.category, is_guess=False)
            )
            for candidate in candidates
        ]
    return replace(offer_made, candidates=tuple(candidates))
