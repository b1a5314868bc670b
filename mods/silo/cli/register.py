# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod register``: items for components without a number, and the identity into their files.

Asked one by one, as a table to edit (``--plan``, ``--apply``), or all at once (``--yes``).
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo.bom.declare import Modelled
from silo.bom.errors import ConflictError, DocumentError, Exit, InputError
from silo.bom.findings import Finding
from silo.bom.identity import walk_entries
from silo.bom.model import BomEntry, Extraction
from silo.bom.naming import Proposal, propose, propose_all
from silo.bom.paths import relative
from silo.bom.report import base_of
from silo.bom_sync import resolve
from silo.cli import common
from silo.cli.common import Commands
from silo.cli.register_dialog import Dialog
from silo.declaring import chosen, modelled
from silo.files import check_writable
from silo.open_in_freecad import open_in_any
from silo.registering.offer import Candidate, Offer, Seen, State, offer
from silo.registering.orders import Order, carry_out
from silo.registering.table import doubts, orders_of, read_table, write_table
from silo.registration import Journal, Registration, component_key, document_uid, unclear

if TYPE_CHECKING:
    from silo.api.client import SiloClient

_MOST_MODELLED = 40
_OPEN = (
    "it is open in FreeCAD, and saving it there would undo the registration. Close it there, or register it "
    "from there (Silo, Register Parts), then run this again; --even-if-open registers it all the same"
)


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
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Register what is unregistered; 1 where something was skipped or failed."""
    if not (args.yes or args.plan or args.apply or args.undeclare or sys.stdin.isatty()):
        raise InputError(
            "register asks before it creates items, and there is nobody to ask here; say --yes, "
            "or write a table with --plan FILE, edit it, and use it with --apply FILE"
        )
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
    extraction, unused = _folder(args) if os.path.isdir(args.top) else (common.read_top(args), frozenset())
    base = os.path.realpath(args.top) if os.path.isdir(args.top) else base_of(extraction)
    with common.client_of(args) as client:
        schema = client.find_schema(args.schema)
        found = _offer(extraction, client, schema, args)
        _tell_rules(found.categories)
        if args.category and args.category not in found.categories:
            known = ", ".join(found.categories)
            raise InputError(f"--category: schema {schema} has no {args.category}; it has {known}")
        run = _Run(args, client, schema, found, base)
        if args.plan:
            return run.write_plan(unused)
        if args.apply:
            planned = orders_of(rows, found, base, client, args.apply)
            return run.register(planned.orders, planned.unlisted, already=planned.done)
        if args.yes:
            orders, left = run.all_but_duplicates(unused)
            return run.register(orders, left)
        offered = [
            one for one in found.candidates if one.article is None and one.entry.doc_path not in unused
        ]
        orders, left = Dialog(offered, found, client, base, _own).ask()
        return run.register(orders, left)


# --- what there is --------------------------------------------------------------------------------------


def _folder(args: argparse.Namespace) -> tuple[Extraction, frozenset[str]]:
    """All components of a folder's assemblies, and the files that no assembly uses."""
    from silo.vault.reading import Question

    entries: dict[tuple[str, str], BomEntry] = {}
    findings: list[Finding] = []
    with common.plan_of(args) as (plan, reading, base):
        for node in (node for layer in plan.layers for node in layer):
            found = plan.extraction(node, reading)
            findings += found.findings
            for entry in (*found.entries, found.assembly):
                entries.setdefault(entry.key, replace(entry, children=()))
        used = {path for path, _ in entries}
        alone = [top for top in plan.tops if os.path.realpath(top) not in used and top not in plan.errors]
        for answer in reading.ask_many(Question(top, None, not args.no_hardware) for top in alone):
            if isinstance(part := answer.found, Extraction):
                head = part.assembly
                entries.setdefault(head.key, replace(head, children=(), is_assembly=False))
        for path, error in plan.errors.items():
            print(f"silo-mod: {relative(path, base)} is left out: {error}", file=sys.stderr)
    unused = frozenset(path for path, _ in entries) - used
    head = BomEntry(base, object_name="", is_assembly=True, level=0)
    return Extraction(head, tuple(entries.values()), tuple(dict.fromkeys(findings))), unused


def _offer(extraction: Extraction, client: SiloClient, schema: str, args: argparse.Namespace) -> Offer:
    folder = os.path.isdir(args.top)
    paths = {entry.doc_path for entry in walk_entries((extraction.assembly, *extraction.entries))}
    seen = {path: Seen(_state(path, args.even_if_open)) for path in paths}
    journal = Journal()
    found = offer(
        extraction, seen, client, schema, _Told(), journal.pending(), most=None, own_file=not folder
    )
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
    from silo.api.activity import rules_text
    from silo.cli.show import plain

    if problem := getattr(categories, "problem", ""):
        print(f"silo-mod: {plain(rules_text(problem))}", file=sys.stderr)


