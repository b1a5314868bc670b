# SPDX-License-Identifier: LGPL-2.1-or-later
"""Sending what the outbox holds: in order per item, each thing once, whatever dies on the way."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from pydantic import ValidationError

from silo.api.arrived import Downloads, MayHaveArrivedError, Sent, find_arrived
from silo.api.events import Backoff
from silo.api.multipart import Progress
from silo.api.outbox_store import Kind, OutboxEntry, State, Store
from silo.api.replies import WebPageError
from silo.api.transport import Cancel, stop_if
from silo.api.wire import MergeRequest, MergeResult, Revision, ServerState
from silo.bom.errors import (
    AuthError,
    CancelledError,
    ConfigError,
    ConflictError,
    ForbiddenError,
    InputError,
    NotFoundError,
    ReadOnlyError,
    RejectedError,
    RouteMissingError,
    SiloError,
)

EntryProgress = Callable[[OutboxEntry, int, int], object]
"""Told (entry, bytes done, bytes in all)."""

# The server will say the same again, so a person has to look; the others wait and are repeated.
_FINAL = (RejectedError, ForbiddenError, NotFoundError, ConflictError, InputError)
# Not the entry's fault, though of a final kind: our own settings, and a proxy's "not found".
_PASSING = (ConfigError, WebPageError)


class OutboxApi(Downloads, Protocol):
    """What sending needs of a Silo; :class:`silo.api.client.SiloClient` has it."""

    @property
    def base_url(self) -> str: ...

    def revisions(self, part_number: str, /) -> list[Revision]: ...

    def upload_file(
        self,
        part_number: str,
        path: Path | str,
        comment: str = "",
        properties: Mapping[str, Any] | None = None,
        on_progress: Progress | None = None,
        *,
        file_name: str | None = None,
        idempotency_key: str | None = None,
        cancelled: Cancel | None = None,
    ) -> Revision: ...

    def merge_bom(
        self, part_number: str, request: MergeRequest, /, *, cancelled: Cancel | None = None
    ) -> MergeResult: ...

    def ready(self) -> ServerState: ...


@dataclass(frozen=True)
class Delivery:
    """An entry that arrived, and what the server made of it."""

    entry: OutboxEntry
    result: MergeResult | Revision


@dataclass(frozen=True)
class SendReport:
    """What became of a run.

    delivered, rejected, failed
        entries that arrived; that the server does not want; that failed in passing (with the reason on them).
    waiting
        how many entries wait for this server now.
    stopped_by
        why the run ended early: nothing answers, read-only, a wrong token, or a person's stop.
    busy
        another process or thread is sending.
    """

    delivered: tuple[Delivery, ...] = ()
    rejected: tuple[OutboxEntry, ...] = ()
    failed: tuple[OutboxEntry, ...] = ()
    waiting: int = 0
    stopped_by: SiloError | None = None
    busy: bool = False


@dataclass
class _Run:
    delivered: list[Delivery] = field(default_factory=list)
    rejected: list[OutboxEntry] = field(default_factory=list)
    failed: list[OutboxEntry] = field(default_factory=list)
    held: set[str] = field(default_factory=set)  # items whose older entry has to go first
    stopped_by: SiloError | None = None


class Sender:
    """One run over the outbox; the caller holds the send lock."""

    def __init__(
        self,
        store: Store,
        client: OutboxApi,
        backoff: Backoff,
        clock: Callable[[], float],
        chance: Callable[[], float],
    ) -> None:
        self._store, self._client = store, client
        self._backoff, self._clock, self._chance = backoff, clock, chance

    def run(
        self,
        cancelled: Cancel | None,
        on_progress: EntryProgress | None,
        on_delivery: Callable[[Delivery], object] | None,
        *,
        force: bool,
    ) -> SendReport:
        """Send what is due."""
        run, last = _Run(), 0
        # Read anew each time: what is added or discarded meanwhile counts.
        while run.stopped_by is None and (entry := self._store.next_waiting(self._client.base_url, last)):
            last = entry.id
            item = entry.part_number.casefold()
            if item in run.held or (entry.next_attempt > self._clock() and not force):
                run.held.add(item)
                continue
            self._one(entry, run, cancelled, on_progress, on_delivery)
        waiting = [e for e in self._store.entries() if e.state is State.WAITING]
        return SendReport(
            delivered=tuple(run.delivered),
            rejected=tuple(run.rejected),
            failed=tuple(run.failed),
            waiting=sum(1 for e in waiting if e.server == self._client.base_url),
            stopped_by=run.stopped_by,
        )

    def _one(
        self,
        entry: OutboxEntry,
        run: _Run,
        cancelled: Cancel | None,
        on_progress: EntryProgress | None,
        on_delivery: Callable[[Delivery], object] | None,
    ) -> None:
        try:
            stop_if(cancelled)
            # On disk before a byte is sent: whoever comes after a crash knows that it may have arrived.
            self._store.update(entry.id, attempts=entry.attempts + 1)
            result = self._deliver(entry, cancelled, on_progress)
        except CancelledError as error:
            run.stopped_by = error
            return
        except SiloError as error:
            self._failed(entry, error, run)
            return
        self._store.arrived(
            entry, self._clock(), result.revision_number if isinstance(result, Revision) else None
        )
        delivery = Delivery(entry, result)
        run.delivered.append(delivery)
        if on_delivery is not None:
            on_delivery(delivery)

    def _failed(self, entry: OutboxEntry, error: SiloError, run: _Run) -> None:
        if isinstance(error, _FINAL) and not isinstance(error, _PASSING):
            self._store.update(entry.id, state=State.REJECTED, reason=str(error))
            if isinstance(error, MayHaveArrivedError):
                # A person who presses Retry has looked at these revisions.
                self._store.update(entry.id, base_revision=error.newest)
            run.rejected.append(self._store.entry(entry.id) or entry)
            return
        pause = self._backoff.pause(entry.attempts + 1, self._chance())
        self._store.update(entry.id, reason=str(error), next_attempt=self._clock() + pause)
        run.failed.append(self._store.entry(entry.id) or entry)
        run.held.add(entry.part_number.casefold())
        if self._concerns_all(error):
            run.stopped_by = error

    def _concerns_all(self, error: SiloError) -> bool:
        if isinstance(error, (ReadOnlyError, AuthError, ConfigError)):
            return True
        # One huge file that always times out, or that the server fails on, must not hold up the others.
        try:
            self._client.ready()
        except SiloError:
            return True
        return False

    def _deliver(
        self, entry: OutboxEntry, cancelled: Cancel | None, on_progress: EntryProgress | None
    ) -> MergeResult | Revision:
        if entry.kind is Kind.BOM:
            return self._client.merge_bom(entry.part_number, _request(entry), cancelled=cancelled)
        return self._deliver_file(entry, cancelled, on_progress)

    def _deliver_file(
        self, entry: OutboxEntry, cancelled: Cancel | None, on_progress: EntryProgress | None
    ) -> Revision:
        known = self._revisions(entry.part_number)
        if entry.base_revision is None:
            # What the server had before us. Without this note, a file that equals an older revision could
            # not be told from our own that had already arrived.
            base = max((revision.revision_number for revision in known), default=0)
            self._store.update(entry.id, base_revision=base)
        else:
            found = find_arrived(
                self._client, entry.part_number, _sent(entry, entry.base_revision), known, cancelled=cancelled
            )
            if found is not None:
                return found
        payload = entry.payload
        return self._client.upload_file(
            entry.part_number,
            self._store.copies / str(payload["copy"]),
            str(payload.get("comment", "")),
            payload.get("properties") or None,
            None if on_progress is None else lambda done, total: on_progress(entry, done, total),
            file_name=str(payload["file_name"]),
            idempotency_key=entry.key,
            cancelled=cancelled,
        )

    def _revisions(self, part_number: str) -> Sequence[Revision]:
        try:
            return self._client.revisions(part_number)
        except RouteMissingError:
            return ()


def _request(entry: OutboxEntry) -> MergeRequest:
    try:
        return MergeRequest.model_validate(entry.payload)
    except ValidationError as error:
        raise InputError(f"{entry.part_number}: this BOM cannot be read any more; commit it again") from error


def _sent(entry: OutboxEntry, base: int) -> Sent:
    payload = entry.payload
    return Sent(str(payload["file_name"]), str(payload["sha256"]), int(payload["size"]), base)
