# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod bom``: read an assembly's BOM from its files."""

from __future__ import annotations

import argparse
from dataclasses import replace

from silo.bom.model import Extraction
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
    common.add_assembly_options(parser)
    parser.add_argument(
        "--flat", action="store_true", help="quantities multiplied down the tree, each part once"
    )
    parser.add_argument("--resolve", action="store_true", help="ask the server for part numbers and names")
    common.add_json_option(parser)
    common.add_server_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Print the BOM; 0 also with findings, which are part of the answer."""
    extraction = common.read_assembly(args.top, args.assembly, hardware=not args.no_hardware)
    if args.resolve:
        with common.client_of(args) as client:
            common.reach(client, extraction)
            resolved = resolve(extraction, client)
        unresolved = {entry.key for entry in resolved.unresolved}
        extraction = Extraction(
            resolved.assembly,
            (*resolved.entries, *(entry for entry in extraction.entries if entry.key in unresolved)),
            resolved.findings,
        )
    else:
        told = consolidation_findings(extraction.entries)
        extraction = replace(extraction, findings=(*extraction.findings, *told))
    if args.json:
        common.print_json(flat_json(extraction) if args.flat else bom_json(extraction))
        return 0
    from silo.cli import show

    out = show.console()
    out.print(show.flat_table(flat_json(extraction)) if args.flat else show.bom_tree(extraction))
    if extraction.findings:
        out.print()
        out.print(show.findings_text(extraction.findings, base_of(extraction)))
    return 0
