# SPDX-License-Identifier: LGPL-2.1-or-later
"""The BOMs of all assemblies in a folder, read side by side to compare two states of it.

A file that cannot be read is reported in the result. Paths in the result are relative to the folder.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from silo.bom.compare.states import ComparedAssembly
from silo.bom.entry import BomEntry, Extraction
from silo.bom.errors import InputError, SiloError
from silo.bom.findings import Finding, Severity
from silo.bom.message import altered, message
from silo.bom.view.folders import shorten
from silo.bom.walk.document import relative
from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly, find_assemblies
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
    assemblies: tuple[ComparedAssembly, ...] = ()
    unreadable: tuple[tuple[str, str], ...] = ()
    findings: tuple[Finding, ...] = ()

    @property
    def complete(self) -> bool:
        """Return True if every file was read and every BOM is whole."""
        return not self.unreadable and not self.findings


def read_folder(
    folder: Path | str, *, root: Path | str | None = None, lost: Sequence[tuple[str, str]] = ()
) -> FolderBoms:
    """Read all assemblies below a folder. ``root``: no file outside of it is read.

    lost
        each file that is known to be missing, and the reason.

    Raises InputError if there is no such folder. A file that cannot be read is reported in the result.
    """
    base = os.path.realpath(folder)
    if not os.path.isdir(base):
        raise InputError(message("{folder} is not a folder. Name a folder of FreeCAD files.", folder=folder))
    assemblies: dict[tuple[str, str], ComparedAssembly] = {}
    unreadable = [(relative(os.path.join(root or base, path), base), why) for path, why in lost]
    findings: dict[Finding, None] = {}
    with Library(root) as library:
        for path in _users_first(documents_in([base]), library):
            try:
                for extraction in _extractions(library, path, assemblies):
                    findings.update(
                        dict.fromkeys(f for f in extraction.findings if f.severity is Severity.ERROR)
                    )
                    for assembly in _assemblies(extraction):
                        assemblies.setdefault(assembly.head.key, assembly)
            except SiloError as error:
                unreadable.append((relative(path, base), _without(str(error), base, root)))
    ordered = sorted(assemblies.values(), key=lambda assembly: assembly.head.key)
    return FolderBoms(
        base,
        tuple(_relative(assembly, base) for assembly in ordered),
        tuple(unreadable),
        tuple(replace(finding, message=_without(finding.message, base, root)) for finding in findings),
    )


def read_file(path: str, called: str = "") -> FolderBoms:
    """Read the assemblies of one file; ``called``: the name that the file has in the result."""
    path = os.path.realpath(path)
    base = os.path.dirname(path)
    findings: dict[Finding, None] = {}
    found: list[ComparedAssembly] = []
    with Library() as library:
        for extraction in _extractions(library, path, {}):
            findings.update(dict.fromkeys(f for f in extraction.findings if f.severity is Severity.ERROR))
            found += [one for one in _assemblies(extraction) if one.head.doc_path == path]
    return FolderBoms(
        base,
        tuple(_called(_relative(one, base), called) for one in found),
        (),
        tuple(replace(finding, message=shorten(finding.message, base)) for finding in findings),
    )


def _called(assembly: ComparedAssembly, name: str) -> ComparedAssembly:
    return replace(assembly, head=replace(assembly.head, doc_path=name)) if name else assembly


def _without(message: str, base: str, root: Path | str | None) -> str:
    """Shorten the paths in a message, also those beside the folder, since the root may be a temporary one."""
    message = shorten(message, base)
    if root is None or (top := os.path.realpath(root)) == base:
        return message
    return altered(message, lambda text: text.replace(top + os.sep, f"{relative(top, base)}/"))


def _users_first(paths: Sequence[str], library: Library) -> list[str]:
    """Put files to which no other links first, so that the files that they use are walked once, as part of
    them.
    """
    used: set[str] = set()
    for path in paths:
        with suppress(SiloError):  # reported when it is read
            used.update(os.path.basename(recorded).lower() for recorded in library.open(path).linked())
    return sorted(paths, key=lambda path: os.path.basename(path).lower() in used)


def _extractions(
    library: Library, path: str, assemblies: dict[tuple[str, str], ComparedAssembly]
) -> Iterator[Extraction]:
    """Yield the BOMs of a file's assemblies, but not those that were read as part of another one."""
    document = library.open(path)
    for top in _tops(document):
        if (document.FileName, top.Name) not in assemblies:
            yield extract(top)


def _tops(document: Any) -> Iterable[Any]:
    try:
        return (choose_assembly(document),)
    except InputError:  # if several are equally likely, all of them count here
        return find_assemblies(document)


def _assemblies(extraction: Extraction) -> Iterator[ComparedAssembly]:
    """Yield the assembly itself and every sub-assembly below it that has lines."""
    seen: set[int] = set()
    stack = [(extraction.assembly, extraction.entries)]
    while stack:
        head, lines = stack.pop()
        if lines and id(lines) not in seen:
            seen.add(id(lines))
            yield ComparedAssembly(replace(head, children=(), quantity=1, level=0), tuple(lines))
            stack += [(line, line.children) for line in lines]


def _relative(assembly: ComparedAssembly, base: str) -> ComparedAssembly:
    def moved(entry: BomEntry) -> BomEntry:
        return replace(entry, doc_path=relative(entry.doc_path, base), children=())

    return ComparedAssembly(moved(assembly.head), tuple(moved(line) for line in assembly.lines))
