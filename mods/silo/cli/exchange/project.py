# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod commit`` and ``silo-mod status``: a project folder, its files, and what Silo has of them."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo import spoken
from silo.bom.errors import Exit, UnreachableError, counted, exit_of
from silo.bom.message import message
from silo.bom_sync.activity_text import draft_text
from silo.cli.connection import client_of, reach
from silo.cli.json_output import print_json
from silo.cli.options import add_options
from silo.cli.progress import set_sending_step, set_step

if TYPE_CHECKING:
    from collections.abc import Sequence

    from silo.api.client import SiloClient
    from silo.bom.findings import Finding
    from silo.outbox.entry import Entry
    from silo.outbox.report import Report, Sent
    from silo.vault.project import Belonging, FileStanding


def _add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "tops",
        metavar="TOP",
        nargs="*",
        default=["."],
        help="assembly files with all below them, or the project's folder (default: this folder)",
    )


def add_status(parser: argparse.ArgumentParser) -> None:
    """Add the command."""
    _add(parser)


def add_commit(parser: argparse.ArgumentParser) -> None:
    """Add the command."""
    _add(parser)
    parser.add_argument("-m", "--comment", metavar="TEXT", help="what changed")
    add_options(
        parser,
        {
            "--on-top": message("send files that a colleague has committed since, on top of the colleague's"),
        },
    )


def run_status(args: argparse.Namespace) -> int:
    """Print how each file stands. Returns 1 if folder and server differ."""
    from silo.outbox.store import Store
    from silo.vault.project import find_project, must_hold_files, stand

    project = find_project(args.tops, args.root)
    must_hold_files(args.tops, project)
    with client_of(args) as client:
        reach(client)
        belonging, standings = stand(args.tops, project, client, Store())
    if args.json:
        print_json(_status_json(belonging, standings))
    else:
        _show(belonging, standings)
    fine = all(standing.is_fine for standing in standings)
    whole = not (_unsound(belonging) or belonging.gone or belonging.missing)
    return Exit.DONE if fine and whole else Exit.UNDONE


def run_commit(args: argparse.Namespace) -> int:
    """Send what differs, through the queue. Returns 1 if anything is not in Silo afterwards, also what an
    earlier run left; 3 if the server does not answer: then the queue keeps everything.
    """
    from silo.outbox.store import Store
    from silo.vault.committing import commit_files
    from silo.vault.project import find_project, must_hold_files, read_project

    project = find_project(args.tops, args.root)
    must_hold_files(args.tops, project)
    belonging = read_project(args.tops, project)
    away: UnreachableError | None = None
    with client_of(args) as client:
        try:
            reach(client)
        except UnreachableError as error:
            away = error
        committed = commit_files(
            belonging,
            None if away else client,
            Store(),
            comment=args.comment or "",
            allow_missing=args.allow_missing,
            on_top=args.on_top,
            away=away,
            seen=_show if not args.json else lambda _belonging, _standings: None,
            on_progress=set_sending_step,
        )
        belonging, report = committed.belonging, committed.report
        models, undrawn = (0, []) if report.stopped_by else _send_models(belonging, client)
    sent = _sent(committed.sent)
    if args.json:
        waiting = [{"path": entry.label, "reason": entry.reason} for entry in committed.left]
        result = {"sent": sent, "waiting": waiting, "models": models, "undrawn": undrawn}
        print_json({**_status_json(belonging, committed.before), **result})
    else:
        behind = [] if away else committed.behind
        _show_sent(report, sent, committed.left, behind, belonging.project.root)
        _show_models(models, undrawn)
    return exit_of(away) if away else Exit.DONE if committed.done else Exit.UNDONE


