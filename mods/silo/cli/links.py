# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod links``: a link map to start from, as YAML, and a picture with one colour per link."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from silo.bom.errors import InputError
from silo.cli import common
from silo.cli import inertia_common as shared
from silo.cli.common import Commands


def register(commands: Commands) -> None:
    """Add the command."""
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
    shared.add_geometry_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Read, group, write."""
    shared.need_inertia_extra()
    if args.clusters is not None and args.clusters < 1:
        raise InputError(f"--clusters: wanted a number of links above 0, got {args.clusters}")
    if args.clusters is not None and args.urdf:
        raise InputError("--clusters groups by position and --urdf by names; give one of them")
    shared.check_outputs([*args.preview, *([args.out] if args.out else [])], args.preview)
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
    text = as_yaml(start, assembly)
    if claim(assembly, as_map(start, assembly)).members != start.members:
        print(
            f"silo-mod: {args.assembly}: the names of some parts make their lines match other parts as well; "
            "look at the picture (--preview) before you use the map",
            file=sys.stderr,
        )
    for name in args.preview:
        from silo.inertia.preview.write import LinkView, preview_bytes

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
    return 0
