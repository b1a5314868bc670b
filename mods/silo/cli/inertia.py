# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod inertia``, ``mass`` and ``links``: mass properties of an assembly, by link or as a whole."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from silo.bom.errors import Exit, InputError
from silo.cli import common
from silo.cli import inertia_common as shared
from silo.cli.common import Commands

if TYPE_CHECKING:
    from silo.bom.model import BomEntry
    from silo.inertia.calculator import Task
    from silo.inertia.report import InertiaReport


def register(commands: Commands) -> None:
    """Add the commands."""
    _add_inertia(commands)
    _add_links(commands)
    _add_mass(commands)


FRAMES = ("assembly", "own", "urdf")
SNIPPETS = ("urdf", "sdf", "mjcf")


def _add_inertia(commands: Commands) -> None:
    parser = common.add_command(
        commands,
        "inertia",
        "mass, centre of mass and inertia of each link of a STEP assembly, with masses from a BOM",
        "silo-mod inertia examples/arm/arm.step --bom examples/arm/bom.csv --urdf examples/arm/arm.urdf",
    )
    parser.add_argument(
        "assembly", metavar="ASSEMBLY", help="STEP, mesh (STL, OBJ, 3MF, GLB, PLY) or FCStd file"
    )
    group = parser.add_argument_group("links")
    group.add_argument(
        "--links", metavar="MAP", help="YAML map: link → instance path patterns (see docs/inertia.md)"
    )
    group.add_argument(
        "--loose",
        metavar="LINK",
        help="the link of what no other link claims (without a map: base_link, warned of)",
    )
    group.add_argument(
        "--frame",
        choices=FRAMES,
        help="frame of the numbers: the assembly's, each sub-assembly's own, or the URDF's link frames "
        "(default: urdf with --urdf, else assembly)",
    )
    group.add_argument(
        "--urdf", metavar="FILE", help="write <inertial> into this URDF, the rest of it untouched"
    )
    group.add_argument("--urdf-out", metavar="FILE", help="write the URDF here, and leave --urdf as it is")
    group.add_argument(
        "--snippet",
        choices=SNIPPETS,
        help="print a file of the links with their <inertial> and nothing else; joints and shapes are yours",
    )
    shared.add_bom_options(parser)
    shared.add_material_options(parser)
    parser.add_argument(
        "--default-density",
        type=float,
        default=1000.0,
        metavar="RHO",
        help="kg/m³ of parts that the BOM lacks (default: 1000)",
    )
    parser.add_argument(
        "--density-from-step", action="store_true", help="use densities in the file before the default one"
    )
    shared.add_geometry_options(parser)
    shared.add_result_options(parser)
    shared.add_push_options(parser)
    parser.set_defaults(run=run_inertia)


def run_inertia(args: argparse.Namespace) -> int:
    """Calculate and show; 1 for warnings with --strict, or items that a push did not find."""
    shared.need_inertia_extra()
    shared.check_options(args, asks_server=args.push and not args.dry_run)
    if args.urdf_out and not args.urdf:
        raise InputError("--urdf-out needs --urdf, the file to start from")
    if args.snippet and args.json:
        raise InputError("--snippet and --json both go to standard output; use --report OUT.json")
    from silo.inertia.calculator import calculate

    # The small files first: a mistake in them should not cost the reading of the geometry.
    parser = shared.bom_parser(args)
    table = parser.parse(args.bom) if args.bom else None
    task = _task(args)
    assembly = shared.read(args.assembly, args)
    report = calculate(assembly, table, task)
    # What was found is shown first: where a link is refused, that is what explains it.
    shared.show(args, report, assembly, quiet=bool(args.snippet))
    if args.snippet:
        _print_snippet(args.snippet, report)
    if args.urdf:
        _write_urdf(args, report)
    pushed = shared.push_report(args, report) if args.push else 0
    return max(pushed, shared.verdict(args, report))


