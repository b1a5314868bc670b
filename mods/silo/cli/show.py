# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the commands print for people."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TextIO

from rich.console import Console, Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text
from rich.tree import Tree

from silo.bom.document import relative
from silo.bom.findings import Finding, Severity
from silo.bom.model import BomDiff, BomEntry, Extraction
from silo.bom.report import MOST_LINES, base_of, check_tree_size, diff_rows, shorten
from silo.bom.resolve import display_name
from silo.cli import common

if TYPE_CHECKING:
    from silo.activity import ActivityText
    from silo.api.wire import ProductSummary
    from silo.bom.resolve import Proposal
    from silo.bom_sync import Outcome
    from silo.registering.items import Registration
    from silo.registering.modelled import Modelled


_MARK = {
    Severity.ERROR: ("✗", "bold red"),
    Severity.WARNING: ("⚠", "yellow"),
    Severity.INFO: ("·", "dim"),
}
# A line of a comparison, by the field of the diff.
_DIFFERENCE = {
    "added": ("+", "green", "new in the assembly"),
    "quantity_changed": ("~", "yellow", "quantity changed"),
    "conflicts": ("⚡", "magenta", "manual line; a person decides"),
    "removed": ("⚠", "yellow", "not referenced by the assembly; kept"),
    "kept": ("?", "red", "its file is missing; the line is kept"),
    "manual": ("✎", "blue", "manual line; not touched"),
}
_MOST_MODELLED = 40
# A tree longer than this helps nobody on a terminal; a pipe and --json have it all.
_MOST_LINES = 2000
# A hostile file's name may have 60 MB; a path of the system has 4096 at most.
_LONGEST = 5000
_ENDLESS = 1_000_000


class _Terminal(Console):
    def on_broken_pipe(self) -> None:
        """The reader has seen enough; rich would end with exit code 1, the command line says what that is."""
        raise BrokenPipeError


def console(stream: TextIO | None = None) -> Console:
    """Return the terminal. A file or a pipe has no width: each record is one line there, and whole."""
    stream = stream or sys.stdout
    return _Terminal(file=stream, highlight=False, width=None if stream.isatty() else _ENDLESS)


def plain(text: str) -> str:
    """Text of a file or a server without control characters: it may not steer the terminal, nor fill it."""
    shown = text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"
    return "".join(c if c.isprintable() else "�" for c in shown)


def entry_text(entry: BomEntry, base: str) -> Text:
    """One line of the tree."""
    text = Text().append(f"{entry.quantity} × ", "bold")
    if entry.part_number:
        text.append(plain(entry.part_number), "cyan").append("  ").append(plain(entry.name or ""))
    else:
        text.append(plain(display_name(entry) or entry.object_name))
    where = relative(entry.doc_path, base)
    text.append(f"  {plain(where)}#{plain(entry.object_name)}", "dim")
    if entry.missing:
        text.append("  missing", "bold red")
    return text


def bom_tree(extraction: Extraction, base: str = "") -> Tree:
    """Return the multi-level BOM; quantities are per one parent, paths as in :func:`bom_json`."""
    base = base or base_of(extraction)
    head = extraction.assembly
    title = Text(plain(head.part_number or display_name(head)), "bold")
    if head.name:
        title.append("  ").append(plain(head.name))
    title.append(f"  {plain(relative(head.doc_path, base))}#{plain(head.object_name)}", "dim")
    tree = Tree(title)
    if not sys.stdout.isatty():
        check_tree_size(extraction)
    left = [_MOST_LINES if sys.stdout.isatty() else MOST_LINES]

    def grow(branch: Tree, entries: Iterable[BomEntry]) -> None:
        for entry in entries:
            if left[0] <= 0:
                branch.add(Text("… more; --json has all", "dim"))
                return
            left[0] -= 1
            inner = branch.add(entry_text(entry, base))
            grow(inner, entry.children)
            grow_own(inner, entry.own)

    def grow_own(branch: Tree, entries: Iterable[BomEntry]) -> None:
        for entry in entries:
            branch.add(entry_text(entry, base).append("  not an item yet", "yellow"))

    grow(tree, extraction.entries)
    grow_own(tree, head.own)
    return tree


