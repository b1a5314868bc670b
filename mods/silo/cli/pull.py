# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod pull`` and ``silo-mod log``: files from Silo, and what became of one over time."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo.bom.errors import Exit, InputError, SiloError
from silo.cli import common
from silo.cli.common import Commands
from silo.outbox.database import KEPT_ASIDE_DAYS

if TYPE_CHECKING:
    from silo.api.wire import Revision
    from silo.outbox.store import Store
    from silo.vault.pull import Pulled


def register(commands: Commands) -> None:
    """Add both commands."""
    parser = common.add_command(
        commands,
        "pull",
        "fetch the file of an item with all that it links to; edited files stay as they are",
        "silo-mod pull A01-0001 --into robot",
    )
    parser.add_argument("part_number", metavar="PART_NUMBER")
    parser.add_argument(
        "--revision",
        metavar="N",
        type=common.above_zero,
        help="this revision, with the linked files as they were then; else the newest of all",
    )
    parser.add_argument("--into", metavar="FOLDER", default=".", help="the project's folder (else this one)")
    parser.add_argument(
        "--overwrite",
        action="store_true",
        help="replace files with edits that are not in Silo; a copy of each is kept",
    )
    parser.add_argument(
        "--even-if-open",
        action="store_true",
        help="replace files that FreeCAD has open; its next save undoes that",
    )
    common.add_server_options(parser)
    common.add_json_option(parser)
    parser.set_defaults(run=run_pull)

    log = common.add_command(
        commands,
        "log",
        "show the revisions of a file's item, and which one the file is",
        "silo-mod log TopAssembly.FCStd --bom",
    )
    log.add_argument("file", metavar="FILE", help="a FreeCAD file that is registered")
    log.add_argument(
        "--limit", metavar="N", type=common.above_zero, default=20, help="the newest N revisions (20)"
    )
    log.add_argument("--bom", action="store_true", help="what each revision changed in the BOM")
    common.add_server_options(log)
    common.add_json_option(log)
    log.set_defaults(run=run_log)


def run_pull(args: argparse.Namespace) -> int:
    """1 where a file was left alone, or is not in Silo."""
    from silo.open_in_freecad import open_in_any
    from silo.outbox.store import Store
    from silo.vault.fetch import fetched
    from silo.vault.pull import Rules, place, pulled_json

    store, into = Store(), Path(args.into)
    opened = open_in_any()
    with common.client_of(args) as client:
        rules = Rules(
            overwrite=args.overwrite,
            keep=store.keep_aside,
            is_open=lambda path: not args.even_if_open and opened.has_file(path),
            learn=lambda sha256, item, number: store.learn(client.base_url, sha256, item, number),
        )
        number = common.named_item(client, args.part_number).part_number
        with fetched(client, number, args.revision) as tree:
            into.mkdir(parents=True, exist_ok=True)
            pulled = place(tree, into, rules)
    if args.json:
        common.print_json(pulled_json(pulled, Path(os.path.realpath(into))))
    else:
        _show_pulled(pulled, into)
    return Exit.DONE if pulled.complete else Exit.UNDONE


_MARKS = {
    "new": ("+", "green", ""),
    "same": ("=", "dim", "up to date"),
    "updated": ("~", "yellow", "updated"),
    "edited": ("✗", "red", "has edits that are not in Silo; left alone (--overwrite replaces it)"),
    "overwritten": ("~", "yellow", f"replaced; your file is kept for {KEPT_ASIDE_DAYS} days at"),
    "open": ("✗", "red", "is open in FreeCAD; left alone (close it, or --even-if-open)"),
}


def _show_pulled(pulled: Pulled, into: Path) -> None:
    from rich.text import Text

    from silo.cli import show

    out = show.console()
    for one in pulled.files:
        mark, style, words = _MARKS[one.state.value]
        text = Text(f"{mark} ", style).append(show.plain(os.path.relpath(one.path, os.path.realpath(into))))
        text.append(f"  {one.part_number}, revision {one.revision}", "dim")
        if words:
            text.append(f"  {words}{f' {one.kept}' if one.kept else ''}", style)
        out.print(text)
    for lost in pulled.lost:
        line = f"{lost.position}: {lost.path} was not fetched: {lost.reason}"
        out.print(Text("✗ ", "bold red").append(show.plain(line), ""))
    out.print(Text(show.plain(f"Open {pulled.top}"), "bold"))


