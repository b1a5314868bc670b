# SPDX-License-Identifier: LGPL-2.1-or-later
"""The difference between the CAD assembly and the server's lines (spec bom-sync §4).

The rules:

* a line is found by its part number; the numbers come from the server and compare as they are;
* quantities compare as numbers: 12, 12.0 and "12" are equal;
* CAD counts pieces: a line in another unit belongs to people, and no number in it is CAD's;
* a server line without ``source`` counts as ``assembly``;
* a ``manual`` line (or one of a source that we do not know), and one that is no component (``alternate``,
  ``reference``), belongs to people: it is listed apart, never as removed or changed;
* a component that exists as a manual line of the same quantity is there already (``unchanged``); with another
  quantity it is a conflict, which the reviewer resolves;
* a line of a component whose file is missing is not compared (``kept``): its quantity is unknown.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from silo.bom.compare.bom_diff import BomChange, BomDiff, QuantityChange
from silo.bom.compare.owner import is_component, is_manual
from silo.bom.entry import BomEntry
from silo.bom.quantities import as_number, exact_sum, plain, same_quantity
from silo.bom.units import counts_pieces, says_the_same

# (file, object) of a component; the file relative to the assembly's, as a merge names it.
Component = tuple[str, str]


@dataclass(frozen=True, slots=True)
class _Line:
    part_number: str
    quantity: float | None
    unit: str = ""


def _local(entry: Any) -> _Line | None:
    if isinstance(entry, Mapping):
        number = entry.get("child_part_number") or entry.get("part_number")
        quantity = as_number(entry.get("quantity"))
    else:  # a BomEntry, or any other value with these two names
        number, quantity = entry.part_number, as_number(entry.quantity)
    return _Line(number, quantity or 0.0) if number else None


def _summed(lines: Iterable[_Line]) -> dict[str, float | None]:
    total: dict[str, float | None] = {}
    for line in lines:
        if line.part_number in total:
            both = exact_sum((total[line.part_number] or 0.0, line.quantity or 0.0))
            total[line.part_number] = float(both)
        else:
            total[line.part_number] = line.quantity
    return {number: plain(quantity) for number, quantity in total.items()}


def local_quantities(entries: Iterable[BomEntry | Mapping[str, Any]]) -> dict[str, float | None]:
    """Sum the assembly's direct children by part number; entries without a number are left out."""
    return _summed(line for entry in entries if (line := _local(entry)) is not None)


def diff_bom(
    local_entries: Iterable[BomEntry | Mapping[str, Any]],
    remote_entries: Iterable[Mapping[str, Any]],
    missing: Iterable[Component] = (),
) -> BomDiff:
    """Compare the assembly's direct children with the server's lines of the same parent.

    local_entries
        resolved entries (or mappings with ``child_part_number`` and ``quantity``); entries without a part
        number are not compared. Several with one number are summed.
    remote_entries
        mappings with ``child_part_number``, ``quantity``, ``source`` and optionally ``rel_type``, and
        ``components``: what the line stood for in the last sync.
    missing
        components whose file or object is missing now, as the last sync named them.
    """
    remote_entries = list(remote_entries)
    local = local_quantities(local_entries)
    gone = lines_of_missing(remote_entries, missing, local)
    kept = [line for line in remote_entries if line["child_part_number"] in gone]
    remote_entries = [line for line in remote_entries if line["child_part_number"] not in gone]
    local = {number: quantity for number, quantity in local.items() if number not in gone}
    assembly_lines: list[_Line] = []
    manual_lines: list[_Line] = []
    manual_components: list[_Line] = []
    for remote in remote_entries:
        unit = remote.get("unit") or (remote.get("child_unit") if is_manual(remote) else "") or ""
        unit = "" if counts_pieces(unit) else unit
        line = _Line(remote["child_part_number"], as_number(remote.get("quantity")), unit)
        if is_manual(remote):
            manual_lines.append(line)
            if is_component(remote):
                manual_components.append(line)
        else:
            assembly_lines.append(line)
    units = {line.part_number: line.unit for line in manual_components}
    diff = _compare(local, _summed(assembly_lines), _summed(manual_lines), _summed(manual_components), units)
    lines = _summed(_Line(other["child_part_number"], as_number(other.get("quantity"))) for other in kept)
    return replace(diff, kept=tuple(BomChange(number, quantity) for number, quantity in lines.items()))


def lines_of_missing(
    lines: Iterable[Mapping[str, Any]], missing: Iterable[Component], local: Container[str] = ()
) -> frozenset[str]:
    """Return the part numbers of the lines that stand for missing components.

    They are the lines that stood for such a component in the last sync. If a missing component stood for no
    line (the server does not keep that, or the lines are of an old version), any line that the assembly does
    not have now may be its line, so all lines without known components stay.

    local
        the part numbers that the assembly has now.
    """
    gone = {(file, name) for file, name in missing}
    if not gone:
        return frozenset()
    components_by_number: dict[str, set[tuple[Any, Any]]] = {}
    owned = set()
    for line in lines:
        number = line["child_part_number"]
        parts = {
            (component.get("file"), component.get("object")) for component in line.get("components") or ()
        }
        components_by_number.setdefault(number, set()).update(parts)
        if not is_manual(line):
            owned.add(number)
    numbers = {number for number, components in components_by_number.items() if components & gone}
    if gone.difference(*components_by_number.values()):
        numbers |= {number for number in owned if not components_by_number[number] and number not in local}
    return frozenset(numbers)


def _compare(
    local: Mapping[str, float | None],
    assembly: Mapping[str, float | None],
    manual: Mapping[str, float | None],
    manual_components: Mapping[str, float | None],
    units: Mapping[str, str],
) -> BomDiff:
    added: list[BomChange] = []
    changed: list[QuantityChange] = []
    unchanged: list[BomChange] = []
    conflicts: list[QuantityChange] = []
    for number, wanted in local.items():
        if wanted is None:
            continue
        in_manual = number in manual_components
        agreed = in_manual and says_the_same(wanted, manual_components[number], units[number])
        if in_manual and not agreed:
            conflicts.append(QuantityChange(number, wanted, manual_components[number], units[number]))
        if number in assembly:
            if same_quantity(wanted, assembly[number]):
                unchanged.append(BomChange(number, wanted))
            else:
                changed.append(QuantityChange(number, wanted, assembly[number]))
        elif not in_manual:
            added.append(BomChange(number, wanted))
        elif agreed:
            unchanged.append(BomChange(number, wanted))
    return BomDiff(
        added=tuple(added),
        removed=tuple(BomChange(n, q) for n, q in assembly.items() if n not in local),
        quantity_changed=tuple(changed),
        unchanged=tuple(unchanged),
        manual=tuple(BomChange(n, q) for n, q in manual.items()),
        conflicts=tuple(conflicts),
    )
