# SPDX-License-Identifier: LGPL-2.1-or-later
"""The whole BOM sync on one page: extract → resolve → diff → merge (spec bom-sync, "Data Flow").

::

    document ── extract ──▶ Extraction ── resolve ──▶ Resolved ── compare ──▶ MergePlan ── merge ──▶ Outcome
    (FreeCAD,               (frozen)     (by UUID)   (frozen)     (server's   (frozen)     (one     (frozen)
     FCStd)                                                        lines)                  request)

What a run needs from the server is fetched before each pure step; nothing here knows where the document
came from or who shows the result. Nothing is ever deleted, and manual lines are never touched: that is the
server's rule too, so a faulty client cannot break it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import partial
from typing import Any, Protocol

from silo.api.wire import Component, HeldReport, MergeEntry, MergeRequest, MergeResult, SourceDocument
from silo.bom.compare.merge import MergePlan
from silo.bom.entry import BomEntry
from silo.bom.errors import SiloError
from silo.bom.items.lookup import ItemLookup
from silo.bom.left_out import components_of
from silo.bom_sync.held import report_held
from silo.bom_sync.memory import server_of
from silo.bom_sync.reported_lines import is_reported, remember_reported
from silo.bom_sync.resolved import (
    Resolved,
    assemblies,
    assemblies_of_file,
    blocking,
    left_out_parts,
    names_of,
)


class SyncApi(ItemLookup, Protocol):
    """What a sync needs of a Silo; :class:`silo.api.client.SiloClient` has it."""

    def get_bom(self, part_number: str, /) -> Sequence[Any]: ...

    def merge_bom(self, part_number: str, request: MergeRequest, /) -> MergeResult: ...

    def hold_bom(self, part_number: str, report: HeldReport, /) -> Any: ...


class Status(StrEnum):
    """How the sync of one assembly ended."""

    MERGED = "merged"  # the server's BOM took the changes
    UNCHANGED = "unchanged"  # nothing to change, nothing was sent
    DRY_RUN = "dry_run"  # this is what would change; nothing was sent
    BLOCKED = "blocked"  # a broken link: not sent, so that nothing reads as removed
    UNREGISTERED = "unregistered"  # the assembly itself has no part number yet
    FAILED = "failed"  # the server or the way to it


@dataclass(frozen=True)
class Outcome:
    """What became of one assembly's sync."""

    status: Status
    resolved: Resolved
    plan: MergePlan | None = None
    result: MergeResult | None = None
    error: SiloError | None = None
    names: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)

    @property
    def assembly(self) -> BomEntry:
        return self.resolved.assembly


def server_lines(resolved: Resolved, api: SyncApi) -> tuple[Mapping[str, Any], ...]:
    """Return the server's present lines of this assembly; () while it has no part number."""
    number = resolved.assembly.part_number
    if number is None:
        return ()
    return plain_lines(api.get_bom(number))


def plain_lines(lines: Iterable[Any]) -> tuple[Mapping[str, Any], ...]:
    """Return the lines as mappings; a client may have made models of them."""
    return tuple(line if isinstance(line, Mapping) else line.model_dump() for line in lines)


def compare(resolved: Resolved, api: SyncApi) -> MergePlan:
    """Plan a merge into the server's present lines."""
    return resolved.plan(server_lines(resolved, api))


def decide(
    resolved: Resolved, lines: Sequence[Mapping[str, Any]], *, allow_missing: bool = False, server: str = ""
) -> Outcome:
    """Decide what happens to an assembly: it is unregistered, blocked, unchanged, or merged.

    lines
        the server's lines of the assembly.
    allow_missing
        sync although links are broken: lines that stood for a missing component in the last sync stay as they
        are; what the server does not know stays out, and the server records that the BOM is incomplete.
    server
        the address of the server; a server that does not show which lines are unreferenced gets each of them
        once.
    """
    if resolved.assembly.part_number is None:
        return Outcome(Status.UNREGISTERED, resolved)
    plan, names = resolved.plan(lines), names_of(resolved, lines)
    if blocking(resolved) and not allow_missing:
        return Outcome(Status.BLOCKED, resolved, plan, names=names)
    is_news = resolved.is_news(plan, lines) and not is_reported(resolved, plan, server)
    return Outcome(Status.MERGED if is_news else Status.UNCHANGED, resolved, plan, names=names)


