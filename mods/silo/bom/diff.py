# SPDX-License-Identifier: LGPL-2.1-or-later
"""CAD against server: what is new, gone, changed, equal, owned by people, or in conflict (spec bom-sync §4).

The rules of this module:

* a line is found by its part number; the numbers come from the server and compare as they are;
* quantities compare as numbers: 12, 12.0 and "12" are equal;
* a server line without ``source`` counts as ``assembly``;
* a ``manual`` line (or one of a source that we do not know), and one that is no component (``alternate``,
  ``reference``), belongs to people: it is listed apart, never as removed or changed;
* a component that exists as a manual line of the same quantity is there already (``unchanged``); with another
  quantity it is a conflict, for a person to decide;
* a line of a component whose file is missing is not compared (``kept``): nobody knows how many there are.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from silo.bom.model import BomChange, BomDiff, BomEntry, QuantityChange
from silo.bom.numbers import exact_sum, plain

# Two quantities closer than this, relatively, are one: lengths pass through databases as floats.
RELATIVE_TOLERANCE = 1e-9

# (file, object) of a component; the file relative to the assembly's, as a merge names it.
Component = tuple[str, str]


@dataclass(frozen=True, slots=True)
class _Line:
    part_number: str
    quantity: float | None


def as_number(value: object) -> float | None:
    """A quantity as a number: int, float, Decimal or a numeral; None where there is none."""
    if value is None or isinstance(value, bool):
        return None
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return None
    return number if math.isfinite(number) else None


def same_quantity(a: object, b: object) -> bool:
    """True where both are the same number."""
    x, y = as_number(a), as_number(b)
    if x is None or y is None:
        return x is y
    return math.isclose(x, y, rel_tol=RELATIVE_TOLERANCE, abs_tol=1e-12)


def _local(entry: Any) -> _Line | None:
    if isinstance(entry, Mapping):
        number = entry.get("child_part_number") or entry.get("part_number")
        quantity = as_number(entry.get("quantity"))
    else:  # a BomEntry, or whatever names these two as it does
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
    """The assembly's direct children by part number, summed; entries without a number are left out."""
    return _summed(line for entry in entries if (line := _local(entry)) is not None)


def is_manual(line: Mapping[str, Any]) -> bool:
    """True where a line belongs to people: a relation that is no component, or any source but assembly.

    A source that we do not know is somebody's; only what assemblies wrote may be rewritten by one.
    """
    return not is_component(line) or (line.get("source") or "assembly") != "assembly"


def is_component(line: Mapping[str, Any]) -> bool:
    """True for a line that counts parts; ``alternate`` and ``reference`` lines do not."""
    return (line.get("rel_type") or "component") == "component"


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
    local_entries = list(local_entries)
    gone = lines_of_missing(remote_entries, missing, local_quantities(local_entries))
    kept = [line for line in remote_entries if line["child_part_number"] in gone]
    remote_entries = [line for line in remote_entries if line["child_part_number"] not in gone]
    local = {pn: q for pn, q in local_quantities(local_entries).items() if pn not in gone}
    assembly_lines: list[_Line] = []
    manual_lines: list[_Line] = []
    manual_components: list[_Line] = []
    for remote in remote_entries:
        line = _Line(remote["child_part_number"], as_number(remote.get("quantity")))
        if is_manual(remote):
            manual_lines.append(line)
            if is_component(remote):
                manual_components.append(line)
        else:
            assembly_lines.append(line)
    diff = _compare(local, _summed(assembly_lines), _summed(manual_lines), _summed(manual_components))
    lines = _summed(_Line(one["child_part_number"], as_number(one.get("quantity"))) for one in kept)
    return replace(diff, kept=tuple(BomChange(number, quantity) for number, quantity in lines.items()))


def lines_of_missing(
    lines: Iterable[Mapping[str, Any]], missing: Iterable[Component], local: Container[str] = ()
) -> frozenset[str]:
    """The part numbers of the lines that stand for missing components.

    Those that stood for one of them in the last sync. Where a missing component stood for no line (a server
    that does not keep that, lines of an old version), any line that the assembly does not have now may be its
    own, so all lines whose components are not known stay.

    local
        the part numbers that the assembly has now.
    """
    gone = {(file, name) for file, name in missing}
    if not gone:
        return frozenset()
    known: dict[str, set[tuple[Any, Any]]] = {}
    owned = set()
    for line in lines:
        number = line["child_part_number"]
        parts = {(one.get("file"), one.get("object")) for one in line.get("components") or ()}
        known.setdefault(number, set()).update(parts)
        if not is_manual(line):
            owned.add(number)
    found = {number for number, components in known.items() if components & gone}
    if gone.difference(*known.values()):
        found |= {number for number in owned if not known[number] and number not in local}
    return frozenset(found)


def _compare(
    local: Mapping[str, float | None],
    assembly: Mapping[str, float | None],
    manual: Mapping[str, float | None],
    manual_components: Mapping[str, float | None],
) -> BomDiff:
    added: list[BomChange] = []
    changed: list[QuantityChange] = []
    unchanged: list[BomChange] = []
    conflicts: list[QuantityChange] = []
    for number, wanted in local.items():
        if wanted is None:
            continue
        in_manual = number in manual_components
        if in_manual and not same_quantity(wanted, manual_components[number]):
            conflicts.append(QuantityChange(number, wanted, manual_components[number]))
        if number in assembly:
            if same_quantity(wanted, assembly[number]):
                unchanged.append(BomChange(number, wanted))
            else:
                changed.append(QuantityChange(number, wanted, assembly[number]))
        elif not in_manual:
            added.append(BomChange(number, wanted))
        elif same_quantity(wanted, manual_components[number]):
            unchanged.append(BomChange(number, wanted))
    return BomDiff(
        added=tuple(added),
        removed=tuple(BomChange(n, q) for n, q in assembly.items() if n not in local),
        quantity_changed=tuple(changed),
        unchanged=tuple(unchanged),
        manual=tuple(BomChange(n, q) for n, q in manual.items()),
        conflicts=tuple(conflicts),
    )
