# SPDX-License-Identifier: LGPL-2.1-or-later
"""The merge rules (spec bom-sync §4, "Merge Rules"), once, for the server, the fakes and the tests.

=====================================  ===============================================================
added                                  a new line, ``source`` assembly
quantity changed (assembly line)       takes the assembly's quantity
removed (assembly line, no component)  stays; flagged unreferenced, unflagged when it is referenced again
unchanged                              nothing
kept (its component is missing now)    nothing
manual                                 never touched; another quantity than the assembly's is a conflict
=====================================  ===============================================================

A merge never deletes a line.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from silo.bom.compare.bom_diff import BomDiff
from silo.bom.compare.difference import Component, diff_bom, local_quantities
from silo.bom.compare.owner import is_component, is_manual
from silo.bom.entry import BomEntry
from silo.bom.quantities import same_quantity


@dataclass(frozen=True)
class MergePlan:
    """What a merge will write: the diff, and which unreferenced flags it sets and clears (part numbers).

    ``conflicts_to_report`` names manual lines whose quantity in the assembly the server does not know yet: a
    new conflict, a changed conflict, or a conflict that is over. No line is written for them, but the server
    must ask its reviewers, or stop asking.
    """

    diff: BomDiff
    flag: tuple[str, ...] = ()
    unflag: tuple[str, ...] = ()
    conflicts_to_report: tuple[str, ...] = ()

    @property
    def writes(self) -> bool:
        """Return True if applying the plan changes a line on the server."""
        return bool(self.diff.added or self.diff.quantity_changed or self.flag or self.unflag)

    @property
    def news(self) -> bool:
        """Return True if the merge would change anything on the server; if not, it need not be sent."""
        return self.writes or bool(self.conflicts_to_report)


def plan_merge(
    entries: Iterable[BomEntry | Mapping[str, Any]],
    lines: Iterable[Mapping[str, Any]],
    missing: Iterable[Component] = (),
) -> MergePlan:
    """Plan a merge of the assembly's direct children into the parent's lines; changes nothing itself.

    entries
        as in :func:`silo.bom.compare.difference.diff_bom`.
    lines
        the server's lines; ``unreferenced_since`` (any true value) marks those flagged before.
        ``assembly_told`` says if the server knows the assembly's quantity for a line that people own,
        ``assembly_quantity`` which it is. A server that has neither gets no merge that only reports
        conflicts.
    missing
        as in :func:`silo.bom.compare.difference.diff_bom`: the lines of these components stay as they are.
    """
    local, lines = list(entries), list(lines)
    diff = diff_bom(local, lines, missing)
    kept = {change.part_number for change in diff.kept}
    lines = [line for line in lines if line["child_part_number"] not in kept]
    flagged = {
        line["child_part_number"] for line in lines if line.get("unreferenced_since") and not is_manual(line)
    }
    gone = [change.part_number for change in diff.removed]
    return MergePlan(
        diff=diff,
        flag=tuple(number for number in gone if number not in flagged),
        unflag=tuple(sorted(flagged.difference(gone))),
        conflicts_to_report=_unreported(diff, local_quantities(local), lines),
    )


def _unreported(
    diff: BomDiff, local: Mapping[str, float | None], lines: Iterable[Mapping[str, Any]]
) -> tuple[str, ...]:
    in_conflict = {change.part_number for change in diff.conflicts}
    unreported = []
    for line in lines:
        number, is_reported = line["child_part_number"], line.get("assembly_told")
        if is_reported is None or not is_manual(line) or not is_component(line):
            continue
        # An override of a line that the assembly once owned is in conflict too if the assembly drops it.
        now = local.get(number, 0.0)
        dropped = number not in local and bool(line.get("override"))
        changed = is_reported and not same_quantity(line.get("assembly_quantity"), now)
        if changed or (not is_reported and (number in in_conflict or dropped)):
            unreported.append(number)
    return tuple(unreported)


def apply_merge(lines: Sequence[Mapping[str, Any]], plan: MergePlan, when: str) -> list[dict[str, Any]]:
    """Apply a merge to copies of the lines: what people wrote on a line stays, and no line is deleted.

    ``lines`` has at most one assembly line per number, as the key of every server demands. ``when`` is the
    time stamp written on newly unreferenced lines.
    """
    quantities = {change.part_number: change.local_quantity for change in plan.diff.quantity_changed}
    flag, unflag = set(plan.flag), set(plan.unflag)
    merged: list[dict[str, Any]] = []
    for line in lines:
        after = dict(line)
        number = line["child_part_number"]
        if not is_manual(line):
            if number in quantities:
                after["quantity"] = quantities[number]
            if number in flag:
                after["unreferenced_since"] = when
            if number in unflag:
                after["unreferenced_since"] = None
        merged.append(after)
    merged.extend(
        {
            "child_part_number": change.part_number,
            "quantity": change.quantity,
            "source": "assembly",
            "unreferenced_since": None,
        }
        for change in plan.diff.added
    )
    return merged
