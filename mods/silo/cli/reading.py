# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reading the BOMs of the files and folders that a command line names."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

from silo.bom.entry import Extraction, walk_entries
from silo.bom.errors import InputError, SeveralAssembliesError, SiloError
from silo.bom.findings import respelt_findings
from silo.bom.message import message
from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly
from silo.cli.options import EACH
from silo.cli.progress import count_steps
from silo.platform.processes import processors

if TYPE_CHECKING:
    from silo.vault.plan import Plan
    from silo.vault.reading import VaultReader


@contextmanager
def reading_of(args: argparse.Namespace) -> Iterator[VaultReader]:
    """Yield a reader of files with the options of the command."""
    from silo.vault.index import Index, default_path
    from silo.vault.pool import pool_of
    from silo.vault.reading import VaultReader

    given = getattr(args, "index", None)
    path = None if getattr(args, "no_cache", False) else given or default_path()
    count = getattr(args, "jobs", 1) or processors()  # a command without the option reads one tree
    with Index(path, given=given is not None) as index, pool_of(count, getattr(args, "dask", None)) as pool:
        yield VaultReader(index, pool)


def read_assembly(top: str) -> Extraction:
    """Read the BOM of a file without FreeCAD, and suggest which files were meant by missing ones."""
    from silo.fcstd import Library

    with Library() as library:
        document = library.open(top)
        extraction = extract(choose_assembly(document))
        findings = respelt_findings(library.notes, document.FileName)
    return _with_suggestions(replace(extraction, findings=(*extraction.findings, *findings)))


def _with_suggestions(extraction: Extraction) -> Extraction:
    if not any(entry.missing for entry in walk_entries(extraction.entries)):
        return extraction
    from silo.fcstd.suggest import with_suggestions

    return with_suggestions(extraction)


def read_tops(args: argparse.Namespace) -> list[Extraction]:
    """Read the BOM of the file that the options name, or get it from the index. Raises SiloError.

    Reads each assembly of the file if all are asked for, else one.
    """
    from silo.vault.questions import Question

    names = [None if args.assembly == EACH else args.assembly]
    tops = []
    with reading_of(args) as reading:
        for name in names:
            error = reading.ask(Question(args.top, name, not args.no_hardware, below=True)).found
            if isinstance(error, SeveralAssembliesError) and args.assembly == EACH:
                names += error.names
            elif isinstance(error, SiloError):
                raise error
            else:
                tops.append(_with_suggestions(error))
    return tops


@contextmanager
def plan_of(args: argparse.Namespace) -> Iterator[tuple[Plan, VaultReader, str]]:
    """Yield the plan of all assemblies in the folder that the options name, its reader, and the folder.
    InputError if there is none.
    """
    from silo.files import documents_in
    from silo.vault.plan import make_plan

    refuse_assembly_of([args.top], args.assembly)
    base = os.path.realpath(args.top)
    tops = documents_in([args.top])
    if not tops:
        raise InputError(message("no FreeCAD files (*.FCStd) in {top}", top=args.top))
    with reading_of(args) as reading:
        reading.index.expect(base)
        plan = make_plan(tops, reading, hardware=not args.no_hardware, progress=count_steps(len(tops)))
        yield plan, reading, base


def refuse_assembly_of(tops: Sequence[str], assembly: str | None) -> None:
    """Refuse --assembly for a folder: the name picks one of the assemblies of a file."""
    if assembly not in (None, EACH) and any(os.path.isdir(top) for top in tops):
        raise InputError(
            message("--assembly picks an assembly of one file, and this is a folder; name the file")
        )
