# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a comparison of CAD with the server says: the values of the spec (bom-sync §4), frozen."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any

from silo.bom.entry import BomEntry
from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.bom.frozen import freeze
from silo.bom.message import counted_message, message


class Row(Mapping[str, Any]):
    """A frozen row that reads as a mapping (the spec's dicts) and as attributes; equal to an equal dict."""

    def __getitem__(self, key: str) -> Any:
        if key not in self._names():
            raise KeyError(key)
        return getattr(self, key)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names())

    def __len__(self) -> int:
        return len(self._names())

    def _names(self) -> tuple[str, ...]:
        return tuple(f.name for f in fields(self))  # type: ignore[arg-type]


@dataclass(frozen=True, eq=False)
class BomChange(Row):
    """A part number and its quantity (added, removed, unchanged, manual)."""

    part_number: str
    quantity: float | None

    def __hash__(self) -> int:
        return hash((self.part_number, self.quantity))


@dataclass(frozen=True, eq=False)
class QuantityChange(Row):
    """A line that both sides have, with different quantities (changed, or a conflict with a manual line).

    unit
        that of the server's quantity if it does not count pieces, as CAD does; else no key of the mapping.
    """

    part_number: str
    local_quantity: float
    remote_quantity: float | None
    unit: str = ""

    def _names(self) -> tuple[str, ...]:
        return ("part_number", "local_quantity", "remote_quantity", *(("unit",) if self.unit else ()))

    def __hash__(self) -> int:
        return hash((self.part_number, self.local_quantity, self.remote_quantity))

    def on_server(self, written: str) -> str:
        """Return the server's quantity, as the caller writes it, with its unit."""
        return f"{written} {self.unit}".rstrip()


@dataclass(frozen=True)
class BomDiff:
    """CAD against server, by the spec's §4 table.

    added              in the assembly, not on the server          → will be added
    quantity_changed   assembly line with another quantity         → will take the assembly's quantity
    removed            assembly line, not in the assembly now      → stays, flagged unreferenced
    unchanged          both, same quantity                         → nothing
    manual             lines that people own                       → never touched, listed apart
    conflicts          in the assembly, and manual with another quantity → a user decides
    kept               lines of components that are missing now        → stay as they are
    """

    added: tuple[BomChange, ...] = ()
    removed: tuple[BomChange, ...] = ()
    quantity_changed: tuple[QuantityChange, ...] = ()
    unchanged: tuple[BomChange, ...] = ()
    manual: tuple[BomChange, ...] = ()
    conflicts: tuple[QuantityChange, ...] = ()
    kept: tuple[BomChange, ...] = ()

    def __post_init__(self) -> None:
        freeze(self, *(f.name for f in fields(self)))

    @property
    def drifted(self) -> bool:
        """Return True if CAD and server differ in a way that a check reports."""
        return bool(self.added or self.removed or self.quantity_changed or self.conflicts)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Make findings of what the comparison leaves to a user; :meth:`findings_at` adds the place."""
        return self.findings_at()

    def findings_at(self, parent: BomEntry | None = None) -> tuple[Finding, ...]:
        """Report unreferenced lines in one finding, each conflict in one. ``parent``: the assembly
        compared.
        """
        places = (Place(parent.doc_path, parent.object_name),) if parent is not None else ()
        findings = []
        if self.removed:
            count, numbers = len(self.removed), ", ".join(change.part_number for change in self.removed)
            text = counted_message(
                count,
                "{n} item in the Silo BOM is not referenced by components in this assembly. "
                "Nothing was deleted: {numbers}.",
                "{n} items in the Silo BOM are not referenced by components in this assembly. "
                "Nothing was deleted: {numbers}.",
                numbers=numbers,
            )
            findings.append(Finding(FindingCode.UNREFERENCED, Severity.WARNING, text, places))
        for change in self.conflicts:
            on_server = (
                message("no quantity") if change.remote_quantity is None else f"{change.remote_quantity:g}"
            )
            text = message(
                "{part_number}: the assembly has {local_quantity}, a line kept by hand in the Silo BOM has "
                "{kept}. It stays as it is until somebody decides.",
                part_number=change.part_number,
                local_quantity=f"{change.local_quantity:g}",
                kept=change.on_server(on_server),
            )
            findings.append(Finding(FindingCode.CONFLICT, Severity.WARNING, text, places))
        return tuple(findings)


def rows_as_dicts(rows: Iterable[Row]) -> list[dict[str, Any]]:
    """Return dicts of plain values, for JSON."""
    return [dict(row) for row in rows]
