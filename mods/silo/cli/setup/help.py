# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod help``: the commands by theme, or the options of one command."""

from __future__ import annotations

import argparse

from silo.bom.errors import Exit, InputError, did_you_mean
from silo.bom.message import message


def add_help(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="COMMAND", nargs="?", help="the command (default: list them)")


def run_help(args: argparse.Namespace) -> int:
    """Print the help of a command as its ``--help`` does, or that of the program."""
    from silo.cli.command_table import THEMES
    from silo.cli.parser import build_parser, command_parsers

    if args.name is None:
        build_parser(()).print_help()
        return Exit.DONE
    known = [name for names in THEMES.values() for name in names]
    if args.name not in known:
        text = message("there is no command {name}", name=args.name)
        raise InputError(text + did_you_mean(args.name, known))
    command_parsers(build_parser((args.name,)))[args.name].print_help()
    return Exit.DONE
