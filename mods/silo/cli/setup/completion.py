# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod completion``: the script that completes commands and options in a shell."""

from __future__ import annotations

import argparse

from silo.bom.errors import ConfigError, Exit


def add_completion(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("shell", choices=("bash", "zsh", "tcsh"))


def run_completion(args: argparse.Namespace) -> int:
    """Print the script of a shell. ConfigError if shtab is not installed."""
    try:
        import shtab
    except ImportError:
        raise ConfigError("completion needs the package shtab: pip install 'silo-mod[completion]'") from None
    from silo.cli.parser import build_parser

    print(shtab.complete(build_parser(), args.shell))
    return Exit.DONE
