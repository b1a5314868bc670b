# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod inertia``: mass, centre of mass and inertia tensor per link, from a STEP assembly and a BOM."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

from silo.bom.errors import InputError
from silo.cli import common
from silo.cli import inertia_common as shared
from silo.cli.common import Commands

if TYPE_CHECKING:
    from silo.inertia.calculator import Task
    from silo.inertia.report import InertiaReport

FRAMES = ("assembly", "own", "urdf")
SNIPPETS = ("urdf", "sdf", "mjcf")


def register(commands: Commands) -> None:
    """Add the command."""
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
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
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
    from silo.inertia.frames import FrameChoice
    from silo.inertia.links import ROOT_LINK, read_link_map
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
