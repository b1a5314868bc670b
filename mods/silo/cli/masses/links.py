# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod links``: a link map to start from."""

from __future__ import annotations

import argparse
import sys

from silo.bom.errors import Exit, InputError
from silo.bom.message import message
from silo.cli.json_output import json_text
from silo.cli.masses.geometry import read_model
from silo.cli.masses.options import add_geometry_options, check_scenes, need_inertia_extra
from silo.cli.options import add_each, add_options
from silo.cli.outputs import add_outputs, add_preview
from silo.output_files import NEW


def add_links(parser: argparse.ArgumentParser) -> None:
    add_each(parser, "assembly", "--out", "--preview", metavar="ASSEMBLY", help="a STEP, mesh or FCStd file")
    add_options(parser, {"--urdf FILE": message("give parts to links by the names in this URDF")})
    parser.add_argument(
        "--clusters",
        type=int,
        metavar="N",
        help="make N links of parts that lie together, whatever their names",
    )
    add_preview(parser, message("write the links as a 3D scene (.glb), one colour each; may be repeated"))
    # A map is there to be edited: each that exists is somebody's work.
    add_outputs(parser, {"--out MAP": message("write the map here, not to standard output")}, NEW)
    add_geometry_options(parser)


def run_links(args: argparse.Namespace) -> int:
    """Read the geometry, group it into links, and write the map."""
    need_inertia_extra()
    if args.clusters is not None and args.clusters < 1:
        raise InputError(
            message("--clusters: wanted a number of links above 0, got {clusters}", clusters=args.clusters)
        )
    if args.clusters is not None and args.urdf:
        raise InputError(message("--clusters groups by position and --urdf by names; give one of them"))
    check_scenes(args)
    from silo.inertia.links.claims import ROOT_LINK, claim
    from silo.inertia.links.starting_map import as_map, as_yaml, starting_map
    from silo.inertia.output.whole_file import write_whole
    from silo.inertia.urdf import read_urdf

    urdf = read_urdf(args.urdf) if args.urdf else None
    links, root = (urdf.meshes, urdf.root) if urdf is not None else (None, ROOT_LINK)
    assembly = read_model(args.assembly, args)
    if not assembly.instances:
        raise InputError(
            message("{assembly}: holds no part, so there is nothing to give to links", assembly=args.assembly)
        )
    start = starting_map(assembly, links, root=root, clusters=args.clusters)
    made = as_map(start, assembly)
    if args.json:
        patterns = {link.name: {"parts": list(link.patterns)} for link in made.links}
        text = json_text({"links": patterns}, indent=2) + "\n"
    else:
        text = as_yaml(start, assembly)
    if claim(assembly, made).members != start.members:
        print(
            message(
                "silo-mod: {assembly}: the names of some parts make their lines match other "
                "parts as well; look at the scene (--preview) before you use the map",
                assembly=args.assembly,
            ),
            file=sys.stderr,
        )
    for name in args.preview:
        from silo.drawing.page import LinkView, write_glb

        views = [
            LinkView(link, tuple(assembly.instances[index] for index in ids))
            for link, ids in start.members.items()
        ]
        write_whole(name, write_glb(assembly, views))
    if args.out:
        write_whole(args.out, text.encode("utf-8"))
    else:
        sys.stdout.write(text)
    print(message("{out}: {how}.", out=args.out or "map", how=start.how), file=sys.stderr)
    return Exit.DONE
