# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod register``: items for components without a number, and the identity into their files.

Asked one by one, as a table to edit (``--plan``, ``--apply``), or all at once (``--yes``). ``--adopt`` takes
over what another server knows, ``--orphans`` names the items that no file names.

The questions of ``silo-mod register`` on a terminal, one component at a time.

An answer is taken for what it says and nothing else: what is not understood is asked again, and never becomes
a name or a category. Nothing is registered before the last question, so Ctrl-C leaves everything as it was.
"""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo import spoken
from silo.bom.document import relative
from silo.bom.errors import ConflictError, DocumentError, Exit, InputError, SiloError, counted
from silo.bom.items.proposal import Proposal, propose
from silo.bom.model import Extraction, walk_entries
from silo.bom.report import base_of
from silo.cli.common import (
    add_options,
    add_top,
    client_of,
    not_with,
    only_with,
    plan_of,
    print_json,
    read_tops,
    set_step,
)
from silo.cli.show import plain
from silo.files import check_writable
from silo.freecads import open_in_any
from silo.registering.candidate import Candidate, CandidateFiles, ComponentState
from silo.registering.closed_files import OPEN, carry_out_on_disk, is_own, seen_on_disk, whole_folder
from silo.registering.items import Ask, Registration, finished, unclear
from silo.registering.journal import Journal
from silo.registering.modelled import chosen, modelled
from silo.registering.offer import Offer, offer
from silo.registering.request import ITEM_TYPES, Order, find_item, wrong_name
from silo.registering.table import TableRow, doubts, orders_of, read_table, remarks, write_table

if TYPE_CHECKING:
    from silo.api.client import SiloClient


_HELP = """  y, yes        register it as shown; Enter alone does the same where there is no doubt
  n, no         leave it out; it stays without a number
  name TEXT     give it another name
  type TYPE     part, assembly, consumable or tool
  cat CODE      another category; cat alone lists them all, cat WORD those with the word
  join NUMBER   it is this item of Silo already: take its number, make no new one
  all           register this one and the others, and ask only where there is a doubt
  q, quit       ask no more: what you said yes to is registered, the rest is left out
  ?             this list
