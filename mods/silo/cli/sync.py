# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod sync``: bring BOMs to the server; one file or a whole vault."""

from __future__ import annotations

import argparse
import sys
import uuid
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo.bom.errors import InputError, SiloError
from silo.bom.model import Extraction
from silo.bom.report import base_of, diff_json, entry_json, finding_json, relative
from silo.bom_sync import Outcome, Resolved, Status, blocking, resolve, sync, sync_tree
from silo.cli import common
from silo.cli.common import Commands

if TYPE_CHECKING:
    from silo.api.client import SiloClient

_FINE = (Status.MERGED, Status.UNCHANGED, Status.DRY_RUN)


@dataclass(frozen=True)
class TopResult:
    """What became of one file: its outcomes, or the error that kept it from being read."""

    top: str
    base: str = ""
    whole: Resolved | None = None
    outcomes: tuple[Outcome, ...] = ()
    error: SiloError | None = None
    skipped: str = ""

    @property
    def fine(self) -> bool:
        return self.error is None and all(outcome.status in _FINE for outcome in self.outcomes)


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
    parser.add_argument(
        "--recursive", action="store_true", help="sub-assemblies too, children before parents"
    )
    parser.add_argument("--dry-run", action="store_true", help="show what would change and send nothing")
    parser.add_argument(
        "--allow-missing",
        action="store_true",
        help="sync although links are broken (they read as unreferenced)",
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
    """Sync each file; one failure does not stop the rest. 1 where anything was left undone."""
    tops = common.documents_in(args.tops)
    if not tops:
        raise InputError(f"no FreeCAD files (*.FCStd) in {', '.join(args.tops)}")
    folders = any(Path(top).is_dir() for top in args.tops)
    results: list[TopResult] = []
    with common.client_of(args) as client:
        for number, (top, found) in enumerate(_extractions(args, tops), start=1):
            if len(tops) > 1 and sys.stderr.isatty():
                print(f"[{number}/{len(tops)}] {top}", file=sys.stderr)
            results.append(_sync_one(args, client, top, found, in_folder=folders))
            if not args.json:
                _show(results[-1])
    if args.report:
        from silo.cli.report import markdown

        Path(args.report).write_text(markdown(results), encoding="utf-8")
    if args.json:
        common.print_json({"results": [result_json(result) for result in results]})
    return 0 if all(result.fine for result in results) else 1


def _extractions(args: argparse.Namespace, tops: list[str]) -> Iterator[tuple[str, Extraction | SiloError]]:
    if args.via == "freecad":
        from silo.cli.via_freecad import extract_with_freecad

        yield from extract_with_freecad(tops, args.assembly)
        return
    for top in tops:
        try:
            yield top, common.read_assembly(top, args.assembly)
        except SiloError as error:
            yield top, error


def _sync_one(
    args: argparse.Namespace, client: SiloClient, top: str, found: Extraction | SiloError, *, in_folder: bool
) -> TopResult:
    if isinstance(found, SiloError):
        return TopResult(top, error=found)
    base = base_of(found)
    if in_folder and not found.entries and not found.blocked:
        return TopResult(top, base, skipped="no components of other files: a part, not an assembly")
    try:
        whole = resolve(found, client)
        options = {"allow_missing": args.allow_missing, "dry_run": args.dry_run}
        if args.recursive:
            outcomes = tuple(
                sync_tree(whole, client, sync_id=_new_id, describe=common.source_document, **options)
            )
        else:
            document = common.source_document(whole.assembly)
            outcomes = (sync(whole, client, sync_id=_new_id(), document=document, **options),)
    except SiloError as error:
        return TopResult(top, base, error=error)
    return TopResult(top, base, whole, outcomes)


def _new_id() -> str:
    return str(uuid.uuid4())


def result_json(result: TopResult) -> dict[str, Any]:
    """One file's result for machines."""
    data: dict[str, Any] = {"top": result.top, "ok": result.fine}
    if result.error is not None:
        data["error"] = {"code": result.error.code, "message": str(result.error)}
    if result.skipped:
        data["skipped"] = result.skipped
    data["assemblies"] = [outcome_json(outcome, result.base) for outcome in result.outcomes]
    if result.whole is not None:
        data["unregistered"] = [entry_json(entry, result.base) for entry in result.whole.unresolved]
        data["findings"] = [finding_json(finding, result.base) for finding in result.whole.findings]
    return data


def outcome_json(outcome: Outcome, base: str) -> dict[str, Any]:
    """One assembly's outcome for machines."""
    head = outcome.assembly
    data: dict[str, Any] = {
        "doc_path": relative(head.doc_path, base),
        "object": head.object_name,
        "part_number": head.part_number,
        "status": outcome.status.value,
    }
    if outcome.plan is not None:
        data["diff"] = diff_json(outcome.plan.diff)
    if outcome.result is not None:
        data["result"] = outcome.result.model_dump(mode="json", exclude_none=True)
    if outcome.error is not None:
        data["error"] = {"code": outcome.error.code, "message": str(outcome.error)}
    if outcome.status is Status.BLOCKED:
        data["blocked_by"] = [finding_json(f, base) for f in blocking(outcome.resolved)]
    return data


def _show(result: TopResult) -> None:
    from silo.cli import show
    from silo.cli.diff import names_of

    out = show.console()
    if result.error is not None:
        out.print(f"✗ {show.plain(result.top)}: {show.plain(str(result.error))}", style="red", markup=False)
        return
    if result.skipped:
        out.print(f"· {show.plain(result.top)}: {result.skipped}", style="dim", markup=False)
        return
    assert result.whole is not None  # neither an error nor skipped
    names = names_of(result.whole)
    for outcome in result.outcomes:
        out.print(show.outcome_text(outcome))
        if outcome.plan is not None and outcome.status is not Status.UNCHANGED:
            out.print(show.diff_table(outcome.plan.diff, names))
    if result.whole.findings:
        out.print(show.findings_text(result.whole.findings, result.base))
