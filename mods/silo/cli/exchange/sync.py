# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod sync``: BOMs to the server; of one file, or of a whole vault every night."""

from __future__ import annotations

import argparse
import os
import sys
import threading
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from silo.batch import SyncOptions, TopResult
from silo.bom.errors import DocumentError, Exit, InputError
from silo.bom.message import message
from silo.cli.connection import client_of, reach
from silo.cli.options import EACH, add_options
from silo.cli.progress import count_steps, set_step
from silo.cli.reading import reading_of, refuse_assembly_of
from silo.files import documents_in

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.batch import RunSummary


def add_sync(parser: argparse.ArgumentParser) -> None:
    """Add the command."""
    parser.add_argument(
        "tops",
        metavar="TOP",
        nargs="*",
        default=["."],
        help="assembly files, or folders: all assemblies below them (default: this folder)",
    )
    add_options(parser, {"--verbose": message("each assembly that changes, and each file at fault")})


def run_sync(args: argparse.Namespace) -> int:
    """Sync each file; one failure does not stop the rest. Returns 1 or 3 if anything was left undone."""
    from silo.api.policy import NIGHT
    from silo.batch import ReportFile, RunSummary
    from silo.vault.job import only_job

    refuse_assembly_of(args.tops, args.assembly)
    tops = documents_in(args.tops)
    if not tops:
        raise InputError(message("no FreeCAD files (*.FCStd) in {tops}", tops=", ".join(args.tops)))
    folders = [top for top in args.tops if Path(top).is_dir()]
    base = os.path.realpath(folders[0]) if len(folders) == len(args.tops) == 1 else ""
    options = SyncOptions(
        recursive=args.recursive or bool(folders),
        allow_missing=args.allow_missing,
        dry_run=args.dry_run,
        skip_parts=bool(folders),
    )
    summary = RunSummary(base)
    stop = threading.Event()
    with ExitStack() as stack:
        for folder in {os.path.realpath(folder): folder for folder in folders}.values():
            summary.notes += filter(None, [stack.enter_context(only_job(folder))])
        client = stack.enter_context(client_of(args, NIGHT, stop=stop))
        reports = [ReportFile(path) for path in args.report]
        pages = [path for path in args.report if path.lower().endswith(".html")]
        summary.page = os.path.realpath(pages[0]) if pages else ""
        shown = _Shown(args, many=len(tops) > 1)
        ended, unusable = None, False
        named = {top for top in args.tops if not os.path.isdir(top)}
        try:
            for result in _results(args, tops, options, client, summary, stop):
                summary.add(result)
                unusable = unusable or (result.top in named and isinstance(result.error, DocumentError))
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
    code = summary.exit_code or int(any(report.trouble for report in reports))
    return max(code, Exit.BAD_INPUT) if unusable else code


def _results(
    args: argparse.Namespace,
    tops: Sequence[str],
    options: SyncOptions,
    client: SiloClient,
    summary: RunSummary,
    stop: threading.Event,
) -> Iterator[TopResult]:
    from silo.vault.job import SyncJob
    from silo.vault.plan import make_plan

    begin = time.monotonic()
    with reading_of(args) as reading:
        if summary.base:
            reading.index.expect(summary.base)
        plan = make_plan(
            tops,
            reading,
            assembly=None if args.assembly == EACH else args.assembly,
            each=options.skip_parts or args.assembly == EACH,
            hardware=not args.no_hardware,
            recursive=options.recursive,
            skip_parts=options.skip_parts,
            progress=count_steps(len(tops)),
        )
        summary.parts, summary.files, summary.fine = plan.parts, plan.parts, plan.parts
        reading.index.save()
        summary.seconds["reading"] = time.monotonic() - begin
        if not plan.uuids and plan.nodes:
            reach(client)
        begin = time.monotonic()
        set_step(message("asking the server"))
        progress = count_steps(len(plan.errors) + len({node.top for node in plan.nodes.values()}))
        for result in SyncJob(plan, reading, client, options, summary.base, stop).results():
            progress(result.top)
            yield result
        summary.seconds["server"] = time.monotonic() - begin
        summary.add_findings(plan.shared)
        summary.notes += filter(None, [reading.index.trouble])
        if summary.base:
            summary.moved += moved(reading.index.places(summary.base), plan.places, summary.base)
            summary.before = reading.index.told(summary.base)
            if not options.dry_run:  # a look takes no news from the report of the night
                reading.index.keep_places(summary.base, plan.places)
                if not summary.unsent:  # else the findings are not known, and all would be new the next time
                    reading.index.keep_told(summary.base, summary.told())
            reading.index.forget(summary.base, {os.path.realpath(top) for top in tops})


