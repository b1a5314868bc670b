# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the commands print for people; ``silo-mod search``, ``show``, ``order``, ``whoami``, ``logout``."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from rich.console import Console, Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text
from rich.tree import Tree

from silo import spoken
from silo.bom.document import relative
from silo.bom.errors import ConfigError, Exit, counted
from silo.bom.findings import Finding, Severity
from silo.bom.items.naming import display_name
from silo.bom.model import BomDiff, BomEntry, Extraction
from silo.bom.report import MOST_LINES, base_of, check_tree_size, diff_rows, shorten
from silo.cli.common import (
    above_zero,
    account_of,
    add_each,
    add_options,
    client_of,
    named_item,
    only_with,
    print_json,
)

if TYPE_CHECKING:
    from silo.api.wire import OrderList, ProductSummary
    from silo.bom.items.proposal import Proposal
    from silo.bom_sync import ActivityText, Outcome
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
        """Raise the error when the reader closes the pipe; rich would end with exit code 1."""
        raise BrokenPipeError

    def print(self, *shown: Any, **how: Any) -> None:
        """Print; texts of ours in the person's language."""
        super().print(*(spoken(one) if isinstance(one, str) else one for one in shown), **how)


def console(stream: TextIO | None = None) -> Console:
    """Open the terminal. A file or a pipe has no width: each record is one whole line there."""
    stream = stream or sys.stdout
    return _Terminal(file=stream, highlight=False, width=None if stream.isatty() else _ENDLESS)


def plain(text: str) -> str:
    """Replace control characters in text of a file or a server, and cut it: it may neither steer the terminal
    nor fill it.
    """
    shown = text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"
    return "".join(c if c.isprintable() else "�" for c in shown)


def entry_text(entry: BomEntry, base: str) -> Text:
    """Write one line of the tree."""
    text = Text().append(f"{entry.quantity} × ", "bold")
    if entry.part_number:
        text.append(plain(entry.part_number), "cyan").append("  ").append(plain(entry.name or ""))
    else:
        text.append(plain(display_name(entry) or entry.object_name))
    where = relative(entry.doc_path, base)
    text.append(f"  {plain(where)}#{plain(entry.object_name)}", "dim")
    if entry.missing:
        text.append(f"  {spoken('missing')}", "bold red")
    return text


def bom_tree(extraction: Extraction, base: str = "") -> Tree:
    """Draw the multi-level BOM; quantities are per one parent, paths as in :func:`bom_json`."""
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
                branch.add(Text(spoken("… more; --json has all"), "dim"))
                return
            left[0] -= 1
            inner = branch.add(entry_text(entry, base))
            grow(inner, entry.children)
            grow_own(inner, entry.own)

    def grow_own(branch: Tree, entries: Iterable[BomEntry]) -> None:
        for entry in entries:
            branch.add(entry_text(entry, base).append(spoken("  not an item yet"), "yellow"))

    grow(tree, extraction.entries)
    grow_own(tree, head.own)
    return tree


def table_of(*titles: str) -> Table:
    """Begin a table without lines that has these headings."""
    table = Table(box=None, pad_edge=False)
    for title in titles:
        table.add_column(spoken(title), justify="right" if title == "Quantity" else "left", overflow="fold")
    return table


