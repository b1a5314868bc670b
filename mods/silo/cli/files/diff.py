# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod diff``: the BOM of an assembly, or of each assembly of a folder, against the server's."""

from __future__ import annotations

import argparse
import os
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo.bom.compare.bom_diff import BomDiff
from silo.bom.errors import Exit
from silo.bom.items.naming import display_name
from silo.bom.message import message
from silo.bom.view.diff_rows import diff_json
from silo.bom.view.folders import base_folder
from silo.bom.view.tree_json import finding_json
from silo.bom.walk.document import relative
from silo.cli.connection import client_of, reach
from silo.cli.json_output import print_json
from silo.cli.options import add_top
from silo.cli.reading import plan_of, read_tops
from silo.proposed_command import proposed

if TYPE_CHECKING:
    from silo.bom_sync.resolved import Resolved


def add_diff(parser: argparse.ArgumentParser) -> None:
    add_top(parser)


def run_diff(args: argparse.Namespace) -> int:
    """Print the comparison; with ``--check`` returns 1 for drift, broken links and unregistered
    components.
    """
    from silo.batch import suggest_by_identity
    from silo.bom_sync.resolved import assemblies, blocking, names_of, resolve
    from silo.bom_sync.steps import server_lines

    if os.path.isdir(args.top):
        return _folder_diff(args)
    extraction = read_tops(args)[0]
    with client_of(args) as client:
        reach(client, extraction)
        whole = resolve(extraction, client)
        chosen = list(assemblies(whole)) if args.recursive else [whole]
        lines = [server_lines(resolved, client) for resolved in chosen]
        whole = suggest_by_identity(whole, list(zip(chosen, lines, strict=True)))
    compared = [(resolved, resolved.diff(rows)) for resolved, rows in zip(chosen, lines, strict=True)]
    base = base_folder(extraction)
    drifted = bool(whole.unresolved or whole.assembly.part_number is None) or any(
        diff.drifted or (blocking(resolved) and not args.allow_missing) for resolved, diff in compared
    )
    if args.json:
        data = [{**_head(resolved, base), "diff": diff_json(diff)} for resolved, diff in compared]
        all_findings = chain(
            whole.findings, *(diff.findings_at(resolved.assembly) for resolved, diff in compared)
        )
        findings = [finding_json(finding, base) for finding in all_findings]
        print_json({"drift": drifted, "assemblies": data, "findings": findings})
    else:
        _show(whole, compared, names_of(whole, chain.from_iterable(lines)), base)
    # What cannot be compared whole is no answer, whether one wants to know of differences or not.
    broken = any(
        (blocking(resolved) and not args.allow_missing) or resolved.assembly.part_number is None
        for resolved, _ in compared
    )
    return Exit.UNDONE if broken or (args.check and drifted) else Exit.DONE


def _folder_diff(args: argparse.Namespace) -> int:
    """Compare every assembly of a folder with the server, and show those that differ."""
    from silo.batch import RunSummary, SyncOptions, is_news
    from silo.bom_sync.resolved import blocking
    from silo.cli.bom_display import diff_table
    from silo.cli.sync_display import outcome_text
    from silo.cli.terminal import console, plain
    from silo.vault.job import SyncJob

    out, data = console(), []
    with plan_of(args) as (plan, reading, base), client_of(args) as client:
        if not plan.uuids:
            reach(client)
        summary = RunSummary(base)
        options = SyncOptions(recursive=True, dry_run=True, allow_missing=args.allow_missing)
        drifted = broken = False
        compared_count = 0
        for result in SyncJob(plan, reading, client, options, base).results():
            summary.add(result)
            broken = broken or result.error is not None
            drifted = drifted or not result.fine or bool(result.unregistered)
            for outcome in result.outcomes:
                news = is_news(outcome)
                whole = args.allow_missing or not blocking(outcome.resolved)
                numbered = outcome.resolved.assembly.part_number is not None
                broken = broken or not whole or not numbered or outcome.error is not None
                compared_count += outcome.plan is not None and whole
                drifted = drifted or (outcome.plan is not None and outcome.plan.diff.drifted)
                if args.json:
                    compared = {"diff": diff_json(outcome.plan.diff)} if outcome.plan is not None else {}
                    data.append({**_head(outcome.resolved, base), **compared})
                elif news:
                    out.print(outcome_text(outcome, base))
                    if outcome.plan is not None and whole:
                        out.print(diff_table(outcome.plan.diff, outcome.names))
    if args.json:
        findings = [finding_json(finding, base) for finding in summary.findings]
        errors = [{"message": words, "files": files} for words, files in summary.errors.items()]
        print_json({"drift": drifted, "assemblies": data, "findings": findings, "errors": errors})
    else:
        for words in (*summary.warnings, *summary.errors):
            out.print(plain(words), markup=False)
        words = message("no differences")
        if drifted:
            words = message("there are differences, or what could not be compared (see above)")
        out.print(
            message(
                "Assemblies compared: {compared_count}; {words}.", compared_count=compared_count, words=words
            )
        )
    if summary.exit_code is Exit.REMOTE:
        return Exit.REMOTE
    return Exit.UNDONE if broken or (args.check and drifted) else Exit.DONE


def _head(resolved: Resolved, base: str) -> dict[str, Any]:
    head = resolved.assembly
    return {
        "doc_path": relative(head.doc_path, base),
        "object": head.object_name,
        "part_number": head.part_number,
        "name": head.name,
    }


def _show(
    whole: Resolved, compared: list[tuple[Resolved, BomDiff]], names: dict[str, str], base: str
) -> None:
    from silo.bom_sync.resolved import blocking
    from silo.cli.bom_display import diff_table, entry_text, findings_text
    from silo.cli.terminal import console, plain

    out = console()
    for resolved, diff in compared:
        head = resolved.assembly
        if head.part_number:
            out.print(entry_text(head, base))
        else:
            name = plain(display_name(head))
            register = proposed("register", Path(head.doc_path))
            text = message(
                "{name}: no part number yet, so nothing to compare with; {register} gives it one",
                name=name,
                register=register,
            )
            out.print(text, markup=False, soft_wrap=True)
        if head.part_number or diff.added:
            out.print(diff_table(diff, names, whole=not (blocking(resolved) or resolved.unresolved)))
        out.print()
    out.print(findings_text(whole.findings, base))
