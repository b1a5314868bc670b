# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod mass``: mass, centre of mass and inertia of a FreeCAD assembly as a whole."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from silo.bom.errors import Exit
from silo.bom.message import message
from silo.cli.connection import client_of
from silo.cli.masses.geometry import read_model
from silo.cli.masses.options import (
    add_bom_options,
    add_geometry_options,
    add_material_options,
    add_push_options,
    add_result_options,
    bom_table,
    check_options,
    material_table,
    need_inertia_extra,
)
from silo.cli.masses.push import push_report
from silo.cli.masses.report import show_report, verdict
from silo.cli.options import add_each, only_with
from silo.cli.reading import read_tops

if TYPE_CHECKING:
    from silo.bom.entry import BomEntry
    from silo.inertia.assembly import Assembly
    from silo.inertia.report import InertiaReport


def add_mass(parser: argparse.ArgumentParser) -> None:
    add_each(
        parser, "top", "--report", "--preview", "--item", metavar="TOP.FCStd", help="the assembly's file"
    )
    add_bom_options(parser)
    add_material_options(parser)
    parser.add_argument(
        "--default-density",
        type=float,
        metavar="RHO",
        help="kg/m³ of parts without a material (default: they count as zero, and are listed)",
    )
    add_geometry_options(parser)
    add_result_options(parser)
    add_push_options(parser)
    # The index is asked only for part numbers.
    only_with(parser, "--push", "--index")


def run_mass(args: argparse.Namespace) -> int:
    """Calculate and show; returns 1 for warnings with --strict, or items that a push did not find."""
    need_inertia_extra()
    # The documents hold identities; their part numbers are the server's, for a preview as well.
    check_options(args, asks_server=args.push)
    from silo.inertia.calculation import calculate
    from silo.inertia.links.link_map import Link, LinkMap
    from silo.inertia.masses import Options
    from silo.inertia.notes import GeometryCode
    from silo.inertia.task import Task

    table = bom_table(args)
    materials = material_table(args)
    assembly = read_model(args.top, args, object_name=args.assembly, hardware=not args.no_hardware)
    name = assembly.name or "assembly"
    # A FreeCAD document is its own BOM: where it states no material, nothing does.
    options = Options(
        args.default_density or 1000.0,
        step_density=True,
        unknown_is_zero=args.default_density is None,
        own_bom=True,
    )
    whole = LinkMap((Link(name, ("**",)),)) if assembly.instances else None
    report = calculate(assembly, table, Task(materials, options, whole, simulated=False))
    if not assembly.instances:
        words = message("the document holds no part with a shape: there is nothing to weigh")
        report.add_warning("", "", words, GeometryCode.NO_GEOMETRY)
    weightless = bool(assembly.instances) and report.total is not None and report.total.mass == 0
    if weightless:
        print(f"silo-mod: {_weightless(assembly)}", file=sys.stderr)
    show_report(args, report, assembly)
    pushed = _push(args, report) if args.push else 0
    return max(pushed, verdict(args, report), Exit.UNDONE if weightless else Exit.DONE)


def _weightless(assembly: Assembly) -> str:
    """Say why the whole weighs nothing, and what to do."""
    return message(
        "{name} weighs 0 kg here, since no part has a material with a density. Give the materials in "
        "FreeCAD, or a BOM with --bom, or --default-density 1000 for a first number",
        name=assembly.name or "assembly",
    )


def _push(args: argparse.Namespace, report: InertiaReport) -> int:
    """Push the masses to the items with the part numbers of the documents' identities; --item replaces that
    of the top assembly.
    """
    from silo.bom.view.folders import base_folder
    from silo.bom_sync.resolved import resolve
    from silo.inertia.geometry.freecad import product_key

    extraction = read_tops(args)[0]
    base = base_folder(extraction)
    with client_of(args) as client:
        resolved = resolve(extraction, client)
    numbers = {
        product_key(
            entry.doc_path, entry.object_name, (entry.standard or "") if entry.is_standard else "", base
        ): entry.part_number
        for entry in _all((*resolved.entries, resolved.assembly))
        if entry.part_number
    }
    args.item = args.item or resolved.assembly.part_number
    return push_report(args, report, numbers)


def _all(entries: Sequence[BomEntry]) -> Iterator[BomEntry]:
    for entry in entries:
        yield entry
        yield from _all(entry.children)
