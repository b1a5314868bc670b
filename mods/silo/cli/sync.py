# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod sync``: bring BOMs to the server; one file or a whole vault."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

from silo.batch import Options, TopResult, exit_code, result_json, stopped_by, sync_top
from silo.bom.errors import InputError, SiloError
from silo.bom.model import Extraction
from silo.bom_sync import Status
from silo.cli import common
from silo.cli.common import Commands
from silo.files import check_writable, documents_in


def register(commands: Commands) -> None:
    """Add the command."""
    parser = common.add_command(
        commands,
        "sync",
        "merge BOMs into the server; nothing is ever deleted, manual lines are never touched",
        "silo-mod sync TopAssembly.FCStd --recursive",
    )
    parser.add_argument("tops", metavar="TOP.FCStd", nargs="+", help="assembly files, or folders of them")
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
    parser.add_argument("--report", metavar="OUT.md", help="write a Markdown report to this file")
    common.add_json_option(parser)
    common.add_server_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Sync each file; one failure does not stop the rest. 1 or 3 where anything was left undone."""
    tops = documents_in(args.tops)
    if not tops:
        raise InputError(f"no FreeCAD files (*.FCStd) in {', '.join(args.tops)}")
    check_writable(args.report)
    options = Options(
        recursive=args.recursive,
        allow_missing=args.allow_missing,
        dry_run=args.dry_run,
        skip_parts=any(Path(top).is_dir() for top in args.tops),
    )
    results: list[TopResult] = []
    stopped: SiloError | None = None
    with common.client_of(args) as client:
        extractions = _extractions(args, tops)
        for number, top in enumerate(tops, start=1):
            # Before the file is read: a person wants to know which one takes so long.
            if (len(tops) > 1 or args.via == "freecad") and sys.stderr.isatty():
                print(f"[{number}/{len(tops)}] {top}", file=sys.stderr)
            if stopped is not None:
                results.append(TopResult(top, error=stopped))
            else:
                _, found = next(extractions)
                if number == 1 and isinstance(found, Extraction):
                    common.reach(client, found)
                results.append(sync_top(top, found, client, options))
                stopped = stopped_by(results[-1], client)
            if not args.json:
                _show(results[-1])
    if args.report:
        from silo.batch_report import markdown

        Path(args.report).write_text(markdown(results), encoding="utf-8")
    if args.json:
        common.print_json({"results": [result_json(result) for result in results]})
    elif len(results) > 1:
        fine = sum(result.fine for result in results)
        print(f"{fine} of {len(results)} files in order.")
    return exit_code(results)


def _extractions(args: argparse.Namespace, tops: list[str]) -> Iterator[tuple[str, Extraction | SiloError]]:
    if args.via == "freecad":
        from silo.freecadcmd.run import run_freecad

        yield from run_freecad(tops, args.assembly, hardware=not args.no_hardware)
        return
    for top in tops:
        try:
            yield top, common.read_assembly(top, args.assembly, hardware=not args.no_hardware)
        except SiloError as error:
            yield top, error


def _show(result: TopResult) -> None:
    from silo.cli import show

    out = show.console()
    if result.error is not None:
        out.print(f"✗ {show.plain(result.top)}: {show.plain(str(result.error))}", style="red", markup=False)
        return
    if result.skipped:
        out.print(f"· {show.plain(result.top)}: {result.skipped}", style="dim", markup=False)
        return
    assert result.whole is not None  # neither an error nor skipped
    for outcome in result.outcomes:
        out.print(show.outcome_text(outcome))
        if outcome.plan is not None and outcome.status is not Status.UNCHANGED:
            out.print(show.diff_table(outcome.plan.diff, outcome.names))
    if result.whole.findings:
        out.print(show.findings_text(result.whole.findings, result.base))
