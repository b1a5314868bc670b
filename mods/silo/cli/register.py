# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod register``: items for components without a number, and the identity into their files."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from silo.bom.declare import Modelled
from silo.bom.errors import ConflictError, DocumentError, InputError, SiloError
from silo.bom.model import BomEntry, Extraction
from silo.bom.naming import Proposal, propose, propose_all
from silo.bom.paths import relative
from silo.bom.report import base_of
from silo.bom_sync import resolve
from silo.cli import common
from silo.cli.common import Commands
from silo.declaring import chosen, declare, modelled
from silo.open_in_freecad import open_in_any
from silo.registration import Ask, Journal, Registration, unclear
from silo.registration import register as register_component
from silo.standard_items import register_standard

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.bom.categories import Categories

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
        "silo-mod register TopAssembly.FCStd --yes",
    )
    common.add_assembly_options(parser)
    parser.add_argument("--yes", action="store_true", help="take every proposal without asking")
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
    if not args.yes and not sys.stdin.isatty():
        raise InputError("register asks before it creates items, and there is nobody to ask here; say --yes")
    if args.undeclare:
        return _undeclare(args)
    if args.declare:
        return _declare(args)
    extraction = common.read_top(args)
    articles = [one for one in modelled(args.top, args.assembly) if not one.declared]
    with common.client_of(args) as client:
        schema = client.find_schema(args.schema)
        proposals = proposals_for(extraction, client, schema)
        if args.category:
            proposals = [p if p.entry.is_assembly else replace(p, category=args.category) for p in proposals]
        is_open = _never if args.even_if_open else _now
        chosen = proposals if args.yes else _ask(proposals, base_of(extraction))
        done = register_all(chosen, client, schema=schema, ask=_asker(args.unclear), is_open=is_open)
    skipped = [p for p in proposals if p not in chosen]
    _tell(args, extraction, done, skipped, articles)
    return 1 if skipped or any(r.error for r in done) else 0


def _declare(args: argparse.Namespace) -> int:
    """Give what is modelled in the file an identity; 1 where that failed."""
    articles = modelled(args.top, args.assembly)
    wanted = chosen(articles, args.declare, apart=args.apart)
    extraction = common.read_assembly(args.top, args.assembly, hardware=not args.no_hardware)
    done = []
    with common.client_of(args) as client:
        schema = client.find_schema(args.schema)
        categories = _categories(client, schema)
        is_open = _never if args.even_if_open else _now

        def check(path: str) -> None:
            if is_open(path):
                raise DocumentError(path, _OPEN)

        for one in wanted:
            if one.declared:
                raise InputError(f"{one.entry.label} is a component already; --undeclare takes that back")
            proposal = propose(one.entry, categories, shares_file=True)
            if args.category:
                proposal = replace(proposal, category=args.category)
            asker = _asker(args.unclear)
            done.append(declare(one, proposal, client, Journal(), schema=schema, ask=asker, check=check))
    _tell(args, extraction, done, [], [one for one in articles if one not in wanted and not one.declared])
    return 1 if any(result.error for result in done) else 0


def _undeclare(args: argparse.Namespace) -> int:
    """Take identities out of the file."""
    from silo.fcstd import unstamp

    articles = [one for one in modelled(args.top, args.assembly) if one.declared]
    path = articles[0].entry.doc_path if articles else os.path.realpath(args.top)
    wanted = chosen(articles, args.undeclare)
    if not args.even_if_open and _now(path):
        raise DocumentError(path, _OPEN)
    names = [name for one in wanted for name in one.objects]
    taken = [name for name in names if unstamp(path, name)]
    if args.json:
        common.print_json({"undeclared": taken})
    else:
        print(f"No component any more: {', '.join(taken)}. The next sync flags the line as unreferenced.")
    return 0


def proposals_for(extraction: Extraction, client: SiloClient, schema: str) -> list[Proposal]:
    """What to register: the components without an item, parts first, and the assembly itself last."""
    wanted = resolve(extraction, client).unregistered
    tree = (extraction.assembly, *extraction.entries)
    return propose_all(wanted, tree, _categories(client, schema)) if wanted else []


def _categories(client: SiloClient, schema: str) -> Categories:
    """A mistake in the site's rules costs proposals, no more; it is said on stderr."""
    from silo.api.activity import rules_text
    from silo.cli.show import plain

    found = client.categories(schema)
    if found.problem:
        print(f"silo-mod: {plain(rules_text(found.problem))}", file=sys.stderr)
    return found


