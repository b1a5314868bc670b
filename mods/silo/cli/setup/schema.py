# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod schema``: the JSON Schema of what a command prints with ``--json``."""

from __future__ import annotations

import argparse

from silo.bom.errors import Exit, InputError
from silo.bom.message import message
from silo.cli.json_output import print_json, print_json_list


def add_schema(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="COMMAND", nargs="?", help="the command (default: list them)")


def run_schema(args: argparse.Namespace) -> int:
    """Print one schema, or the names of all."""
    from silo.cli.json_schemas import NAMES, schema_of

    if args.name is not None:
        if args.name not in NAMES:
            raise InputError(
                message(
                    "there is no schema {name}; there are: {names}",
                    name=repr(args.name),
                    names=", ".join(NAMES),
                )
            )
        print_json(schema_of(args.name))
    elif args.json:
        print_json_list(NAMES)
    else:
        print("\n".join(NAMES))
    return Exit.DONE
