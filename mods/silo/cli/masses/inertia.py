# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod inertia``: mass, centre of mass and inertia of each link of an assembly."""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from silo import spoken
from silo.bom.errors import InputError, listed
from silo.bom.message import message
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
    named_values,
    need_inertia_extra,
)
from silo.cli.masses.push import push_report
from silo.cli.masses.report import show_report, verdict
from silo.cli.options import add_each, add_options
from silo.cli.outputs import add_outputs
from silo.output_files import beginning

if TYPE_CHECKING:
    from silo.inertia.report import InertiaReport
    from silo.inertia.task import Task
    from silo.inertia.urdf import Urdf


FRAMES = ("assembly", "own", "urdf")

SNIPPETS = ("urdf", "sdf", "mjcf")


def add_inertia(parser: argparse.ArgumentParser) -> None:
    add_each(
        parser,
        "assembly",
        "--report",
        "--preview",
        "--item",
        "--urdf-out",
        "--in-place",
        metavar="ASSEMBLY",
        help="a STEP, mesh or FCStd file, or a URDF or MJCF file with its meshes",
    )
    group = parser.add_argument_group("links")
    add_options(
        group,
        {
            "--links MAP": "YAML map: link → instance path patterns (see docs/inertia.md)",
            "--loose LINK": "the link of what no other link claims (without a map: base_link, warned of)",
            "--mass NAME=MASS...": (
                "what a scale says of a link, or of each component of a pattern, for example "
                "arm=1.25kg; its parts are scaled to it; may be repeated"
            ),
        },
    )
    group.add_argument(
        "--frame",
        choices=FRAMES,
        help="frame of the numbers: the assembly's, each sub-assembly's own, or the URDF's link frames "
        "(default: urdf with --urdf, else assembly)",
    )
    add_options(
        group,
        {
            "--urdf FILE": "take names and frames of the links from this URDF, to fill it",
            "--joint NAME=POSITION...": (
                "the position of a joint of the URDF [rad or m] in which the geometry was exported, for "
                "example elbow=0.52; 0 for the others; may be repeated"
            ),
            "--in-place": "write the <inertial> into the --urdf itself",
        },
    )
    text = "write the URDF with its <inertial> here, the rest of it untouched"
    add_outputs(parser, {"--urdf-out FILE": text}, beginning("a URDF", "<(?:robot|mujoco)[ >]"), group)
    group.add_argument(
        "--snippet",
        choices=SNIPPETS,
        help="print a file of the links with their <inertial> and nothing else; joints and shapes are yours",
    )
    add_bom_options(parser)
    add_material_options(parser)
    parser.add_argument(
        "--default-density",
        type=float,
        default=1000.0,
        metavar="RHO",
        help="kg/m³ of parts that the BOM lacks (default: 1000)",
    )
    add_options(parser, {"--density-from-step": "use densities in the file before the default one"})
    add_geometry_options(parser)
    add_result_options(parser)
    add_push_options(parser)


def run_inertia(args: argparse.Namespace) -> int:
    """Calculate and show; returns 1 for warnings with --strict, or items that a push did not find."""
    need_inertia_extra()
    check_options(args, asks_server=args.push and not args.dry_run)
    from silo.inertia.xacro_files import refuse_writing

    if not args.urdf and is_urdf(args.assembly):
        args.urdf = args.assembly
    if (args.urdf_out or args.in_place) and not args.urdf:
        raise InputError("--urdf-out and --in-place do nothing without --urdf, or a URDF as ASSEMBLY")
    if args.urdf_out and args.in_place:
        raise InputError("--urdf-out and --in-place name two places for one URDF; give one of them")
    for written in (args.urdf if args.in_place else None, args.urdf_out):
        if written:
            refuse_writing(Path(written))
    if args.snippet and args.json:
        raise InputError("--snippet and --json both go to standard output; use --report FILE.json")
    from silo.inertia.calculation import calculate

    # The small files first: a mistake in them should not cost the reading of the geometry.
    table = bom_table(args)
    task = _task(args)
    if args.urdf_out and task.urdf is not None:
        _refuse_another_robot(args.urdf_out, task.urdf)
    assembly = read_model(args.assembly, args)
    report = calculate(assembly, table, task)
    # What was found is shown first: where a link is refused, that is what explains it.
    show_report(args, report, assembly, quiet=bool(args.snippet))
    if args.snippet:
        _print_snippet(args.snippet, report)
    if task.urdf is not None:
        _write_urdf(args, report, task.urdf)
    pushed = push_report(args, report) if args.push else 0
    return max(pushed, verdict(args, report))


