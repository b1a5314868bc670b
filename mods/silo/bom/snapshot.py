# SPDX-License-Identifier: LGPL-2.1-or-later
"""A whole extraction as JSON values, to be read back: for another process, or for later.

Entries stand in a table, each distinct entry once: nested assemblies share their children, and a tree
written out in full could be exponentially larger. What a look-up adds (``also``, ``unregistered``) is a later
step's and not kept.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any

from silo.bom.entry import BomEntry, Extraction
from silo.bom.errors import InputError
from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.bom.message import beside, message, read_beside

FORMAT = 1

_ELSEWHERE = frozenset({"children", "instances", "also", "unregistered", "own", "copy"})

_PLAIN_FIELDS = tuple(f.name for f in fields(BomEntry) if f.name not in _ELSEWHERE)

# Usual values of an entry are left out: a vault has tens of thousands of entries to read every night.
_USUAL = {f.name: f.default for f in fields(BomEntry) if f.name in _PLAIN_FIELDS and f.default is not MISSING}


def to_plain(extraction: Extraction) -> dict[str, Any]:
    """Write an extraction as JSON values, from which :func:`from_plain` makes an equal one."""
    table = _Table()
    return {
        "format": FORMAT,
        "assembly": table.add(extraction.assembly),
        "entries": [table.add(entry) for entry in extraction.entries],
        "table": table.rows,
        "findings": [_plain_finding(finding) for finding in extraction.findings],
    }


def from_plain(data: Mapping[str, Any]) -> Extraction:
    """Read the extraction that :func:`to_plain` wrote. Raises InputError for anything else."""
    if data.get("format") != FORMAT:
        raise InputError(
            message(
                "expected a BOM snapshot of format {format}, got {data}",
                format=FORMAT,
                data=repr(data.get("format")),
            )
        )
    try:
        entries: list[BomEntry] = []
        for row in data["table"]:
            entries.append(_entry(row, entries))
        return Extraction(
            assembly=entries[data["assembly"]],
            entries=tuple(entries[number] for number in data["entries"]),
            findings=tuple(_finding(finding) for finding in data["findings"]),
        )
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise InputError(message("this BOM snapshot is not complete: {error}", error=repr(error))) from error


def whole_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """Fill in the plain fields of a table row that were not written because they have their usual value."""
    return {**_USUAL, **row}


class _Table:
    """Rows of entries, children before parents."""

    def __init__(self) -> None:
        self.rows: list[dict[str, Any]] = []
        self._known: dict[int, int] = {}

    def add(self, entry: BomEntry) -> int:
        if (number := self._known.get(id(entry))) is not None:
            return number
        children = [self.add(child) for child in entry.children]
        row = {
            name: value
            for name, value in vars(entry).items()
            if name not in _ELSEWHERE and (name not in _USUAL or value != _USUAL[name])
        }
        row |= {"children": children, "instances": list(entry.instances)}
        if entry.variant:
            row["copy"] = list(entry.copy)
        if entry.own:
            row["own"] = [self.add(bom_entry) for bom_entry in entry.own]
        self.rows.append(row)
        return self._known.setdefault(id(entry), len(self.rows) - 1)


def _entry(row: Mapping[str, Any], before: list[BomEntry]) -> BomEntry:
    children = tuple(before[number] for number in row["children"])
    plain = {name: row[name] for name in _PLAIN_FIELDS if name in row}
    mine = tuple(before[number] for number in row.get("own", ()))
    path, name = row.get("copy", ("", ""))
    instances = tuple(row["instances"])
    return BomEntry(**plain, children=children, instances=instances, own=mine, copy=(path, name))


def _plain_finding(finding: Finding) -> dict[str, Any]:
    return {
        "code": finding.code.value,
        "severity": finding.severity.value,
        "message": finding.message,
        **beside(finding.message),
        "where": [
            [place.doc_path, place.obj, *([place.label, place.standing] if place.standing else [])]
            for place in finding.where
        ],
        "file": finding.file,
        "did_you_mean": finding.did_you_mean,
    }


def _finding(data: Mapping[str, Any]) -> Finding:
    return Finding(
        FindingCode[data["code"].upper()],
        Severity(data["severity"]),
        read_beside(data),
        tuple(Place(*place) for place in data["where"]),
        data.get("file", ""),
        data.get("did_you_mean", ""),
    )
