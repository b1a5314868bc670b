# SPDX-License-Identifier: LGPL-2.1-or-later
"""A sync run as Markdown, to attach to a nightly job."""

from __future__ import annotations

from collections.abc import Sequence

from silo.batch import TopResult, findings_of
from silo.bom.findings import Severity
from silo.bom.report import shorten
from silo.bom_sync import Status


def cell(text: str) -> str:
    """Text of others as a table cell: one line, no markup."""
    text = "".join(c if c.isprintable() else " " for c in text)
    for sign in "\\`*_[]<>|#":
        text = text.replace(sign, "\\" + sign)
    return text


def markdown(results: Sequence[TopResult]) -> str:
    """The whole run: a table of assemblies, then what needs a person."""
    done = sum(result.fine for result in results)
    lines = [
        "# BOM sync",
        "",
        f"{done} of {len(results)} files in order.",
        "",
        "| File | Assembly | Result | Added | Quantity changed | Unreferenced | Conflicts |",
        "|---|---|---|---:|---:|---:|---:|",
    ]
    for result in results:
        lines += _rows(result)
    lines += _attention(results)
    return "\n".join(lines) + "\n"


def _rows(result: TopResult) -> list[str]:
    if result.error is not None or result.skipped:
        words = f"error: {result.error}" if result.error is not None else result.skipped
        return [f"| {cell(result.top)} | | {cell(words)} | | | | |"]
    rows = []
    for outcome in result.outcomes:
        who = outcome.assembly.part_number or outcome.assembly.label
        diff = outcome.plan.diff if outcome.plan is not None else None
        counts = (
            [len(diff.added), len(diff.quantity_changed), len(diff.removed), len(diff.conflicts)]
            if diff
            else [""] * 4
        )
        words = f"failed: {outcome.error}" if outcome.status is Status.FAILED else outcome.status.value
        rows.append(
            f"| {cell(result.top)} | {cell(who)} | {cell(words)} | " + " | ".join(map(str, counts)) + " |"
        )
    return rows


def _attention(results: Sequence[TopResult]) -> list[str]:
    lines: list[str] = []
    for result in results:
        told = [f for f in findings_of(result) if f.severity is not Severity.INFO]
        if told:
            lines += ["", f"## {cell(result.top)}", ""]
            lines += [f"- **{f.severity.value}**: {cell(shorten(f.message, result.base))}" for f in told]
    return lines