def flat_table(rows: Sequence[Mapping[str, Any]]) -> Table:
    """Draw the flat BOM: a purchaser's table of totals."""
    table = table_of("Part number", "Name", "Quantity", "Unit", "Standard or file", "")
    for row in rows:
        file = f"{row['doc_path']}#{row['object']}"
        table.add_row(
            Text(plain(row["part_number"] or "–"), "cyan" if row["part_number"] else "dim"),
            Text(plain(row["name"])),
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
    from silo.bom_sync import summary_texts

    texts, values = summary_texts(summary)
    lines = [f"⚠ {plain(text)}" for text in texts]
    rest = len(lines) - MOST_LINES
    shown = [*lines[:MOST_LINES], f"… and {rest} more"] if rest > 0 else lines or ["✓ nothing is open"]
    shown += map(plain, values)
    return Text("\n").join(Text(spoken(line)) for line in (f"In Silo, {plain(summary.part_number)}:", *shown))


def diff_table(diff: BomDiff, names: Mapping[str, str], *, whole: bool = True) -> RenderableType:
    """Draw the difference of CAD and server: a row for each line that differs or that a person added.

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
        text = f"Lines that agree: {len(diff.unchanged)}; the others cannot be compared."
        return Text(spoken(text), "yellow")
    if not table.row_count:
        return Text(spoken(f"No differences; lines that agree: {len(diff.unchanged)}."), "green")
    if not diff.unchanged:
        return table
    return Group(table, Text(spoken(f"{counted(len(diff.unchanged), 'line')} unchanged."), "dim"))


_STATUS = {
    "merged": ("✓", "green"),
    "unchanged": ("✓", "green"),
    "dry_run": ("·", "cyan"),
    "blocked": ("✗", "red"),
    "unregistered": ("⚠", "yellow"),
    "failed": ("✗", "red"),
}


def outcome_text(outcome: Outcome, base: str) -> Text:
    """Write which assembly it was, what became of it, and its file relative to ``base``."""
    from silo.api.merging import unusual
    from silo.batch import STATUS_WORDS
    from silo.bom_sync import draft_text

    mark, style = _STATUS[outcome.status]
    head = outcome.assembly
    who = " ".join(filter(None, (head.part_number, head.name))) or display_name(head)
    text = Text().append(f"{mark} ", style).append(plain(who), "bold")
    text.append(f": {spoken(STATUS_WORDS[outcome.status])}")
    if outcome.error is not None:
        text.append(f": {plain(spoken(str(outcome.error)))}")
    text.append(f"  {plain(relative(head.doc_path, base))}", "dim")
    if draft := draft_text(outcome.result):
        text.append(f"\n  {plain(spoken(draft))}", "dim")
    for message in unusual(outcome.result):
        text.append(f"\n  ⚠ {plain(spoken(message))}", "yellow")
    return text


def activity_box(activity: ActivityText) -> Panel:
    """Draw the Activity pane's box (spec §6)."""
    body = Text()
    body.append(f"📋 {plain(spoken(activity.headline))}\n", "bold")
    body.append(plain(spoken(activity.counts)))
    if activity.resolve_url:
        body.append(spoken(f"\n[View in Silo →] {plain(activity.resolve_url)}"), "cyan")
    if activity.unregistered:
        body.append(f"\n{plain(spoken(activity.unregistered))}\n", "yellow")
        body.append(spoken("[Register Parts...]"), "cyan")
    return Panel(body, title=spoken("Database Activity"), title_align="left", expand=False, padding=(0, 1))


# --- registering ----------------------------------------------------------------------------------------


def article_json(article: Modelled, base: str) -> Mapping[str, Any]:
    """Return an article that is modelled in the file, as JSON values."""
    return {
        "doc_path": relative(article.entry.doc_path, base),
        "objects": list(article.objects),
        "label": article.entry.label,
        "quantity": article.entry.quantity,
        "alike": article.alike,
        "source": relative(article.source, base),
    }


def articles_text(articles: Sequence[Modelled], base: str) -> list[str]:
    """Write the section about what is modelled in the file, line by line."""
    lines = ["Modelled in this file, not counted:"]
    most = _MOST_MODELLED if sys.stdout.isatty() else len(articles)
    for article in articles[:most]:
        copies = f", {len(article.objects)} copies of one {article.alike}" if len(article.objects) > 1 else ""
        source = f", imported from {plain(relative(article.source, base))}" if article.source else ""
        label = plain(article.entry.label)
        lines.append(f"  {article.entry.quantity} × {label} ({article.entry.object_name}{copies}{source})")
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
        from silo.batch import error_json

        row |= {"error": error_json(result.error)}
    return row


def registrations(
    args: argparse.Namespace,
    base: str,
    done: Sequence[Registration],
    left: Sequence[tuple[Proposal, str]],
    articles: Sequence[Modelled],
) -> None:
    """Show each registration; ``left``: proposals that were not registered, and why."""
    if args.json:
        print_json(
            {
                "registered": [proposal_json(r.proposal, base, r) for r in done if r.error is None],
                "failed": [proposal_json(r.proposal, base, r) for r in done if r.error is not None],
                "unregistered": [proposal_json(proposal, base, note=why) for proposal, why in left],
                "modelled": [article_json(article, base) for article in articles],
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
            note = " (the item was there already)" if result.found else ""
            out.print(f"✓ {result.part_number}  {name}{guess}{note}", markup=False)
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


def add_search(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("words", metavar="WORD", nargs="+")


def add_show(parser: argparse.ArgumentParser) -> None:
    add_each(parser, "part_number", metavar="PART_NUMBER", help="the item")


def add_order(parser: argparse.ArgumentParser) -> None:
    add_each(
        parser, "part_number", "--revision", "--csv", "--xlsx", metavar="PRODUCT", help="its part number"
    )
    parser.add_argument("--quantity", metavar="N", type=above_zero, default=1, help="for so many pieces (1)")
    add_options(
        parser,
        {
            "--revision REVISION": "of a released revision, such as B (else of the draft)",
            "--spares PERCENT": "so many percent more of each part",
            "--rest": "without what was ordered already",
            "--csv FILE": "write a table as CSV (- for standard output)",
            "--xlsx FILE": "write a table as a workbook",
            "--supplier NAME": "only what this supplier sells",
        },
    )
    kinds = ("bought", "made", "unsaid")
    parser.add_argument("--kind", choices=kinds, default="bought", help="only these parts (bought)")
    only_with(parser, "--csv --xlsx", "--kind", "--supplier")


def add_completion(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("shell", choices=("bash", "zsh", "tcsh"))


def run_search(args: argparse.Namespace) -> int:
    """Print the items; 1 if there is none."""
    with client_of(args) as client:
        items = client.search_items(" ".join(args.words), limit=args.limit)
    rows = [{name: getattr(item, name) for name in ("part_number", "name", "item_type")} for item in items]
    if args.json:
        print_json(rows)
    else:
        _print(rows or [{"part_number": spoken("No item has these words.")}])
    return Exit.DONE if rows else Exit.UNDONE


def run_show(args: argparse.Namespace) -> int:
    """Print the item and its lines."""
    with client_of(args) as client:
        item = named_item(client, args.part_number)
        lines = client.get_bom(item.part_number)
        page = client.web_url(f"/items/{item.part_number}")
    head = {name: getattr(item, name) for name in ("part_number", "name", "item_type", "current_revision")}
    rows: list[dict[str, Any]] = [
        {
            "part_number": line.child_part_number,
            "name": line.child_name or line.child_description,
            "quantity": line.quantity,
            "source": line.source,
        }
        for line in lines
    ]
    if args.json:
        print_json({**head, "page": page, "bom": rows})
        return Exit.DONE
    _print([{**head, "current_revision": spoken(f"revision {item.current_revision}")}])
    _print(rows)
    print(page)
    return Exit.DONE


def run_order(args: argparse.Namespace) -> int:
    """Print what to order, or write it as a table."""
    from silo.files import check_writable
    from silo.platform import replacing

    asked = {"pieces": args.quantity, "spares": args.spares, "release": args.revision, "rest": args.rest}
    given = {name: str(value) for name, value in asked.items() if value}
    table = {"kind": args.kind} | ({"supplier": args.supplier} if args.supplier else {})
    check_writable(*(path for path in (args.csv, args.xlsx) if path and path != "-"))
    with client_of(args) as client:
        number = named_item(client, args.part_number).part_number
        for end, path in (("csv", args.csv), ("xlsx", args.xlsx)):
            data = client.get_order_table(number, end, **given, **table) if path else b""
            if end == "csv" and path == "-":
                sys.stdout.write(data.decode("utf-8-sig").replace("\r\n", "\n"))
            elif path:
                with replacing(Path(path)) as file:
                    file.write(data)
        if args.json:
            print_json(client.get_order(number, **given).model_dump(mode="json"))
        elif args.csv != "-":
            _print_order(client.get_order(number, **given))
    return Exit.DONE


def _print_order(order: OrderList) -> None:
    from silo.api.wire import SupplierPart

    out = console()
    head = (
        f"{order.part_number}: what to order for {order.pieces} with {order.spares} % spares. {order.state}"
    )
    out.print(Text(plain(spoken(head)), "bold"))
    for warning in order.warnings:
        out.print(Text(f"⚠ {plain(spoken(warning))}", "yellow"))
    titles = ("Part number", "Name", "Needed", "Ordered", "Quantity", "Supplier", "Its number", "Cost")
    table = table_of("", *titles, "")
    empty = SupplierPart(supplier="", currency="")
    for part in sorted(order.parts, key=lambda part: (part.kind, (part.supplier_part or empty).supplier)):
        of = part.supplier_part or empty
        price = f"{part.quantity} at {part.price} {of.currency}" if part.price else part.quantity or ""
        cells = (
            *(spoken(part.kind), part.part_number, part.name, f"{part.needed} {part.unit or ''}"),
            *(part.ordered, spoken(price), of.supplier, of.number),
            f"{part.cost or ''} {of.currency}".strip(),
            "; ".join((*map(spoken, part.remarks), *(file.name for file in part.files))),
        )
        table.add_row(*(Text(plain(cell)) for cell in cells))
    if order.parts:
        out.print(table)
        days = "not known" if order.lead_time_days is None else counted(order.lead_time_days, "day")
        cost, without = f"{order.total_cost} {order.currency}", counted(order.unpriced, "part")
        total = f"Cost: {cost}, without {without}" if order.unpriced else f"Cost: {cost}"
        out.print(Text(spoken(f"{total}\nLongest lead time: {days}")))


def run_whoami(args: argparse.Namespace) -> int:
    """Print the address, where it comes from, and the user."""
    from silo.api.config import resolve_server

    where = resolve_server(args.server, args.token)
    with client_of(args) as client:
        name, role = account_of(client)
        account = {"url": client.base_url, "from": where.url_from, "username": name, "role": role}
    if args.json:
        print_json(account)
    else:
        who = ", ".join(filter(None, (name, role)))
        text = f"{account['url']} (from {account['from']}): {who or 'this server does not say who you are'}"
        print(plain(spoken(text)))
    return Exit.DONE


def run_logout(args: argparse.Namespace) -> int:
    """Remove the configuration that ``login`` wrote; a token in the environment stays."""
    from silo.api.config import checked_config, config_path
    from silo.platform import remove_patiently

    path = config_path()
    there = path.exists()
    if there:
        checked_config(path)  # what is not ours stays
        remove_patiently(path)
    if args.json:
        print_json({"configuration": str(path), "removed": there})
    else:
        print(spoken(f"{path} is removed." if there else f"There was no {path}; nothing is remembered."))
        if os.environ.get("SILO_API_TOKEN"):
            print(spoken("SILO_API_TOKEN still has a token."))
    return Exit.DONE


def run_completion(args: argparse.Namespace) -> int:
    """Print the script of a shell. ConfigError if shtab is not installed."""
    try:
        import shtab
    except ImportError:
        raise ConfigError("completion needs the package shtab: pip install 'silo-mod[completion]'") from None
    from silo.cli.main import build_parser

    print(shtab.complete(build_parser(), args.shell))
    return Exit.DONE


def _print(rows: list[dict[str, Any]]) -> None:
    table = Table(box=None, pad_edge=False, show_header=False)
    for row in rows:
        table.add_row(*(Text(plain("" if value is None else str(value))) for value in row.values()))
    if rows:
        console().print(table)