def _send_models(belonging: Belonging, client: SiloClient) -> tuple[int, list[str]]:
    """Send the models that the server lacks of these files. The commits remain done, whatever happens
    here.
    """
    try:
        from silo.drawing.models import send_models
    except ImportError:
        missing = message(
            'Silo gets no models, sizes or masses of these files: pip install "silo-mod[inertia]"'
        )
        return 0, [missing]
    files = [(Path(file.path), file.sha256) for file in belonging.files]
    return send_models(client, files, at=set_step)


def _show_models(models: int, undrawn: list[str]) -> None:
    from rich.text import Text

    from silo.cli.terminal import console, plain

    if models:
        console().print(
            Text(spoken(message("Silo can show {models} in 3D", models=counted(models, "more file"))), "dim")
        )
    for problem in undrawn:
        console().print(
            Text(plain(spoken(message("! {problem}. The commit stands", problem=problem))), "yellow")
        )


def _unsound(belonging: Belonging) -> bool:
    return bool(belonging.outside or belonging.unreadable)


def _sent(arrived: Sequence[Sent]) -> list[dict[str, Any]]:
    return [
        {
            "path": file.entry.label,
            "part_number": file.number,
            "revision": file.revision if file.entry.has_file else None,
            "bom": file.status.value if file.status is not None else None,
            "remark": file.conflict or file.entry.remark or draft_text(file.result or file.uploaded),
            "blocked_by": [one.message for one in _blocking(file)],
        }
        for file in arrived
    ]


def _blocking(sent: Sent) -> Sequence[Finding]:
    """Return what holds the BOM of a commit that arrived, as ``sync`` names it."""
    from silo.bom_sync.resolved import blocking

    return blocking(sent.resolved) if sent.status == "blocked" and sent.resolved is not None else ()


def _status_json(belonging: Belonging, standings: Sequence[FileStanding]) -> dict[str, Any]:
    return {
        "root": belonging.project.root,
        "files": [
            {
                "path": standing.file.place,
                "state": standing.state.value,
                "document": standing.file.document or None,
                "items": len({item for item, _ in standing.file.held}),
                "moved_from": standing.file.moved_from or None,
                "newest": standing.newest.revision_number if standing.newest is not None else None,
                "held_bom": standing.held or None,
            }
            for standing in standings
        ],
        "outside": [{"file": place, "link": link} for place, link in belonging.outside],
        "missing": [{"file": place, "link": link} for place, link in belonging.missing],
        "unreadable": [{"file": place, "reason": reason} for place, reason in belonging.unreadable],
        "gone": list(belonging.gone),
        "copies": [{"file": place, "of": first} for place, first in belonging.doubtful],
    }


_MARKS = {
    "SAME": ("=", "dim"),
    "NEW": ("+", "green"),
    "EDITED": ("~", "yellow"),
    "NEWER": ("↓", "cyan"),
    "BOTH": ("✗", "red"),
    "WAITING": ("…", "yellow"),
    "HELD": ("✗", "red"),
    "SET_BACK": ("↑", "red"),
    "UNKNOWN": ("✗", "red"),
}
_WORDS = {
    "SAME": "same",
    "NEW": message("not in Silo"),
    "EDITED": "edited",
    "NEWER": message("newer in Silo"),
    "BOTH": message("edited, and newer in Silo"),
    "WAITING": "waiting",
    "HELD": message("held: its commit needs your choice"),
    "SET_BACK": message("newer than the server, which was restored from a backup"),
    "UNKNOWN": message("of an item that this server does not have"),
}


