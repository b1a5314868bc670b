# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod diff``: the preview, and the drift check for CI."""

from __future__ import annotations

import argparse
import os
from itertools import chain
from typing import Any

from silo.batch import suggest_by_identity
from silo.bom.diff import diff_findings
from silo.bom.model import BomDiff
from silo.bom.naming import display_name
from silo.bom.paths import relative
from silo.bom.report import base_of, diff_json, finding_json
from silo.bom_sync import Resolved, assemblies, blocking, names_of, resolve, server_lines
from silo.cli import common
from silo.cli.common import Commands


def register(commands: Commands) -> None:
    """Add the command."""
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
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
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
        told = chain(whole.findings, *(diff_findings(diff, one.assembly) for one, diff in compared))
        findings = [finding_json(finding, base) for finding in told]
        common.print_json({"drift": drifted, "assemblies": data, "findings": findings})
    else:
        _show(whole, compared, names_of(whole, chain.from_iterable(lines)), base)
    return 1 if args.check and drifted else 0


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
        drifted = False
        for result in Job(plan, reading, client, Options(recursive=True, dry_run=True), base).results():
            summary.add(result)
            drifted = drifted or not result.fine or bool(result.unregistered)
            for outcome in result.outcomes:
                news = is_news(outcome)
                drifted = drifted or (outcome.plan is not None and outcome.plan.diff.drifted)
                if args.json:
                    compared = {"diff": diff_json(outcome.plan.diff)} if outcome.plan is not None else {}
                    data.append({**_head(outcome.resolved, base), **compared})
                elif news:
                    out.print(show.outcome_text(outcome))
                    if outcome.plan is not None and not blocking(outcome.resolved):
                        out.print(show.diff_table(outcome.plan.diff, outcome.names))
    if args.json:
        findings = [finding_json(finding, base) for finding in summary.findings]
        errors = [{"message": words, "files": files} for words, files in summary.errors.items()]
        common.print_json({"drift": drifted, "assemblies": data, "findings": findings, "errors": errors})
    else:
        for words in (*summary.warnings, *summary.errors):
            out.print(show.plain(words), markup=False)
        compared_count = sum(summary.statuses.values())
        out.print(f"Assemblies compared: {compared_count}; {'they differ' if drifted else 'no differences'}.")
    if summary.exit_code == 3:
        return 3
    return 1 if args.check and drifted else 0


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
            out.print(show.diff_table(diff, names))
        out.print()
    out.print(show.findings_text(whole.findings, base))
