# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod sync``: bring BOMs to the server; of one file, or of a whole vault every night."""

from __future__ import annotations

import argparse
import os
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from silo.batch import Options, TopResult, stopped_by, sync_top
from silo.bom.errors import DocumentError, InputError, SiloError
from silo.cli import common
from silo.cli.common import Commands
from silo.files import check_writable, documents_in

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.batch_report import Summary

# A job at night waits for a server that is busy.
_BUSY_TRIES, _LONGEST_S = 12, 120.0


def register(commands: Commands) -> None:
    """Add the command."""
    parser = common.add_command(
        commands,
        "sync",
        "merge BOMs into the server; nothing is ever deleted, manual lines are never touched",
        "silo-mod sync vault/ --report night.md --report night.xml",
    )
    parser.add_argument(
        "tops", metavar="TOP", nargs="+", help="assembly files, or folders: all assemblies below them"
    )
    parser.add_argument("--assembly", metavar="NAME", help="the assembly to read, where a file holds several")
    common.add_hardware_option(parser)
    parser.add_argument(
        "--recursive", action="store_true", help="sub-assemblies too, children before parents"
    )
    parser.add_argument("--dry-run", action="store_true", help="show what would change and send nothing")
    parser.add_argument(
        "--allow-missing",
        action="store_true",
        help="sync although files are missing; their known lines stay as they are",
    )
    parser.add_argument(
        "--via",
        choices=("files", "freecad"),
        default="files",
        help="read the files directly (default), or let freecadcmd open them",
    )
    parser.add_argument(
        "--report",
        metavar="FILE",
        action="append",
        default=[],
        help="write a report: Markdown (.md), JSON (.json) or JUnit XML (.xml); may be given several times",
    )
    common.add_json_option(parser)
    common.add_reading_options(parser)
    common.add_server_options(parser)
    common.not_with(parser, "--via", *common.READING)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Sync each file; one failure does not stop the rest. 1 or 3 where anything was left undone."""
    from silo.batch_report import Report, Summary, form_of
    from silo.vault.lock import only_job

    common.refuse_assembly_of(args.tops, args.assembly)
    tops = documents_in(args.tops)
    if not tops:
        raise InputError(f"no FreeCAD files (*.FCStd) in {', '.join(args.tops)}")
    check_writable(*args.report)
    for path in args.report:
        form_of(path)
    folders = [top for top in args.tops if Path(top).is_dir()]
    base = os.path.realpath(folders[0]) if len(folders) == len(args.tops) == 1 else ""
    options = Options(
        recursive=args.recursive or (bool(folders) and args.via == "files"),
        allow_missing=args.allow_missing,
        dry_run=args.dry_run,
        skip_parts=bool(folders),
    )
    summary = Summary(base)
    stop = threading.Event()
    with ExitStack() as stack:
        for folder in {os.path.realpath(folder): folder for folder in folders}.values():
            summary.notes += filter(None, [stack.enter_context(only_job(folder))])
        client = stack.enter_context(
            common.client_of(args, busy_tries=_BUSY_TRIES, longest=_LONGEST_S, stop=stop)
        )
        reports = [Report(path) for path in args.report]
        shown = _Shown(args, summary, many=len(tops) > 1)
        ended = None
        try:
            for result in _results(args, tops, options, client, summary, stop):
                summary.add(result)
                shown.add(result)
                for report in reports:
                    report.add(result)
            ended = summary
        finally:
            for report in reports:
                report.close(ended)
            shown.close(ended)
    for trouble in filter(None, (report.trouble for report in reports)):
        print(f"silo-mod: {trouble}", file=sys.stderr)
    return summary.exit_code or int(any(report.trouble for report in reports))


def _results(
    args: argparse.Namespace,
    tops: Sequence[str],
    options: Options,
    client: SiloClient,
    summary: Summary,
    stop: threading.Event,
) -> Iterator[TopResult]:
    if args.via == "freecad":
        yield from _by_freecad(args, tops, options, client)
        return
    from silo.vault.job import Job
    from silo.vault.plan import make_plan

    begin = time.monotonic()
    told = _Progress(len(tops))
    with common.reading_of(args) as reading:
        if summary.base:
            reading.index.expect(summary.base)
        plan = make_plan(
            tops,
            reading,
            assembly=args.assembly,
            hardware=not args.no_hardware,
            recursive=options.recursive,
            skip_parts=options.skip_parts,
            progress=told.begin,
        )
        summary.parts, summary.files, summary.fine = plan.parts, plan.parts, plan.parts
        reading.index.save()
        summary.seconds["reading"] = time.monotonic() - begin
        if not plan.uuids and plan.nodes:
            common.reach(client)
        begin = time.monotonic()
        yield from Job(plan, reading, client, options, summary.base, stop).results()
        summary.seconds["server"] = time.monotonic() - begin
        summary.add_findings(plan.shared)
        summary.notes += filter(None, [reading.index.trouble])
        if summary.base:
            summary.moved += moved(reading.index.places(summary.base), plan.places, summary.base)
            if not options.dry_run:  # a look takes no news from the report of the night
                reading.index.keep_places(summary.base, plan.places)
            reading.index.forget(summary.base, {os.path.realpath(top) for top in tops})


def _by_freecad(
    args: argparse.Namespace, tops: Sequence[str], options: Options, client: SiloClient
) -> Iterator[TopResult]:
    """Files that FreeCAD opens, one by one."""
    from silo.freecadcmd.run import run_freecad

    stopped: SiloError | None = None
    asked = dict.fromkeys(top for top in tops if os.path.isfile(top))
    found = run_freecad(list(asked), args.assembly, hardware=not args.no_hardware)
    told = _Progress(len(tops), always=True)
    for number, top in enumerate(tops):
        told.begin(top)
        if stopped is not None:
            yield TopResult(top, error=stopped)
            continue
        if top not in asked:  # a link to nothing, a folder that cannot be listed
            yield TopResult(top, error=DocumentError(top, "it cannot be opened"))
            continue
        _, extraction = next(found)
        if number == 0 and not isinstance(extraction, SiloError):
            common.reach(client, extraction)
        result = sync_top(top, extraction, client, options)
        stopped = stopped_by(result, client)
        yield result


class _Progress:
    """Names each file when it is begun, on a terminal: a person wants to know which one takes so long."""

    def __init__(self, count: int, *, always: bool = False) -> None:
        self._count, self._number = count, 0
        self._shows = (count > 1 or always) and sys.stderr.isatty()

    def begin(self, top: str) -> None:
        self._number += 1
        if self._shows:
            print(f"[{self._number}/{self._count}] {top}", file=sys.stderr)


class _Shown:
    """What standard output gets: JSON as the run goes, or what changed, and errors last."""

    def __init__(self, args: argparse.Namespace, summary: Summary, *, many: bool) -> None:
        from silo.batch_report import Json

        self._json, self._many, self._count = Json() if args.json else None, many, 0
        if self._json is not None:
            print(self._json.head(summary), end="")

    def add(self, result: TopResult) -> None:
        if self._json is not None:
            print(self._json.one(result, self._count), end="")
            self._count += 1
        else:
            _show(result, whole=not self._many)

    def close(self, summary: Summary | None) -> None:
        if self._json is not None:
            print(self._json.end(summary), end="")
        elif summary is not None and self._many:
            _show_summary(summary)


def _show(result: TopResult, *, whole: bool) -> None:
    """``whole``: everything about the one file; of many only what changed, for the summary says the rest."""
    from silo.batch_report import is_news
    from silo.bom_sync import Status
    from silo.cli import show

    out = show.console()
    if result.error is not None:
        words = str(result.error)
        where = "" if os.path.basename(result.top) in words else f"{result.top}: "
        out.print(f"✗ {show.plain(where + words)}", style="red", markup=False)
        return
    for outcome in result.outcomes:
        if not whole and not is_news(outcome):
            continue
        out.print(show.outcome_text(outcome))
        if outcome.plan is not None and outcome.status in (Status.MERGED, Status.DRY_RUN):
            out.print(show.diff_table(outcome.plan.diff, outcome.names))
    if whole and result.findings:
        out.print(show.findings_text(result.findings, result.base))


def _show_summary(summary: Summary) -> None:
    from silo.cli import show

    out = show.console()
    sections: list[tuple[str, str, Sequence[str]]] = [
        ("Moved", "cyan", [f"{name}: {old} → {new}" for name, old, new in summary.moved]),
        ("Without a part number (silo-mod register)", "yellow", list(summary.unregistered.values())),
        ("Warnings", "yellow", list(summary.warnings)),
        ("Errors", "bold red", list(summary.errors)),
    ]
    for title, style, lines in sections:
        if lines:
            out.print(f"\n{title}", style=style)
        for line in lines:
            out.print(f"  {show.plain(line)}", markup=False)
    for note in summary.notes:
        out.print(show.plain(note), style="yellow", markup=False)
    out.print(f"\n{summary.sentence()}", markup=False)


def moved(before: dict[str, set[str]], now: set[tuple[str, str]], base: str) -> list[tuple[str, str, str]]:
    """Files that carry on the identity of one that is gone or another item's by now: (name, before, now)."""
    from silo.bom.document import relative

    here: dict[str, set[str]] = {}
    for uuid, path in now:
        here.setdefault(uuid, set()).add(path)
    taken = {path for _, path in now}
    found = []
    for uuid, paths in sorted(before.items()):
        left = paths - here.get(uuid, set())
        gone = {path for path in left if path in taken or not os.path.lexists(path)}
        new = here.get(uuid, set()) - paths
        if len(gone) == len(new) == 1:
            (old_path,), (new_path,) = gone, new
            name = os.path.splitext(os.path.basename(new_path))[0]
            found.append((name, relative(old_path, base), relative(new_path, base)))
    return found