def _task(args: argparse.Namespace) -> Task:
    from silo.inertia.calculator import Task
    from silo.inertia.links import ROOT_LINK, FrameChoice, read_link_map
    from silo.inertia.massrule import Options
    from silo.inertia.output.urdf import frame_doubts, link_names, read_urdf, root_link, urdf_frames

    frame = FrameChoice(args.frame or ("urdf" if args.urdf else "assembly"))
    frames, root = None, ROOT_LINK
    doubts: tuple[str, ...] = ()
    if frame is FrameChoice.URDF and not args.urdf:
        raise InputError("--frame urdf needs --urdf FILE, whose joints say where the link frames are")
    if args.urdf:
        data = read_urdf(args.urdf)
        link_names(data, args.urdf)  # a file that cannot be filled is reported before anything else is read
        try:
            frames, root = urdf_frames(data, args.urdf), root_link(data, args.urdf)
            doubts = frame_doubts(data, args.urdf)
        except InputError:
            # A xacro that is not expanded has no frames; who named another one does without the comparison.
            if frame is FrameChoice.URDF:
                raise
    return Task(
        shared.material_table(args),
        Options(args.default_density, args.density_from_step),
        read_link_map(args.links) if args.links else None,
        frame,
        frames,
        doubts,
        args.loose,
        root,
    )


def _write_urdf(args: argparse.Namespace, report: InertiaReport) -> None:
    from silo.inertia.output.urdf import write_urdf
    from silo.inertia.output.values import writable

    links = writable(report.links.values())
    filled = write_urdf(args.urdf, links, args.urdf_out)
    if not filled.written:
        raise InputError(
            f"{args.urdf}: none of its links ({shared.names_of(filled.untouched)}) is one of ours "
            f"({shared.names_of(tuple(report.links))}); a link map with --links gives them the URDF's names"
        )
    target = args.urdf_out or args.urdf
    print(f"{target}: wrote the inertia of {shared.names_of(filled.written)}.", file=sys.stderr)
    if filled.absent:
        print(f"{target}: has no link {shared.names_of(filled.absent)}.", file=sys.stderr)
    left = [name for name in filled.untouched if name not in report.links]
    if left:
        print(f"{target}: left as they were, no link of ours: {shared.names_of(left)}.", file=sys.stderr)
    massless = [name for name in report.links if name not in links]
    if massless:
        print(f"{target}: not written, without mass: {shared.names_of(massless)}.", file=sys.stderr)


def _print_snippet(kind: str, report: InertiaReport) -> None:
    from silo.cli.show import plain
    from silo.inertia.output.snippets import document
    from silo.inertia.output.values import writable

    text = document(writable(report.links.values()), kind, report.assembly)
    # A file that says nothing of its encoding is UTF-8; a pipe of another code page gets ASCII.
    utf8 = (sys.stdout.encoding or "ascii").lower().replace("-", "") == "utf8"
    sys.stdout.write(text if utf8 else text.encode("ascii", "xmlcharrefreplace").decode())
    # The elements do not say it themselves, and in another frame than the link's they are wrong.
    for name, link in report.links.items():
        print(f"{plain(name)}: frame of the numbers: {plain(link.frame.description)}", file=sys.stderr)


def _add_links(commands: Commands) -> None:
    parser = common.add_command(
        commands,
        "links",
        "a link map to start from: which part of an assembly belongs to which link of the robot",
        "silo-mod links examples/arm/arm.step --urdf examples/arm/arm.urdf > map.yaml",
    )
    parser.add_argument(
        "assembly", metavar="ASSEMBLY", help="STEP, mesh (STL, OBJ, 3MF, GLB, PLY) or FCStd file"
    )
    parser.add_argument("--urdf", metavar="FILE", help="give parts to links by the names in this URDF")
    parser.add_argument(
        "--clusters",
        type=int,
        metavar="N",
        help="make N links of parts that lie together, whatever their names",
    )
    parser.add_argument(
        "--preview",
        action="append",
        default=[],
        metavar="OUT",
        help="draw the links, one colour each: .png or .glb; may be repeated",
    )
    parser.add_argument("--out", metavar="MAP", help="write the map here, not to standard output")
    common.add_json_option(parser)
    shared.add_geometry_options(parser)
    parser.set_defaults(run=run_links)


