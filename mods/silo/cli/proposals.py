# SPDX-License-Identifier: LGPL-2.1-or-later
"""The proposal to run a command again for the same file, with what its run was given."""

from __future__ import annotations

import argparse
from pathlib import Path

from silo.proposed_command import proposed

# What decides which parts and which server the run is about. A token stays out of every message.
_KEPT = ("--assembly", "--server", "--schema", "--no-hardware", "--even-if-open")


def proposed_again(args: argparse.Namespace, *words: str | Path) -> str:
    """Propose this command once more, with other ``words`` behind its file."""
    kept: list[str] = []
    for option in _KEPT:
        action = args.parser._option_string_actions.get(option)
        if action is None or (value := getattr(args, action.dest)) == action.default:
            continue
        # With = a value that begins with a dash is no option.
        kept += [option] if action.nargs == 0 else [f"{option}={value}"]
    return proposed(args.command, Path(args.top), *words, *kept)
