# SPDX-License-Identifier: LGPL-2.1-or-later
"""The report of ``silo-mod inertia`` and ``mass``: printed, written; its warnings as an exit code."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from silo import spoken
from silo.bom.errors import Exit, counted
from silo.bom.message import message

if TYPE_CHECKING:
    from silo.inertia.assembly import Assembly
    from silo.inertia.report import InertiaReport


def show_report(
    args: argparse.Namespace, report: InertiaReport, assembly: Assembly, *, quiet: bool = False
) -> None:
    """Write every file that was asked for, and print the report; only its warnings if ``quiet``."""
    from silo.cli.terminal import console

    _write_files(args, report, assembly)
    if quiet:
        from silo.inertia.output.terminal import report_warnings

        console(sys.stderr).print(report_warnings(report, whole=not sys.stderr.isatty(), say=spoken))
        return
    if args.json:
        from silo.inertia.output.json import report_json

        # A pipe on Windows takes the country's code page: names must not turn into question marks there.
        sys.stdout.write(report_json(report, sys.stdout.encoding or "ascii"))
        return
    from silo.inertia.output.terminal import report_tables

    console().print(report_tables(report, whole=not sys.stdout.isatty(), say=spoken))


def _write_files(args: argparse.Namespace, report: InertiaReport, assembly: Assembly) -> None:
    from silo.inertia.output.whole_file import write_whole

    for name in args.preview:
        from silo.drawing.page import views_of, write_glb

        write_whole(name, write_glb(assembly, views_of(report, assembly)))
    for name in args.report:
        from silo.drawing.page import report_html
        from silo.inertia.output.csv import report_csv
        from silo.inertia.output.json import report_json
        from silo.inertia.output.markdown import report_markdown

        writers = {
            ".html": lambda inertia_report: report_html(inertia_report, assembly),
            ".json": report_json,
            ".csv": report_csv,
            ".md": report_markdown,
        }
        write_whole(name, writers[Path(name).suffix.lower()](report).encode("utf-8"))


def verdict(args: argparse.Namespace, report: InertiaReport) -> int:
    """Return exit code 1, and print why, if a warning without --allow says that something could not be read;
    with --strict, if there is any warning without --allow.
    """
    from silo.inertia.notes import GeometryCode

    left = [
        w.code
        for w in report.warnings
        if w.code not in args.allow and (args.strict or w.code == GeometryCode.NOT_READ)
    ]
    if left:
        why = "--strict" if args.strict else message("what cannot be read is in no mass")
        count, codes = counted(len(left), "warning"), ", ".join(sorted({*left}))
        print(f"silo-mod: {why}: {count} ({codes})", file=sys.stderr)
    return Exit.UNDONE if left else Exit.DONE
