# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod bom-diff``: what changed in parts between two folders or two git revisions; needs no server."""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

from silo.bom.changes import AssemblyChange, LineChange, changes_json, compare_assemblies
from silo.bom.errors import InputError
from silo.bom.model import BomEntry
from silo.bom.naming import display_name
from silo.bom.report import finding_json, shorten
from silo.cli import common
from silo.cli.common import Commands
from silo.vault.folder import FolderBoms, read_folder

_MARK = {
    "added": ("+", "green"),
    "removed": ("-", "red"),
    "quantity_changed": ("~", "yellow"),
    "moved": ("→", "dim"),
}


def register(commands: Commands) -> None:
    """Add the command."""
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
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Print the comparison. 1 where a BOM could not be read whole, and with ``--check`` where one changed."""
    if args.json and args.markdown:
        raise InputError("--json and --markdown exclude each other; take one.")
    with _two_folders(args) as (old_folder, new_folder, root):
        old = read_folder(old_folder, root=old_folder if root else None)
        new = read_folder(new_folder, root=new_folder if root else None)
    changes = compare_assemblies(old.assemblies, new.assemblies)
    if args.json:
        common.print_json(_json(changes, old, new))
    elif args.markdown:
        print(_markdown(changes, old, new))
    else:
        _show(changes, old, new)
    # An old state that is damaged cannot be mended any more; a new one can.
    return 1 if not new.complete or (args.check and changes) else 0


@contextmanager
def _two_folders(args: argparse.Namespace) -> Iterator[tuple[Path, Path, bool]]:
    """The folders to read, and whether links may not leave them."""
    if args.git is None:
        if len(args.folders) != 2:
            raise InputError("Name two folders, OLD and NEW, or two revisions with --git A..B.")
        yield Path(args.folders[0]), Path(args.folders[1]), False
        return
    if len(args.folders) > 1:
        raise InputError("With --git name at most one folder, the part of the repository to compare.")
    from silo.vault.git import lay_out, parse_range, top_of

    top, below = top_of(args.folders[0] if args.folders else ".")
    chosen = parse_range(top, args.git)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True, prefix="silo-bom-diff-") as scratch:
        old, new = Path(scratch, "old"), Path(scratch, "new")
        for revision, target in ((chosen.old, old), (chosen.new, new)):
            if revision is not None:
                (target / below).mkdir(parents=True)
                lay_out(top, revision, below, target)
        yield old / below, (new if chosen.new is not None else Path(top)) / below, True


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


def _show(changes: tuple[AssemblyChange, ...], old: FolderBoms, new: FolderBoms) -> None:
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
        out.print(Text(f"No BOM changed; assemblies compared: {len(new.assemblies)}.", "green"))
    for words in (*_incomplete(old, "old"), *_incomplete(new, "new")):
        out.print(Text("✗ ", "bold red").append(show.plain(words), ""))


def _name(entry: BomEntry) -> str:
    return display_name(entry) or entry.object_name


def _markdown(changes: tuple[AssemblyChange, ...], old: FolderBoms, new: FolderBoms) -> str:
    from silo.batch_report import cell

    lines = ["## BOM changes", ""]
    if not changes:
        lines += [f"No BOM changed. Assemblies compared: {len(new.assemblies)}.", ""]
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


def _json(changes: tuple[AssemblyChange, ...], old: FolderBoms, new: FolderBoms) -> dict[str, object]:
    def state(boms: FolderBoms) -> dict[str, object]:
        return {
            "assemblies": len(boms.assemblies),
            "complete": boms.complete,
            "unreadable": [{"file": path, "reason": why} for path, why in boms.unreadable],
            "findings": [finding_json(finding, boms.base) for finding in boms.findings],
        }

    return {"changes": changes_json(changes), "old": state(old), "new": state(new)}
