# SPDX-License-Identifier: LGPL-2.1-or-later
"""A BOM as plain data: the JSON of ``silo-mod bom``, the flat list, and a whole extraction to be read back.

The JSON for people and machines has short paths. :func:`to_plain` keeps everything, for another process or
for later: entries stand in a table, each distinct one once, because nested assemblies share their children
and a tree written out in full could be exponentially larger. What a look-up adds (``also``,
``unregistered``) is a later step's and not kept.

What a sync leaves out of an assembly's BOM: an incomplete BOM must never look like a complete one.

The rules of this module:

* only the assembly's direct children count; its sub-assemblies have a list of their own;
* paths are relative to the assembly's file, with ``/``, so that two machines agree on them;
* the list travels with the merge, and the server keeps that of the last one.
"""

from __future__ import annotations

import os.path
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import MISSING, asdict, dataclass, fields
from enum import StrEnum
from types import ModuleType
from typing import Any

from silo.bom.document import relative
from silo.bom.errors import InputError
from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.bom.items.naming import display_name
from silo.bom.model import BomDiff, BomEntry, Extraction, rows_as_dicts, walk_entries
from silo.bom.standard import STANDARD_PARTS

# A CAD model counts pieces.
PIECES = "pcs"

# A line takes about 1 kB of memory on its way to JSON or to a terminal.
MOST_LINES = 500_000


def project_folder(path: str, top: str = "", rules: ModuleType = os.path) -> str:
    """Return a file's folder as people call it, the same on every machine: ``robot``, ``robot/arm``.

    It begins with the folder of ``top``, the assembly of the whole run; for a file outside of that folder it
    is the file's own folder.
    """
    base = rules.dirname(top or path)
    inner = relative(rules.dirname(path), base, rules)
    name = rules.basename(base)
    if inner in ("", ".") or not base:
        return str(name)
    if inner.startswith("..") or rules.isabs(inner):
        return str(rules.basename(rules.dirname(path)))
    return f"{name}/{inner}" if name else inner


def base_of(extraction: Extraction) -> str:
    """Return the folder to which printed paths are relative: that of the top file."""
    return os.path.dirname(extraction.assembly.doc_path)


def entry_json(entry: BomEntry, base: str) -> dict[str, Any]:
    """Return an entry with its children as JSON values; quantities per one parent."""
    return {
        "doc_path": relative(entry.doc_path, base),
        "object": entry.object_name,
        "label": entry.label,
        "silo_uuid": entry.silo_uuid,
        "part_number": entry.part_number,
        "name": entry.name,
        "standard": entry.standard,
        "quantity": entry.quantity,
        "missing": entry.missing,
        "level": entry.level,
        "consolidation_warning": entry.consolidation_warning,
        "children": [entry_json(child, base) for child in entry.children],
        **({"own": [entry_json(bom_entry, base) for bom_entry in entry.own]} if entry.own else {}),
    }


def finding_json(finding: Finding, base: str) -> dict[str, Any]:
    """Return a finding as JSON values; places are ``file`` and ``object``, files relative to the top file's
    folder.

    A broken link also has the ``file`` that it records, and the one that was probably meant, if there is one.
    """
    files = {"file": finding.file, "did_you_mean": finding.did_you_mean}
    return {
        "code": finding.code.value,
        "severity": finding.severity.value,
        "message": shorten(finding.message, base),
        "where": [{"file": relative(place.doc_path, base), "object": place.obj} for place in finding.where],
        **{key: relative(path, base) for key, path in files.items() if path},
    }


def shorten(message: str, base: str) -> str:
    """Cut the folder ``base`` from the paths in a message."""
    folder = base.rstrip("/\\")
    # The root of the disk cannot be left out: all separators would go.
    return message.replace(folder + os.sep, "") if folder else message


def tree_size(entries: Iterable[BomEntry]) -> int:
    """Count the lines of the tree written out in full. Nested assemblies share values, so it may be huge."""
    sizes: dict[int, int] = {}

    def size(entry: BomEntry) -> int:
        if id(entry) not in sizes:
            sizes[id(entry)] = 1 + sum(map(size, entry.children))
        return sizes[id(entry)]

    return sum(map(size, entries))


