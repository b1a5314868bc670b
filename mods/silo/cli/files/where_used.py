# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod where-used``: the files of a folder that link to a file, and the tops that a change touches."""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping

from silo.bom.errors import Exit, InputError, did_you_mean
from silo.bom.message import message
from silo.bom.walk.document import relative
from silo.cli.json_output import print_json
from silo.cli.options import add_each
from silo.cli.progress import count_steps
from silo.cli.reading import reading_of
from silo.files import documents_in


def add_where_used(parser: argparse.ArgumentParser) -> None:
    text = message("the file; it need not be there any more")
    add_each(parser, "part", metavar="PART.FCStd", help=text)


def run_where_used(args: argparse.Namespace) -> int:
    """Print the files; for an unchanged vault the index knows them."""
    from silo.vault.questions import Question

    if not os.path.isdir(args.root):
        raise InputError(message("{root} is not a folder. Name the folder of the vault.", root=args.root))
    base, part = os.path.realpath(args.root), os.path.realpath(args.part)
    if not os.path.lexists(part) and os.path.lexists(inner := os.path.join(base, args.part)):
        part = os.path.realpath(inner)  # as the other commands print it
    tops = documents_in([base])
    if part not in tops and not os.path.lexists(part) and not os.path.isdir(os.path.dirname(part)):
        raise InputError(message("{part}: there is no such file, nor its folder.", part=args.part))
    users: dict[str, set[str]] = {}
    unread = []
    with reading_of(args) as reading:
        reading.index.expect(base)
        progress = count_steps(len(tops))
        for top, answer in zip(tops, reading.ask_many(map(Question, tops)), strict=True):
            progress(top)
            if "document" in answer.plain:
                unread.append(top)
            for used in answer.known.links:
                users.setdefault(used, set()).add(top)
    if part not in users and not os.path.lexists(part):
        relative_paths = {relative(place, base) for place in (*tops, *users)}
        meant = did_you_mean(relative(part, base), sorted(relative_paths)) or "."
        raise InputError(
            message(
                "{part}: there is no such file, and none in {root} links to one{meant}",
                part=args.part,
                root=args.root,
                meant=meant,
            )
        )
    above = _above(part, users)
    uses = {
        "direct": users.get(part, ()),
        "all": above,
        "tops": [top for top in above if not users.get(top)],
        "unreadable": unread,
    }
    said = {name: [relative(path, base) for path in sorted(paths)] for name, paths in uses.items()}
    if args.json:
        print_json({"part": relative(part, base), **said})
        return Exit.UNDONE if unread else Exit.DONE
    from silo.cli.terminal import console, plain

    out = console()
    lines = said["direct"] or [message("No file of {root} links to it.", root=args.root)]
    if said["tops"]:
        lines.append(message("Tops that a change touches: {said}", said=", ".join(said["tops"])))
    lines += [
        message("✗ {path} could not be read, so its links are not known.", path=path)
        for path in said["unreadable"]
    ]
    for line in lines:
        out.print(plain(line), markup=False)
    return Exit.UNDONE if unread else Exit.DONE


def _above(part: str, users: Mapping[str, set[str]]) -> set[str]:
    """Find all files that use ``part``, directly or not."""
    result: set[str] = set()
    left = [part]
    while left:
        for user in users.get(left.pop(), ()):
            if user not in result and user != part:
                result.add(user)
                left.append(user)
    return result