def flat_table(rows: Sequence[Mapping[str, Any]]) -> Table:
    """The flat BOM: a purchaser's table of totals."""
    table = Table(box=None, pad_edge=False)
    for title in ("Part number", "Name", "Quantity", "Unit", "Standard or file", ""):
        table.add_column(title, justify="right" if title == "Quantity" else "left", overflow="fold")
    for row in rows:
        file = f"{row['doc_path']}#{row['object']}"
        table.add_row(
            Text(plain(row["part_number"] or "–"), "cyan" if row["part_number"] else "dim"),
            Text(plain(row["name"])),
            str(row["quantity"]),
            row["unit"],
            Text(plain(row["standard"] or file)),
            Text("missing" if row["missing"] else "", "bold red"),
        )
    return table


def findings_text(findings: Iterable[Finding], base: str = "") -> Group:
    """Findings, the worst first."""
    order = {Severity.ERROR: 0, Severity.WARNING: 1, Severity.INFO: 2}
    lines = []
    for finding in sorted(findings, key=lambda f: order[f.severity]):
        mark, style = _MARK[finding.severity]
        lines.append(Text().append(f"{mark} ", style).append(plain(shorten(finding.message, base)), ""))
    return Group(*lines)


def summary_text(summary: ProductSummary) -> Text:
    """Return what the server says of a product over all levels: what is open, mass and cost."""
    told = (*summary.open.items(), *((one, f"incomplete: {why}") for one, why in summary.incomplete.items()))
    lines = [f"⚠ {plain(number)}: {plain(words)}" for number, words in told]
    rest = len(lines) - MOST_LINES
    shown = [*lines[:MOST_LINES], f"… and {rest} more"] if rest > 0 else lines or ["✓ nothing is open"]
    values = [(f"{summary.total_mass_kg:g} kg" if summary.total_mass_kg else "", summary.mass_missing)]
    costs = ", ".join(f"{one.total_cost:.2f} {plain(one.currency)}" for one in summary.totals)
    for value, lacking in (*values, (costs, summary.cost_missing)):
        known = f" for {summary.parts - lacking.count} of {summary.parts} parts" if lacking.count else ""
        shown += [f"{value}{known}"] if value else []
    return Text("\n").join(Text(line) for line in (f"In Silo, {plain(summary.part_number)}:", *shown))


def diff_table(diff: BomDiff, names: Mapping[str, str], *, whole: bool = True) -> RenderableType:
    """CAD against server, one row per line that differs or is a person's own.

    whole
        False where components are missing or have no number: then nobody knows that nothing differs.
    """
    table = Table(box=None, pad_edge=False)
    for title, justify in (
        ("", "left"),
        ("Part number", "left"),
        ("Name", "left"),
        ("Quantity", "right"),
        ("", "left"),
    ):
        table.add_column(title, justify=justify)  # type: ignore[arg-type]

    for kind, number, quantity in diff_rows(diff):
        mark, style, note = _DIFFERENCE[kind]
        name = Text(plain(names.get(number, "")))
        table.add_row(Text(mark, style), Text(plain(number), style), name, quantity, Text(note, "dim"))
    if not table.row_count and not whole:
        return Text(f"Lines that agree: {len(diff.unchanged)}; the others cannot be compared.", "yellow")
    if not table.row_count:
        return Text(f"No differences; lines that agree: {len(diff.unchanged)}.", "green")
    if not diff.unchanged:
        return table
    lines = "line" if len(diff.unchanged) == 1 else "lines"
    return Group(table, Text(f"{len(diff.unchanged)} {lines} unchanged.", "dim"))


_STATUS = {
    "merged": ("✓", "green"),
    "unchanged": ("✓", "green"),
    "dry_run": ("·", "cyan"),
    "blocked": ("✗", "red"),
    "unregistered": ("⚠", "yellow"),
    "failed": ("✗", "red"),
}


def outcome_text(outcome: Outcome, base: str) -> Text:
    """Return one line: which assembly, what became of it, and its file relative to ``base``."""
    from silo.activity import draft_text
    from silo.api.boms import unusual
    from silo.batch import STATUS_WORDS

    mark, style = _STATUS[outcome.status]
    head = outcome.assembly
    who = " ".join(filter(None, (head.part_number, head.name))) or display_name(head)
    text = Text().append(f"{mark} ", style).append(plain(who), "bold")
    text.append(f": {STATUS_WORDS[outcome.status]}")
    if outcome.error is not None:
        text.append(f": {plain(str(outcome.error))}")
    text.append(f"  {plain(relative(head.doc_path, base))}", "dim")
    if draft := draft_text(outcome.result):
        text.append(f"\n  {plain(draft)}", "dim")
    for message in unusual(outcome.result):
        text.append(f"\n  ⚠ {plain(message)}", "yellow")
    return text


