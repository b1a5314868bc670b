# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod install-addon``: the add-on into a FreeCAD found on this machine."""

from __future__ import annotations

import argparse
from pathlib import Path

from silo.cli import common
from silo.cli.common import Commands


def register(commands: Commands) -> None:
    """Add the command."""
    parser = common.add_command(
        commands,
        "install-addon",
        "put the add-on and its Python packages into a FreeCAD found on this machine",
        "silo-mod install-addon --freecadcmd /usr/bin/freecadcmd",
    )
    parser.add_argument("--freecadcmd", metavar="PATH", help="freecadcmd (default: found on the PATH)")
    parser.add_argument("--freecad-data", metavar="DIR", help="its data folder (default: FreeCAD is asked)")
    parser.add_argument("--copy", action="store_true", help="copy the add-on, do not link to this checkout")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Install, and say where."""
    from silo.addon_install import ask_freecad, install_folder, install_packages

    place = ask_freecad(args.freecadcmd, Path(args.freecad_data) if args.freecad_data else None)
    print("FreeCAD {}.{} with Python {}.{}".format(*place.freecad, *place.python))
    print(f"Add-on:   {install_folder(place, copy=args.copy)}")
    print(f"Packages: {install_packages(place)}")
    print("Start FreeCAD again, and choose the workbench Silo.")
    return 0
