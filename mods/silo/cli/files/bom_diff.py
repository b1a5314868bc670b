# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod bom-diff``: what changed in parts between two folders, or two git revisions. Needs no server."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from silo import spoken
from silo.bom.entry import BomEntry
from silo.bom.errors import Exit, InputError
from silo.bom.items.naming import display_name
from silo.bom.message import message
from silo.bom.view.folders import shorten
from silo.bom.view.tree_json import finding_json
from silo.cli.json_output import json_text, print_json
from silo.cli.options import add_options
from silo.platform.whole_files import replacing, scratch_folder

if TYPE_CHECKING:
    from silo.bom.compare.two_states import AssemblyChange, LineChange
    from silo.vault.folder_boms import FolderBoms


_MARK = {
    "added": ("+", "green"),
    "removed": ("-", "red"),
    "quantity_changed": ("~", "yellow"),
    "moved": ("→", "dim"),
}


def add_bom_diff(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "folders",
        metavar="FOLDER",
        nargs="*",
        help="OLD and NEW, folders or files; with --git the one folder",
    )
    add_options(
        parser,
        {
            "--git A..B": (
                message(
                    "compare two revisions of a repository; A...B: from where B branched off A; A "
                    "alone: against the files as they are"
                )
            )
        },
    )


def run_bom_diff(args: argparse.Namespace) -> int:
    """Print the comparison. Returns 1 if a BOM could not be read completely, and with ``--check`` if one
    changed.
    """
    from silo.bom.compare.two_states import compare_assemblies

    old, new = _two_states(args)
    unread = {path for state in (old, new) for path, _ in state.unreadable}
    # A file that cannot be read has neither lost its assembly nor got one.
    changes = tuple(
        change
        for change in compare_assemblies(old.assemblies, new.assemblies)
        if change.head.doc_path not in unread or (change.old and change.new)
    )
    for path in args.report:
        make = _markdown if path.lower().endswith(".md") else _changes_json
        made = make(changes, old, new)
        text = made if isinstance(made, str) else json_text(made, indent=2)
        with replacing(Path(path)) as stream:
            stream.write(f"{text}\n".encode())
    if args.json:
        print_json(_changes_json(changes, old, new))
    else:
        _show_changes(changes, old, new)
    # An old state that is damaged cannot be repaired any more; a new one can.
    return Exit.UNDONE if not new.complete or (args.check and changes) else Exit.DONE


def _two_states(args: argparse.Namespace) -> tuple[FolderBoms, FolderBoms]:
    """Read the two states to compare. Raises InputError."""
    from silo.vault.folder_boms import read_file, read_folder

    if args.git is None:
        if len(args.folders) != 2:
            raise InputError(
                message("Name two folders or two files, OLD and NEW, or two revisions with --git A..B.")
            )
        if all(map(os.path.isfile, args.folders)):  # of one file, whatever its two states are called
            first, second = args.folders
            return read_file(first, os.path.basename(second)), read_file(second)
        return read_folder(args.folders[0]), read_folder(args.folders[1])
    if len(args.folders) > 1:
        raise InputError(
            message("With --git name at most one folder, the part of the repository to compare.")
        )
    from silo.vault.git import lay_out, parse_range, top_of

    top, below, work_tree = top_of(args.folders[0] if args.folders else ".")
    chosen = parse_range(top, args.git)
    if chosen.new is None and not work_tree:
        raise InputError(
            message("{top} has no work tree to compare with. Name two revisions, A..B.", top=top)
        )
    laid: dict[str, Path] = {}
    with scratch_folder("silo-bom-diff-") as scratch:

        def state(name: str, revision: str | None) -> tuple[Path, list[tuple[str, str]]]:
            """Lay out the whole repository as it was, since the folder may use files beside it."""
            folder = Path(top) if revision is None else Path(scratch, name)
            return folder, [] if revision is None else lay_out(top, revision, folder, laid)

        states = [state("old", chosen.old), state("new", chosen.new)]
        if not any((folder / below).is_dir() for folder, _ in states):
            raise InputError(
                message("There are no FreeCAD files in {top}, before or after.", top=below or top)
            )
        nothing = Path(scratch, "nothing")
        nothing.mkdir()
        old, new = (
            read_folder(there if (there := folder / below).is_dir() else nothing, root=folder, lost=lost)
            for folder, lost in states
        )
    return old, new


def _title(change: AssemblyChange) -> str:
    words = {
        "added": message("new assembly"),
        "removed": message("assembly removed"),
        "moved": "moved",
        "changed": "",
    }
    note = words[change.kind]
    if change.old and change.new and change.old.head.key != change.new.head.key:
        note = message("was {doc_path}", doc_path=change.old.head.doc_path)
    return message(
        "{doc_path}: {head}{note}",
        doc_path=change.head.doc_path,
        head=_name(change.head),
        note=message(" ({note})", note=note) if note else "",
    )


