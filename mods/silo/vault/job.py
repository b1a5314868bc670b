# SPDX-License-Identifier: LGPL-2.1-or-later
"""Carrying out a plan: look everything up at once, compare, merge what is news, children before parents.

Requests depend on the number of identities and of changes, not on that of assemblies: identities and BOMs
are asked for by the thousand. Assemblies that do not depend on each other are merged side by side. Whatever
ends the job, the next one continues: what was merged agrees then, and is not sent again. There is one job at
a time on a vault: if its disk carries no locks, the report says what that cannot prevent.
"""

from __future__ import annotations

import os
import threading
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any
from uuid import uuid4

from silo.api.policy import ends_run
from silo.api.wire import SourceDocument
from silo.batch import SyncOptions, TopResult, source_document, suggest_by_identity
from silo.bom.errors import CancelledError, DocumentError, SiloError
from silo.bom.findings import FindingCode
from silo.bom.items.lookup import Known
from silo.bom.message import message
from silo.bom_sync import Outcome, Resolved, Status, SyncApi, sync
from silo.bom_sync.resolved import blocking, known_items, resolve_known
from silo.bom_sync.steps import plain_lines
from silo.folder_lock import folder_lock
from silo.vault.plan import Plan, PlannedAssembly
from silo.vault.reading import VaultReader, grouped

NAME = ".silo-sync.lock"


@contextmanager
def only_job(folder: str) -> Iterator[str]:
    """Keep a second job away from a folder; yields what the lock cannot prevent, "" for nothing.

    Raises InputError with the name of the first job.
    """
    with folder_lock(folder, NAME, "synced") as problem:
        yield problem and (
            message(
                "{folder} cannot be locked ({problem}): a job of another user or machine is not "
                "noticed. Two jobs at once cost requests; the BOMs are right anyway.",
                folder=folder,
                problem=problem,
            )
        )


_AT_ONCE = 500  # assemblies whose BOMs are in memory at one time

_SENDERS = 4

Lines = Mapping[str, Sequence[Mapping[str, Any]]]

_KEPT = ("id", "part_number", "name", "description", "last_sync")


