# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod bom --verify``: the BOM against the solids that FreeCAD shows."""

from __future__ import annotations

import argparse
import os
import sys
from typing import Any

from silo.bom.errors import InputError, SiloError
from silo.bom.message import message
from silo.bom.view.folders import base_folder
from silo.bom.view.tree_json import bom_json
from silo.cli.json_output import print_json


def verify(args: argparse.Namespace) -> int:
    """Compare the BOM, as live FreeCAD has it, with the solids that FreeCAD shows.

    It asks a FreeCAD that can open all files of the assembly, by the versions that saved them.
    """
    from silo.bom.walk.document import saved_by
    from silo.bom.walk.links import extract
    from silo.bom.walk.roots import choose_assembly
    from silo.fcstd import FcstdDocument, Library
    from silo.freecads.run import freecad_for, run_freecad

    if os.path.isdir(args.top):
        raise InputError(message("--verify is for one file; name the file."))
    with Library() as library:
        extract(choose_assembly(library.open(args.top), args.assembly))
        read = [document for document in library.documents.values() if isinstance(document, FcstdDocument)]
        command, version = freecad_for(max(saved_by(document.ProgramVersion) for document in read))
    print(
        message("Compared in FreeCAD {version} ({command}).", version=version, command=command),
        file=sys.stderr,
    )
    witness: dict[str, list[dict[str, Any]]] = {}
    ((top, error),) = run_freecad(
        [args.top], args.assembly, command=command, hardware=not args.no_hardware, witness=witness
    )
    if isinstance(error, SiloError):
        raise error
    accounts = witness[top]
    differs = error.blocked or not all(account["agrees"] for account in accounts)
    if args.json:
        print_json({**bom_json(error), "witness": accounts})
        return int(differs)
    from silo.cli.bom_display import findings_text
    from silo.cli.terminal import console, plain

    out = console()
    for account in accounts:
        mark = "✓" if account["agrees"] else "✗"
        out.print(f"{mark} {plain(account['sentence'])}", markup=False)
    if error.blocked:
        out.print(findings_text(error.findings, base_folder(error)))
    return int(differs)
