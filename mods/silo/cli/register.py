# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod register``: items for components without a number, and the identity into their files."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from silo.bom.errors import InputError
from silo.bom.model import BomEntry, Extraction
from silo.bom.naming import Proposal, crowded_files, propose
from silo.bom.report import base_of, relative
from silo.bom_sync import resolve
from silo.cli import common
from silo.cli.common import Commands
from silo.registration import Journal, Registration
from silo.registration import register as register_component

if TYPE_CHECKING:
    from silo.api.client import SiloClient


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
    parser.add_argument("--schema", default="kindred-rd", help="part number schema (default: kindred-rd)")
    parser.add_argument("--category", help="this category for every part (assemblies keep theirs)")
    common.add_json_option(parser)
    common.add_server_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Register what is unregistered; 1 where something was skipped or failed."""
    if not args.yes and not sys.stdin.isatty():
        raise InputError("register asks before it creates items, and there is nobody to ask here; say --yes")
    extraction = common.read_assembly(args.top, args.assembly)
    with common.client_of(args) as client:
        proposals = proposals_for(extraction, client, args.schema)
        if args.category:
            proposals = [p if p.entry.is_assembly else replace(p, category=args.category) for p in proposals]
        chosen = proposals if args.yes else _ask(proposals, base_of(extraction))
        done = register_all(chosen, extraction, client, schema=args.schema)
    skipped = [p for p in proposals if p not in chosen]
    _tell(args, extraction, done, skipped)
    return 1 if skipped or any(r.error for r in done) else 0


def proposals_for(extraction: Extraction, client: SiloClient, schema: str) -> list[Proposal]:
    """What to register: the components without an item, parts first, and the assembly itself last."""
    resolved = resolve(extraction, client)
    wanted = list(resolved.unresolved)
    if resolved.assembly.part_number is None:
        wanted.append(extraction.assembly)
    if not wanted:
        return []
    categories = client.categories(schema)
    crowded = crowded_files((extraction.assembly, *extraction.entries))
    parts_first = sorted(wanted, key=lambda entry: (entry.is_assembly, -entry.level))
    return [propose(entry, categories, shares_file=entry.doc_path in crowded) for entry in parts_first]


def register_all(
    proposals: Sequence[Proposal], extraction: Extraction, client: SiloClient, *, schema: str
) -> list[Registration]:
    """Register each; one failure does not stop the rest."""
    from silo.fcstd import stamp
    from silo.folders import data_folder

    crowded = crowded_files((extraction.assembly, *extraction.entries))
    journal = Journal(data_folder() / "registrations.json")

    def write(entry: BomEntry, identity: str) -> None:
        name = entry.object_name if entry.doc_path in crowded else None
        stamp(entry.doc_path, identity, object_name=name)

    return [register_component(p, client, journal, write, schema=schema) for p in proposals]


def _ask(proposals: Sequence[Proposal], base: str) -> list[Proposal]:
    chosen: list[Proposal] = []
    for number, proposal in enumerate(proposals, start=1):
        where = relative(proposal.entry.doc_path, base)
        question = (
            f"[{number}/{len(proposals)}] {where}#{proposal.entry.object_name}: register as "
            f"{proposal.item_type} {proposal.name!r} in category {proposal.category}? [Y/n/q/new name] "
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
) -> None:
    base = base_of(extraction)
    if args.json:
        common.print_json(
            {
                "registered": [_row(r.proposal, base, r) for r in done if r.error is None],
                "failed": [_row(r.proposal, base, r) for r in done if r.error is not None],
                "unregistered": [_row(p, base) for p in skipped],
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
            out.print(f"✓ {result.part_number}  {name}", markup=False)
        else:
            out.print(f"✗ {name}: {show.plain(str(result.error))}", style="red", markup=False)
    for proposal in skipped:
        where = relative(proposal.entry.doc_path, base)
        out.print(f"⚠ {show.plain(where)}: unregistered, left out of the BOM", style="yellow", markup=False)


def _row(proposal: Proposal, base: str, result: Registration | None = None) -> Mapping[str, Any]:
    row: dict[str, Any] = {
        "doc_path": relative(proposal.entry.doc_path, base),
        "object": proposal.entry.object_name,
        "name": proposal.name,
        "item_type": proposal.item_type,
        "category": proposal.category,
    }
    if result is not None and result.error is None:
        row |= {"part_number": result.part_number, "silo_uuid": result.item_id}
    if result is not None and result.error is not None:
        row |= {"error": {"code": result.error.code, "message": str(result.error)}}
    return row
