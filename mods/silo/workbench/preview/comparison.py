# SPDX-License-Identifier: LGPL-2.1-or-later
"""The comparison that a preview shows: an assembly and its sub-assemblies against the server.

:func:`ask` reads from the server and belongs in the worker; the rest is pure.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from silo.bom.compare.bom_diff import BomDiff
from silo.bom.entry import BomEntry, Extraction
from silo.bom.findings import Finding
from silo.bom.items.naming import display_name
from silo.bom.items.part_address import part_page
from silo.workbench.documents.snapshot import Snapshot
from silo.workbench.session.worker import Control

if TYPE_CHECKING:
    from silo.bom_sync.resolved import Resolved


@dataclass(frozen=True)
class Compared:
    """One assembly against the server's lines.

    to_send
        a sync of it would be sent: the server has something to learn from it.
    """

    resolved: Resolved
    lines: tuple[Mapping[str, Any], ...]
    diff: BomDiff
    to_send: bool

    @property
    def is_new(self) -> bool:
        """Return True if a sync would send it, and the server has no line of it yet."""
        return self.to_send and not self.lines


@dataclass(frozen=True)
class Preview:
    """All that the preview shows, and what a sync from it needs.

    compared
        every assembly, children before parents; the one that was asked for is the last.
    broken
        what keeps the assembly from being synced.
    page
        address of the assembly's BOM on the server.
    note
        why it was made, if it was not asked for.
    """

    snapshot: Snapshot
    compared: tuple[Compared, ...]
    names: Mapping[str, str] = field(default_factory=dict)
    broken: tuple[Finding, ...] = ()
    page: str = ""
    note: str = ""

    @property
    def top(self) -> Compared:
        return self.compared[-1]

    @property
    def number(self) -> str:
        """Return the part number of the assembly; "" while it has none."""
        return self.top.resolved.assembly.part_number or ""

    @property
    def unregistered(self) -> tuple[BomEntry, ...]:
        """Return the components without a part number, the assembly itself included."""
        return self.top.resolved.unregistered

    @property
    def movable(self) -> tuple[Finding, ...]:
        """Return the broken links for which exactly one file fits."""
        return tuple(finding for finding in self.broken if finding.did_you_mean)

    @property
    def to_send_below(self) -> int:
        """Count the sub-assemblies for which a sync has something to send."""
        return sum(1 for compared in self.compared[:-1] if compared.to_send)


def ask(snapshot: Snapshot, api: Any, control: Control) -> Preview:
    """Compare a snapshot with the server, sub-assemblies included. Worker."""
    from silo.batch import suggest_by_identity
    from silo.bom_sync.resolved import assemblies, blocking, names_of, resolve
    from silo.bom_sync.steps import server_lines
    from silo.fcstd.suggest import with_suggestions

    extraction = snapshot.extraction or Extraction(BomEntry(snapshot.path, label=snapshot.label))
    extraction = with_suggestions(extraction)
    whole = resolve(extraction, api)
    lines = []
    for assembly in assemblies(whole):
        control.check()
        control.progress(assembly.assembly.part_number or assembly.assembly.label)
        lines.append(server_lines(assembly, api))
    whole = suggest_by_identity(whole, list(zip(assemblies(whole), lines, strict=True)))
    compared = [_compared(resolved, other) for resolved, other in zip(assemblies(whole), lines, strict=True)]
    all_lines = [line for pair in compared for line in pair.lines]
    number = whole.assembly.part_number
    page = api.web_url(part_page(number, "bom")) if number else ""
    return Preview(snapshot, tuple(compared), names_of(whole, all_lines), blocking(whole), page)


def _compared(resolved: Resolved, lines: tuple[Mapping[str, Any], ...]) -> Compared:
    from silo.bom_sync.steps import Status, decide

    # Whether what is missing may be left out is asked in the window, so it does not count here.
    outcome = decide(resolved, lines, allow_missing=True)
    diff = resolved.diff(lines) if outcome.plan is None else outcome.plan.diff
    return Compared(resolved, lines, diff, outcome.status is Status.MERGED)


def to_sync(preview: Preview, *, below: bool) -> tuple[Snapshot, ...]:
    """Return the snapshots whose BOMs a sync sends, children before parents; without ``below`` only the top
    one.
    """
    snapshots = []
    for compared in preview.compared[:-1] if below else ():
        if compared.to_send:
            snapshots.append(_part_of(preview.snapshot, compared.resolved))
    return (*snapshots, preview.snapshot)


def _part_of(snapshot: Snapshot, resolved: Resolved) -> Snapshot:
    """Cut the snapshot of a sub-assembly from that of its parent."""
    head = resolved.assembly
    original = _find(snapshot.extraction, head.key)
    mine = tuple(f for f in resolved.findings if any(place.doc_path == head.doc_path for place in f.where))
    return Snapshot(
        path=head.doc_path,
        label=display_name(head),
        identity=head.silo_uuid,
        extraction=Extraction(replace(head, children=()), original.children if original else (), mine),
    )


def _find(extraction: Extraction | None, key: tuple[str, str]) -> BomEntry | None:
    stack = list(extraction.entries) if extraction is not None else []
    seen = set()
    while stack:
        entry = stack.pop()
        if entry.key == key:
            return entry
        if id(entry) not in seen:
            seen.add(id(entry))
            stack.extend(entry.children)
    return None