def check_tree_size(extraction: Extraction, most: int = MOST_LINES) -> None:
    """Raise InputError if the tree has more lines than anybody could read, or memory could hold."""
    lines = tree_size(extraction.entries)
    if lines > most:
        raise InputError(
            f"The BOM tree of {extraction.assembly.label} has {lines:,} lines, more than the {most:,} that "
            "can be shown. Use the flat list (--flat): each component once, with its total."
        )


def bom_json(extraction: Extraction, base: str = "") -> dict[str, Any]:
    """Return the whole BOM of an assembly as JSON values. Raises InputError if the tree is too large to be
    written out.

    Paths are relative to ``base``; without it, to the folder of the assembly's file.
    """
    check_tree_size(extraction)
    base = base or base_of(extraction)
    head = extraction.assembly
    return {
        "assembly": {
            "doc_path": relative(head.doc_path, base),
            "object": head.object_name,
            "label": head.label,
            "silo_uuid": head.silo_uuid,
            "part_number": head.part_number,
            "name": head.name,
        },
        "entries": [entry_json(entry, base) for entry in extraction.entries],
        **({"own": [entry_json(bom_entry, base) for bom_entry in head.own]} if head.own else {}),
        "findings": [finding_json(finding, base) for finding in extraction.findings],
    }


def flat_counts(entries: Iterable[BomEntry]) -> dict[tuple[str, str], int]:
    """Count the instances of each component in the whole assembly, sub-assemblies included."""
    below: dict[int, dict[tuple[str, str], int]] = {}

    def total(group: Iterable[BomEntry]) -> dict[tuple[str, str], int]:
        counts: dict[tuple[str, str], int] = {}
        for entry in group:
            # Nested assemblies share their values; each distinct one is counted once.
            if id(entry) not in below:
                counted = below[id(entry)] = {entry.key: 0, **total(entry.children)}
                counted[entry.key] += 1
            for key, count in below[id(entry)].items():
                counts[key] = counts.get(key, 0) + count * entry.quantity
        return counts

    return total(entries)


def flat_lines(entries: Iterable[BomEntry]) -> list[tuple[BomEntry, int]]:
    """Return each component once, with the number of its instances in the whole assembly."""
    direct = tuple(entries)
    bom_entries = {entry.key: entry for entry in walk_entries(direct)}
    return [(bom_entries[key], count) for key, count in flat_counts(direct).items()]


def flat_json(extraction: Extraction) -> list[dict[str, Any]]:
    """Return each component once, with its total, as JSON values: what a purchaser orders from.

    ``part_number`` and ``name`` as far as they are known, ``quantity`` multiplied down the tree, ``unit``,
    the ``standard`` or the file (``doc_path``, ``object``), and if it is ``missing``.
    """
    base = base_of(extraction)
    return [
        {
            "part_number": entry.part_number,
            "name": entry.name or entry.standard or display_name(entry) or entry.object_name,
            "quantity": count,
            "unit": PIECES,
            "standard": entry.standard,
            "doc_path": relative(entry.doc_path, base),
            "object": entry.object_name,
            "missing": entry.missing,
        }
        for entry, count in flat_lines(extraction.entries)
    ]


def diff_json(diff: BomDiff) -> dict[str, Any]:
    """Return a comparison with the server as JSON values."""
    return {field.name: rows_as_dicts(getattr(diff, field.name)) for field in fields(diff)}


_TOLD = ("added", "quantity_changed", "conflicts", "removed", "kept", "manual")


def diff_rows(diff: BomDiff) -> Iterator[tuple[str, str, str]]:
    """Yield each line that differs or is a person's own: (field of the diff, part number, quantity in
    words).
    """
    disputed = {change.part_number for change in diff.conflicts}
    for kind in _TOLD:
        for change in getattr(diff, kind):
            if kind == "quantity_changed":
                quantity = f"{_quantity(change.remote_quantity)} → {_quantity(change.local_quantity)}"
            elif kind == "conflicts":
                kept = change.on_server(_quantity(change.remote_quantity))
                quantity = f"CAD {_quantity(change.local_quantity)}, Silo {kept}"
            elif kind == "manual" and change.part_number in disputed:
                continue
            else:
                quantity = _quantity(change.quantity)
            yield kind, change.part_number, quantity


def _quantity(value: float | None) -> str:
    return "?" if value is None else f"{value:g}"


FORMAT = 1