def _task(args: argparse.Namespace) -> Task:
    from silo.inertia.links.frames import FrameChoice
    from silo.inertia.links.link_map import read_link_map
    from silo.inertia.masses import Options
    from silo.inertia.task import Task

    frame = FrameChoice(args.frame or ("urdf" if args.urdf else "assembly"))
    if frame is FrameChoice.URDF and not args.urdf:
        raise InputError("--frame urdf needs --urdf FILE, whose joints say where the link frames are")
    return Task(
        material_table(args),
        Options(args.default_density, args.density_from_step),
        read_link_map(args.links) if args.links else None,
        frame,
        _urdf(args),
        args.loose,
        weights=named_values(args.mass, "--mass", "NAME=MASS, for example arm=1.25kg"),
    )


def _urdf(args: argparse.Namespace) -> Urdf | None:
    from silo.inertia.urdf import read_urdf

    pose = {}
    for name, text in named_values(args.joint, "--joint", "NAME=POSITION, for example elbow=0.52").items():
        try:
            pose[name] = float(text)
        except ValueError:
            pose[name] = math.nan
        if not math.isfinite(pose[name]):
            raise InputError(
                message("--joint {name}: wanted a position in rad or m, got “{text}”", name=name, text=text)
            )
    if not args.urdf:
        if pose:
            raise InputError(message("--joint needs --urdf FILE, whose joints it moves"))
        return None
    urdf = read_urdf(args.urdf)
    if pose and urdf.source == args.assembly:
        raise InputError(
            message("--joint is for geometry beside a URDF; the meshes of a URDF move with its links")
        )
    return urdf.at(pose) if pose else urdf


def _refuse_another_robot(path: str, urdf: Urdf) -> None:
    """Raise InputError if a URDF of another robot is at the place of the one that is written."""
    from silo.inertia.urdf import read_urdf

    if not Path(path).is_file() or not Path(path).stat().st_size:
        return
    there = read_urdf(path)
    if there.robot != urdf.robot or not set(there.names) & set(urdf.names):
        raise InputError(
            message(
                "{path} is the URDF of another robot, {name}; remove it, or give --urdf-out another name",
                path=path,
                name=there.robot or "?",
            )
        )


def is_urdf(path: str) -> bool:
    """Return True if the geometry is a URDF or MJCF file, which then is also the file to fill."""
    from silo.inertia.geometry.formats import Format, detect

    return Path(path).is_file() and detect(Path(path)) in (Format.URDF, Format.MJCF)


def _write_urdf(args: argparse.Namespace, report: InertiaReport, urdf: Urdf) -> None:
    from silo.inertia.output.accepted import writable
    from silo.inertia.urdf import write_urdf

    links = writable(report.links.values())
    target = args.urdf if args.in_place else args.urdf_out
    filled = write_urdf(urdf, links, target)
    if not filled.written:
        raise InputError(
            f"{args.urdf}: none of its links ({listed(filled.untouched, 8)}) is one of ours "
            f"({listed(tuple(report.links), 8)}); a link map with --links gives them the URDF's names"
        )
    if target is None:
        print(f"{args.urdf}: not written; --urdf-out FILE or --in-place says where to", file=sys.stderr)
        return
    print(f"{target}: wrote the inertia of {listed(filled.written, 8)}.", file=sys.stderr)
    if (fused := urdf.fused_base) and set(fused) & set(filled.written):
        note = message(
            "To compare: MuJoCo merges {links} into its static world and shows no mass of them, unless the "
            'URDF says <mujoco><compiler fusestatic="false"/></mujoco>.',
            links=listed(fused, 8),
        )
        print(spoken(note), file=sys.stderr)
    left = [name for name in filled.untouched if name not in report.links]
    if left:
        print(f"{target}: left as they were, no link of ours: {listed(left, 8)}.", file=sys.stderr)
    massless = [name for name in report.links if name not in links]
    if massless:
        print(f"{target}: not written, without mass: {listed(massless, 8)}.", file=sys.stderr)


def _print_snippet(kind: str, report: InertiaReport) -> None:
    from silo.cli.terminal import plain
    from silo.inertia.output.accepted import writable
    from silo.inertia.output.snippets import document

    text = document(writable(report.links.values()), kind, report.assembly)
    # A file that says nothing of its encoding is UTF-8; a pipe of another code page gets ASCII.
    utf8 = (sys.stdout.encoding or "ascii").lower().replace("-", "") == "utf8"
    sys.stdout.write(text if utf8 else text.encode("ascii", "xmlcharrefreplace").decode())
    # The elements do not say it themselves, and in another frame than the link's they are wrong.
    for name, link in report.links.items():
        print(f"{plain(name)}: frame of the numbers: {plain(link.frame.description)}", file=sys.stderr)