Nothing is registered before the last question. Ctrl-C leaves everything as it was."""


def read_line(prompt: str) -> str | None:
    """Ask a person for a line; None at the end of the input. Asks on stderr, since standard output may be
    JSON.
    """
    set_step("")
    print(prompt, end="", file=sys.stderr, flush=True)
    try:
        return input()
    except EOFError:
        return None


class Dialog:
    """Asks about candidates; :meth:`ask` gives the orders, and what stays without a number.

    own
        True where the look-alike on the server is the component's own item.
    """

    def __init__(
        self,
        candidates: Sequence[Candidate],
        found: Offer,
        api: Any,
        base: str,
        own: Callable[[Candidate], bool],
        read: Callable[[str], str | None] = read_line,
    ) -> None:
        self._candidates, self._found, self._api, self._base = candidates, found, api, base
        self._own, self._read = own, read
        self._all = self._quit = False
        self._earlier = CandidateFiles()

    def ask(self) -> tuple[list[Order], list[Candidate]]:
        """Ask about each component. Returns the orders, and the components that stay without a number."""
        orders: list[Order] = []
        left: list[Candidate] = []
        for number, candidate in enumerate(self._candidates):
            fine = candidate.state.usable and candidate.state is not ComponentState.ELSEWHERE
            # A file that cannot be written is not asked about; carrying it out reports the reason.
            order = (
                None if self._quit else self._order_for(candidate, number) if fine else Order.of(candidate)
            )
            if order is not None:
                orders.append(order)
            elif not candidate.same_as:
                left.append(candidate)
        return orders, left

    def _order_for(self, candidate: Candidate, number: int) -> Order | None:
        self._earlier.add(candidate)
        doubtful = bool(doubts(candidate, self._earlier)) and not self._own(candidate)
        order = Order.of(candidate)
        if self._all and not doubtful:
            return order
        entry = candidate.entry
        where = entry.standard or f"{relative(entry.doc_path, self._base)}#{entry.object_name}"
        _say(f"\n[{number + 1}/{len(self._candidates)}] {where}")
        for remark in remarks(candidate, self._earlier):
            _say(f"  ⚠ {remark}")
        yes = "y" if doubtful else "Y"
        while True:
            _say(f"  {self._described(order)}")
            answer = self._read(f"  register it? [{yes}/n/name/type/cat/join/all/q/?] ")
            word, _, rest = ("q" if answer is None else answer.strip()).partition(" ")
            match word.lower(), rest.strip():
                case (("q" | "quit"), ""):
                    self._quit = True
                    return None
                case (("n" | "no"), ""):
                    return None
                case (("y" | "yes"), ""):
                    return order
                case ("" | "all") as said, "":
                    self._all = self._all or bool(said)
                    if not doubtful:
                        return order
                    _say("  There is a doubt (⚠): please answer y or n, or join NUMBER.")
                case (("?" | "h" | "help"), _):
                    _say(_HELP)
                case ("name" | "type" | "cat" | "join") as what, text:
                    order = self._changed(order, what, text)
                case _:
                    _say(f"  {answer!r} is no answer; ? lists what can be answered.")

    def _described(self, order: Order) -> str:
        if order.existing is not None:
            return f"join {order.existing.part_number} {order.existing.name!r}"
        meaning = self._found.categories.get(order.category, "")
        return f"{order.item_type} {order.name!r}, category {order.category} ({meaning})"

    def _changed(self, order: Order, what: str, text: str) -> Order:
        """Return the order with the change; if it is not possible, explain that and return the order
        unchanged.
        """
        if what == "name":
            if problem := wrong_name(text, order.candidate):
                _say(f"  {problem}")
                return order
            return replace(order, name=text)
        if what == "type":
            if text.lower() in ITEM_TYPES:
                return order.retyped(text.lower(), self._found.categories)
            _say(f"  type: one of {', '.join(ITEM_TYPES)}")
            return order
        if what == "cat":
            return self._category(order, text)
        try:
            return replace(order, existing=find_item(text, order.candidate, self._api) if text else None)
        except InputError as problem:
            _say(f"  {problem}")
        except SiloError as error:
            _say(f"  Silo cannot say: {error}")
        return order

    def _category(self, order: Order, text: str) -> Order:
        categories = self._found.categories
        if text.upper() in categories:
            return replace(order, category=text.upper())
        if text in categories:
            return replace(order, category=text)
        codes = [
            code for code, words in categories.items() if text.casefold() in f"{code} {words}".casefold()
        ]
        if not codes:
            _say(f"  There is no category {text!r}; cat alone lists them all.")
        for code in codes:
            _say(f"    {code}  {categories[code]}")
        return order


def _say(text: str) -> None:
    for line in text.split("\n"):
        print(plain(line), file=sys.stderr)


def add_register(parser: argparse.ArgumentParser) -> None:
    """Add the command."""
    add_top(parser, "--plan", "--apply", "--declare", "--undeclare", "--not-a-part")
    how = parser.add_mutually_exclusive_group()
    add_options(
        how,
        {
            "--yes": "take every proposal without asking",
            "--adopt": (
                "take over what was registered on another server: an item for each identity that this"
                " server does not know, with the same UUID"
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
            "--plan FILE": "write the proposals as a table (CSV) to edit; no more",
            "--apply FILE": "register what an edited table says",
        },
    )
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
                "count what is modelled in the assembly's own file (name or label); equal copies are one item"
            ),
            "--apart": "with --declare: an item for each copy",
            "--undeclare OBJECT...": (
                "take back a decision about an object in the assembly's own file: its identity, whose"
                " item stays, or that it is no part"
            ),
            "--not-a-part OBJECT...": (
                "say of what is modelled in the assembly's own file that it is no part; the file keeps that"
            ),
        },
    )
    parser.add_argument("--category", help="this category for every part (assemblies keep theirs)")
    only_with(parser, "--yes", "--duplicates")
    only_with(parser, "--declare", "--apart")
    not_with(parser, "--undeclare", "--declare", "--category", "--not-a-part")
    not_with(parser, "--not-a-part", "--declare", "--category")
    not_with(parser, "--apply", "--category")


def run_register(args: argparse.Namespace) -> int:
    """Register what is unregistered; returns 1 if something was skipped or failed."""
    taken = args.undeclare or args.not_a_part
    if args.orphans:
        return _orphans(args)
    if not (args.yes or args.adopt or args.plan or args.apply or taken or sys.stdin.isatty()):
        raise InputError(
            "register asks before it creates items, and there is nobody to ask here; say --yes, "
            "or write a table with --plan FILE, edit it, and use it with --apply FILE"
        )
    if args.plan and args.json:
        raise InputError("--plan writes a table and no JSON; leave out --json")
    if (args.declare or taken) and (args.plan or args.apply or os.path.isdir(args.top)):
        raise InputError("--declare, --undeclare and --not-a-part are for one file, and not for a table")
    if taken:
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
    with client_of(args) as client:
        schema = client.find_schema(args.schema)
        offer_made = _offer(extraction, client, schema, args)
        _tell_rules(offer_made.categories)
        if args.category and args.category not in offer_made.categories:
            text = ", ".join(offer_made.categories)
            raise InputError(f"--category: schema {schema} has no {args.category}; it has {text}")
        code = _RegisterRun(args, client, schema, offer_made, base).as_asked(rows, unused)
        return code or (Exit.UNDONE if unread else Exit.DONE)


# --- what there is --------------------------------------------------------------------------------------


def _read(args: argparse.Namespace) -> tuple[Extraction, frozenset[str], bool]:
    """Read the components, the files that no assembly uses, and if any file cannot be read."""
    if not os.path.isdir(args.top):
        extraction = read_tops(args)[0]
        return extraction, frozenset(), _tell_missing(extraction, base_of(extraction))
    with plan_of(args) as (plan, reading, base):
        for path, error in plan.errors.items():
            print(f"silo-mod: {relative(path, base)} is left out: {error}", file=sys.stderr)
        extraction, unused = whole_folder(plan, reading, base, hardware=not args.no_hardware)
        return extraction, unused, _tell_missing(extraction, base) or bool(plan.errors)


def _tell_missing(extraction: Extraction, base: str) -> bool:
    """Report the missing files, which nobody can register."""
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
    offer_made = offer(
        extraction, seen, client, schema, _Told(), journal.pending(), most=None, own_file=not folder
    )
    if offer_made.unsearched:
        print(
            f"silo-mod: Silo was not searched for probable duplicates: {offer_made.unsearched}",
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


def _tell_rules(categories: Mapping[str, str]) -> None:
    """Report a mistake in the site's rules on standard error; it only costs proposals."""
    from silo.bom_sync import rules_text
    from silo.cli.show import plain

    if problem := getattr(categories, "problem", ""):
        print(f"silo-mod: {plain(rules_text(problem))}", file=sys.stderr)