def run_links(args: argparse.Namespace) -> int:
    """Read, group, write."""
    shared.need_inertia_extra()
    if args.clusters is not None and args.clusters < 1:
        raise InputError(f"--clusters: wanted a number of links above 0, got {args.clusters}")
    if args.clusters is not None and args.urdf:
        raise InputError("--clusters groups by position and --urdf by names; give one of them")
    shared.check_outputs(args)
    from silo.inertia.links import ROOT_LINK, claim
    from silo.inertia.output.files import write_whole
    from silo.inertia.output.urdf import link_meshes, read_urdf, root_link
    from silo.inertia.starting_map import as_map, as_yaml, starting_map

    links, root = None, ROOT_LINK
    if args.urdf:
        data = read_urdf(args.urdf)
        links, root = link_meshes(data, args.urdf), root_link(data, args.urdf)
    assembly = shared.read(args.assembly, args)
    if not assembly.instances:
        raise InputError(f"{args.assembly}: holds no part, so there is nothing to give to links")
    start = starting_map(assembly, links, root=root, clusters=args.clusters)
    made = as_map(start, assembly)
    if args.json:
        patterns = {link.name: {"parts": list(link.patterns)} for link in made.links}
        text = common.json_text({"links": patterns}, indent=2) + "\n"
    else:
        text = as_yaml(start, assembly)
    if claim(assembly, made).members != start.members:
        print(
            f"silo-mod: {args.assembly}: the names of some parts make their lines match other parts as well; "
            "look at the picture (--preview) before you use the map",
            file=sys.stderr,
        )
    for name in args.preview:
        from silo.inertia.preview.picture import preview_bytes
        from silo.inertia.preview.scene import LinkView

        views = [
            LinkView(link, tuple(assembly.instances[index] for index in ids))
            for link, ids in start.members.items()
        ]
        write_whole(name, preview_bytes(assembly, views, Path(name).suffix))
    if args.out:
        write_whole(args.out, text.encode("utf-8"))
    else:
        sys.stdout.write(text)
    print(f"{args.out or 'map'}: {start.how}.", file=sys.stderr)
    return Exit.DONE


def _add_mass(commands: Commands) -> None:
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
    # FreeCAD reads its own documents, in one process, afresh. The index is asked only for part numbers.
    common.not_with(parser, "--via", "--mesh-unit", "--jobs", "--no-siblings", "--no-cache")
    common.only_with(parser, "--push", "--index", "--no-index")
    parser.set_defaults(run=run_mass)


def run_mass(args: argparse.Namespace) -> int:
    """Calculate and show; 1 for warnings with --strict, or items that a push did not find."""
    shared.need_inertia_extra(args.via)
    # The documents hold identities; their part numbers are the server's, for a preview as well.
    shared.check_options(args, asks_server=args.push)
    from silo.inertia.calculator import Task, calculate
    from silo.inertia.links import Link, LinkMap
    from silo.inertia.massrule import Options
    from silo.inertia.model import GeometryCode

    parser = shared.bom_parser(args)
    table = parser.parse(args.bom) if args.bom else None
    materials = shared.material_table(args)
    assembly = shared.read(
        args.top, args, via=args.via, object_name=args.assembly, hardware=not args.no_hardware
    )
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
    from silo.bom.report import base_of
    from silo.bom_sync import resolve
    from silo.inertia.geometry.freecad.walk import product_key

    extraction = common.read_top(args)
    base = base_of(extraction)
    with common.client_of(args) as client:
        resolved = resolve(extraction, client)
    numbers = {
        product_key(
            entry.doc_path, entry.object_name, (entry.standard or "") if entry.is_standard else "", base
        ): entry.part_number
        for entry in _all((*resolved.entries, resolved.assembly))
        if entry.part_number
    }
    args.item = args.item or resolved.assembly.part_number
    return shared.push_report(args, report, numbers)


def _all(entries: Sequence[BomEntry]) -> Iterator[BomEntry]:
    for entry in entries:
        yield entry
        yield from _all(entry.children)
