# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod diff`` and ``bom-diff``: CAD against the server; two folders or git revisions without one."""

from __future__ import annotations

import argparse
import os
from itertools import chain
from pathlib import Path
from typing import Any, Literal

from silo.batch import suggest_by_identity
from silo.bom.changes import AssemblyChange, LineChange, changes_json, compare_assemblies
from silo.bom.document import relative
from silo.bom.errors import Exit, InputError
from silo.bom.model import BomDiff, BomEntry
from silo.bom.naming import display_name
from silo.bom.report import base_of, diff_json, finding_json, shorten
from silo.bom_sync import Resolved, assemblies, blocking, names_of, resolve, server_lines
from silo.cli import common
from silo.cli.common import Commands
from silo.folders import scratch_folder
from silo.vault.folder import FolderBoms, read_folder


def register(commands: Commands) -> None:
    """Add the commands."""
    _add_diff(commands)
    _add_bom_diff(commands)


def _add_diff(commands: Commands) -> None:
    parser = common.add_command(
        commands,
        "diff",
        "compare an assembly's BOM with the server's; changes nothing",
        "silo-mod diff TopAssembly.FCStd --check",
    )
    common.add_assembly_options(parser, folders=True)
    parser.add_argument("--recursive", action="store_true", help="compare the sub-assemblies too")
    parser.add_argument("--check", action="store_true", help="exit 1 where CAD and server differ, for CI")
    common.add_json_option(parser)
    common.add_server_options(parser)
    parser.set_defaults(run=run_diff)


def run_diff(args: argparse.Namespace) -> int:
    """Print the comparison; with ``--check`` 1 on drift, on broken links and on unregistered components."""
    if os.path.isdir(args.top):
        return _folder(args)
    extraction = common.read_top(args)
    with common.client_of(args) as client:
        common.reach(client, extraction)
        whole = resolve(extraction, client)
        chosen = list(assemblies(whole)) if args.recursive else [whole]
        lines = [server_lines(one, client) for one in chosen]
        whole = suggest_by_identity(whole, list(zip(chosen, lines, strict=True)))
    compared = [(one, one.diff(known)) for one, known in zip(chosen, lines, strict=True)]
    base = base_of(extraction)
    drifted = bool(whole.unresolved or whole.assembly.part_number is None) or any(
        diff.drifted or blocking(one) for one, diff in compared
    )
    if args.json:
        data = [{**_head(one, base), "diff": diff_json(diff)} for one, diff in compared]
        told = chain(whole.findings, *(diff.findings_at(one.assembly) for one, diff in compared))
        findings = [finding_json(finding, base) for finding in told]
        common.print_json({"drift": drifted, "assemblies": data, "findings": findings})
    else:
        _show(whole, compared, names_of(whole, chain.from_iterable(lines)), base)
    # What cannot be compared whole is no answer, whether one wants to know of differences or not.
    broken = any(blocking(one) or one.assembly.part_number is None for one, _ in compared)
    return Exit.UNDONE if broken or (args.check and drifted) else Exit.DONE


def _folder(args: argparse.Namespace) -> int:
    """Every assembly of a folder against the server; only those that differ are shown."""
    from silo.batch import Options
    from silo.batch_report import Summary, is_news
    from silo.cli import show
    from silo.vault.job import Job

    out, data = show.console(), []
    with common.plan_of(args) as (plan, reading, base), common.client_of(args) as client:
        if not plan.uuids:
            common.reach(client)
        summary = Summary(base)
        drifted = broken = False
        compared_count = 0
        for result in Job(plan, reading, client, Options(recursive=True, dry_run=True), base).results():
            summary.add(result)
            broken = broken or result.error is not None
            drifted = drifted or not result.fine or bool(result.unregistered)
            for outcome in result.outcomes:
                news = is_news(outcome)
                whole = not blocking(outcome.resolved)
                numbered = outcome.resolved.assembly.part_number is not None
                broken = broken or not whole or not numbered or outcome.error is not None
                compared_count += outcome.plan is not None and whole
                drifted = drifted or (outcome.plan is not None and outcome.plan.diff.drifted)
                if args.json:
                    compared = {"diff": diff_json(outcome.plan.diff)} if outcome.plan is not None else {}
                    data.append({**_head(outcome.resolved, base), **compared})
                elif news:
                    out.print(show.outcome_text(outcome))
                    if outcome.plan is not None and whole:
                        out.print(show.diff_table(outcome.plan.diff, outcome.names))
    if args.json:
        findings = [finding_json(finding, base) for finding in summary.findings]
        errors = [{"message": words, "files": files} for words, files in summary.errors.items()]
        common.print_json({"drift": drifted, "assemblies": data, "findings": findings, "errors": errors})
    else:
        for words in (*summary.warnings, *summary.errors):
            out.print(show.plain(words), markup=False)
        words = "no differences"
        if drifted:
            words = "there are differences, or what could not be compared (see above)"
        out.print(f"Assemblies compared: {compared_count}; {words}.")
    if summary.exit_code is Exit.REMOTE:
        return Exit.REMOTE
    return Exit.UNDONE if broken or (args.check and drifted) else Exit.DONE


