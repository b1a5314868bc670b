# SPDX-License-Identifier: LGPL-2.1-or-later
"""An extraction in the words of the truth table, with paths relative to the case."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from freecad_cases.truth import Truth

from silo.bom.entry import BomEntry, Extraction, walk_entries
from silo.bom.errors import SiloError
from silo.bom.findings import Finding, Place
from silo.bom.snapshot import to_plain
from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly
from silo.fcstd import Library


def read(top: Path) -> Extraction | SiloError:
    """What the reader of files says of a file."""
    try:
        with Library() as library:
            return extract(choose_assembly(library.open(top)))
    except SiloError as error:
        return error


def component(entry: BomEntry, base: str) -> str:
    """``file#object``, or the designation of a standard part; a missing one is marked."""
    if entry.is_standard:
        return entry.standard or ""
    place = str(Place(os.path.relpath(entry.doc_path, base), entry.object_name))
    return f"{place} (missing)" if entry.missing else place


def bom_of(entries: Iterable[BomEntry], base: str) -> dict[str, Any]:
    """Component → quantity, or (quantity, what it contains)."""
    return {
        component(entry, base): (entry.quantity, bom_of(entry.children, base))
        if entry.children
        else entry.quantity
        for entry in entries
    }


def findings_of(findings: Iterable[Finding], base: str) -> dict[str, tuple[str, ...]]:
    """Code → all the places, sorted."""
    found: dict[str, list[str]] = {}
    for finding in findings:
        places = found.setdefault(finding.code.value, [])
        places += [str(Place(os.path.relpath(place.doc_path, base), place.obj)) for place in finding.where]
    return {code: tuple(sorted(places)) for code, places in found.items()}


def consolidated(entries: Iterable[BomEntry], base: str) -> frozenset[str]:
    return frozenset(component(e, base) for e in _all(entries) if e.consolidation_warning)


def uuids_of(entries: Iterable[BomEntry], base: str) -> dict[str, str]:
    return {
        component(e, base): e.silo_uuid for e in walk_entries(entries) if e.silo_uuid and not e.is_standard
    }


def _all(entries: Iterable[BomEntry]) -> Iterator[BomEntry]:
    for entry in entries:
        yield entry
        yield from _all(entry.children)


def whole(extraction: Extraction, base: str) -> Mapping[str, Any]:
    """Everything that an extraction says, to compare two ways of reading the same files.

    Left out is the document's label: FreeCAD sets it to the file's name when it opens the file, whatever the
    file says.
    """
    plain = to_plain(extraction)
    for row in plain["table"]:
        del row["document_label"]
    prefix = base.rstrip("/") + "/"
    return _shortened(plain, prefix)


def _shortened(value: Any, prefix: str) -> Any:
    if isinstance(value, str):
        return value.replace(prefix, "")
    if isinstance(value, list):
        return [_shortened(item, prefix) for item in value]
    if isinstance(value, dict):
        return {key: _shortened(item, prefix) for key, item in value.items()}
    return value


def differences(found: Extraction | SiloError, truth: Truth, base: Path) -> list[str]:
    """How an extraction, or the lack of one, differs from the truth; nothing where it is right."""
    if isinstance(found, SiloError):
        return [] if truth.error and truth.error in str(found) else [f"error: {found}"]
    if truth.error:
        return [f"expected the error {truth.error!r}"]
    folder = os.path.realpath(base)
    pairs = {
        "BOM": (bom_of(found.entries, folder), dict(truth.bom)),
        "findings": (
            findings_of(found.findings, folder),
            {code: tuple(sorted(places)) for code, places in truth.findings.items()},
        ),
        "consolidated": (consolidated(found.entries, folder), truth.consolidated),
        "identities": (uuids_of(found.entries, folder), dict(truth.uuids)),
    }
    return [f"{what}: expected {wanted}, got {got}" for what, (got, wanted) in pairs.items() if got != wanted]