def _state(path: str, even_if_open: bool) -> State:
    if not os.path.isfile(path):
        return State.MISSING
    if not os.access(path, os.W_OK):
        return State.READ_ONLY
    return State.ELSEWHERE if not even_if_open and open_in_any().has_file(path) else State.READY


def _own(candidate: Candidate) -> bool:
    """True where the look-alike is its own item, made by a run that was interrupted or undone."""
    record = Journal().find(component_key(candidate.entry))
    if record is None:
        return False
    return not record.finished or record.document_uid == document_uid(candidate.entry)


class _Told:
    """A long run on a terminal says where it is; Ctrl-C ends it."""

    def progress(self, detail: str = "", fraction: float | None = None) -> None:
        from silo.cli import show

        if fraction and sys.stderr.isatty():
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

    def write_plan(self, unused: frozenset[str]) -> int:
        """The table; nothing is registered."""
        from silo.durable import replacing

        earlier: list[Candidate] = []

        def wanted(one: Candidate) -> bool:
            doubtful = bool(doubts(one, earlier)) and not _own(one)
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
            f"silo-mod register {self.args.top} --apply {self.args.plan}",
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
            doubtful = bool(doubts(one, earlier)) and not _own(one)
            earlier.append(one)
            if not doubtful or self.args.duplicates == "new":
                orders.append(Order.of(one))
            elif self.args.duplicates == "join" and len(one.similar) == 1:
                orders.append(replace(Order.of(one), existing=one.similar[0]))
            else:
                left.append(one)
        if unused and not self.args.json:
            count = len(unused)
            files = "1 file" if count == 1 else f"{count} files"
            print(
                f"{files} that no assembly uses: left alone (name the file, or use --plan)", file=sys.stderr
            )
        return orders, left

    def register(self, orders: Sequence[Order], left: Sequence[Candidate], *, already: int = 0) -> int:
        """Carry out; what was done is reported also where Ctrl-C ends it."""
        try:
            done = carry_out_in_files(
                orders,
                self.client,
                schema=self.schema,
                ask=_asker(self.args.unclear),
                even_if_open=self.args.even_if_open,
                done=self.done,
            )
        finally:
            self._report(left, already)
        return Exit.UNDONE if left or any(one.error for one in done) else Exit.DONE

    def _report(self, left: Sequence[Candidate], already: int) -> None:
        articles = [
            one.article for one in self.found.candidates if one.article is not None and not one.declared
        ]
        declared = {one.proposal.entry.key for one in self.done}
        report(
            self.args,
            self.base,
            self.done,
            [(one.proposal, "; ".join(doubts(one, self.found.candidates))) for one in left],
            [one for one in articles if one.entry.key not in declared],
        )
        if already and not self.args.json:
            print(f"{already} of the table's components had their number already.")


def carry_out_in_files(
    orders: Sequence[Order],
    client: SiloClient,
    *,
    schema: str,
    ask: Callable[[Proposal, Sequence[Mapping[str, Any]]], Mapping[str, Any] | None] = unclear,
    even_if_open: bool = True,
    done: list[Registration] | None = None,
) -> list[Registration]:
    """Register, with the identities written into the files; ``done`` grows with each.

    even_if_open
        also files that a running FreeCAD has open; else they are left alone, and are an error.
    """
    from silo.fcstd import check_stampable, stamp

    results: list[Registration] = [] if done is None else done

    def places(candidate: Candidate) -> list[tuple[str | None, str | None]]:
        """(the object that the identity is for, the object that gets the property), each once."""
        if candidate.article is not None:
            return [(name, name) for name in candidate.article.objects]
        name = candidate.entry.object_name
        return [(name if candidate.shares_file else None, name or None)]

    def write(candidate: Candidate, identity: str) -> None:
        for own, item in places(candidate):
            again = bool(candidate.same_as)
            stamp(candidate.entry.doc_path, identity, object_name=own, item_object=item, replace=again)

    def check(candidate: Candidate) -> None:
        # Looked at anew for each file: people open files while a long run is under way.
        if not even_if_open and open_in_any().has_file(candidate.entry.doc_path):
            raise DocumentError(candidate.entry.doc_path, _OPEN)
        for own, item in places(candidate):
            again = bool(candidate.same_as)
            check_stampable(candidate.entry.doc_path, object_name=own, item_object=item, replace=again)

    carry_out(
        orders,
        client,
        Journal(),
        write,
        schema=schema,
        control=_Told(),
        done=lambda _order, result: results.append(result),
        check=check,
        ask=lambda _order, proposal, items: ask(proposal, items),
    )
    return results