class _Told:
    """A long run says where it is; Ctrl-C ends it."""

    def progress(self, detail: str = "", fraction: float | None = None) -> None:
        if fraction is None:
            print(f"silo-mod: {plain(detail)}", file=sys.stderr)
        elif fraction:
            set_step(f"{detail}, {fraction:.0%}")

    def check(self) -> None:
        return


# --- doing it -------------------------------------------------------------------------------------------


class _RegisterRun:
    """One registration, from orders to the report."""

    def __init__(
        self, args: argparse.Namespace, client: SiloClient, schema: str, found: Offer, base: str
    ) -> None:
        self.args, self.client, self.schema, self.found, self.base = args, client, schema, found, base
        self.done: list[Registration] = []

    def as_asked(self, rows: Sequence[TableRow], unused: frozenset[str]) -> int:
        """Register with a table, with --yes, or with the answers of a person."""
        if self.args.plan:
            return self.write_plan(unused)
        if self.args.apply:
            planned = orders_of(rows, self.found, self.base, self.client, self.args.apply)
            return self.register(planned.orders, planned.unlisted, already=planned.done)
        if self.args.yes or self.args.adopt:
            return self.register(*self.all_but_duplicates(unused))
        counted = (candidate for candidate in self.found.candidates if candidate.article is None)
        offered = [candidate for candidate in counted if candidate.entry.doc_path not in unused]
        return self.register(*Dialog(offered, self.found, self.client, self.base, is_own).ask())

    def write_plan(self, unused: frozenset[str]) -> int:
        """Write the table of all components, and register nothing."""
        from silo.platform import replacing

        earlier = CandidateFiles()

        def wanted(candidate: Candidate) -> bool:
            earlier.add(candidate)
            doubtful = bool(doubts(candidate, earlier)) and not is_own(candidate)
            return not doubtful and candidate.article is None and candidate.entry.doc_path not in unused

        table = write_table(self.found, wanted, self.base)
        if self.args.plan == "-":
            sys.stdout.write(table.decode("utf-8-sig", "surrogateescape"))
            return Exit.DONE
        with replacing(Path(self.args.plan)) as file:
            file.write(table)
        count = sum(not component.decided for component in self.found.candidates)
        print(
            f"{self.args.plan}: {counted(count, 'row')}. Edit it, then: "
            f"silo-mod register {shlex.quote(self.args.top)} --apply {shlex.quote(self.args.plan)}",
            file=sys.stderr,
        )
        return Exit.DONE

    def all_but_duplicates(self, unused: frozenset[str]) -> tuple[list[Order], list[Candidate]]:
        """Divide the components into orders and those to leave; ``--duplicates`` decides about components
        that seem to be items already.
        """
        orders, left = [], []
        earlier = CandidateFiles()
        for candidate in self.found.candidates:
            if candidate.article is not None or candidate.same_as or candidate.entry.doc_path in unused:
                continue
            earlier.add(candidate)
            doubts_here, is_foreign = doubts(candidate, earlier), candidate.foreign and not is_own(candidate)
            doubtful = len(doubts_here) > candidate.foreign and not is_own(candidate)
            if is_foreign != self.args.adopt:
                left.append(candidate)
            elif not doubtful or self.args.duplicates == "new":
                orders.append(Order.of(candidate))
            elif self.args.duplicates == "join" and len(candidate.similar) == 1:
                orders.append(replace(Order.of(candidate), existing=candidate.similar[0]))
            else:
                left.append(candidate)
        if unused:
            files = counted(len(unused), "file")
            words = f"{files} that no assembly uses: left alone (name the file, or use --plan)"
            print(words, file=sys.stderr)
        return orders, left

    def register(self, orders: Sequence[Order], left: Sequence[Candidate], *, already: int = 0) -> int:
        """Register the orders; the result is reported even if Ctrl-C ends it."""
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
        return Exit.UNDONE if left or any(registration.error for registration in done) else Exit.DONE

    def _report(self, left: Sequence[Candidate], already: int) -> None:
        articles = [
            candidate.article
            for candidate in self.found.candidates
            if candidate.article is not None and not candidate.decided
        ]
        declared = {registration.proposal.entry.key for registration in self.done}
        from silo.cli.show import registrations

        contents = CandidateFiles()
        for candidate in self.found.candidates:
            contents.add(candidate)
        registrations(
            self.args,
            self.base,
            self.done,
            [(candidate.proposal, "; ".join(doubts(candidate, contents))) for candidate in left],
            [article for article in articles if article.entry.key not in declared],
        )
        if already and not self.args.json:
            print(spoken(f"{already} of the table's components had their number already."))