def _show(belonging: Belonging, standings: Sequence[FileStanding]) -> None:
    from rich.text import Text

    from silo.cli.terminal import console, plain

    out = console()
    out.print(Text(plain(spoken(message("Project {root}", root=belonging.project.root))), "bold"))
    for standing in standings:
        mark, style = _MARKS[standing.state.name]
        line = (
            Text(f"{mark} ", style)
            .append(plain(standing.file.place))
            .append(f"  {spoken(_WORDS[standing.state.name])}", style)
        )
        if standing.newest is not None:
            line.append(
                spoken(
                    message("  revision {revision_number}", revision_number=standing.newest.revision_number)
                ),
                "dim",
            )
        if not standing.file.item:
            count = len({item for item, _ in standing.file.held})
            held = (
                message("{count} items in it", count=count)
                if count
                else message("a file without a part number")
            )
            line.append(f"  {spoken(held)}", "dim")
        if standing.file.moved_from:
            line.append(
                plain(spoken(message("  was {moved_from}", moved_from=standing.file.moved_from))), "cyan"
            )
        out.print(line)
        if standing.held:
            reason = spoken(message("its BOM is held: {held}", held=standing.held))
            out.print(Text(plain(f"  ✗ {reason}"), "red"))
        if standing.file.problem:
            out.print(Text(plain(spoken(message("  {problem}", problem=standing.file.problem))), "yellow"))
    notes = [
        *(
            (
                message(
                    "{place}: its link {link} leads out of the project, and is not sent",
                    place=place,
                    link=link,
                )
            )
            for place, link in belonging.outside
        ),
        *(
            (message("{place}: its link {link} leads to no file", place=place, link=link))
            for place, link in belonging.missing
        ),
        *(
            (message("{place} cannot be read: {reason}", place=place, reason=reason))
            for place, reason in belonging.unreadable
        ),
        *(
            (message("{place} is gone from the folder; Silo keeps it", place=place))
            for place in belonging.gone
        ),
        *(
            message(
                "{place} has the identity of {first}: the same part, or a copy? Register the "
                "copy as a new part",
                place=place,
                first=first,
            )
            for place, first in belonging.doubtful
        ),
    ]
    for note in notes:
        out.print(Text(plain(spoken(message("! {note}", note=note))), "yellow"))


def _show_sent(
    report: Report, sent: list[dict[str, Any]], left: Sequence[Entry], behind: list[FileStanding], base: str
) -> None:
    from rich.text import Text

    from silo.batch import STATUS_WORDS
    from silo.bom.view.folders import shorten
    from silo.bom_sync.steps import Status
    from silo.cli.terminal import console, plain

    out = console()
    for row in sent:
        revision = message("revision {row}", row=row["revision"]) if row["revision"] else ""
        bom = message("BOM {row}", row=row["bom"].replace("_", " ")) if row["bom"] else ""
        text = ", ".join(filter(None, (row["part_number"], revision, bom, row["remark"])))
        out.print(Text("✓ ", "green").append(plain(f"{row['path']}  {spoken(text)}")))
        if row["blocked_by"]:
            out.print(Text(f"  ✗ {spoken(STATUS_WORDS[Status.BLOCKED])}", "red"))
        for reason in row["blocked_by"]:
            out.print(Text(plain(f"    {spoken(shorten(reason, base))}"), "red"))
    for entry in left:
        text = spoken(message("{label} waits in the queue: {reason}", label=entry.label, reason=entry.reason))
        out.print(Text("✗ ", "red").append(plain(text)))
    for late in behind:
        advice = {
            "NEWER": message("was not sent: silo-mod pull fetches the newer file"),
            "BOTH": message(
                "was not sent: look at the newer file (silo-mod log); --on-top sends yours on top of it"
            ),
            "SET_BACK": message(
                "was not sent: the server was restored from a backup; --on-top sends all such files again"
            ),
            "UNKNOWN": message(
                "was not sent: is this the right server? Else take the identity out and register it"
            ),
        }.get(late.state.name, message("was written while it was sent: commit it again"))
        out.print(Text("✗ ", "red").append(plain(f"{late.file.place} {spoken(advice)}")))
    if report.busy:
        out.print(message("Another program sends the queue now; what waits goes with it"), style="yellow")
    if report.stopped_by is not None:
        text = message("Stopped: {stopped_by}. Run it again to send the rest", stopped_by=report.stopped_by)
        out.print(plain(text), style="red", markup=False)
    if not (sent or left or behind):
        out.print(message("Nothing to send: Silo has all of it"))