def _quantities(line: LineChange) -> str:
    if line.old and line.new and line.old.quantity != line.new.quantity:
        return f"{line.old.quantity:g} → {line.new.quantity:g}"
    return f"{line.entry.quantity:g}"


def _where(line: LineChange, change: AssemblyChange) -> str:
    """Return a line's file, with the object if the assembly has another object of that file."""
    heads = [
        bom_entry for state in (change.old, change.new) if state for bom_entry in (state.head, *state.lines)
    ]

    def place(entry: BomEntry) -> str:
        several = len({head.object_name for head in heads if head.doc_path == entry.doc_path}) > 1
        return f"{entry.doc_path}#{entry.object_name}" if several and not entry.standard else entry.doc_path

    gone = " (missing)" if line.entry.missing else ""
    if line.old and line.new and line.old.key != line.new.key:
        return f"{place(line.old)} → {place(line.new)}{gone}"
    return f"{place(line.entry)}{gone}"


def _incomplete(state: FolderBoms, name: str) -> list[str]:
    words: list[str] = [
        message(
            "{state}: {path} could not be read: {why}", state=name, path=path, why=shorten(why, state.base)
        )
        for path, why in state.unreadable
    ]
    words += [
        message("{state}: {text}", state=name, text=shorten(one.message, state.base))
        for one in state.findings
    ]
    return words


def _show_changes(changes: tuple[AssemblyChange, ...], old: FolderBoms, new: FolderBoms) -> None:
    from rich.table import Table
    from rich.text import Text

    from silo.cli.terminal import console, plain

    out = console()
    for change in changes:
        out.print(Text(plain(spoken(_title(change))), "bold"))
        table = Table(box=None, pad_edge=False, show_header=False)
        columns: tuple[Literal["left", "right"], ...] = ("left", "left", "right", "left")
        for justify in columns:
            table.add_column(justify=justify)
        for line in change.lines:
            mark, style = _MARK[line.kind]
            name = Text(plain(_name(line.entry)))
            table.add_row(
                Text(f"  {mark}", style),
                name,
                _quantities(line),
                Text(plain(spoken(_where(line, change))), "dim"),
            )
        if change.lines:
            out.print(table)
        out.print()
    if not changes:
        text = spoken(_unchanged(old, new))
        out.print(Text(text, "green" if new.assemblies and new.complete else "yellow"))
    for words in (*_incomplete(old, message("old")), *_incomplete(new, message("new"))):
        out.print(Text("✗ ", "bold red").append(plain(spoken(words)), ""))


def _name(entry: BomEntry) -> str:
    return display_name(entry) or entry.object_name


def _unchanged(old: FolderBoms, new: FolderBoms) -> str:
    if not (old.assemblies or new.assemblies):
        return message("There is no assembly to compare, before or after.")
    part = "" if old.complete and new.complete else message(", as far as they could be read")
    return message(
        "No BOM changed{part}; assemblies compared: {count}.", part=part, count=len(new.assemblies)
    )


def _markdown(changes: tuple[AssemblyChange, ...], old: FolderBoms, new: FolderBoms) -> str:
    from silo.batch import cell

    lines = [message("## BOM changes"), ""]
    if not changes:
        lines += [_unchanged(old, new), ""]
    for change in changes:
        lines += [f"### {cell(_title(change))}", ""]
        if change.lines:
            lines += ["| | Part | Quantity | File |", "|---|---|---:|---|"]
        for line in change.lines:
            words = (line.kind.replace("_", " "), _name(line.entry), _quantities(line), _where(line, change))
            lines.append(f"| {' | '.join(map(cell, words))} |")
        lines.append("")
    incomplete = [*_incomplete(old, message("old")), *_incomplete(new, message("new"))]
    if incomplete:
        lines += [message("### Not complete"), "", *(f"- {cell(words)}" for words in incomplete), ""]
    return "\n".join(lines).rstrip()


def _changes_json(changes: tuple[AssemblyChange, ...], old: FolderBoms, new: FolderBoms) -> dict[str, object]:
    from silo.bom.compare.two_states import changes_json

    def state(boms: FolderBoms) -> dict[str, object]:
        return {
            "assemblies": len(boms.assemblies),
            "complete": boms.complete,
            "unreadable": [{"file": path, "reason": why} for path, why in boms.unreadable],
            "findings": [finding_json(finding, boms.base) for finding in boms.findings],
        }

    return {"changes": changes_json(changes), "old": state(old), "new": state(new)}
