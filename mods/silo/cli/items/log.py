# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod log``: the revisions of a file's item; with ``--since`` what changed in a product."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo import caption, spoken
from silo.bom.errors import Exit, InputError, SiloError
from silo.bom.message import message
from silo.cli.connection import client_of, named_item
from silo.cli.json_output import print_json
from silo.cli.options import add_each, add_options, only_with
from silo.cli.progress import set_step
from silo.proposed_command import proposed

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.api.wire import Item, ProductChanges, Revision
    from silo.outbox.store import Store


def add_log(parser: argparse.ArgumentParser) -> None:
    add_each(
        parser,
        "file",
        metavar="FILE",
        help="a FreeCAD file that is registered, or a part number",
    )
    points = {
        "--since POINT": message(
            "what changed in the product on all levels since then: a day such as 2026-02-08, "
            "a revision of the item such as r3, or a frozen revision such as A"
        ),
        "--until POINT": message("up to then (now)"),
    }
    add_options(parser, points)
    only_with(parser, "--since", "--until")
    add_options(parser, {"--changes": message("what each revision changed in the BOM")})


def run_log(args: argparse.Namespace) -> int:
    """Print the revisions, newest first; or what changed in the product."""
    from silo.checksums import sha256_of
    from silo.outbox.store import Store
    from silo.vault.revisions import RevisionBoms, file_revisions, words

    path = os.path.realpath(args.file)
    if args.since:
        with client_of(args) as client:
            number = args.file
            if os.path.isfile(path):
                number = _item_of(client, args.file, _identity(args.file, path)).part_number
            _show_changes(args, client.get_changes(number, args.since, args.until or ""))
        return Exit.DONE
    is_file = os.path.isfile(path)
    if not is_file and (os.path.isdir(path) or not _may_be_number(args.file)):
        raise InputError(
            message("{file} is not a file. Give the path of an FCStd file, or a part number.", file=args.file)
        )
    if args.changes and not is_file:
        raise InputError(
            message("--changes compares BOMs from the folder of a file; give the path of an FCStd file")
        )
    identity = _identity(args.file, path) if is_file else ""
    with client_of(args) as client:
        item = _item_of(client, args.file, identity) if is_file else named_item(client, args.file)
        revisions = client.revisions(item.part_number)
        shown = revisions[: args.limit]
        here: tuple[int | None, bool] = (None, False)
        if is_file:
            here = _revision_on_disk(Store(), path, sha256_of(path), identity, client.base_url, revisions)
        changes: dict[int, str] = {}
        if args.changes:
            files = file_revisions(revisions)
            with RevisionBoms(client, item.part_number, path) as boms:
                for number, revision in enumerate(files):
                    set_step(message("revision {revision_number}", revision_number=revision.revision_number))
                    if revision.revision_number < shown[-1].revision_number:
                        break
                    older = files[number + 1].revision_number if number + 1 < len(files) else None
                    try:
                        changes[revision.revision_number] = words(
                            boms.change(older, revision.revision_number)
                        )
                    except SiloError as error:
                        changes[revision.revision_number] = message("cannot be read: {error}", error=error)
    if args.json:
        print_json(_log_json(item.part_number, shown, here, changes, args.changes))
    else:
        _show_log(item.part_number, item.name, shown, here if is_file else None, changes, len(revisions))
    return Exit.DONE


def _may_be_number(text: str) -> bool:
    """Return False for what is meant as a file, which is not there."""
    return not text.lower().endswith(".fcstd") and os.sep not in text and text != "-"


def _identity(name: str, path: str) -> str:
    from silo.fcstd import Library
    from silo.fcstd.linked import identity_in

    with Library() as library:
        library.open(path)
        identity = identity_in(library, path)
    if not identity:
        register = proposed("register", Path(path))
        raise InputError(
            message(
                "{name} belongs to no single item in Silo; {register} gives it one",
                name=name,
                register=register,
            )
        )
    return identity