def activity_box(activity: ActivityText) -> Panel:
    """The Activity pane's box (spec §6)."""
    body = Text()
    body.append(f"📋 {plain(activity.headline)}\n", "bold")
    body.append(plain(activity.counts))
    if activity.resolve_url:
        body.append(f"\n[View in Silo →] {plain(activity.resolve_url)}", "cyan")
    if activity.unregistered:
        body.append(f"\n{plain(activity.unregistered)}\n", "yellow").append("[Register Parts...]", "cyan")
    return Panel(body, title="Database Activity", title_align="left", expand=False, padding=(0, 1))


# --- registering ----------------------------------------------------------------------------------------


def article_json(article: Modelled, base: str) -> Mapping[str, Any]:
    """What is modelled in the file and not counted."""
    return {
        "doc_path": relative(article.entry.doc_path, base),
        "objects": list(article.objects),
        "label": article.entry.label,
        "quantity": article.entry.quantity,
        "alike": article.alike,
        "source": relative(article.source, base),
    }


def articles_text(articles: Sequence[Modelled], base: str) -> list[str]:
    """The section of what is modelled in the file, line by line."""
    lines = ["Modelled in this file, not counted:"]
    most = _MOST_MODELLED if sys.stdout.isatty() else len(articles)
    for one in articles[:most]:
        copies = f", {len(one.objects)} copies of one {one.alike}" if len(one.objects) > 1 else ""
        source = f", imported from {plain(relative(one.source, base))}" if one.source else ""
        label = plain(one.entry.label)
        lines.append(f"  {one.entry.quantity} × {label} ({one.entry.object_name}{copies}{source})")
    if len(articles) > most:
        lines.append(f"  and {len(articles) - most} more; --json has them all")
    lines.append("Declare what is a part: silo-mod register TOP.FCStd --yes --declare OBJECT")
    return lines


def proposal_json(
    proposal: Proposal, base: str, result: Registration | None = None, note: str = ""
) -> Mapping[str, Any]:
    row: dict[str, Any] = {
        "doc_path": relative(proposal.entry.doc_path, base),
        "object": proposal.entry.object_name,
        "standard": proposal.entry.standard,
        "name": proposal.name,
        "item_type": proposal.item_type,
        "category": proposal.category,
        "guess": proposal.is_guess,
        "note": note,
    }
    if result is not None and result.error is None:
        row |= {"part_number": result.part_number, "silo_uuid": result.item_id, "found": result.found}
    if result is not None and result.error is not None:
        row |= {"error": {"code": result.error.code, "message": str(result.error)}}
    return row


def registrations(
    args: argparse.Namespace,
    base: str,
    done: Sequence[Registration],
    left: Sequence[tuple[Proposal, str]],
    articles: Sequence[Modelled],
) -> None:
    """What became of each; ``left``: proposals that were not registered, and why."""
    if args.json:
        common.print_json(
            {
                "registered": [proposal_json(r.proposal, base, r) for r in done if r.error is None],
                "failed": [proposal_json(r.proposal, base, r) for r in done if r.error is not None],
                "unregistered": [proposal_json(proposal, base, note=why) for proposal, why in left],
                "modelled": [article_json(one, base) for one in articles],
            }
        )
        return
    out = console()
    if not done and not left:
        out.print("Every component has its part number already.")
    for result in done:
        name = plain(result.proposal.name)
        if result.error is None:
            guess = " (the category is a guess)" if result.proposal.is_guess else ""
            found = " (the item was there already)" if result.found else ""
            out.print(f"✓ {result.part_number}  {name}{guess}{found}", markup=False)
        else:
            out.print(f"✗ {name}: {plain(str(result.error))}", style="red", markup=False)
    for proposal, why in left:
        where = proposal.entry.standard or relative(proposal.entry.doc_path, base)
        reason = f" ({plain(why)})" if why else ""
        text = f"⚠ {plain(where)}: unregistered, left out of the BOM{reason}"
        out.print(text, style="yellow", markup=False)
    if any(proposal.entry.silo_uuid and not proposal.entry.is_standard for proposal, _ in left):
        out.print("Are these parts of another server? silo-mod register --adopt takes them over.")
    if args.yes and any(why for _, why in left):
        out.print(
            "Is it the same part? --duplicates join takes the item, --duplicates new makes another; "
            "--plan asks for each."
        )
    for line in articles_text(articles, base) if articles else ():
        out.print(line, markup=False, highlight=False)
