# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod relink``: mend links whose file has moved."""

from __future__ import annotations

import argparse
import os

from silo.bom.errors import DocumentError, InputError, SiloError
from silo.bom.identity import walk_entries
from silo.bom.paths import relative
from silo.cli import common
from silo.cli.common import Commands
from silo.open_in_freecad import open_in_any


def register(commands: Commands) -> None:
    """Add the command."""
    parser = common.add_command(
        commands,
        "relink",
        "let the links of an assembly and its sub-assemblies lead to a file that has moved",
        "silo-mod relink TopAssembly.FCStd --from parts/Bolt.FCStd --to hardware/Bolt.FCStd --dry-run",
    )
    parser.add_argument("top", metavar="TOP.FCStd", help="the assembly's file")
    parser.add_argument(
        "--from",
        dest="old",
        metavar="OLD",
        required=True,
        help="the file that the links record; relative to TOP's folder, as `silo-mod bom` prints it",
    )
    parser.add_argument("--to", dest="new", metavar="NEW", required=True, help="the file that is meant")
    parser.add_argument(
        "--even-if-open",
        action="store_true",
        help="also files that a running FreeCAD has open; whoever saves them there undoes this",
    )
    parser.add_argument("--dry-run", action="store_true", help="show what would change and write nothing")
    common.add_json_option(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Mend the links; 2 where no link records OLD, or NEW does not hold what they want."""
    from silo.fcstd.relink import Relinked, relink

    folder = os.path.dirname(os.path.realpath(args.top))
    paths = _documents(args.top)
    new = _either(folder, args.new)
    done: list[Relinked] = []
    for old in dict.fromkeys((os.path.join(folder, args.old), os.path.abspath(args.old))):
        done = done or relink(
            paths,
            os.path.normpath(old),
            new,
            dry_run=args.dry_run,
            check=_any if args.even_if_open else _closed,
        )
    if not done:
        raise InputError(f"no link of {args.top} and its sub-assemblies records {args.old}; nothing to mend")
    if args.json:
        rows = [
            {"file": relative(one.path, folder), "links": one.links, "objects": list(one.objects)}
            for one in done
        ]
        common.print_json({"dry_run": args.dry_run, "to": relative(new, folder), "files": rows})
        return 0
    from silo.cli import show

    out = show.console()
    for one in done:
        links = "1 link" if one.links == 1 else f"{one.links} links"
        verb = "would lead" if args.dry_run else "now leads" if one.links == 1 else "now lead"
        text = f"✓ {relative(one.path, folder)}: {links} {verb} to {relative(new, folder)}"
        out.print(show.plain(text), markup=False)
    return 0


def _any(_path: str) -> None:
    return


def _closed(path: str) -> None:
    if open_in_any().has_file(path):
        raise DocumentError(
            path,
            "it is open in FreeCAD, and saving it there would undo the change. Close it there, or mend the "
            "links from there (BOM in Silo, Mend links); --even-if-open writes it all the same",
        )


def _documents(top: str) -> list[str]:
    """The files of the tree, as far as they can be read."""
    try:
        extraction = common.read_assembly(top)
    except SiloError:  # such as no assembly in the file: its own links can be mended all the same
        return [top]
    entries = walk_entries(extraction.entries)
    return [top, *(entry.doc_path for entry in entries if not entry.missing and entry.doc_path)]


def _either(folder: str, path: str) -> str:
    beside = os.path.normpath(os.path.join(folder, path))
    return beside if os.path.exists(beside) else os.path.abspath(path)