_ELSEWHERE = frozenset({"children", "instances", "also", "unregistered", "own"})
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
        raise InputError(f"this BOM snapshot is not complete: {error!r}") from error


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
        if entry.own:
            row["own"] = [self.add(bom_entry) for bom_entry in entry.own]
        self.rows.append(row)
        return self._known.setdefault(id(entry), len(self.rows) - 1)


def _entry(row: Mapping[str, Any], before: list[BomEntry]) -> BomEntry:
    children = tuple(before[number] for number in row["children"])
    plain = {name: row[name] for name in _PLAIN_FIELDS if name in row}
    mine = tuple(before[number] for number in row.get("own", ()))
    return BomEntry(**plain, children=children, instances=tuple(row["instances"]), own=mine)


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
        FindingCode[data["code"].upper()],
        Severity(data["severity"]),
        data["message"],
        tuple(Place(path, obj) for path, obj in data["where"]),
        data.get("file", ""),
        data.get("did_you_mean", ""),
    )


class Reason(StrEnum):
    """Why something is not in a BOM."""

    MISSING = "missing"  # its file or object is not there, or cannot be read
    UNREGISTERED = "unregistered"  # it has no part number yet
    BROKEN = "broken"  # something else keeps the assembly from being read in full; see the message
    REFUSED = "refused"  # the server refused the merge; see the message


@dataclass(frozen=True, slots=True)
class LeftOut:
    """One thing that is left out.

    ``file`` (relative to the assembly's) and ``object`` name a component; ``message`` says more where a
    name does not. ``quantity`` is per one assembly, 0 where it is unknown.
    """

    reason: Reason
    name: str = ""
    file: str = ""
    object: str = ""
    quantity: int = 0
    message: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Return the fields that are set, as JSON values."""
        return {key: value for key, value in asdict(self).items() if value}


def components_of(entry: BomEntry, base: str) -> list[dict[str, str]]:
    """Return the components of a line, by which the server remembers it. ``base``: the assembly's folder.

    Standard parts have no file of their own that could be missing.
    """
    return [
        {"file": relative(path, base), "object": name}
        for path, name in (entry.key, *entry.also)
        if path not in ("", STANDARD_PARTS)
    ]


def left_out_of(
    entries: Iterable[BomEntry], unregistered: Iterable[BomEntry], errors: Iterable[Finding], base: str
) -> tuple[LeftOut, ...]:
    """List all that a BOM of these direct children leaves out.

    errors
        the findings that block this assembly. Those that missing entries explain are not repeated.
    """
    missing = [entry for entry in entries if entry.missing]
    explained = {name for entry in missing for name in entry.instances}
    outs = [_component(Reason.MISSING, entry, base) for entry in missing]
    outs += [_component(Reason.UNREGISTERED, entry, base) for entry in unregistered]
    outs += [
        LeftOut(Reason.BROKEN, message=shorten(finding.message, base))
        for finding in errors
        if not {place.obj for place in finding.where} <= explained
    ]
    return tuple(outs)


def _component(reason: Reason, entry: BomEntry, base: str) -> LeftOut:
    name = display_name(entry) or entry.object_name
    return LeftOut(reason, name, relative(entry.doc_path, base), entry.object_name, entry.quantity)


def remembered(
    before: Mapping[str, Sequence[Mapping[str, str]]],
    entries: Iterable[Mapping[str, Any]],
    kept: Iterable[str],
) -> dict[str, list[dict[str, str]]]:
    """Map each part number to the components that are kept for it after a merge.

    Lines that were kept because a component is missing keep their components, so that the next sync knows the
    component again.
    """
    fields_by_key: dict[str, list[dict[str, str]]] = {}
    for entry in entries:
        fields_by_key.setdefault(entry["child_part_number"], []).extend(
            map(dict, entry.get("components") or ())
        )
    for number in kept:
        mine = fields_by_key.setdefault(number, [])
        mine += [dict(fields) for fields in before.get(number, ()) if fields not in mine]
    return {number: components for number, components in fields_by_key.items() if components}


def in_words(left_out: Sequence[LeftOut] | Sequence[Mapping[str, Any]]) -> str:
    """Write ``2 missing, 1 unregistered``; "" if nothing is left out."""
    reasons = Counter(str(out["reason"] if isinstance(out, Mapping) else out.reason) for out in left_out)
    parts = [f"{reasons.pop(reason)} {reason}" for reason in Reason if reason in reasons]
    return ", ".join([*parts, *(f"{count} {reason}" for reason, count in reasons.items())])
