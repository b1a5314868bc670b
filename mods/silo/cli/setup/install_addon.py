# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod install-addon``: the add-on and its Python packages, put into a FreeCAD of this machine."""

from __future__ import annotations

import argparse
from pathlib import Path

from silo import spoken
from silo.bom.errors import Exit
from silo.bom.message import message
from silo.cli.json_output import print_json
from silo.cli.options import add_options


def add_install_addon(parser: argparse.ArgumentParser) -> None:
    add_options(
        parser,
        {
            "--freecadcmd PATH": message("freecadcmd (default: found on the PATH)"),
            "--freecad-data DIR": message("its data folder (default: FreeCAD is asked)"),
            "--copy": message("copy the add-on, do not link to this checkout"),
        },
    )


def run_install_addon(args: argparse.Namespace) -> int:
    """Install the add-on, and print where it is."""
    from silo.freecads.addon import ask_freecad, install_folder, install_packages

    place = ask_freecad(args.freecadcmd, Path(args.freecad_data) if args.freecad_data else None)
    report = {
        "freecad": "FreeCAD {}.{} with Python {}.{}".format(*place.freecad, *place.python),
        "addon": str(install_folder(place, copy=args.copy)),
        "packages": str(install_packages(place)),
    }
    if args.json:
        print_json(report)
    else:
        text = message(
            "{freecad}\nAdd-on:   {addon}\nPackages: {packages}",
            freecad=report["freecad"],
            addon=report["addon"],
            packages=report["packages"],
        )
        print(spoken(message("{text}\nStart FreeCAD again, and choose the workbench Silo.", text=text)))
    return Exit.DONE