def _head(one: Resolved, base: str) -> dict[str, Any]:
    head = one.assembly
    return {
        "doc_path": relative(head.doc_path, base),
        "object": head.object_name,
        "part_number": head.part_number,
        "name": head.name,
    }


def _show(
    whole: Resolved, compared: list[tuple[Resolved, BomDiff]], names: dict[str, str], base: str
) -> None:
    from silo.cli import show

    out = show.console()
    for one, diff in compared:
        head = one.assembly
        if head.part_number:
            out.print(show.entry_text(head, base))
        else:
            name = show.plain(display_name(head))
            out.print(
                f"{name}: no part number yet, so nothing to compare with (silo-mod register)", markup=False
            )
        if head.part_number or diff.added:
            out.print(show.diff_table(diff, names, whole=not (blocking(one) or one.unresolved)))
        out.print()
    out.print(show.findings_text(whole.findings, base))


_MARK = {
    "added": ("+", "green"),
    "removed": ("-", "red"),
    "quantity_changed": ("~", "yellow"),
    "moved": ("→", "dim"),
}


def _add_bom_diff(commands: Commands) -> None:
    parser = common.add_command(
        commands,
        "bom-diff",
        "show what changed in parts between two folders, or two git revisions; needs no server",
        "silo-mod bom-diff --git main...HEAD",
    )
    parser.add_argument(
        "folders", metavar="FOLDER", nargs="*", help="OLD and NEW; with --git the one folder to compare"
    )
    parser.add_argument(
        "--git",
        metavar="A..B",
        help="compare two revisions of a repository; A...B: from where B branched off A; "
        "A alone: against the files as they are",
    )
    parser.add_argument("--check", action="store_true", help="exit 1 where a BOM changed, for CI")
    parser.add_argument("--markdown", action="store_true", help="print Markdown, for a pull request")
    common.add_json_option(parser)
    parser.set_defaults(run=run_bom_diff)


def run_bom_diff(args: argparse.Namespace) -> int:
    """Print the comparison. 1 where a BOM could not be read whole, and with ``--check`` where one changed."""
    if args.json and args.markdown:
        raise InputError("--json and --markdown exclude each other; take one.")
    old, new = _two_states(args)
    changes = compare_assemblies(old.assemblies, new.assemblies)
    if args.json:
        common.print_json(_changes_json(changes, old, new))
    elif args.markdown:
        print(_markdown(changes, old, new))
    else:
        _show_changes(changes, old, new)
    # An old state that is damaged cannot be mended any more; a new one can.
    return Exit.UNDONE if not new.complete or (args.check and changes) else Exit.DONE


def _two_states(args: argparse.Namespace) -> tuple[FolderBoms, FolderBoms]:
    """What is to be compared. Raises InputError."""
    if args.git is None:
        if len(args.folders) != 2:
            raise InputError("Name two folders, OLD and NEW, or two revisions with --git A..B.")
        return read_folder(args.folders[0]), read_folder(args.folders[1])
    if len(args.folders) > 1:
        raise InputError("With --git name at most one folder, the part of the repository to compare.")
    from silo.vault.git import lay_out, parse_range, top_of

    top, below, work_tree = top_of(args.folders[0] if args.folders else ".")
    chosen = parse_range(top, args.git)
    if chosen.new is None and not work_tree:
        raise InputError(f"{top} has no work tree to compare with. Name two revisions, A..B.")
    laid: dict[str, Path] = {}
    with scratch_folder("silo-bom-diff-") as scratch:

        def state(name: str, revision: str | None) -> tuple[Path, list[tuple[str, str]]]:
            """The whole repository as it was: the folder may use what lies beside it."""
            folder = Path(top) if revision is None else Path(scratch, name)
            return folder, [] if revision is None else lay_out(top, revision, folder, laid)

        states = [state("old", chosen.old), state("new", chosen.new)]
        if not any((folder / below).is_dir() for folder, _ in states):
            raise InputError(f"There are no FreeCAD files in {below or top}, before or after.")
        nothing = Path(scratch, "nothing")
        nothing.mkdir()
        old, new = (
            read_folder(there if (there := folder / below).is_dir() else nothing, root=folder, lost=lost)
            for folder, lost in states
        )
    return old, new


