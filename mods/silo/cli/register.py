# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod register``: items for components without a number, and the identity into their files.

Asked one by one, as a table to edit (``--plan``, ``--apply``), or all at once (``--yes``).
"""

from __future__ import annotations

import argparse
import os
import shlex
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo.bom.document import relative
from silo.bom.errors import ConflictError, DocumentError, Exit, InputError
from silo.bom.identity import walk_entries
from silo.bom.model import Extraction
from silo.bom.naming import Proposal, propose
from silo.bom.report import base_of
from silo.cli import common
from silo.cli.common import Commands
from silo.cli.register_dialog import Dialog
from silo.files import check_writable
from silo.open_in_freecad import open_in_any
from silo.registering.items import Ask, Registration, unclear
from silo.registering.journal import Journal
from silo.registering.modelled import chosen, modelled
from silo.registering.offer import Candidate, Offer, State, offer
from silo.registering.on_disk import OPEN, carry_out_on_disk, is_own, seen_on_disk, whole_folder
from silo.registering.orders import Order
from silo.registering.table import Row, doubts, orders_of, read_table, write_table

if TYPE_CHECKING:
    from silo.api.client import SiloClient


def register(commands: Commands) -> None:
    """Add the command."""
    parser = common.add_command(
        commands,
        "register",
        "create items for components without a part number and write their identity into the files",
        "silo-mod register vault/ --plan parts.csv      (edit the table, then)\n"
        "  silo-mod register vault/ --apply parts.csv",
    )
    common.add_assembly_options(parser, folders=True)
    how = parser.add_mutually_exclusive_group()
    how.add_argument("--yes", action="store_true", help="take every proposal without asking")
    how.add_argument("--plan", metavar="FILE", help="write the proposals as a table (CSV) to edit; no more")
    how.add_argument("--apply", metavar="FILE", help="register what an edited table says")
    parser.add_argument(
        "--duplicates",
        choices=("leave", "join", "new"),
        default="leave",
        help="with --yes, what Silo seems to have already: leave it out and say so (default), join the one "
        "item that it seems to be, or make a new item",
    )
    parser.add_argument(
        "--schema",
        default="kindred-rd",
        help="part number schema (default: kindred-rd, else the server's only one)",
    )
    parser.add_argument(
        "--unclear",
        choices=("ask", "take", "new"),
        default="ask",
        help="an interrupted run may have made the item, and the server does not show for which part: "
        "ask (default), take it where only one fits, or make a new one",
    )
    parser.add_argument(
        "--even-if-open",
        action="store_true",
        help="also files that a running FreeCAD has open; whoever saves them there undoes the registration",
    )
    parser.add_argument(
        "--declare",
        metavar="OBJECT",
        action="append",
        default=[],
        help="count what is modelled in the assembly's own file (name or label); equal copies are one item",
    )
    parser.add_argument("--apart", action="store_true", help="with --declare: an item for each copy")
    parser.add_argument(
        "--undeclare",
        metavar="OBJECT",
        action="append",
        default=[],
        help="take the identity from an object in the assembly's own file; its item stays",
    )
    parser.add_argument("--category", help="this category for every part (assemblies keep theirs)")
    common.add_json_option(parser)
    common.add_server_options(parser)
    common.only_with(parser, "--yes", "--duplicates")
    common.only_with(parser, "--declare", "--apart")
    common.not_with(parser, "--undeclare", "--declare", "--category")
    common.not_with(parser, "--apply", "--category")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Register what is unregistered; 1 where something was skipped or failed."""
    if not (args.yes or args.plan or args.apply or args.undeclare or sys.stdin.isatty()):
        raise InputError(
            "register asks before it creates items, and there is nobody to ask here; say --yes, "
            "or write a table with --plan FILE, edit it, and use it with --apply FILE"
        )
    if args.plan and args.json:
        raise InputError("--plan writes a table and no JSON; leave out --json")
    if (args.declare or args.undeclare) and (args.plan or args.apply or os.path.isdir(args.top)):
        raise InputError("--declare and --undeclare are for one file, and not for a table")
    if args.undeclare:
        return _undeclare(args)
    if args.declare:
        return _declare(args)
    if args.plan and args.plan != "-":
        check_writable(args.plan)
        if os.path.lexists(args.plan):
            raise InputError(f"{args.plan} is there already, and may hold edits; name another file")
    rows = read_table(Path(args.apply).read_bytes(), args.apply) if args.apply else []
    extraction, unused, unread = _read(args)
    base = os.path.realpath(args.top) if os.path.isdir(args.top) else base_of(extraction)
    with common.client_of(args) as client:
        schema = client.find_schema(args.schema)
        found = _offer(extraction, client, schema, args)
        _tell_rules(found.categories)
        if args.category and args.category not in found.categories:
            known = ", ".join(found.categories)
            raise InputError(f"--category: schema {schema} has no {args.category}; it has {known}")
        code = _Run(args, client, schema, found, base).as_asked(rows, unused)
        return code or (Exit.UNDONE if unread else Exit.DONE)