class _Shown:
    """What standard output gets: JSON as the run goes, or what changed, and errors last."""

    def __init__(self, args: argparse.Namespace, *, many: bool) -> None:
        from silo.batch import Json

        self._json, self._many, self._count = Json() if args.json else None, many, 0
        self._verbose: bool = args.verbose
        if self._json is not None:
            print(self._json.head(None), end="")

    def add(self, result: TopResult) -> None:
        if self._json is not None:
            print(self._json.one(result, self._count), end="")
            self._count += 1
        elif self._verbose or not self._many:
            _show(result, whole=not self._many)

    def close(self, summary: RunSummary | None) -> None:
        if self._json is not None:
            print(self._json.end(summary), end="")
        elif summary is not None and self._many:
            _show_summary(summary, whole=self._verbose)


def _show(result: TopResult, *, whole: bool) -> None:
    """Show a result. ``whole``: everything about the one file; otherwise only what changed, since the summary
    has the rest.
    """
    from silo.batch import is_news
    from silo.bom_sync.steps import Status
    from silo.cli.bom_display import diff_table, findings_text
    from silo.cli.sync_display import outcome_text
    from silo.cli.terminal import console, plain

    out = console()
    if result.error is not None:
        words = str(result.error)
        where = "" if os.path.basename(result.top) in words else f"{result.top}: "
        out.print(message("✗ {words}", words=plain(where + words)), style="red", markup=False)
        return
    for outcome in result.outcomes:
        if not whole and not is_news(outcome):
            continue
        out.print(outcome_text(outcome, result.base))
        if outcome.plan is not None and outcome.status in (Status.MERGED, Status.DRY_RUN):
            out.print(diff_table(outcome.plan.diff, outcome.names))
    if whole and result.findings:
        out.print(findings_text(result.findings, result.base))


def _show_summary(summary: RunSummary, *, whole: bool) -> None:
    """Show the counts and what is left to people, on one screen; ``whole``: each file at fault."""
    from silo.cli.terminal import console, plain

    out = console()
    out.print(plain(summary.sentence()), markup=False, soft_wrap=True)
    mail: Iterable[tuple[str, list[tuple[str, list[str]]]]] = (
        (title, [(line, []) for line in lines]) for title, lines in summary.mail()
    )
    for title, lines in summary.sections() if whole else mail:
        if lines:
            out.print(f"\n{title}", style=_STYLES.get(title, ""))
        for line, more in lines:
            out.print(f"  {plain(line)}", markup=False, soft_wrap=True)
            for text in more:
                out.print(message("    {text}", text=plain(text)), markup=False, soft_wrap=True)


_STYLES = {"New since the last run": "bold", "Moved": "cyan", "Warnings": "yellow", "Errors": "bold red"}


def moved(before: dict[str, set[str]], now: set[tuple[str, str]], base: str) -> list[tuple[str, str, str]]:
    """Find the files that took over the identity of a file that is gone, or that has another item now: (name,
    before, now).
    """
    from silo.bom.walk.document import relative

    here: dict[str, set[str]] = {}
    for uuid, path in now:
        here.setdefault(uuid, set()).add(path)
    taken = {path for _, path in now}
    result = []
    for uuid, paths in sorted(before.items()):
        left = paths - here.get(uuid, set())
        gone = {path for path in left if path in taken or not os.path.lexists(path)}
        new = here.get(uuid, set()) - paths
        if len(gone) == len(new) == 1:
            (old_path,), (new_path,) = gone, new
            name = os.path.splitext(os.path.basename(new_path))[0]
            result.append((name, relative(old_path, base), relative(new_path, base)))
    return result
