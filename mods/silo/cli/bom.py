# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod bom``, ``where-used`` and ``relink``: what files hold, which link to which, and mending that.

``silo-mod diff`` and ``bom-diff``: CAD against the server; two folders or git revisions without one.
"""

from __future__ import annotations

import argparse
import csv
import os
import sys
from collections.abc import Mapping
from dataclasses import replace
from io import StringIO
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from silo import spoken
from silo.bom.consolidation import consolidation_findings, one_hint_each
from silo.bom.document import relative
from silo.bom.errors import (
    BusyError,
    ConfigError,
    DocumentError,
    Exit,
    InputError,
    SiloError,
    counted,
    did_you_mean,
)
from silo.bom.findings import FindingCode
from silo.bom.headers import safe_cell
from silo.bom.items.naming import display_name
from silo.bom.model import BomDiff, BomEntry, Extraction, walk_entries
from silo.bom.report import PIECES, base_of, bom_json, diff_json, finding_json, flat_json, shorten
from silo.bom.text import with_allowed_characters
from silo.cli.common import (
    EACH,
    READING,
    add_each,
    add_options,
    add_top,
    client_of,
    count_steps,
    json_text,
    not_with,
    only_with,
    plan_of,
    print_json,
    reach,
    read_assembly,
    read_tops,
    reading_of,
)
from silo.files import check_writable, documents_in
from silo.platform import replacing, scratch_folder

if TYPE_CHECKING:
    from silo.bom.compare.two_states import AssemblyChange, LineChange
    from silo.bom_sync import Resolved
    from silo.vault.plan import FolderBoms


def add_bom(parser: argparse.ArgumentParser) -> None:
    add_top(parser, "--csv", "--xlsx")
    add_options(
        parser,
        {
            "--flat": "quantities multiplied down the tree, each part once",
            "--verify": (
                "have freecadcmd compare the BOM with the solids that FreeCAD shows; 1 where they differ"
            ),
            "--resolve": "ask the server for part numbers and names",
            "--why PART": (
                "show why the assembly itself has so many of a part (name, label or standard): each chain"
            ),
            "--verbose": "also hints, such as links that an array could replace",
            "--csv FILE": "write the lines as CSV (- for standard output)",
            "--xlsx FILE": "write the lines as a workbook",
        },
    )
    only_with(parser, "--resolve", "--server", "--token")
    not_with(parser, "--verify", "--flat", "--resolve", "--csv", "--xlsx", "--why", *READING)
    not_with(parser, "--why", "--flat", "--resolve", "--csv", "--xlsx", "--json", *READING)


def run_bom(args: argparse.Namespace) -> int:
    """Print the BOM; returns 1 if an error says that it is incomplete."""
    if args.verify:
        return _verify(args)
    if args.why:
        return _why(args)
    check_writable(*(path for path in (args.csv, args.xlsx) if path and path != "-"))
    if os.path.isdir(args.top) or args.assembly == EACH:
        return _show_each(args)
    extraction, summary = read_tops(args)[0], None
    if args.resolve:
        from silo.batch import ask_for_moved
        from silo.bom_sync import resolve

        with client_of(args) as client:
            reach(client, extraction)
            resolved = ask_for_moved(resolve(extraction, client), client)
            if number := resolved.assembly.part_number:
                try:
                    summary = client.get_summary(number)
                except BusyError as error:  # a very large product is summed up; the BOM is here
                    print(error, file=sys.stderr)
        entries = {entry.key: entry for entry in resolved.unresolved}
        head = _whole(replace(resolved.assembly, children=resolved.entries), entries)
        extraction = Extraction(resolved.assembly, head.children, resolved.findings)
    else:
        hints = consolidation_findings(extraction.entries)
        extraction = replace(extraction, findings=(*extraction.findings, *hints))
    if args.csv:
        _write_csv(args.csv, _table(extraction, flat=args.flat))
    if args.xlsx:
        _write_xlsx(args.xlsx, _table(extraction, flat=args.flat))
    if args.json:
        kept = {"silo": summary.model_dump(mode="json")} if summary else {}
        print_json(flat_json(extraction) if args.flat else bom_json(extraction) | kept)
    if args.json or args.csv == "-":
        return _exit_of(extraction, args)
    from silo.cli.show import bom_tree, console, findings_text, flat_table, summary_text

    out = console()
    out.print(flat_table(flat_json(extraction)) if args.flat else bom_tree(extraction))
    findings = one_hint_each(extraction.findings)
    findings = tuple(
        finding for finding in findings if args.verbose or finding.code is not FindingCode.CONSOLIDATION
    )
    if findings:
        out.print()
        out.print(findings_text(findings, base_of(extraction)))
    if summary:
        out.print()
        out.print(summary_text(summary))
    return _exit_of(extraction, args)


def _why(args: argparse.Namespace) -> int:
    """Print each way from the assembly to a part, with the arrays on it."""
    from silo.bom.links import why
    from silo.bom.roots import choose_assembly
    from silo.cli.show import console, plain
    from silo.fcstd import Library

    if os.path.isdir(args.top):
        raise InputError("--why is for one assembly; name its file.")
    with Library() as library:
        top = choose_assembly(library.open(args.top), args.assembly)
        first, *ways = why(top, [args.why], hardware=not args.no_hardware)
    out = console()
    for line in (first, *(f"  {way}" for way in ways)):
        out.print(plain(line), markup=False)
    return Exit.DONE


def _exit_of(extraction: Extraction, args: argparse.Namespace) -> int:
    """Return exit code 1 if an error makes the BOM incomplete, or if own parts of the file are no items
    yet.
    """
    incomplete = extraction.blocked and not args.allow_missing
    return Exit.UNDONE if incomplete or extraction.assembly.own else Exit.DONE


def _show_each(args: argparse.Namespace) -> int:
    """Show each assembly of a file; in a folder, each with its own lines, children first. Returns 1 if one is
    incomplete.
    """
    if args.flat or args.resolve or args.csv or args.xlsx:
        raise InputError("--flat, --resolve, --csv and --xlsx are for one assembly; name its file.")
    from silo.cli.show import bom_tree, console, findings_text, plain

    out, errors = console(), {}
    if os.path.isdir(args.top):
        with plan_of(args) as (plan, reading, base):
            tops = [(plan.extraction(node, reading), base) for layer in plan.layers for node in layer]
        errors = {relative(top, base): str(error) for top, error in plan.errors.items()}
    else:
        tops = [(extraction_of_top, base_of(extraction_of_top)) for extraction_of_top in read_tops(args)]
    if args.json:
        print_json({"assemblies": [bom_json(*root) for root in tops], "errors": errors})
    for extraction, base in tops if not args.json else ():
        out.print(bom_tree(extraction, base))
        if extraction.findings:
            out.print(findings_text(extraction.findings, base))
        out.print()
    for path, words in errors.items() if not args.json else ():
        out.print(f"✗ {plain(path)}: {plain(words)}", style="red", markup=False)
    return (
        Exit.UNDONE
        if errors
        else max((_exit_of(extraction_of_top, args) for extraction_of_top, _ in tops), default=Exit.DONE)
    )


def _table(extraction: Extraction, *, flat: bool) -> list[list[str | int]]:
    """Make the rows of a spreadsheet, with a heading; ``level`` is 1 for direct children of the assembly."""
    rows: list[dict[str, Any]] = []

    def grow(entries: list[dict[str, Any]]) -> None:
        for entry in entries:
            name = entry["name"] or entry["standard"] or entry["label"]
            rows.append({**entry, "name": name, "unit": PIECES})
            grow(entry["children"])

    grow([]) if flat else grow(bom_json(extraction)["entries"])
    level = () if flat else ("level",)
    columns = (*level, "part_number", "name", "quantity", "unit", "standard", "doc_path", "object", "missing")
    table_rows = flat_json(extraction) if flat else rows
    cells = [["yes" if row[name] is True else row[name] or "" for name in columns] for row in table_rows]
    return [[name.replace("doc_path", "file").replace("_", " ") for name in columns], *cells]


def _write_csv(path: str, rows: list[list[str | int]]) -> None:
    text = StringIO(newline="")
    csv.writer(text).writerows(list(map(safe_cell, row)) for row in rows)
    if path == "-":
        sys.stdout.write(text.getvalue().replace("\r\n", "\n"))
        return
    with replacing(Path(path)) as file:  # spreadsheets want the mark
        file.write(b"\xef\xbb\xbf" + text.getvalue().encode("utf-8", "surrogateescape"))


def _write_xlsx(path: str, rows: list[list[str | int]]) -> None:
    """Write a workbook; text stays text. ConfigError if XlsxWriter is not installed."""
    try:
        from xlsxwriter import Workbook
    except ImportError:
        raise ConfigError("--xlsx needs the package XlsxWriter: pip install 'silo-mod[server]'") from None
    with replacing(Path(path)) as file, Workbook(file, {"in_memory": True}) as book:
        sheet = book.add_worksheet()
        for number, row in enumerate(rows):
            for column, value in enumerate(row):
                if isinstance(value, str):  # no formula
                    sheet.write_string(number, column, with_allowed_characters(value)[:32767])
                else:
                    sheet.write_number(number, column, value)
        sheet.freeze_panes(1, 0)


def _verify(args: argparse.Namespace) -> int:
    """Compare the BOM, as live FreeCAD has it, with the solids that FreeCAD shows.

    It asks a FreeCAD that can open all files of the assembly, by the versions that saved them.
    """
    from silo.bom.document import saved_by
    from silo.bom.links import extract
    from silo.bom.roots import choose_assembly
    from silo.fcstd import FcstdDocument, Library
    from silo.freecads import freecad_for, run_freecad

    if os.path.isdir(args.top):
        raise InputError("--verify is for one file; name the file.")
    with Library() as library:
        extract(choose_assembly(library.open(args.top), args.assembly))
        read = [document for document in library.documents.values() if isinstance(document, FcstdDocument)]
        command, version = freecad_for(max(saved_by(document.ProgramVersion) for document in read))
    print(f"Compared in FreeCAD {version} ({command}).", file=sys.stderr)
    witness: dict[str, list[dict[str, Any]]] = {}
    ((top, error),) = run_freecad(
        [args.top], args.assembly, command=command, hardware=not args.no_hardware, witness=witness
    )
    if isinstance(error, SiloError):
        raise error
    accounts = witness[top]
    differs = error.blocked or not all(account["agrees"] for account in accounts)
    if args.json:
        print_json({**bom_json(error), "witness": accounts})
        return int(differs)
    from silo.cli.show import console, findings_text, plain

    out = console()
    for account in accounts:
        mark = "✓" if account["agrees"] else "✗"
        out.print(f"{mark} {plain(account['sentence'])}", markup=False)
    if error.blocked:
        out.print(findings_text(error.findings, base_of(error)))
    return int(differs)


def _whole(entry: BomEntry, unresolved: Mapping[tuple[str, str], BomEntry]) -> BomEntry:
    """Give an entry all its children back, also those without a part number."""
    entries = (*entry.children, *(unresolved.get(child.key, child) for child in entry.unregistered))
    children = (
        replace(_whole(bom_entry, unresolved), quantity=child.quantity, level=child.level)
        for bom_entry, child in zip(entries, (*entry.children, *entry.unregistered), strict=True)
    )
    return replace(entry, children=tuple(children))


def add_where_used(parser: argparse.ArgumentParser) -> None:
    text = "the file; it need not be there any more"
    add_each(parser, "part", metavar="PART.FCStd", help=text)


def run_where_used(args: argparse.Namespace) -> int:
    """Print the files; for an unchanged vault the index knows them."""
    from silo.vault.reading import Question

    if not os.path.isdir(args.root):
        raise InputError(f"{args.root} is not a folder. Name the folder of the vault.")
    base, part = os.path.realpath(args.root), os.path.realpath(args.part)
    if not os.path.lexists(part) and os.path.lexists(inner := os.path.join(base, args.part)):
        part = os.path.realpath(inner)  # as the other commands print it
    tops = documents_in([base])
    if part not in tops and not os.path.lexists(part) and not os.path.isdir(os.path.dirname(part)):
        raise InputError(f"{args.part}: there is no such file, nor its folder.")
    users: dict[str, set[str]] = {}
    unread = []
    with reading_of(args) as reading:
        reading.index.expect(base)
        progress = count_steps(len(tops))
        for top, answer in zip(tops, reading.ask_many(map(Question, tops)), strict=True):
            progress(top)
            if "document" in answer.plain:
                unread.append(top)
            for used in answer.known.links:
                users.setdefault(used, set()).add(top)
    if part not in users and not os.path.lexists(part):
        relative_paths = {relative(place, base) for place in (*tops, *users)}
        meant = did_you_mean(relative(part, base), sorted(relative_paths)) or "."
        raise InputError(f"{args.part}: there is no such file, and none in {args.root} links to one{meant}")
    above = _above(part, users)
    uses = {
        "direct": users.get(part, ()),
        "all": above,
        "tops": [top for top in above if not users.get(top)],
        "unreadable": unread,
    }
    said = {name: [relative(path, base) for path in sorted(paths)] for name, paths in uses.items()}
    if args.json:
        print_json({"part": relative(part, base), **said})
        return Exit.UNDONE if unread else Exit.DONE
    from silo.cli.show import console, plain

    out = console()
    lines = said["direct"] or [f"No file of {args.root} links to it."]
    if said["tops"]:
        lines.append(f"Tops that a change touches: {', '.join(said['tops'])}")
    lines += [f"✗ {path} could not be read, so its links are not known." for path in said["unreadable"]]
    for line in lines:
        out.print(plain(line), markup=False)
    return Exit.UNDONE if unread else Exit.DONE


def _above(part: str, users: Mapping[str, set[str]]) -> set[str]:
    """Find all files that use ``part``, directly or not."""
    result: set[str] = set()
    left = [part]
    while left:
        for user in users.get(left.pop(), ()):
            if user not in result and user != part:
                result.add(user)
                left.append(user)
    return result


def add_relink(parser: argparse.ArgumentParser) -> None:
    add_each(parser, "top", metavar="TOP.FCStd", help="the assembly's file")
    parser.add_argument(
        "--from",
        dest="old",
        metavar="OLD",
        required=True,
        help="the file that the links record; relative to TOP's folder, as `silo-mod bom` prints it",
    )
    parser.add_argument("--to", dest="new", metavar="NEW", required=True, help="the file that is meant")


def run_relink(args: argparse.Namespace) -> int:
    """Mend the links; returns 2 if no link records OLD, or if NEW does not hold what they want."""
    from silo.fcstd.relink import Relinked, relink

    folder = os.path.dirname(os.path.realpath(args.top))
    paths = _documents(args.top)
    new = _either(folder, args.new)
    done: list[Relinked] = []
    for old in dict.fromkeys((os.path.join(folder, args.old), os.path.abspath(args.old))):
        done = done or relink(
            paths,
            os.path.normpath(old),
            new,
            dry_run=args.dry_run,
            check=_any if args.even_if_open else _closed,
        )
    if not done:
        raise InputError(f"no link of {args.top} and its sub-assemblies records {args.old}; nothing to mend")
    if args.json:
        rows = [
            {
                "file": relative(relinked.path, folder),
                "links": relinked.links,
                "objects": list(relinked.objects),
            }
            for relinked in done
        ]
        print_json({"dry_run": args.dry_run, "to": relative(new, folder), "files": rows})
        return Exit.DONE
    from silo.cli.show import console, plain

    out = console()
    for relinked in done:
        links = counted(relinked.links, "link")
        verb = "would lead" if args.dry_run else "now leads" if relinked.links == 1 else "now lead"
        text = f"✓ {relative(relinked.path, folder)}: {links} {verb} to {relative(new, folder)}"
        out.print(plain(text), markup=False)
    return Exit.DONE


def _any(_path: str) -> None:
    return


def _closed(path: str) -> None:
    from silo.freecads import open_in_any

    if open_in_any().has_file(path):
        raise DocumentError(
            path,
            "it is open in FreeCAD, and saving it there would undo the change. Close it there, or mend the "
            "links from there (BOM in Silo, Mend links); --even-if-open writes it anyway",
        )


def _documents(top: str) -> list[str]:
    """List the files of the tree that can be read."""
    try:
        extraction = read_assembly(top)
    except SiloError:  # such as no assembly in the file: its own links can be mended anyway
        return [top]
    entries = walk_entries(extraction.entries)
    return [top, *(entry.doc_path for entry in entries if not entry.missing and entry.doc_path)]


def _either(folder: str, path: str) -> str:
    beside = os.path.normpath(os.path.join(folder, path))
    return beside if os.path.exists(beside) else os.path.abspath(path)


def add_diff(parser: argparse.ArgumentParser) -> None:
    add_top(parser)


def run_diff(args: argparse.Namespace) -> int:
    """Print the comparison; with ``--check`` returns 1 for drift, broken links and unregistered
    components.
    """
    from silo.batch import suggest_by_identity
    from silo.bom_sync import assemblies, blocking, names_of, resolve, server_lines

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
    base = base_of(extraction)
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
    from silo.bom_sync import blocking
    from silo.cli.show import console, diff_table, outcome_text, plain
    from silo.vault.plan import SyncJob

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
        words = "no differences"
        if drifted:
            words = "there are differences, or what could not be compared (see above)"
        out.print(f"Assemblies compared: {compared_count}; {words}.")
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
    from silo.bom_sync import blocking
    from silo.cli.show import console, diff_table, entry_text, findings_text, plain

    out = console()
    for resolved, diff in compared:
        head = resolved.assembly
        if head.part_number:
            out.print(entry_text(head, base))
        else:
            name = plain(display_name(head))
            out.print(
                f"{name}: no part number yet, so nothing to compare with (silo-mod register)", markup=False
            )
        if head.part_number or diff.added:
            out.print(diff_table(diff, names, whole=not (blocking(resolved) or resolved.unresolved)))
        out.print()
    out.print(findings_text(whole.findings, base))


_MARK = {
    "added": ("+", "green"),
    "removed": ("-", "red"),
    "quantity_changed": ("~", "yellow"),
    "moved": ("→", "dim"),
}


def add_bom_diff(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "folders", metavar="FOLDER", nargs="*", help="OLD and NEW; with --git the one folder to compare"
    )
    add_options(
        parser,
        {
            "--git A..B": (
                "compare two revisions of a repository; A...B: from where B branched off A; A alone: "
                "against the files as they are"
            )
        },
    )


def run_bom_diff(args: argparse.Namespace) -> int:
    """Print the comparison. Returns 1 if a BOM could not be read completely, and with ``--check`` if one
    changed.
    """
    from silo.bom.compare.two_states import compare_assemblies

    check_writable(*args.report)
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
    # An old state that is damaged cannot be mended any more; a new one can.
    return Exit.UNDONE if not new.complete or (args.check and changes) else Exit.DONE


def _two_states(args: argparse.Namespace) -> tuple[FolderBoms, FolderBoms]:
    """Read the two states to compare. Raises InputError."""
    from silo.vault.plan import read_folder

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
            """Lay out the whole repository as it was, since the folder may use files beside it."""
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
    return f"{change.head.doc_path}: {_name(change.head)}{f' ({note})' if note else ''}"


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
    words = [
        f"{name}: {path} could not be read: {shorten(why, state.base)}" for path, why in state.unreadable
    ]
    return words + [f"{name}: {shorten(finding.message, state.base)}" for finding in state.findings]


def _show_changes(changes: tuple[AssemblyChange, ...], old: FolderBoms, new: FolderBoms) -> None:
    from rich.table import Table
    from rich.text import Text

    from silo.cli.show import console, plain

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
    for words in (*_incomplete(old, "old"), *_incomplete(new, "new")):
        out.print(Text("✗ ", "bold red").append(plain(spoken(words)), ""))


def _name(entry: BomEntry) -> str:
    return display_name(entry) or entry.object_name


def _unchanged(old: FolderBoms, new: FolderBoms) -> str:
    if not (old.assemblies or new.assemblies):
        return "There is no assembly to compare, before or after."
    part = "" if old.complete and new.complete else " as far as they could be read"
    return f"No BOM changed{part}; assemblies compared: {len(new.assemblies)}."


def _markdown(changes: tuple[AssemblyChange, ...], old: FolderBoms, new: FolderBoms) -> str:
    from silo.batch import cell

    lines = ["## BOM changes", ""]
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
    incomplete = [*_incomplete(old, "old"), *_incomplete(new, "new")]
    if incomplete:
        lines += ["### Not complete", "", *(f"- {cell(words)}" for words in incomplete), ""]
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
