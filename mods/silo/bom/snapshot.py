# SPDX-License-Identifier: LGPL-2.1-or-later
"""An extraction as plain data and back, whole: for another process, or for later.

``silo.bom.report`` prints a BOM for people and machines with short paths; this keeps everything. Entries are
kept in a table, each distinct one once, because nested assemblies share their children and a tree written
out in full could be exponentially larger. What a look-up adds (``also``,
``unregistered``) is a later step's and not kept.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any

from silo.bom.errors import InputError
from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.bom.model import BomEntry, Extraction

FORMAT = 1

_ELSEWHERE = ("children", "instances", "also", "unregistered")
_PLAIN_FIELDS = tuple(f.name for f in fields(BomEntry) if f.name not in _ELSEWHERE)
# What an entry usually says is left out: a vault has tens of thousands of them to read every night.
_USUAL = {f.name: f.default for f in fields(BomEntry) if f.name in _PLAIN_FIELDS and f.default is not MISSING}


def to_plain(extraction: Extraction) -> dict[str, Any]:
    """JSON-ready data that :func:`from_plain` makes an equal extraction of."""
    table = _Table()
    return {
        "format": FORMAT,
        "assembly": table.add(extraction.assembly),
        "entries": [table.add(entry) for entry in extraction.entries],
        "table": table.rows,
        "findings": [_plain_finding(finding) for finding in extraction.findings],
    }


def from_plain(data: Mapping[str, Any]) -> Extraction:
    """The extraction that :func:`to_plain` wrote. Raises InputError for anything else."""
    if data.get("format") != FORMAT:
        raise InputError(f"expected a BOM snapshot of format {FORMAT}, got {data.get('format')!r}")
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
        raise InputError(f"this is no complete BOM snapshot: {error!r}") from error


def whole_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """A row of the table with all its plain fields, also those that are not written."""
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
        whole = {name: getattr(entry, name) for name in _PLAIN_FIELDS}
        row = {name: value for name, value in whole.items() if name not in _USUAL or value != _USUAL[name]}
        self.rows.append({**row, "children": children, "instances": list(entry.instances)})
        self._known[id(entry)] = len(self.rows) - 1
        return len(self.rows) - 1


def _entry(row: Mapping[str, Any], before: list[BomEntry]) -> BomEntry:
    children = tuple(before[number] for number in row["children"])
    plain = {name: row[name] for name in _PLAIN_FIELDS if name in row}
    return BomEntry(**plain, children=children, instances=tuple(row["instances"]))


def _plain_finding(finding: Finding) -> dict[str, Any]:
    return {
        "code": finding.code.value,
        "severity": finding.severity.value,
        "message": finding.message,
        "where": [[place.doc_path, place.obj] for place in finding.where],
        "file": finding.file,
        "did_you_mean": finding.did_you_mean,
    }


def _finding(data: Mapping[str, Any]) -> Finding:
    return Finding(
        FindingCode(data["code"]),
        Severity(data["severity"]),
        data["message"],
        tuple(Place(path, obj) for path, obj in data["where"]),
        data.get("file", ""),
        data.get("did_you_mean", ""),
    )
