# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod commit`` and ``silo-mod status``: a project folder, its files, and what Silo has of them."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from silo.bom.errors import Exit, UnreachableError, exit_of
from silo.cli import common

if TYPE_CHECKING:
    from silo.outbox.send import Report
    from silo.vault.project import Belonging, Standing


def _add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "tops", metavar="TOP", nargs="+", help="assembly files with all below them, or the project's folder"
    )
    parser.add_argument(
        "--root",
        metavar="FOLDER",
        help="the project's folder; it is remembered (else the folder above that is one, or that holds all)",
    )


def add_status(parser: argparse.ArgumentParser) -> None:
    """Add the command."""
    _add(parser)
    parser.set_defaults(run=run_status)


def add_commit(parser: argparse.ArgumentParser) -> None:
    """Add the command."""
    _add(parser)
    parser.add_argument("-m", "--comment", metavar="TEXT", help="what changed")
    parser.add_argument(
        "--allow-missing",
        action="store_true",
        help="sync BOMs although files are missing; their known lines stay as they are",
    )
    parser.add_argument(
        "--on-top",
        action="store_true",
        help="send files that a colleague has committed since, on top of the colleague's",
    )
    parser.set_defaults(run=run_commit)


def run_status(args: argparse.Namespace) -> int:
    """Print how each file stands. 1 where folder and server differ."""
    from silo.outbox.store import Store
    from silo.vault.project import compare, find_project, name_documents, read_project

    found = read_project(args.tops, find_project(args.tops, args.root))
    with common.client_of(args) as client:
        common.reach(client)
        found = name_documents(found, client, new=False)
        standings = compare(found, client, Store())
    if args.json:
        common.print_json(_told(found, standings))
    else:
        _show(found, standings)
    fine = all(one.state.name == "SAME" for one in standings)
    return Exit.DONE if fine and not _unsound(found) and not found.gone else Exit.UNDONE


def run_commit(args: argparse.Namespace) -> int:
    """Send what differs, through the queue. 1 where anything is not in Silo afterwards; 3 where the server
    does not answer: then all that the project does not remember as sent is kept in the queue."""
    from silo.outbox.send import Report, send_all
    from silo.outbox.store import Store
    from silo.vault.project import (
        State,
        commits,
        compare,
        find_project,
        keep,
        name_documents,
        read_project,
        remember,
    )

    found = read_project(args.tops, find_project(args.tops, args.root))
    store = Store()
    away: UnreachableError | None = None
    with common.client_of(args) as client:
        try:
            common.reach(client)
        except UnreachableError as error:
            away = error
        there = None if away else client
        found = name_documents(found, there)
        standings = compare(found, there, store)
        if not args.json:
            _show(found, standings)
        remember(found.project, (one.file for one in standings if one.state is State.SAME))
        mine = set()
        options = {"allow_missing": args.allow_missing, "over_newer": args.on_top}
        for file, commit in commits(found, standings, comment=args.comment or "", **options):
            keep(found.project, store, file, commit, client.base_url if there else "")
            mine.add(commit.key)
        report = Report(stopped_by=away) if away else send_all(store, client, force=True)
    left = [entry for entry in store.entries() if entry.key in mine]
    refused = {State.NEWER, State.NO_ITEM} | (set() if args.on_top else {State.BOTH})
    sent = _sent(report, mine)
    behind = [one for one in standings if one.state in refused]
    incomplete = [told for told in sent if told["bom"] == "blocked"]
    if args.json:
        waiting = [{"path": entry.label, "reason": entry.reason} for entry in left]
        common.print_json({**_told(found, standings), "sent": sent, "waiting": waiting})
    else:
        _show_sent(report, sent, left, behind)
    done = not (left or behind or incomplete or _unsound(found) or report.stopped_by or report.busy)
    return exit_of(away) if away else Exit.DONE if done else Exit.UNDONE


def _unsound(found: Belonging) -> bool:
    return bool(found.outside or found.unreadable)


def _sent(report: Report, mine: set[str]) -> list[dict[str, Any]]:
    return [
        {
            "path": one.entry.label,
            "part_number": one.number,
            "revision": one.revision if one.entry.has_file else None,
            "bom": one.status.value if one.status is not None else None,
            "remark": one.entry.remark,
        }
        for one in report.sent
        if one.entry.key in mine
    ]