def _never(_path: str) -> bool:
    return False


def _now(path: str) -> bool:
    # Looked at anew for each file: people open files while a long run is under way.
    return open_in_any().has_file(path)


def register_all(
    proposals: Sequence[Proposal],
    client: SiloClient,
    *,
    schema: str,
    ask: Ask = unclear,
    is_open: Callable[[str], bool] = _never,
) -> list[Registration]:
    """Register each; one failure does not stop the rest, unless it concerns all of them.

    is_open
        True for a file that a running FreeCAD has open; it is left alone, and its component is an error.
    """
    from silo.api.policy import ends_run
    from silo.fcstd import check_stampable, stamp

    shared = {proposal.entry.key for proposal in proposals if proposal.shares_file}

    def own_name(entry: BomEntry) -> str | None:
        return entry.object_name if entry.key in shared else None

    def write(entry: BomEntry, identity: str) -> None:
        item = entry.object_name or None
        stamp(entry.doc_path, identity, object_name=own_name(entry), item_object=item)

    def check(entry: BomEntry) -> None:
        item = entry.object_name or None
        if is_open(entry.doc_path):
            raise DocumentError(entry.doc_path, _OPEN)
        check_stampable(entry.doc_path, object_name=own_name(entry), item_object=item)

    journal, done = Journal(), []
    stopped: SiloError | None = None
    for proposal in proposals:
        if stopped is not None:
            done.append(Registration(proposal, error=stopped))
            continue
        if proposal.entry.is_standard:
            result = register_standard(proposal, client, schema=schema)
        else:
            result = register_component(proposal, client, journal, write, schema=schema, check=check, ask=ask)
        stopped = result.error if result.error is not None and ends_run(result.error, client) else None
        done.append(result)
    return done


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


def _guess(proposal: Proposal) -> str:
    return " (a guess)" if proposal.is_guess else ""


def _ask(proposals: Sequence[Proposal], base: str) -> list[Proposal]:
    chosen: list[Proposal] = []
    for number, proposal in enumerate(proposals, start=1):
        where = relative(proposal.entry.doc_path, base)
        what = proposal.entry.standard or f"{where}#{proposal.entry.object_name}"
        question = (
            f"[{number}/{len(proposals)}] {what}: register as "
            f"{proposal.item_type} {proposal.name!r} in category {proposal.category}{_guess(proposal)}? "
            "[Y/n/q/new name] "
        )
        try:
            answer = input(question).strip()
        except EOFError:
            break
        if answer.lower() == "q":
            break
        if answer.lower() in ("n", "no"):
            continue
        chosen.append(proposal if answer.lower() in ("", "y", "yes") else replace(proposal, name=answer))
    return chosen


def _tell(
    args: argparse.Namespace,
    extraction: Extraction,
    done: Sequence[Registration],
    skipped: Sequence[Proposal],
    articles: Sequence[Modelled] = (),
) -> None:
    base = base_of(extraction)
    if args.json:
        common.print_json(
            {
                "registered": [_row(r.proposal, base, r) for r in done if r.error is None],
                "failed": [_row(r.proposal, base, r) for r in done if r.error is not None],
                "unregistered": [_row(p, base) for p in skipped],
                "modelled": [_modelled_row(one, base) for one in articles],
            }
        )
        return
    from silo.cli import show

    out = show.console()
    if not done and not skipped:
        out.print("Every component has its part number already.")
    for result in done:
        name = show.plain(result.proposal.name)
        if result.error is None:
            out.print(f"✓ {result.part_number}  {name}{_guess(result.proposal)}", markup=False)
        else:
            out.print(f"✗ {name}: {show.plain(str(result.error))}", style="red", markup=False)
    for proposal in skipped:
        where = relative(proposal.entry.doc_path, base)
        out.print(f"⚠ {show.plain(where)}: unregistered, left out of the BOM", style="yellow", markup=False)
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


def _row(proposal: Proposal, base: str, result: Registration | None = None) -> Mapping[str, Any]:
    row: dict[str, Any] = {
        "doc_path": relative(proposal.entry.doc_path, base),
        "object": proposal.entry.object_name,
        "standard": proposal.entry.standard,
        "name": proposal.name,
        "item_type": proposal.item_type,
        "category": proposal.category,
        "guess": proposal.is_guess,
    }
    if result is not None and result.error is None:
        row |= {"part_number": result.part_number, "silo_uuid": result.item_id}
    if result is not None and result.error is not None:
        row |= {"error": {"code": result.error.code, "message": str(result.error)}}
    return row