# --- what there is --------------------------------------------------------------------------------------


def _read(args: argparse.Namespace) -> tuple[Extraction, frozenset[str], bool]:
    """The components, the files that no assembly uses, and whether there is a file that cannot be read."""
    if not os.path.isdir(args.top):
        extraction = common.read_top(args)
        return extraction, frozenset(), _tell_missing(extraction, base_of(extraction))
    with common.plan_of(args) as (plan, reading, base):
        for path, error in plan.errors.items():
            print(f"silo-mod: {relative(path, base)} is left out: {error}", file=sys.stderr)
        extraction, unused = whole_folder(plan, reading, base, hardware=not args.no_hardware)
        return extraction, unused, _tell_missing(extraction, base) or bool(plan.errors)


def _tell_missing(extraction: Extraction, base: str) -> bool:
    """Report the files that nobody can register, for they are not there."""
    from silo.cli.show import plain

    missing = {entry.doc_path for entry in walk_entries(extraction.entries) if entry.missing}
    for path in sorted(missing):
        print(f"silo-mod: {plain(relative(path, base))} is left out: it is not there", file=sys.stderr)
    return bool(missing)


def _offer(extraction: Extraction, client: SiloClient, schema: str, args: argparse.Namespace) -> Offer:
    folder = os.path.isdir(args.top)
    paths = {entry.doc_path for entry in walk_entries((extraction.assembly, *extraction.entries))}
    seen = seen_on_disk(paths, even_if_open=args.even_if_open)
    journal = Journal()
    found = offer(
        extraction, seen, client, schema, _Told(), journal.pending(), most=None, own_file=not folder
    )
    if found.unsearched:
        print(f"silo-mod: Silo was not searched for probable duplicates: {found.unsearched}", file=sys.stderr)
    candidates = [one for one in found.candidates if not folder or one.entry.key != extraction.assembly.key]
    if args.category:
        candidates = [
            one
            if one.entry.is_assembly
            else replace(one, proposal=replace(one.proposal, category=args.category, is_guess=False))
            for one in candidates
        ]
    return replace(found, candidates=tuple(candidates))


def _tell_rules(categories: Mapping[str, str]) -> None:
    """A mistake in the site's rules costs proposals, no more; it is said on stderr."""
    from silo.activity import rules_text
    from silo.cli.show import plain

    if problem := getattr(categories, "problem", ""):
        print(f"silo-mod: {plain(rules_text(problem))}", file=sys.stderr)


class _Told:
    """A long run on a terminal says where it is, once a second; Ctrl-C ends it."""

    def __init__(self) -> None:
        self._at = time.monotonic()

    def progress(self, detail: str = "", fraction: float | None = None) -> None:
        from silo.cli import show

        now = time.monotonic()
        if fraction and now - self._at > 1 and sys.stderr.isatty():
            self._at = now
            print(f"[{fraction:4.0%}] {show.plain(detail)}", file=sys.stderr)

    def check(self) -> None:
        return


# --- doing it -------------------------------------------------------------------------------------------