@dataclass
class SyncJob:
    """One run of a plan.

    base
        the folder that paths in the results are relative to; "" for that of each file.
    stop
        set where the job is interrupted, so that no merge waits for a busy server any more.
    senders
        merges that are under way at one time.
    """

    plan: Plan
    reading: VaultReader
    api: SyncApi
    options: SyncOptions
    base: str
    stop: threading.Event = field(default_factory=threading.Event)
    senders: int = _SENDERS

    def __post_init__(self) -> None:
        self.stopped: SiloError | None = None
        self._sent: dict[str, Future[Outcome]] = {}

    def results(self) -> Iterator[TopResult]:
        """Yield the result of each file as soon as it is known; files that could not be read come first."""
        for top, error in self.plan.errors.items():
            yield TopResult(top, self._base(top), error=error)
        try:
            items = self._known_items()
        except SiloError as error:
            self.stopped = error
            for top, count in Counter(node.top for node in self.plan.nodes.values()).items():
                yield TopResult(top, self._base(top), error=error, left=count)
            return
        left = Counter(node.top for node in self.plan.nodes.values())
        done: dict[str, list[Outcome]] = {}
        for layer in self.plan.layers:
            for nodes in grouped(layer, _AT_ONCE):
                for node, outcome in zip(nodes, self._outcomes(nodes, items), strict=True):
                    done.setdefault(node.top, []).append(outcome)
                    left[node.top] -= 1
                    if not left[node.top]:
                        yield TopResult(node.top, self._base(node.top), outcomes=tuple(done.pop(node.top)))

    def _base(self, top: str) -> str:
        return self.base or os.path.dirname(os.path.realpath(top))

    def _known_items(self) -> Known:
        """Look up the items of everything in the plan, and keep what is needed of them."""
        items = known_items(self.plan.uuids, self.plan.standards.values(), self.api)
        return {
            key: {name: item.get(name) for name in _KEPT} for key, item in items.items() if item is not None
        }

    def _outcomes(self, nodes: Sequence[PlannedAssembly], items: Known) -> list[Outcome]:
        """Sync assemblies that do not depend on each other."""
        several = [resolve_known(self.plan.extraction(node, self.reading), items) for node in nodes]
        numbers = [resolved.assembly.part_number for resolved in several]
        lines = self._lines([number for number in numbers if number is not None])
        several = [self._with_suggestion(resolved, lines) for resolved in several]
        with ThreadPoolExecutor(self.senders, "silo-merge") as pool:
            asked = []
            try:
                for resolved in several:
                    number = resolved.assembly.part_number
                    first = self._sent.get(number or "")
                    # Copies of one file are one item, and one merge.
                    if first is None or blocking(resolved):
                        first = pool.submit(self._sync, resolved, lines)
                        if number is not None and not blocking(resolved):
                            self._sent[number] = first
                    asked.append(first)
                outcomes = [future.result() for future in asked]
            except BaseException:  # Ctrl-C, also while the first are sent; the senders end what is under way
                self.stopped = self.stopped or CancelledError(message("the job was stopped"))
                self.stop.set()
                raise
        return [
            outcome if outcome.resolved is resolved else _as_the_first(resolved, outcome)
            for resolved, outcome in zip(several, outcomes, strict=True)
        ]

    def _with_suggestion(self, resolved: Resolved, lines: Lines) -> Resolved:
        """Add to findings of missing files the file that has the identity known from the last sync."""
        line = lines.get(resolved.assembly.part_number or "", ())
        return suggest_by_identity(resolved, [(resolved, line)], self._files_with if self.base else None)

    def _files_with(self, identities: Iterable[str]) -> set[str]:
        """Return the files of the folder that have one of these identities. All were read; none is read
        again.
        """
        wanted = {identity.lower() for identity in identities}
        return {path for identity, path in self.plan.places | self.plan.spares if identity in wanted}

    def _lines(self, numbers: Sequence[str]) -> Lines:
        many = getattr(self.api, "get_boms", None)
        if self.stopped is not None or many is None or not numbers:
            return {}
        try:
            return {number: plain_lines(answer) for number, answer in many(numbers).items()}
        except SiloError as error:
            self._stop_for(error)
            return {}

    def _sync(self, resolved: Resolved, lines: Lines) -> Outcome:
        if self.stopped is not None:
            return Outcome(Status.FAILED, resolved, error=self.stopped)
        try:
            outcome = sync(
                resolved,
                self.api,
                sync_id=str(uuid4()),
                allow_missing=self.options.allow_missing
                and not any(
                    finding.code in (FindingCode.CYCLE, FindingCode.TOO_DEEP) for finding in resolved.findings
                ),
                dry_run=self.options.dry_run,
                describe=lambda: self._source(resolved),
                lines=lines.get(resolved.assembly.part_number or ""),
            )
        except SiloError as error:
            outcome = Outcome(Status.FAILED, resolved, error=error)
        if outcome.error is not None:
            self._stop_for(outcome.error)
        return outcome

    def _source(self, resolved: Resolved) -> SourceDocument:
        """Describe the file of a BOM that is about to be sent. DocumentError if it changed since it was
        read.
        """
        if not self.reading.index.untouched(resolved.assembly.doc_path):
            raise DocumentError(
                resolved.assembly.doc_path, message("it was changed while the job ran; the next run takes it")
            )
        return source_document(resolved.assembly)

    def _stop_for(self, error: SiloError) -> None:
        """End the job for an error that concerns every request; the remaining assemblies get it as their
        error.
        """
        if self.stopped is None and ends_run(error, self.api):
            self.stopped = error


def _as_the_first(resolved: Resolved, first: Outcome) -> Outcome:
    """Make the outcome of a copy from that of the file that was sent for both."""
    status = Status.UNCHANGED if first.status is Status.MERGED else first.status
    return replace(first, resolved=resolved, status=status, result=None)