def _declare(args: argparse.Namespace) -> int:
    """Give an identity to what is modelled in the file; returns 1 if that failed."""
    articles = modelled(args.top, args.assembly)
    wanted = chosen(articles, args.declare, apart=args.apart)
    for part in wanted:
        if part.decided:
            what = "no part, as somebody said" if part.no_part else "a component already"
            raise InputError(f"{part.entry.label} is {what}; --undeclare takes that back")
    with client_of(args) as client:
        schema = client.find_schema(args.schema)
        categories = client.categories(schema)
        _tell_rules(categories)
        own_offer = Offer(
            tuple(
                Candidate(
                    propose(part.entry, categories, shares_file=True), ComponentState.READY, article=part
                )
                for part in (*wanted, *(article for article in articles if article not in wanted))
            ),
            categories,
        )
        orders = [Order.of(part) for part in own_offer.candidates[: len(wanted)]]
        if args.category:
            orders = [replace(part, category=args.category) for part in orders]
        base = os.path.dirname(os.path.realpath(args.top))
        return _RegisterRun(args, client, schema, own_offer, base).register(orders, ())


def _undeclare(args: argparse.Namespace) -> int:
    """Take identities and marks out of the file; an object that is no part gets its mark."""
    from silo.fcstd import unstamp

    no_part = bool(args.not_a_part)
    articles = [
        part for part in modelled(args.top, args.assembly) if (not part.no_part if no_part else part.decided)
    ]
    path = articles[0].entry.doc_path if articles else os.path.realpath(args.top)
    wanted = chosen(articles, args.not_a_part or args.undeclare)
    if not args.even_if_open and open_in_any().has_file(path):
        raise DocumentError(path, OPEN)
    names = [name for part in wanted for name in part.objects]
    taken = [name for name in names if unstamp(path, name, no_part=no_part)]
    if args.json:
        print_json({"undeclared": taken})
    elif no_part:
        print(spoken(f"No part of any BOM: {', '.join(taken)} (SiloBomExclude)."))
    else:
        text = f"Undecided again: {', '.join(taken)}. The next sync flags a line of it as unreferenced."
        print(spoken(text))
    return Exit.DONE