def _told(found: Belonging, standings: list[Standing]) -> dict[str, Any]:
    return {
        "root": found.project.root,
        "files": [
            {
                "path": one.file.place,
                "state": one.state.name.lower().replace("_", " "),
                "document": one.file.document or None,
                "items": len({item for item, _ in one.file.held}),
                "moved_from": one.file.moved_from or None,
                "newest": one.newest.revision_number if one.newest is not None else None,
            }
            for one in standings
        ],
        "outside": [{"file": place, "link": link} for place, link in found.outside],
        "missing": [{"file": place, "link": link} for place, link in found.missing],
        "unreadable": [{"file": place, "reason": reason} for place, reason in found.unreadable],
        "gone": list(found.gone),
        "copies": [{"file": place, "of": first} for place, first in found.doubtful],
    }


_MARKS = {
    "SAME": ("=", "dim"),
    "NEW": ("+", "green"),
    "EDITED": ("~", "yellow"),
    "NEWER": ("↓", "cyan"),
    "BOTH": ("✗", "red"),
    "WAITING": ("…", "yellow"),
    "NO_ITEM": ("✗", "red"),
}


def _show(found: Belonging, standings: list[Standing]) -> None:
    from rich.text import Text

    from silo.cli import show

    out = show.console()
    out.print(Text(show.plain(f"Project {found.project.root}"), "bold"))
    for one in standings:
        mark, style = _MARKS[one.state.name]
        line = (
            Text(f"{mark} ", style).append(show.plain(one.file.place)).append(f"  {one.state.value}", style)
        )
        if one.newest is not None:
            line.append(f"  revision {one.newest.revision_number}", "dim")
        if not one.file.item:
            count = len({item for item, _ in one.file.held})
            line.append(f"  {f'{count} items in it' if count else 'a file without a part number'}", "dim")
        if one.file.moved_from:
            line.append(show.plain(f"  was {one.file.moved_from}"), "cyan")
        out.print(line)
        if one.file.problem:
            out.print(Text(show.plain(f"  {one.file.problem}"), "yellow"))
    notes = [
        *(
            (f"{place}: its link {link} leads out of the project, and is not sent")
            for place, link in found.outside
        ),
        *((f"{place}: its link {link} leads to no file") for place, link in found.missing),
        *((f"{place} cannot be read: {reason}") for place, reason in found.unreadable),
        *((f"{place} is gone from the folder; Silo keeps it") for place in found.gone),
        *(
            f"{place} has the identity of {first}: the same part, or a copy? Register the copy as a new part"
            for place, first in found.doubtful
        ),
    ]
    for note in notes:
        out.print(Text(show.plain(f"! {note}"), "yellow"))


def _show_sent(report: Report, sent: list[dict[str, Any]], left: list[Any], behind: list[Standing]) -> None:
    from rich.text import Text

    from silo.cli import show

    out = show.console()
    for one in sent:
        revision = f"revision {one['revision']}" if one["revision"] else ""
        bom = f"BOM {one['bom'].replace('_', ' ')}" if one["bom"] else ""
        told = ", ".join(filter(None, (one["part_number"], revision, bom, one["remark"])))
        out.print(Text("✓ ", "green").append(show.plain(f"{one['path']}  {told}")))
    for entry in left:
        out.print(Text("✗ ", "red").append(show.plain(f"{entry.label} waits in the queue: {entry.reason}")))
    for late in behind:
        advice = {
            "NEWER": "was not sent: silo-mod pull fetches the newer file",
            "BOTH": "was not sent: look at the newer file (silo-mod log); --on-top sends yours on top of it",
            "NO_ITEM": "was not sent: is this the right server? Else take the identity out and register it",
        }[late.state.name]
        out.print(Text("✗ ", "red").append(show.plain(f"{late.file.place} {advice}")))
    if report.busy:
        out.print(Text("Another program sends the queue now; what waits goes with it", "yellow"))
    if report.stopped_by is not None:
        out.print(Text(show.plain(f"Stopped: {report.stopped_by}. Run it again to send the rest"), "red"))
    if not (sent or left or behind):
        out.print("Nothing to send: Silo has all of it")