def proposals_for(extraction: Extraction, client: SiloClient, schema: str) -> list[Proposal]:
    """What to register: the components without an item, parts first, and the assembly itself last."""
    wanted = resolve(extraction, client).unregistered
    tree = (extraction.assembly, *extraction.entries)
    return propose_all(wanted, tree, client.categories(schema)) if wanted else []


def register_all(
    proposals: Sequence[Proposal], client: SiloClient, *, schema: str, **more: Any
) -> list[Registration]:
    """Register these as they were proposed (:func:`carry_out_in_files`)."""
    orders = [Order.of(Candidate(one, State.READY)) for one in proposals]
    return carry_out_in_files(orders, client, schema=schema, **more)


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
        raise DocumentError(path, _OPEN)
    names = [name for one in wanted for name in one.objects]
    taken = [name for name in names if unstamp(path, name)]
    if args.json:
        common.print_json({"undeclared": taken})
    else:
        print(f"No component any more: {', '.join(taken)}. The next sync flags the line as unreferenced.")
    return Exit.DONE


def _asker(how: str) -> Callable[[Proposal, Sequence[Mapping[str, Any]]], Mapping[str, Any] | None]:
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


# --- what people and machines see -----------------------------------------------------------------------


def report(
    args: argparse.Namespace,
    base: str,
    done: Sequence[Registration],
    left: Sequence[tuple[Proposal, str]],
    articles: Sequence[Modelled],
) -> None:
    """What became of each; ``left``: proposals that were not registered, and why."""
    if args.json:
        common.print_json(
            {
                "registered": [_row(r.proposal, base, r) for r in done if r.error is None],
                "failed": [_row(r.proposal, base, r) for r in done if r.error is not None],
                "unregistered": [_row(proposal, base, note=why) for proposal, why in left],
                "modelled": [_modelled_row(one, base) for one in articles],
            }
        )
        return
    from silo.cli import show

    out = show.console()
    if not done and not left:
        out.print("Every component has its part number already.")
    for result in done:
        name = show.plain(result.proposal.name)
        if result.error is None:
            guess = " (the category is a guess)" if result.proposal.is_guess else ""
            found = " (the item was there already)" if result.found else ""
            out.print(f"✓ {result.part_number}  {name}{guess}{found}", markup=False)
        else:
            out.print(f"✗ {name}: {show.plain(str(result.error))}", style="red", markup=False)
    for proposal, why in left:
        where = proposal.entry.standard or relative(proposal.entry.doc_path, base)
        reason = f" ({show.plain(why)})" if why else ""
        text = f"⚠ {show.plain(where)}: unregistered, left out of the BOM{reason}"
        out.print(text, style="yellow", markup=False)
    if args.yes and any(why for _, why in left):
        out.print(
            "Is it the same part? --duplicates join takes the item, --duplicates new makes another; "
            "--plan asks for each."
        )
    for line in _modelled_text(articles, base) if articles else ():
        out.print(line, markup=False, highlight=False)


def _modelled_row(article: Modelled, base: str) -> Mapping[str, Any]:
    """What is modelled in the file and not counted."""
    return {
        "doc_path": relative(article.entry.doc_path, base),
        "objects": list(article.objects),
        "label": article.entry.label,
        "quantity": article.entry.quantity,
        "alike": article.alike,
        "source": relative(article.source, base),
    }


def _modelled_text(articles: Sequence[Modelled], base: str) -> list[str]:
    """The section of what is modelled in the file, line by line."""
    from silo.cli import show

    lines = ["Modelled in this file, not counted:"]
    for one in articles[:_MOST_MODELLED]:
        copies = f", {len(one.objects)} copies of one {one.alike}" if len(one.objects) > 1 else ""
        source = f", imported from {show.plain(relative(one.source, base))}" if one.source else ""
        label = show.plain(one.entry.label)
        lines.append(f"  {one.entry.quantity} × {label} ({one.entry.object_name}{copies}{source})")
    if len(articles) > _MOST_MODELLED:
        lines.append(f"  and {len(articles) - _MOST_MODELLED} more; --json has them all")
    lines.append("Declare what is a part: silo-mod register TOP.FCStd --yes --declare OBJECT")
    return lines


def _row(
    proposal: Proposal, base: str, result: Registration | None = None, note: str = ""
) -> Mapping[str, Any]:
    row: dict[str, Any] = {
        "doc_path": relative(proposal.entry.doc_path, base),
        "object": proposal.entry.object_name,
        "standard": proposal.entry.standard,
        "name": proposal.name,
        "item_type": proposal.item_type,
        "category": proposal.category,
        "guess": proposal.is_guess,
        "note": note,
    }
    if result is not None and result.error is None:
        row |= {"part_number": result.part_number, "silo_uuid": result.item_id, "found": result.found}
    if result is not None and result.error is not None:
        row |= {"error": {"code": result.error.code, "message": str(result.error)}}
    return row
