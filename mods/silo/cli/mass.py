# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod mass``: the mass of a FreeCAD assembly, rolled up from its parts' shapes and materials."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from silo.bom.errors import InputError
from silo.cli import common
from silo.cli import inertia_common as shared
from silo.cli.common import Commands

if TYPE_CHECKING:
    from silo.bom.model import BomEntry
    from silo.inertia.report import InertiaReport


def register(commands: Commands) -> None:
    """Add the command."""
    parser = common.add_command(
        commands,
        "mass",
        "mass, centre of mass and inertia of a FreeCAD assembly, from its parts' shapes and materials",
        "silo-mod mass TopAssembly.FCStd --push",
    )
    common.add_assembly_options(parser)
    shared.add_bom_options(parser)
    shared.add_material_options(parser)
    parser.add_argument(
        "--default-density",
        type=float,
        metavar="RHO",
        help="kg/m³ of parts without a material (default: they count as zero, and are listed)",
    )
    parser.add_argument(
        "--via",
        choices=("files", "freecad"),
        default="files",
        help="read the files directly (default), or let freecadcmd open and measure them",
    )
    shared.add_geometry_options(parser)
    shared.add_result_options(parser)
    shared.add_push_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Calculate and show; 1 for warnings with --strict, or items that a push did not find."""
    shared.need_inertia_extra(args.via)
    if args.no_hardware:
        raise InputError(
            "mass weighs every part that is there; --no-hardware cannot leave standard parts out"
        )
    # The documents hold identities; their part numbers are the server's, for a preview as well.
    shared.check_options(args, asks_server=args.push)
    from silo.inertia.calculator import Task, calculate
    from silo.inertia.links import Link, LinkMap
    from silo.inertia.massrule import Options
    from silo.inertia.model import GeometryCode

    parser = shared.bom_parser(args)
    table = parser.parse(args.bom) if args.bom else None
    materials = shared.material_table(args)
    assembly = shared.read(args.top, args, via=args.via, object_name=args.assembly)
    name = assembly.name or "assembly"
    # A FreeCAD document is its own BOM: where it states no material, nobody does.
    options = Options(
        args.default_density or 1000.0,
        step_density=True,
        unknown_is_zero=args.default_density is None,
        own_bom=True,
    )
    whole = LinkMap((Link(name, ("**",)),)) if assembly.instances else None
    report = calculate(assembly, table, Task(materials, options, whole, simulated=False))
    if not assembly.instances:
        words = "the document holds no part with a shape: there is nothing to weigh"
        report.add_warning("", "", words, GeometryCode.NO_GEOMETRY)
    shared.show(args, report, assembly)
    pushed = _push(args, report) if args.push else 0
    return max(pushed, shared.verdict(args, report))


def _push(args: argparse.Namespace, report: InertiaReport) -> int:
    """The documents' identities give the part numbers; the top assembly's own, unless --item says another."""
    from silo.bom.paths import relative
    from silo.bom.report import base_of
    from silo.bom_sync import resolve

    extraction = common.read_top(args)
    base = base_of(extraction)
    with common.client_of(args) as client:
        resolved = resolve(extraction, client)
    numbers = {
        f"{relative(entry.doc_path, base)}#{entry.object_name}": entry.part_number
        for entry in _all((*resolved.entries, resolved.assembly))
        if entry.part_number
    }
    args.item = args.item or resolved.assembly.part_number
    return shared.push_report(args, report, numbers)


def _all(entries: Sequence[BomEntry]) -> Iterator[BomEntry]:
    for entry in entries:
        yield entry
        yield from _all(entry.children)
