# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod bom``: the BOM of an assembly, read from its files without FreeCAD."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Mapping
from dataclasses import replace

from silo.bom.consolidation import consolidation_findings, one_hint_each
from silo.bom.entry import BomEntry, Extraction
from silo.bom.errors import BusyError, Exit, InputError
from silo.bom.findings import FindingCode
from silo.bom.message import message
from silo.bom.view.flat_list import flat_json
from silo.bom.view.folders import base_folder
from silo.bom.view.tree_json import bom_json
from silo.bom.walk.document import relative
from silo.cli.connection import client_of, reach
from silo.cli.files.bom_table import table_rows, write_csv, write_xlsx
from silo.cli.files.bom_verify import verify
from silo.cli.json_output import print_json
from silo.cli.options import EACH, READING, add_options, add_top, not_with, only_with
from silo.cli.outputs import add_outputs
from silo.cli.reading import plan_of, read_tops
from silo.output_files import csv_table, workbook


def add_bom(parser: argparse.ArgumentParser) -> None:
    add_top(parser, "--csv", "--xlsx")
    add_options(
        parser,
        {
            "--flat": message("quantities multiplied down the tree, each part once"),
            "--verify": (
                message(
                    "have freecadcmd compare the BOM with the solids that FreeCAD shows; 1 where they differ"
                )
            ),
            "--resolve": message("ask the server for part numbers and names"),
            "--why PART": (
                message(
                    "show why the assembly itself has so many of a part (name, label or standard): each chain"
                )
            ),
            "--verbose": message("also hints, such as links that an array could replace"),
        },
    )
    headings = (message("part number"), "name", "quantity", "unit", "file")
    add_outputs(
        parser,
        {"--csv FILE": message("write the lines as CSV (- for standard output)")},
        csv_table(*headings),
    )
    add_outputs(parser, {"--xlsx FILE": message("write the lines as a workbook")}, workbook(*headings))
    parser.set_defaults(to_standard_output=("--csv",))
    only_with(parser, "--resolve", "--server", "--token")
    not_with(parser, "--verify", "--flat", "--resolve", "--csv", "--xlsx", "--why", *READING)
    not_with(parser, "--why", "--flat", "--resolve", "--csv", "--xlsx", "--json", *READING)


def run_bom(args: argparse.Namespace) -> int:
    """Print the BOM; returns 1 if an error says that it is incomplete."""
    if args.verify:
        return verify(args)
    if args.why:
        return _why(args)
    if os.path.isdir(args.top) or args.assembly == EACH:
        return _show_each(args)
    extraction, summary = read_tops(args)[0], None
    if args.resolve:
        from silo.batch import ask_for_moved
        from silo.bom_sync.resolved import resolve

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
        write_csv(args.csv, table_rows(extraction, flat=args.flat))
    if args.xlsx:
        write_xlsx(args.xlsx, table_rows(extraction, flat=args.flat))
    if args.json:
        kept = {"silo": summary.model_dump(mode="json")} if summary else {}
        print_json(flat_json(extraction) if args.flat else bom_json(extraction) | kept)
    if args.json or args.csv == "-":
        return _exit_of(extraction, args)
    from silo.cli.bom_display import bom_tree, findings_text, flat_table, summary_text
    from silo.cli.terminal import console

    out = console()
    out.print(flat_table(flat_json(extraction)) if args.flat else bom_tree(extraction))
    findings = one_hint_each(extraction.findings)
    findings = tuple(
        finding for finding in findings if args.verbose or finding.code is not FindingCode.CONSOLIDATION
    )
    if findings:
        out.print()
        out.print(findings_text(findings, base_folder(extraction)))
    if summary:
        out.print()
        out.print(summary_text(summary))
    return _exit_of(extraction, args)


def _why(args: argparse.Namespace) -> int:
    """Print each way from the assembly to a part, with the arrays on it."""
    from silo.bom.walk.links import why
    from silo.bom.walk.roots import choose_assembly
    from silo.cli.terminal import console, plain
    from silo.fcstd import Library

    if os.path.isdir(args.top):
        raise InputError(message("--why is for one assembly; name its file."))
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
        raise InputError(message("--flat, --resolve, --csv and --xlsx are for one assembly; name its file."))
    from silo.cli.bom_display import bom_tree, findings_text
    from silo.cli.terminal import console, plain

    out, errors = console(), {}
    if os.path.isdir(args.top):
        with plan_of(args) as (plan, reading, base):
            tops = [(plan.extraction(node, reading), base) for layer in plan.layers for node in layer]
        errors = {relative(top, base): str(error) for top, error in plan.errors.items()}
    else:
        tops = [(extraction_of_top, base_folder(extraction_of_top)) for extraction_of_top in read_tops(args)]
    if args.json:
        print_json({"assemblies": [bom_json(*root) for root in tops], "errors": errors})
    for extraction, base in tops if not args.json else ():
        out.print(bom_tree(extraction, base))
        if extraction.findings:
            out.print(findings_text(extraction.findings, base))
        out.print()
    for path, words in errors.items() if not args.json else ():
        out.print(
            message("✗ {path}: {words}", path=plain(path), words=plain(words)), style="red", markup=False
        )
    return (
        Exit.UNDONE
        if errors
        else max((_exit_of(extraction_of_top, args) for extraction_of_top, _ in tops), default=Exit.DONE)
    )


def _whole(entry: BomEntry, unresolved: Mapping[tuple[str, str], BomEntry]) -> BomEntry:
    """Give an entry all its children back, also those without a part number."""
    entries = (*entry.children, *(unresolved.get(child.key, child) for child in entry.unregistered))
    children = (
        replace(_whole(bom_entry, unresolved), quantity=child.quantity, level=child.level)
        for bom_entry, child in zip(entries, (*entry.children, *entry.unregistered), strict=True)
    )
    return replace(entry, children=tuple(children))
