# SPDX-License-Identifier: LGPL-2.1-or-later
"""How a BOM looks on a terminal: as a tree, as a flat table, beside the server's; with its findings."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text
from rich.tree import Tree

from silo import caption, spoken
from silo.bom.compare.bom_diff import BomDiff
from silo.bom.entry import BomEntry, Extraction
from silo.bom.errors import counted
from silo.bom.findings import Finding, Severity
from silo.bom.items.naming import display_name, own_part_name, with_values
from silo.bom.message import message
from silo.bom.view.diff_rows import diff_rows
from silo.bom.view.folders import base_folder, shorten
from silo.bom.view.tree_json import MOST_LINES, check_tree_size
from silo.bom.walk.document import relative
from silo.cli.terminal import plain, table_of

if TYPE_CHECKING:
    from silo.api.wire import ProductSummary


_MARK = {
    Severity.ERROR: ("✗", "bold red"),
    Severity.WARNING: ("⚠", "yellow"),
    Severity.INFO: ("·", "dim"),
}

# A line of a comparison, by the field of the diff.
_DIFFERENCE = {
    "added": ("+", "green", message("new in the assembly")),
    "quantity_changed": ("~", "yellow", message("quantity changed")),
    "conflicts": ("⚡", "magenta", message("manual line; a reviewer decides")),
    "removed": ("⚠", "yellow", message("not referenced by the assembly; kept")),
    "kept": ("?", "red", message("its file is missing; the line is kept")),
    "manual": ("✎", "blue", message("manual line; not touched")),
}

# A tree longer than this does not help on a terminal; a pipe and --json have it all.
_MOST_LINES = 2000


def entry_text(entry: BomEntry, base: str, *, own: bool = False) -> Text:
    """Write one line of the tree; ``own``: a part modelled in the assembly's file."""
    text = Text().append(f"{entry.quantity} × ", "bold")
    if entry.part_number:
        name = with_values(entry.name or "", entry.variant)
        text.append(plain(entry.part_number), "cyan").append("  ").append(plain(name))
    else:
        text.append(plain((own_part_name(entry) if own else display_name(entry)) or entry.object_name))
    where = relative(entry.doc_path, base)
    text.append(f"  {plain(where)}#{plain(entry.object_name)}", "dim")
    if values := entry.counted_variants:
        words = message("with variants: {values}", values=plain("; ".join(values)))
        text.append(f"  {spoken(words)}", "yellow")
    if entry.missing:
        text.append(f"  {spoken('missing')}", "bold red")
    return text


def bom_tree(extraction: Extraction, base: str = "") -> Tree:
    """Draw the multi-level BOM; quantities are per one parent, paths as in :func:`bom_json`."""
    base = base or base_folder(extraction)
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
                branch.add(Text(caption("… more; --json has all"), "dim"))
                return
            left[0] -= 1
            inner = branch.add(entry_text(entry, base))
            grow(inner, entry.children)
            grow_own(inner, entry.own)

    def grow_own(branch: Tree, entries: Iterable[BomEntry]) -> None:
        for entry in entries:
            branch.add(entry_text(entry, base, own=True).append(caption("  not an item yet"), "yellow"))

    grow(tree, extraction.entries)
    grow_own(tree, head.own)
    return tree


def flat_table(rows: Sequence[Mapping[str, Any]]) -> Table:
    """Draw the flat BOM: a purchaser's table of totals."""
    table = table_of("Part number", "Name", "Quantity", "Unit", "Standard or file", "")
    for row in rows:
        file, values = f"{row['doc_path']}#{row['object']}", row.get("variant", "")
        table.add_row(
            Text(plain(row["part_number"] or "–"), "cyan" if row["part_number"] else "dim"),
            Text(plain(with_values(row["name"], values))),
            str(row["quantity"]),
            row["unit"],
            Text(plain(row["standard"] or file)),
            Text(spoken("missing") if row["missing"] else "", "bold red"),
        )
    return table


def findings_text(findings: Iterable[Finding], base: str = "") -> Group:
    """Write the findings, the worst first."""
    order = {Severity.ERROR: 0, Severity.WARNING: 1, Severity.INFO: 2}
    lines = []
    for finding in sorted(findings, key=lambda f: order[f.severity]):
        mark, style = _MARK[finding.severity]
        lines.append(
            Text().append(f"{mark} ", style).append(plain(spoken(shorten(finding.message, base))), "")
        )
    return Group(*lines)


def summary_text(summary: ProductSummary) -> Text:
    """Write what the server keeps of a product over all levels: what is open, mass and cost."""
    from silo.bom_sync.activity_text import summary_texts

    texts, values = summary_texts(summary)
    lines = [f"⚠ {plain(text)}" for text in texts]
    rest = len(lines) - MOST_LINES
    shown = (
        [*lines[:MOST_LINES], message("… and {rest} more", rest=rest)]
        if rest > 0
        else lines or [message("✓ nothing is open")]
    )
    shown += map(plain, values)
    return Text("\n").join(
        Text(spoken(line))
        for line in (message("In Silo, {part_number}:", part_number=plain(summary.part_number)), *shown)
    )


def diff_table(diff: BomDiff, names: Mapping[str, str], *, whole: bool = True) -> RenderableType:
    """Draw the difference of CAD and server: a row for each line that differs or that a user added.

    whole
        False if components are missing or have no number: then it is not known that nothing differs.
    """
    table = table_of("", "Part number", "Name", "Quantity", "")
    for kind, number, quantity in diff_rows(diff):
        mark, style, note = _DIFFERENCE[kind]
        name = Text(plain(names.get(number, "")))
        table.add_row(
            Text(mark, style), Text(plain(number), style), name, quantity, Text(spoken(note), "dim")
        )
    if not table.row_count and not whole:
        text = message("Lines that agree: {count}; the others cannot be compared.", count=len(diff.unchanged))
        return Text(spoken(text), "yellow")
    if not table.row_count:
        return Text(
            spoken(message("No differences; lines that agree: {count}.", count=len(diff.unchanged))), "green"
        )
    if not diff.unchanged:
        return table
    return Group(
        table,
        Text(
            spoken(message("{unchanged} unchanged.", unchanged=counted(len(diff.unchanged), "line"))), "dim"
        ),
    )
