# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod relink``: the links of an assembly, led to a file that has moved."""

from __future__ import annotations

import argparse
import os

from silo.bom.entry import walk_entries
from silo.bom.errors import DocumentError, Exit, InputError, SiloError, counted
from silo.bom.message import message
from silo.bom.walk.document import relative
from silo.cli.json_output import print_json
from silo.cli.options import add_each
from silo.cli.reading import read_assembly


def add_relink(parser: argparse.ArgumentParser) -> None:
    add_each(parser, "top", metavar="TOP.FCStd", help="the assembly's file")
    parser.add_argument(
        "--from",
        dest="old",
        metavar="OLD",
        required=True,
        help="the file that the links record; relative to TOP's folder, as `silo-mod bom` prints it",
    )
    parser.add_argument("--to", dest="new", metavar="NEW", required=True, help="the file that is meant")


def run_relink(args: argparse.Namespace) -> int:
    """Repair the links; returns 2 if no link records OLD, or if NEW does not hold what they want."""
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
        raise InputError(
            message(
                "no link of {top} and its sub-assemblies records {old}; nothing to mend",
                top=args.top,
                old=args.old,
            )
        )
    if args.json:
        rows = [
            {
                "file": relative(relinked.path, folder),
                "links": relinked.links,
                "objects": list(relinked.objects),
            }
            for relinked in done
        ]
        print_json({"dry_run": args.dry_run, "to": relative(new, folder), "files": rows})
        return Exit.DONE
    from silo.cli.terminal import console, plain

    out = console()
    for relinked in done:
        links = counted(relinked.links, "link")
        verb = (
            message("would lead")
            if args.dry_run
            else message("now leads")
            if relinked.links == 1
            else message("now lead")
        )
        text = message(
            "✓ {file}: {links} {verb} to {target}",
            file=relative(relinked.path, folder),
            links=links,
            verb=verb,
            target=relative(new, folder),
        )
        out.print(plain(text), markup=False)
    return Exit.DONE


def _any(_path: str) -> None:
    return


def _closed(path: str) -> None:
    from silo.freecads.open_documents import open_in_any

    if open_in_any().has_file(path):
        raise DocumentError(
            path,
            message(
                "it is open in FreeCAD, and saving it there would undo the change. Close it "
                "there, or mend the links from there (BOM in Silo, Mend links); --even-if-open "
                "writes it anyway"
            ),
        )


def _documents(top: str) -> list[str]:
    """List the files of the tree that can be read."""
    try:
        extraction = read_assembly(top)
    except SiloError:  # such as no assembly in the file: its own links can be repaired anyway
        return [top]
    entries = walk_entries(extraction.entries)
    return [top, *(entry.doc_path for entry in entries if not entry.missing and entry.doc_path)]


def _either(folder: str, path: str) -> str:
    beside = os.path.normpath(os.path.join(folder, path))
    return beside if os.path.exists(beside) else os.path.abspath(path)
