# SPDX-License-Identifier: LGPL-2.1-or-later
"""All assemblies of a folder, each once, read without FreeCAD."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from silo.bom.changes import Assembly
from silo.bom.document import relative
from silo.bom.errors import InputError, SiloError
from silo.bom.findings import Finding, Severity
from silo.bom.links import extract
from silo.bom.model import BomEntry, Extraction
from silo.bom.roots import choose_assembly, find_assemblies
from silo.fcstd import Library
from silo.files import documents_in


@dataclass(frozen=True, slots=True)
class FolderBoms:
    """What the files of a folder say. Paths are relative to it.

    unreadable
        file and reason, for files that could not be read.
    findings
        what keeps a BOM from being complete (severity error), each once.
    """

    base: str
    assemblies: tuple[Assembly, ...] = ()
    unreadable: tuple[tuple[str, str], ...] = ()
    findings: tuple[Finding, ...] = ()

    @property
    def complete(self) -> bool:
        """True where every file was read and every BOM is whole."""
        return not self.unreadable and not self.findings


def read_folder(
    folder: Path | str, *, root: Path | str | None = None, lost: Sequence[tuple[str, str]] = ()
) -> FolderBoms:
    """Read all assemblies below a folder. ``root``: no file outside of it is read.

    lost
        file and reason of what is known not to be there.

    Raises InputError where there is no such folder. A file that cannot be read is reported in the result.
    """
    base = os.path.realpath(folder)
    if not os.path.isdir(base):
        raise InputError(f"{folder} is no folder. Name a folder of FreeCAD files.")
    assemblies: dict[tuple[str, str], Assembly] = {}
    unreadable = list(lost)
    findings: dict[Finding, None] = {}
    with Library(root) as library:
        for path in _users_first(documents_in([base]), library):
            try:
                for found in _extractions(library, path, assemblies):
                    findings.update(dict.fromkeys(f for f in found.findings if f.severity is Severity.ERROR))
                    for assembly in _assemblies(found):
                        assemblies.setdefault(assembly.head.key, assembly)
            except SiloError as error:
                unreadable.append((relative(path, base), str(error)))
    ordered = sorted(assemblies.values(), key=lambda assembly: assembly.head.key)
    return FolderBoms(
        base,
        tuple(_relative(assembly, base) for assembly in ordered),
        tuple(unreadable),
        tuple(findings),
    )


def _users_first(paths: Sequence[str], library: Library) -> list[str]:
    """Files that no other links to come first, so that what they use is walked once, as part of them."""
    used: set[str] = set()
    for path in paths:
        with suppress(SiloError):  # reported where it is read
            used.update(os.path.basename(recorded).lower() for recorded in library.open(path).linked())
    return sorted(paths, key=lambda path: os.path.basename(path).lower() in used)


def _extractions(library: Library, path: str, known: dict[tuple[str, str], Assembly]) -> Iterator[Extraction]:
    """The BOMs of a file's assemblies, without those that were read as part of another one."""
    document = library.open(path)
    for top in _tops(document):
        if (document.FileName, top.Name) not in known:
            yield extract(top)


def _tops(document: Any) -> Iterable[Any]:
    try:
        return (choose_assembly(document),)
    except InputError:  # several are equally likely: here all of them count
        return find_assemblies(document)


def _assemblies(found: Extraction) -> Iterator[Assembly]:
    """The assembly itself and every sub-assembly below it that has lines."""
    seen: set[int] = set()
    stack = [(found.assembly, found.entries)]
    while stack:
        head, lines = stack.pop()
        if lines and id(lines) not in seen:
            seen.add(id(lines))
            yield Assembly(replace(head, children=(), quantity=1, level=0), tuple(lines))
            stack += [(line, line.children) for line in lines]


def _relative(assembly: Assembly, base: str) -> Assembly:
    def moved(entry: BomEntry) -> BomEntry:
        return replace(entry, doc_path=relative(entry.doc_path, base), children=())

    return Assembly(moved(assembly.head), tuple(moved(line) for line in assembly.lines))