class _Run:
    """One registration, from orders to the report."""

    def __init__(
        self, args: argparse.Namespace, client: SiloClient, schema: str, found: Offer, base: str
    ) -> None:
        self.args, self.client, self.schema, self.found, self.base = args, client, schema, found, base
        self.done: list[Registration] = []

    def as_asked(self, rows: Sequence[Row], unused: frozenset[str]) -> int:
        """With a table, with --yes, or with the answers of a person."""
        if self.args.plan:
            return self.write_plan(unused)
        if self.args.apply:
            planned = orders_of(rows, self.found, self.base, self.client, self.args.apply)
            return self.register(planned.orders, planned.unlisted, already=planned.done)
        if self.args.yes:
            return self.register(*self.all_but_duplicates(unused))
        counted = (one for one in self.found.candidates if one.article is None)
        offered = [one for one in counted if one.entry.doc_path not in unused]
        return self.register(*Dialog(offered, self.found, self.client, self.base, is_own).ask())

    def write_plan(self, unused: frozenset[str]) -> int:
        """The table; nothing is registered."""
        from silo.durable import replacing

        earlier: list[Candidate] = []

        def wanted(one: Candidate) -> bool:
            doubtful = bool(doubts(one, earlier)) and not is_own(one)
            earlier.append(one)
            return not doubtful and one.article is None and one.entry.doc_path not in unused

        table = write_table(self.found, wanted, self.base)
        if self.args.plan == "-":
            sys.stdout.write(table.decode("utf-8-sig", "surrogateescape"))
            return Exit.DONE
        with replacing(Path(self.args.plan)) as file:
            file.write(table)
        count = sum(not one.declared for one in self.found.candidates)
        print(
            f"{self.args.plan}: {count} {'row' if count == 1 else 'rows'}. Edit it, then: "
            f"silo-mod register {shlex.quote(self.args.top)} --apply {shlex.quote(self.args.plan)}",
            file=sys.stderr,
        )
        return Exit.DONE

    def all_but_duplicates(self, unused: frozenset[str]) -> tuple[list[Order], list[Candidate]]:
        """Every proposal; what seems to be an item already is treated as ``--duplicates`` says."""
        orders, left = [], []
        earlier: list[Candidate] = []
        for one in self.found.candidates:
            if one.article is not None or one.same_as or one.entry.doc_path in unused:
                continue
            doubtful = bool(doubts(one, earlier)) and not is_own(one)
            earlier.append(one)
            if not doubtful or self.args.duplicates == "new":
                orders.append(Order.of(one))
            elif self.args.duplicates == "join" and len(one.similar) == 1:
                orders.append(replace(Order.of(one), existing=one.similar[0]))
            else:
                left.append(one)
        if unused:
            files = "1 file" if len(unused) == 1 else f"{len(unused)} files"
            words = f"{files} that no assembly uses: left alone (name the file, or use --plan)"
            print(words, file=sys.stderr)
        return orders, left

    def register(self, orders: Sequence[Order], left: Sequence[Candidate], *, already: int = 0) -> int:
        """Carry out; what was done is reported also where Ctrl-C ends it."""
        try:
            done = carry_out_on_disk(
                orders,
                self.client,
                schema=self.schema,
                ask=_asker(self.args.unclear),
                even_if_open=self.args.even_if_open,
                done=self.done,
                control=_Told(),
            )
        finally:
            self._report(left, already)
        return Exit.UNDONE if left or any(one.error for one in done) else Exit.DONE

    def _report(self, left: Sequence[Candidate], already: int) -> None:
        articles = [
            one.article for one in self.found.candidates if one.article is not None and not one.declared
        ]
        declared = {one.proposal.entry.key for one in self.done}
        from silo.cli import show

        show.registrations(
            self.args,
            self.base,
            self.done,
            [(one.proposal, "; ".join(doubts(one, self.found.candidates))) for one in left],
            [one for one in articles if one.entry.key not in declared],
        )
        if already and not self.args.json:
            print(f"{already} of the table's components had their number already.")


def _declare(args: argparse.Namespace) -> int:
    """Give what is modelled in the file an identity; 1 where that failed."""
    articles = modelled(args.top, args.assembly)
    wanted = chosen(articles, args.declare, apart=args.apart)
    for one in wanted:
        if one.declared:
            raise InputError(f"{one.entry.label} is a component already; --undeclare takes that back")
    with common.client_of(args) as client:
        schema = client.find_schema(args.schema)
        categories = client.categories(schema)
        _tell_rules(categories)
        found = Offer(
            tuple(
                Candidate(propose(one.entry, categories, shares_file=True), State.READY, article=one)
                for one in (*wanted, *(one for one in articles if one not in wanted))
            ),
            categories,
        )
        orders = [Order.of(one) for one in found.candidates[: len(wanted)]]
        if args.category:
            orders = [replace(one, category=args.category) for one in orders]
        base = os.path.dirname(os.path.realpath(args.top))
        return _Run(args, client, schema, found, base).register(orders, ())


def _undeclare(args: argparse.Namespace) -> int:
    """Take identities out of the file."""
    from silo.fcstd import unstamp

    articles = [one for one in modelled(args.top, args.assembly) if one.declared]
    path = articles[0].entry.doc_path if articles else os.path.realpath(args.top)
    wanted = chosen(articles, args.undeclare)
    if not args.even_if_open and open_in_any().has_file(path):
        raise DocumentError(path, OPEN)
    names = [name for one in wanted for name in one.objects]
    taken = [name for name in names if unstamp(path, name)]
    if args.json:
        common.print_json({"undeclared": taken})
    else:
        print(f"No component any more: {', '.join(taken)}. The next sync flags the line as unreferenced.")
    return Exit.DONE


def _asker(how: str) -> Ask:
    """Which of the items that fit an interrupted run made: as ``--unclear`` says."""

    def ask(proposal: Proposal, found: Sequence[Mapping[str, Any]]) -> Mapping[str, Any] | None:
        if how == "new":
            return None
        if how == "take" and len(found) == 1:
            return found[0]
        if how == "take" or not sys.stdin.isatty():
            try:
                return unclear(proposal, found)
            except ConflictError as error:
                raise ConflictError(f"{error}: --unclear take, or --unclear new") from None
        print(f"{proposal.name}: an interrupted run may have made its item already:", file=sys.stderr)
        for number, item in enumerate(found, start=1):
            print(f"  {number}  {item['part_number']}  {item.get('created_at') or ''}", file=sys.stderr)
        answer = input("which one is it? [number, n = make a new item] ").strip()
        if answer.isdecimal() and 1 <= int(answer) <= len(found):
            return found[int(answer) - 1]
        return None if answer.lower() == "n" else unclear(proposal, found)

    return ask