# --- what people see ------------------------------------------------------------------------------------


def _title(change: AssemblyChange) -> str:
    words = {"added": "new assembly", "removed": "assembly removed", "moved": "moved", "changed": ""}
    note = words[change.kind]
    if change.old and change.new and change.old.head.key != change.new.head.key:
        note = f"was {change.old.head.doc_path}"
    return f"{change.head.doc_path}{f' ({note})' if note else ''}"


def _quantities(line: LineChange) -> str:
    if line.old and line.new and line.old.quantity != line.new.quantity:
        return f"{line.old.quantity:g} → {line.new.quantity:g}"
    return f"{line.entry.quantity:g}"


def _where(line: LineChange) -> str:
    gone = " (missing)" if line.entry.missing else ""
    if line.old and line.new and line.old.key != line.new.key:
        return f"{line.old.doc_path} → {line.new.doc_path}{gone}"
    return f"{line.entry.doc_path}{gone}"


def _incomplete(state: FolderBoms, name: str) -> list[str]:
    words = [
        f"{name}: {path} could not be read: {shorten(why, state.base)}" for path, why in state.unreadable
    ]
    return words + [f"{name}: {shorten(finding.message, state.base)}" for finding in state.findings]


def _show_changes(changes: tuple[AssemblyChange, ...], old: FolderBoms, new: FolderBoms) -> None:
    from rich.table import Table
    from rich.text import Text

    from silo.cli import show

    out = show.console()
    for change in changes:
        out.print(Text(show.plain(_title(change)), "bold"))
        table = Table(box=None, pad_edge=False, show_header=False)
        columns: tuple[Literal["left", "right"], ...] = ("left", "left", "right", "left")
        for justify in columns:
            table.add_column(justify=justify)
        for line in change.lines:
            mark, style = _MARK[line.kind]
            name = Text(show.plain(_name(line.entry)))
            table.add_row(
                Text(f"  {mark}", style), name, _quantities(line), Text(show.plain(_where(line)), "dim")
            )
        if change.lines:
            out.print(table)
        out.print()
    if not changes:
        out.print(Text(_unchanged(old, new), "green" if new.assemblies and new.complete else "yellow"))
    for words in (*_incomplete(old, "old"), *_incomplete(new, "new")):
        out.print(Text("✗ ", "bold red").append(show.plain(words), ""))


def _name(entry: BomEntry) -> str:
    return display_name(entry) or entry.object_name


def _unchanged(old: FolderBoms, new: FolderBoms) -> str:
    if not (old.assemblies or new.assemblies):
        return "There is no assembly to compare, before or after."
    part = "" if old.complete and new.complete else " as far as they could be read"
    return f"No BOM changed{part}; assemblies compared: {len(new.assemblies)}."


def _markdown(changes: tuple[AssemblyChange, ...], old: FolderBoms, new: FolderBoms) -> str:
    from silo.batch_report import cell

    lines = ["## BOM changes", ""]
    if not changes:
        lines += [_unchanged(old, new), ""]
    for change in changes:
        lines += [f"### {cell(_title(change))}", ""]
        if change.lines:
            lines += ["| | Part | Quantity | File |", "|---|---|---:|---|"]
        for line in change.lines:
            words = line.kind.replace("_", " ")
            lines.append(
                f"| {words} | {cell(_name(line.entry))} | {_quantities(line)} | {cell(_where(line))} |"
            )
        lines.append("")
    incomplete = [*_incomplete(old, "old"), *_incomplete(new, "new")]
    if incomplete:
        lines += ["### Not complete", "", *(f"- {cell(words)}" for words in incomplete), ""]
    return "\n".join(lines).rstrip()


def _changes_json(changes: tuple[AssemblyChange, ...], old: FolderBoms, new: FolderBoms) -> dict[str, object]:
    def state(boms: FolderBoms) -> dict[str, object]:
        return {
            "assemblies": len(boms.assemblies),
            "complete": boms.complete,
            "unreadable": [{"file": path, "reason": why} for path, why in boms.unreadable],
            "findings": [finding_json(finding, boms.base) for finding in boms.findings],
        }

    return {"changes": changes_json(changes), "old": state(old), "new": state(new)}