def sync(
    resolved: Resolved,
    api: SyncApi,
    *,
    sync_id: str,
    allow_missing: bool = False,
    dry_run: bool = False,
    describe: Callable[[], SourceDocument | None] = lambda: None,
    lines: Sequence[Mapping[str, Any]] | None = None,
) -> Outcome:
    """Bring one assembly's direct children to the server.

    sync_id
        names this attempt; the same id sent again gives the same answer and changes nothing twice.
    dry_run
        compare, and send nothing.
    describe
        finds the file of the BOM, if there is something to send.
    lines
        the server's lines of the assembly; None asks for them.
    """
    number = resolved.assembly.part_number
    try:
        lines = server_lines(resolved, api) if lines is None else lines
        server = server_of(api)
        outcome = decide(resolved, lines, allow_missing=allow_missing, server=server)
        if dry_run and outcome.status in (Status.MERGED, Status.UNCHANGED):
            return replace(outcome, status=Status.DRY_RUN)
        if outcome.status is Status.BLOCKED and not dry_run:
            # A server that cannot take the report hears of it with the next sync; this one says it here.
            with suppress(SiloError):
                report_held(resolved, api, describe())
        if outcome.status is not Status.MERGED or number is None:
            return outcome
        request = merge_request(resolved, sync_id, describe())
        outcome = replace(outcome, result=api.merge_bom(number, request))
        remember_reported(resolved, resolved.plan(lines), server)
        return outcome
    except SiloError as error:
        return Outcome(Status.FAILED, resolved, error=error)


def merge_request(resolved: Resolved, sync_id: str, document: SourceDocument | None = None) -> MergeRequest:
    """Make the request of spec §5, with the direct children only.

    A server that remembers its syncs also gets the components of each line in the CAD model, and what is left
    out. Any other server gets exactly the request of the spec.
    """
    remembers = resolved.assembly.silo_uuid in resolved.last_syncs
    entries = [
        MergeEntry(
            child_part_number=entry.part_number,
            quantity=entry.quantity,
            components=[Component(**component) for component in components_of(entry, resolved.folder)]
            if remembers
            else None,
            find_number=(entry.find_number or None) if remembers else None,
        )
        for entry in resolved.entries
        if entry.part_number is not None
    ]
    left_out = left_out_parts(resolved) if remembers else None
    return MergeRequest(entries=entries, sync_id=sync_id, document=document, left_out=left_out)


def sync_tree(
    resolved: Resolved,
    api: SyncApi,
    *,
    sync_id: Callable[[], str],
    allow_missing: bool = False,
    dry_run: bool = False,
    describe: Callable[[BomEntry], SourceDocument | None] = lambda _entry: None,
    recursive: bool = True,
) -> Iterator[Outcome]:
    """Sync an assembly with all its sub-assemblies, leaves first; one failure does not stop the others.

    A failure that concerns all of them does (:func:`silo.api.policy.ends_run`): the remaining ones get it as
    their error.
    """
    from silo.api.policy import ends_run  # loads the network's packages

    stopped: SiloError | None = None
    for assembly in (assemblies if recursive else assemblies_of_file)(resolved):
        if stopped is not None:
            yield Outcome(Status.FAILED, assembly, error=stopped)
            continue
        outcome = sync(
            assembly,
            api,
            sync_id=sync_id(),
            allow_missing=allow_missing,
            dry_run=dry_run,
            describe=partial(describe, assembly.assembly),
        )
        stopped = outcome.error if outcome.error is not None and ends_run(outcome.error, api) else None
        yield outcome