def run_log(args: argparse.Namespace) -> int:
    """Print the revisions, newest first."""
    from silo.fcstd import Library
    from silo.fcstd.linked import identity_in
    from silo.files import sha256_of
    from silo.outbox.store import Store
    from silo.vault.revisions import RevisionBoms, file_revisions, words

    path = os.path.realpath(args.file)
    if not os.path.isfile(path):
        raise InputError(f"{args.file} is no file")
    with Library() as library:
        library.open(path)
        identity = identity_in(library, path)
    if not identity:
        raise InputError(f"{args.file} belongs to no single item in Silo; register it (silo-mod register)")
    with common.client_of(args) as client:
        item = client.get_item_by_uuid(identity)
        if item is None:
            raise InputError(f"{args.file}: this server has no item {identity}; is it the right server?")
        known = client.revisions(item.part_number)
        shown = known[: args.limit]
        here = _here(Store(), sha256_of(path), identity, client.base_url, known)
        changes: dict[int, str] = {}
        if args.bom:
            files = file_revisions(known)
            with RevisionBoms(client, item.part_number, path) as boms:
                for number, one in enumerate(files):
                    if one.revision_number < shown[-1].revision_number:
                        break
                    older = files[number + 1].revision_number if number + 1 < len(files) else None
                    try:
                        changes[one.revision_number] = words(boms.change(older, one.revision_number))
                    except SiloError as error:
                        changes[one.revision_number] = f"cannot be read: {error}"
    if args.json:
        common.print_json(_log_json(item.part_number, shown, here, changes, args.bom))
    else:
        _show_log(item.part_number, item.name, shown, here, changes, len(known))
    return Exit.DONE


def _here(
    store: Store, sha256: str, identity: str, server: str, known: list[Revision]
) -> tuple[int | None, bool]:
    """The revision that the file is, or was made from, and whether it has edits since."""
    from silo.api.revisions import standing

    for content, edited in ((sha256, False), (store.origin_of(sha256), True)):
        number = store.known_revision(server, content, identity)
        if (base := standing(known, content, number).base) is not None:
            return base.revision_number, edited
    return None, True


def _log_json(
    number: str,
    shown: list[Revision],
    here: tuple[int | None, bool],
    changes: dict[int, str],
    with_bom: bool,
) -> dict[str, Any]:
    keys = {
        "revision_number",
        "comment",
        "created_by",
        "created_at",
        "file_name",
        "file_size",
        "base_revision",
    }
    rows = []
    for one in shown:
        row = one.model_dump(mode="json", include=keys)
        rows.append({**row, "bom": changes.get(one.revision_number)} if with_bom else row)
    return {"part_number": number, "file_is": here[0], "edited": here[1], "revisions": rows}


def _show_log(
    number: str,
    name: str,
    shown: list[Revision],
    here: tuple[int | None, bool],
    changes: dict[int, str],
    total: int,
) -> None:
    from rich.text import Text

    from silo.cli import show

    out = show.console()
    out.print(Text(show.plain(f"{number}  {name}"), "bold"))
    if here[0] is None:
        out.print(Text("This file is no revision in Silo, and it is not known which one it was made from."))
    for one in shown:
        stamp = one.created_at.astimezone().strftime("%Y-%m-%d %H:%M") if one.created_at else ""
        text = Text(f"{one.revision_number:>4}  ", "cyan")
        text.append(f"{stamp}  {show.plain(one.created_by or '')}  ", "dim")
        text.append(show.plain(one.comment) or "(no comment)")
        if not (one.file_name or one.file_checksum):
            text.append("  properties only", "dim")
        if one.revision_number == here[0]:
            text.append("  ← this file, edited since" if here[1] else "  ← this file", "green")
        out.print(text)
        if said := changes.get(one.revision_number):
            out.print(Text(f"      {show.plain(said)}", "yellow"))
    if total > len(shown):
        out.print(Text(f"… and {total - len(shown)} older; --limit shows more", "dim"))