def _orphans(args: argparse.Namespace) -> int:
    """List the items that no file names, or archive them; returns 1 if any are left."""
    journal, rows, done = Journal(), [], args.orphans == "archive"
    base = os.path.join(os.path.realpath(args.top), "")
    with client_of(args) as client:
        for record in journal.unfinished():
            if not os.path.join(record.component.rpartition("#")[0], "").startswith(base):
                continue
            items = filter(None, map(client.get_item_by_uuid, {record.item_id, record.wanted}))
            if (item := next(items, None)) is None or finished(record, journal):
                continue
            if done:
                client.archive_item(item.part_number)
                journal.forget(record.component)
            rows.append({"part_number": item.part_number, "name": item.name, "component": record.component})
    if args.json:
        print_json({"archived" if done else "orphans": rows})
    for row in rows if not args.json else ():
        print(*map(plain, (row["part_number"], row["name"], row["component"])), sep="  ")
    if rows and not done:
        words = "registering these files again takes the items; --orphans archive puts them out of use"
        print(f"silo-mod: {words}", file=sys.stderr)
    return Exit.UNDONE if rows and not done else Exit.DONE


def _asker(how: str) -> Ask:
    """Make the function that decides, as ``--unclear`` says, which of several matching items a component
    gets.
    """

    def ask(proposal: Proposal, matches: Sequence[Mapping[str, Any]]) -> Mapping[str, Any] | None:
        if how == "new":
            return None
        if how == "take" and len(matches) == 1:
            return matches[0]
        if how == "take" or not sys.stdin.isatty():
            try:
                return unclear(proposal, matches)
            except ConflictError as error:
                raise ConflictError(f"{error}: --unclear take, or --unclear new") from None
        print(f"{proposal.name}: is it one of these items? A copy of it is not.", file=sys.stderr)
        for number, item in enumerate(matches, start=1):
            print(f"  {number}  {item['part_number']}  {item.get('created_at') or ''}", file=sys.stderr)
        set_step("")
        answer = input(spoken("which one is it? [number, n = make a new item] ")).strip()
        if answer.isdecimal() and 1 <= int(answer) <= len(matches):
            return matches[int(answer) - 1]
        return None if answer.lower() == "n" else unclear(proposal, matches)

    return ask
