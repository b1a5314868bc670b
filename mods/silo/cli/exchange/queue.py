# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod queue``: the commits that are not in Silo yet."""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from silo import spoken
from silo.bom.errors import ConfigError, Exit, InputError, SiloError, exit_of
from silo.bom.message import message
from silo.cli.connection import client_of
from silo.cli.json_output import print_json
from silo.cli.options import above_zero, add_options
from silo.cli.progress import set_sending_step

if TYPE_CHECKING:
    from silo.api.pause import Pause
    from silo.outbox.entry import Entry
    from silo.outbox.store import Store


def add_queue(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "do",
        metavar="list|retry|discard|save",
        nargs="?",
        choices=("list", "retry", "discard", "save"),
        default="list",
        help="list them (default); retry: end the pauses and send all, with NUMBER also what is held; "
        "discard: forget commits, the documents stay; save: write the files of commits",
    )
    parser.add_argument(
        "numbers", metavar="NUMBER", nargs="*", type=above_zero, help="commits, as list shows them"
    )
    add_options(parser, {"--here": message("retry: send them to the server in use instead")})


def run_queue(args: argparse.Namespace) -> int:
    """Show the queue, after doing what ``args.do`` says. Returns 1 if something waits or is held; 2 or 3 if
    the server stops a retry.
    """
    from silo.api.address import canonical
    from silo.api.config import resolve_server
    from silo.outbox.store import Store

    store, here = Store(), ""
    with suppress(ConfigError):
        here = canonical(resolve_server(args.server, args.token).url)
    if args.do in ("discard", "save") and not args.numbers:
        raise InputError(
            message("queue {do}: which commit? Give the number that `silo-mod queue` shows", do=args.do)
        )
    stopped = _retry(args, store, here) if args.do == "retry" else None
    for number in args.numbers:
        entry = next((pending for pending in store.entries() if pending.id == number), None)
        if entry is None:
            if args.do != "retry":
                raise InputError(
                    message(
                        "there is no commit {number} in the queue; `silo-mod queue` lists them", number=number
                    )
                )
        elif args.do == "discard":
            store.discard(number, keep=True)
        elif args.do == "save":
            Path(args.into).mkdir(parents=True, exist_ok=True)
            target = Path(args.into) / f"{number}-{entry.file_name}"
            if os.path.lexists(target):
                raise InputError(
                    message("{path} is there already, and nothing is written over it", path=str(target))
                )
            store.save_copy(number, target)
            print(message("{target} is written", target=target), file=sys.stderr)
    left = store.entries()
    pause = store.pause(here) if here else None
    if pause is not None and not pause.left(store.clock()):
        pause = None
    if store.closed:
        print(f"silo-mod: {store.closed}", file=sys.stderr)
    _show_queue(args, left, here, pause, store.clock())
    if stopped is not None:
        return exit_of(stopped)
    return Exit.UNDONE if left else Exit.DONE


def _retry(args: argparse.Namespace, store: Store, here: str) -> SiloError | None:
    """Send what waits; returns the error that stopped it, or None."""
    from silo.outbox.send import send_all

    for number in args.numbers:
        store.retry(number, here if args.here else None)
    with client_of(args) as client:
        report = send_all(store, client, force=True, on_progress=set_sending_step)
    for sent in report.sent:
        print(
            message(
                "{part_number} {file_name} is in Silo",
                part_number=sent.part_number,
                file_name=sent.entry.label or sent.entry.file_name,
            ),
            file=sys.stderr,
        )
    if report.busy:
        print(message("silo-mod: another program sends just now"), file=sys.stderr)
    return report.stopped_by


def _show_queue(
    args: argparse.Namespace, left: Sequence[Entry], here: str, pause: Pause | None, now: float
) -> None:
    from rich.text import Text

    from silo.cli.terminal import console, plain, table_of
    from silo.outbox.status_text import parts, pause_text, status_text

    queue_rows = [(pending, status_text(pending, here, is_paused=pause is not None)) for pending in left]
    notice = pause_text(pause, here, now) if pause is not None else ""
    if args.json:
        rows = [
            {
                "number": pending.id,
                "part_number": pending.part_number,
                "label": pending.label,
                "path": pending.path,
                "what": parts(pending),
                "state": said.state,
                "reason": said.reason,
                "since": pending.taken_at,
                "server": pending.server,
                "needs_a_person": said.urgent,
            }
            for pending, said in queue_rows
        ]
        print_json({"pause": notice or None, "items": rows, "total": len(rows)})
        return
    out = console()
    if notice:
        out.print(plain(notice), style="yellow", markup=False)
    if not left:
        out.print(message("Nothing waits: every commit of this computer is in Silo."), markup=False)
        return
    table = table_of("", "Commit", "What", "Since", "State", "Why")
    for entry, said in queue_rows:
        name = " ".join(filter(None, (entry.part_number, entry.label or entry.file_name)))
        since = time.strftime("%Y-%m-%d %H:%M", time.localtime(entry.taken_at))
        cells = (str(entry.id), plain(name), parts(entry), since, said.state, plain(said.reason))
        table.add_row(*map(Text, map(spoken, cells)), style="bold" if said.urgent else "")
    out.print(table)
