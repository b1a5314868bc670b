# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod bom``: read an assembly's BOM from its files."""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping
from dataclasses import replace

from silo.batch import ask_for_moved
from silo.bom.errors import Exit, InputError, SiloError
from silo.bom.model import BomEntry, Extraction
from silo.bom.paths import relative
from silo.bom.report import base_of, bom_json, flat_json
from silo.bom.resolve import consolidation_findings
from silo.bom_sync import resolve
from silo.cli import common
from silo.cli.common import Commands


def register(commands: Commands) -> None:
    """Add the command."""
    parser = common.add_command(
        commands,
        "bom",
        "show the BOM of a FreeCAD assembly, read from its files without FreeCAD",
        "silo-mod bom examples/gearbox/TopAssembly.FCStd --flat",
    )
    common.add_assembly_options(parser, folders=True)
    parser.add_argument(
        "--flat", action="store_true", help="quantities multiplied down the tree, each part once"
    )
    parser.add_argument(
        "--verify",
        action="store_true",
        help="have freecadcmd compare the BOM with the solids that FreeCAD shows; 1 where they differ",
    )
    parser.add_argument("--resolve", action="store_true", help="ask the server for part numbers and names")
    common.add_json_option(parser)
    common.add_server_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Print the BOM; 1 where an error says that it is not the whole one."""
    if args.verify:
        return _verify(args)
    if os.path.isdir(args.top):
        return _folder(args)
    extraction = common.read_top(args)
    if args.resolve:
        with common.client_of(args) as client:
            common.reach(client, extraction)
            resolved = ask_for_moved(resolve(extraction, client), client)
        known = {entry.key: entry for entry in resolved.unresolved}
        head = _whole(replace(resolved.assembly, children=resolved.entries), known)
        extraction = Extraction(resolved.assembly, head.children, resolved.findings)
    else:
        told = consolidation_findings(extraction.entries)
        extraction = replace(extraction, findings=(*extraction.findings, *told))
    if args.json:
        common.print_json(flat_json(extraction) if args.flat else bom_json(extraction))
        return Exit.UNDONE if extraction.blocked else Exit.DONE
    from silo.cli import show

    out = show.console()
    out.print(show.flat_table(flat_json(extraction)) if args.flat else show.bom_tree(extraction))
    if extraction.findings:
        out.print()
        out.print(show.findings_text(extraction.findings, base_of(extraction)))
    return Exit.UNDONE if extraction.blocked else Exit.DONE


def _folder(args: argparse.Namespace) -> int:
    """Each assembly of a folder with its own lines, children first; 1 where one is not whole."""
    if args.flat or args.resolve:
        raise InputError("--flat and --resolve are for one assembly; name its file.")
    from silo.cli import show

    out, fine, data = show.console(), True, []
    with common.plan_of(args) as (plan, reading, base):
        for node in (node for layer in plan.layers for node in layer):
            found = plan.extraction(node, reading)
            fine = fine and not found.blocked
            if args.json:
                data.append(bom_json(found))
                continue
            out.print(show.bom_tree(found))
            if found.findings:
                out.print(show.findings_text(found.findings, base))
            out.print()
    errors = {relative(top, base): str(error) for top, error in plan.errors.items()}
    if args.json:
        common.print_json({"assemblies": data, "errors": errors})
    for path, words in errors.items() if not args.json else ():
        out.print(f"✗ {show.plain(path)}: {show.plain(words)}", style="red", markup=False)
    return Exit.DONE if fine and not errors else Exit.UNDONE


def _verify(args: argparse.Namespace) -> int:
    """The geometry as witness: the BOM as live FreeCAD has it, against the solids shown."""
    from silo.freecadcmd.run import verify_in_freecad

    ((_, found),) = verify_in_freecad([args.top], args.assembly, hardware=not args.no_hardware)
    if isinstance(found, SiloError):
        raise found
    fine = found.agrees and not found.extraction.blocked
    if args.json:
        common.print_json({**bom_json(found.extraction), "witness": list(found.accounts)})
        return Exit.DONE if fine else Exit.UNDONE
    from silo.cli import show

    out = show.console()
    for account in found.accounts:
        mark = "✓" if account["agrees"] else "✗"
        out.print(f"{mark} {show.plain(account['sentence'])}", markup=False)
    if found.extraction.blocked:
        out.print(show.findings_text(found.extraction.findings, base_of(found.extraction)))
    return Exit.DONE if fine else Exit.UNDONE


def _whole(entry: BomEntry, unresolved: Mapping[tuple[str, str], BomEntry]) -> BomEntry:
    """The entry with all its children again, those without a part number too."""
    found = (*entry.children, *(unresolved.get(child.key, child) for child in entry.unregistered))
    children = (
        replace(_whole(one, unresolved), quantity=child.quantity, level=child.level)
        for one, child in zip(found, (*entry.children, *entry.unregistered), strict=True)
    )
    return replace(entry, children=tuple(children))
