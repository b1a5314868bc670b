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

Nothing is ever deleted by a merge. :func:`would_undo` says when a file or a BOM is refused because it would
undo a colleague's newer file.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol
from urllib.parse import quote

from silo.bom.diff import Component, diff_bom, is_component, is_manual, local_quantities, same_quantity
from silo.bom.errors import MissingRevisionError
from silo.bom.model import BomChange, BomDiff, BomEntry
from silo.bom.numbers import plain


@dataclass(frozen=True)
class MergePlan:
    """What a merge will write: the diff, and which unreferenced flags it sets and clears (part numbers).

    ``tell`` names lines of people whose quantity in the assembly the server does not know yet: a new
    conflict, a changed one, or one that is over. No line is written for them, but the server must ask a
    person, or stop asking.
    """

    diff: BomDiff
    flag: tuple[str, ...] = ()
    unflag: tuple[str, ...] = ()
    tell: tuple[str, ...] = ()

    @property
    def writes(self) -> bool:
        """True where applying the plan changes a line on the server."""
        return bool(self.diff.added or self.diff.quantity_changed or self.flag or self.unflag)

    @property
    def news(self) -> bool:
        """True where the server learns anything from this merge: else it need not be sent."""
        return self.writes or bool(self.tell)


def plan_merge(
    entries: Iterable[BomEntry | Mapping[str, Any]],
    lines: Iterable[Mapping[str, Any]],
    missing: Iterable[Component] = (),
) -> MergePlan:
    """Plan a merge of the assembly's direct children into the parent's lines; changes nothing itself.

    entries
        as in :func:`silo.bom.diff.diff_bom`.
    lines
        the server's lines; ``unreferenced_since`` (any true value) marks those flagged before.
        ``assembly_told`` says whether the server heard of the assembly's quantity for a line that people own,
        ``assembly_quantity`` which; a server that says neither is not sent conflicts alone.
    missing
        as in :func:`silo.bom.diff.diff_bom`: the lines of these components stay as they are.
    """
    local, known = list(entries), list(lines)
    diff = diff_bom(local, known, missing)
    kept = {change.part_number for change in diff.kept}
    known = [line for line in known if line["child_part_number"] not in kept]
    flagged = {
        line["child_part_number"] for line in known if line.get("unreferenced_since") and not is_manual(line)
    }
    gone = [change.part_number for change in diff.removed]
    return MergePlan(
        diff=diff,
        flag=tuple(number for number in gone if number not in flagged),
        unflag=tuple(sorted(flagged.difference(gone))),
        tell=_untold(diff, local_quantities(local), known),
    )


def _untold(
    diff: BomDiff, local: Mapping[str, float | None], lines: Iterable[Mapping[str, Any]]
) -> tuple[str, ...]:
    in_conflict = {change.part_number for change in diff.conflicts}
    untold = []
    for line in lines:
        number, told = line["child_part_number"], line.get("assembly_told")
        if told is None or not is_manual(line) or not is_component(line):
            continue
        # An override of a line that the assembly once owned is in conflict too when the assembly drops it.
        now = local.get(number, 0.0)
        dropped = number not in local and bool(line.get("override"))
        changed = told and not same_quantity(line.get("assembly_quantity"), now)
        if changed or (not told and (number in in_conflict or dropped)):
            untold.append(number)
    return tuple(untold)


def apply_merge(lines: Sequence[Mapping[str, Any]], plan: MergePlan, when: str) -> list[dict[str, Any]]:
    """The lines after the merge: what people wrote on a line stays, nothing is deleted.

    ``lines`` has at most one assembly line per number, as every server's key demands. ``when`` is the time
    stamp written on newly unreferenced lines.
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


def summary(diff: BomDiff) -> str:
    """The sentence of the spec's event: ``BOM updated: 1 added, 1 quantity changed, 1 unreferenced``."""
    parts = [
        f"{len(diff.added)} added",
        f"{len(diff.quantity_changed)} quantity changed",
        f"{len(diff.removed)} unreferenced",
    ]
    if diff.conflicts:
        parts.append(f"{len(diff.conflicts)} in conflict")
    return "BOM updated: " + ", ".join(parts)


def resolve_url(part_number: str) -> str:
    """Where a person decides on what a merge left open."""
    return f"/items/{quote(part_number, safe='')}/bom"


def answer_of(
    diff: BomDiff, part_number: str, sync_id: str | None = None, left_out: Sequence[Mapping[str, Any]] = ()
) -> dict[str, Any]:
    """The answer to a merge (spec §5); ``sync_id`` and ``left_out`` only where there are such."""

    def lines(changes: Iterable[BomChange]) -> list[dict[str, Any]]:
        return [{"part_number": one.part_number, "quantity": plain(one.quantity)} for one in changes]

    unreferenced = [
        {
            "type": "unreferenced",
            "part_number": change.part_number,
            "message": "Present in server BOM but not in assembly",
        }
        for change in diff.removed
    ]
    answer: dict[str, Any] = {
        "status": "merged",
        "diff": {
            "added": lines(diff.added),
            "removed": lines(diff.removed),
            "quantity_changed": [
                {
                    "part_number": change.part_number,
                    "old_quantity": plain(change.remote_quantity),
                    "new_quantity": plain(change.local_quantity),
                }
                for change in diff.quantity_changed
            ],
            "unchanged": lines(diff.unchanged),
        },
        "warnings": unreferenced
        + [conflict_warning(c.part_number, c.local_quantity, c.remote_quantity) for c in diff.conflicts],
        "resolve_url": resolve_url(part_number),
    }
    told = {"sync_id": sync_id, "left_out": [dict(one) for one in left_out]}
    return answer | {name: value for name, value in told.items() if value}


def conflict_warning(part_number: str, assembly: float | None, server: float | None) -> dict[str, Any]:
    """The warning of a line that a person gave another quantity than the assembly has."""
    cad, ours = plain(assembly), plain(server)
    return {
        "type": "conflict",
        "part_number": part_number,
        "message": f"The assembly has {cad}, Silo has {ours} (set by a person); a person decides",
        "assembly_quantity": cad,
        "server_quantity": ours,
    }


class FileRevision(Protocol):
    """A revision with a file."""

    @property
    def revision_number(self) -> int: ...

    @property
    def file_checksum(self) -> str | None: ...


def would_undo(newest: FileRevision | None, base: int | None, sha256: str | None) -> bool:
    """True where a file that was made from revision ``base`` would undo the newest one.

    newest
        the item's newest revision with a file; the very file with this ``sha256`` is nobody else's.
    base
        None where nobody says what the file was made from.
    """
    if base is None or newest is None:
        return False
    return newest.revision_number > base and newest.file_checksum != sha256


def base_of(revision: int | None, sha256: str | None, same: int | None) -> int | None:
    """The revision that a merge's document is, or was made from; None where nobody knows.

    revision, sha256
        what the request says: a revision, and the SHA-256 of its file. Without a revision ``sha256`` is that
        of the document, which may be edited, and then is no revision.
    same
        the newest revision whose file has this ``sha256``; None where none has.

    Raises :class:`MissingRevisionError` for a revision that the server does not have: it was restored from a
    backup since, and the number may by now be that of another file.
    """
    if revision is None:
        return same
    if sha256 and same is None:
        raise MissingRevisionError(
            f"revision {revision} with the SHA-256 {sha256[:12]}… is not on this server, so its BOM was not "
            "merged. The server may have been restored from a backup: send the file again, then its BOM"
        )
    return revision
