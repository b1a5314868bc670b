# SPDX-License-Identifier: LGPL-2.1-or-later
"""The pure part of :class:`silo.testing.FakeSilo`: checking a merge, and walking BOMs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from silo.api.wire import (
    BomLine,
    MergeRequest,
)
from silo.bom.errors import CycleError, RejectedError
from silo.bom.left_out import Reason, remembered

Bom = Callable[[str], Sequence[BomLine]]


def entries_of(request: MergeRequest, known: Mapping[str, str]) -> list[dict[str, Any]]:
    """The request's entries under the server's own numbers (``known``: case-folded → number).

    Raises :class:`RejectedError` with all unknown children at once, each with its index.
    """
    problems = [
        f"entries[{index}].child_part_number: {entry.child_part_number!r} does not exist on this server"
        for index, entry in enumerate(request.entries)
        if entry.child_part_number.casefold() not in known
    ]
    if problems:
        raise RejectedError(
            f"{len(problems)} of the entries cannot be merged: {'; '.join(problems)}", problems
        )
    return [
        {
            "child_part_number": known[entry.child_part_number.casefold()],
            "quantity": entry.quantity,
            "components": [component.model_dump() for component in entry.components or ()],
        }
        for entry in request.entries
    ]


def missing_of(request: MergeRequest) -> list[tuple[str, str]]:
    """The components that the assembly has lost."""
    return [(one.file, one.object) for one in request.left_out or () if one.reason == Reason.MISSING]


def with_components(
    lines: Sequence[Mapping[str, Any]], entries: Iterable[Mapping[str, Any]], kept: Iterable[str]
) -> list[dict[str, Any]]:
    """The lines, each with what it is in the CAD model."""
    before = {line["child_part_number"]: line.get("components", []) for line in lines}
    after = remembered(before, entries, kept)
    return [{**line, "components": after.get(line["child_part_number"], [])} for line in lines]


def check_cycle(bom: Bom, parent: str, children: Sequence[str]) -> None:
    """Raise :class:`CycleError` where one of the children contains the parent."""
    for child in children:
        path = _way(bom, child, parent, (parent,))
        if path is not None:
            raise CycleError(path)


def _way(bom: Bom, here: str, goal: str, path: tuple[str, ...]) -> tuple[str, ...] | None:
    path = (*path, here)
    if here == goal:
        return path
    for line in bom(here):
        found = _way(bom, line.child_part_number, goal, path)
        if found is not None:
            return found
    return None