def _item_of(client: SiloClient, name: str, identity: str) -> Item:
    item = client.get_item_by_uuid(identity)
    if item is None:
        raise InputError(
            message(
                "{name}: this server has no item {identity}; is it the right server?",
                name=name,
                identity=identity,
            )
        )
    return item


def _show_changes(args: argparse.Namespace, changes: ProductChanges) -> None:
    if args.json:
        print_json(changes.model_dump(mode="json"))
        return
    from rich.text import Text

    from silo.cli.terminal import console, plain, table_of

    out = console()
    first, last = (when.strftime("%Y-%m-%d %H:%M") if when else "" for when in (changes.since, changes.to))
    head = message(
        "{part_number}: what changed from {first} to {last} (UTC)",
        part_number=changes.part_number,
        first=first,
        last=last,
    )
    if not changes.changes:
        out.print(message("{head}: nothing on any level", head=plain(head)), markup=False)
        return
    out.print(Text(plain(spoken(head)), "bold"))
    table = table_of("", "Part number", "Name", "In", "Before", "After", "By")
    styles = {"added": "green", "removed": "red"}
    for change in changes.changes:
        when = f", {change.at:%Y-%m-%d %H:%M}" if change.at else ""
        cells = (
            change.part_number,
            change.name,
            change.within,
            change.before,
            change.after,
            change.username + when,
        )
        what = Text(spoken(change.what), styles.get(change.what, "yellow"))
        table.add_row(what, *(Text(plain(cell)) for cell in cells))
    out.print(table)


def _revision_on_disk(
    store: Store, path: str, sha256: str, identity: str, server: str, revisions: list[Revision]
) -> tuple[int | None, bool]:
    """Return the revision that the file is or was made from, and if it has edits since."""
    from silo.file_state import stands

    def known(content: str) -> int | None:
        return store.known_revision(server, content, identity)

    for origins in ((), store.origins(sha256, path, identity)):
        if (base := stands(sha256, origins, revisions, known).base) is not None:
            return base.revision_number, bool(origins)
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
    for revision in shown:
        row = revision.model_dump(mode="json", include=keys)
        rows.append({**row, "bom": changes.get(revision.revision_number)} if with_bom else row)
    return {"part_number": number, "file_is": here[0], "edited": here[1], "revisions": rows}


def _show_log(
    number: str,
    name: str,
    shown: list[Revision],
    here: tuple[int | None, bool] | None,
    changes: dict[int, str],
    total: int,
) -> None:
    """Print the revisions; ``here``: which one the file is, None if no file was named."""
    from rich.text import Text

    from silo.cli.terminal import console, plain

    out = console()
    out.print(Text(plain(f"{number}  {name}"), "bold"))
    if here is not None and here[0] is None:
        out.print(
            message("This file is no revision in Silo, and it is not known which one it was made from.")
        )
    for revision in shown:
        stamp = revision.created_at.astimezone().strftime("%Y-%m-%d %H:%M") if revision.created_at else ""
        text = Text(f"{revision.revision_number:>4}  ", "cyan")
        text.append(
            message("{stamp}  {created_by}  ", stamp=stamp, created_by=plain(revision.created_by or "")),
            "dim",
        )
        text.append(plain(revision.comment) or caption("(no comment)"))
        if not (revision.file_name or revision.file_checksum):
            text.append(caption("  properties only"), "dim")
        if here is not None and revision.revision_number == here[0]:
            text.append(
                spoken(message("  ← this file, edited since") if here[1] else message("  ← this file")),
                "green",
            )
        out.print(text)
        if said := changes.get(revision.revision_number):
            out.print(Text(f"      {plain(spoken(said))}", "yellow"))
    if total > len(shown):
        out.print(
            Text(spoken(message("… and {shown} older; --limit shows more", shown=total - len(shown))), "dim")
        )
