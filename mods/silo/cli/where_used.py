# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod where-used``: which files of a vault a file is part of, without a server and without FreeCAD."""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping

from silo.bom.errors import InputError
from silo.bom.paths import relative
from silo.cli import common
from silo.cli.common import Commands
from silo.files import documents_in


def register(commands: Commands) -> None:
    """Add the command."""
    parser = common.add_command(
        commands,
        "where-used",
        "show which files of a vault link to a file, and which tops a change of it touches",
        "silo-mod where-used vault/parts/Bracket.FCStd vault/",
    )
    parser.add_argument("part", metavar="PART.FCStd", help="the file; it need not be there any more")
    parser.add_argument(
        "vault", metavar="VAULT", nargs="?", default=".", help="the folder (default: this one)"
    )
    common.add_json_option(parser)
    common.add_reading_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Print the files; those of an unchanged vault are known from the index."""
    from silo.vault.reading import Question

    if not os.path.isdir(args.vault):
        raise InputError(f"{args.vault} is no folder. Name the folder of the vault.")
    base, part = os.path.realpath(args.vault), os.path.realpath(args.part)
    tops = documents_in([base])
    if part not in tops and not os.path.lexists(part) and not os.path.isdir(os.path.dirname(part)):
        raise InputError(f"{args.part}: there is no such file, nor its folder.")
    users: dict[str, set[str]] = {}
    unread = []
    with common.reading_of(args) as reading:
        reading.index.expect(base)
        for top, answer in zip(tops, reading.ask_many(map(Question, tops)), strict=True):
            if "document" in answer.plain:
                unread.append(top)
            for used in answer.known.links:
                users.setdefault(used, set()).add(top)
    direct = sorted(users.get(part, ()))
    above = _above(part, users)
    roots = sorted(top for top in above if not users.get(top))
    if args.json:
        common.print_json(
            {
                "part": relative(part, base),
                "direct": [relative(one, base) for one in direct],
                "all": [relative(one, base) for one in sorted(above)],
                "tops": [relative(one, base) for one in roots],
                "unreadable": [relative(one, base) for one in unread],
            }
        )
        return 1 if unread else 0
    from silo.cli import show

    out = show.console()
    for one in direct:
        out.print(show.plain(relative(one, base)), markup=False)
    if not direct:
        out.print(f"No file of {show.plain(args.vault)} links to it.", markup=False)
    elif roots:
        out.print(
            f"Tops that a change touches: {', '.join(show.plain(relative(one, base)) for one in roots)}"
        )
    for one in unread:
        out.print(
            f"✗ {show.plain(relative(one, base))} could not be read, so nobody knows what it links to.",
            markup=False,
        )
    return 1 if unread else 0


def _above(part: str, users: Mapping[str, set[str]]) -> set[str]:
    """All files that use one, directly or not."""
    found: set[str] = set()
    left = [part]
    while left:
        for user in users.get(left.pop(), ()):
            if user not in found and user != part:
                found.add(user)
                left.append(user)
    return found
