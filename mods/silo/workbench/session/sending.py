# SPDX-License-Identifier: LGPL-2.1-or-later
"""From the spool through the outbox to the server: what the worker does after a commit.

::

    Commit ── resolve ──▶ part numbers ── compare ──▶ what changed ── outbox ──▶ server ──▶ Sent

A commit leaves the spool once it lies in the outbox, and the outbox once the server has it. The file never
waits for the BOM: a BOM that cannot be synced (a broken link, no part number) is told, and the file goes.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

from silo.api.outbox import Delivery, Kind, Outbox, OutboxEntry, SendReport, State
from silo.api.outbox_send import OutboxApi
from silo.api.wire import MergeRequest, MergeResult, Revision, SourceDocument
from silo.bom.errors import (
    AuthError,
    CancelledError,
    ConfigError,
    ConflictError,
    ForbiddenError,
    NotFoundError,
    ReadOnlyError,
    RouteMissingError,
    ServerFaultError,
    SiloError,
    UnreachableError,
)
from silo.bom.merge import MergePlan
from silo.bom_sync import Resolved, Status, blocking, compare, merge_request, resolve
from silo.workbench.commit.item_file import other_name
from silo.workbench.session.jobs import Control
from silo.workbench.session.spool import Commit, Spool
from silo.workbench.words import translate


class SendApi(OutboxApi, Protocol):
    """What sending needs of a Silo; :class:`silo.api.client.SiloClient` has it."""

    def get_item_by_uuid(self, uuid: str, /) -> Mapping[str, Any] | None: ...

    def get_bom(self, part_number: str, /) -> Sequence[Any]: ...


# The server, or the way to it, is at fault: whatever else waits would fare no better now.
_STOPS = (UnreachableError, ReadOnlyError, ServerFaultError, RouteMissingError, ConfigError)


@dataclass(frozen=True)
class Sent:
    """What became of one commit.

    status
        of the BOM; None where there was none to sync (a part, or switched off).
    revision
        the file's new revision; None where the server had this very file already.
    """

    part_number: str
    commit: Commit | None = None
    status: Status | None = None
    resolved: Resolved | None = None
    plan: MergePlan | None = None
    result: MergeResult | None = None
    revision: Revision | None = None
    sync_id: str = ""


@dataclass(frozen=True)
class Waiting:
    """Something that is not sent yet, for the pane. ``rejected``: the server does not want it as it is."""

    id: str
    title: str
    what: str
    reason: str = ""
    rejected: bool = False
    since: float = 0.0


@dataclass
class _Open:
    """A commit whose parts lie in the outbox."""

    sent: Sent
    left: set[int]


@dataclass
class Sending:
    """Brings commits to the server. All of it runs in the worker; one object per FreeCAD.

    tell
        told of each commit that is done.
    """

    spool: Spool
    outbox: Outbox
    tell: Callable[[Sent], None] = lambda _sent: None
    _open: dict[str, _Open] = field(default_factory=dict)
    _refused: dict[str, str] = field(default_factory=dict)
    # Commits whose file has another name than the item's: a person was asked, and said "the same part".
    _asked: set[str] = field(default_factory=set)
    _renamed: set[str] = field(default_factory=set)

    def run(self, client: SendApi, control: Control, *, force: bool = False) -> SendReport:
        """Send what waits, oldest first; what could not be sent is still there afterwards.

        Never raises for what the server or the network does: the report's ``stopped_by`` says it.
        """
        with self.spool.forwarding() as mine:
            if not mine:
                return SendReport(busy=True)
            for commit in self.spool.waiting():
                if commit.key in self._refused and not force:
                    continue
                stopped = self._hand_over(commit, client, control)
                if stopped is not None:
                    return SendReport(stopped_by=stopped)
        return self._send(client, control, force=force)

    def _hand_over(self, commit: Commit, client: SendApi, control: Control) -> SiloError | None:
        """Bring one commit as far as it goes; the error that makes it useless to go on with the others."""
        try:
            control.check()
            control.progress(commit.snapshot.label)
            self._forward(commit, client)
        except SiloError as error:
            if _concerns_all(error):
                return error
            self._refused[commit.key] = str(error)
            return None
        # At once: a person who commits ten files sees the first one arrive, not nothing for long.
        return self._send(client, control, force=True).stopped_by

    def waiting(self) -> tuple[Waiting, ...]:
        """What is not sent yet, oldest first."""
        commits = [
            Waiting(
                id=f"commit:{commit.key}",
                title=commit.snapshot.label,
                what=_what(commit),
                reason=self._refused.get(commit.key, ""),
                rejected=commit.key in self._refused,
                since=commit.taken_at,
            )
            for commit in self.spool.waiting()
        ]
        entries = [
            Waiting(
                id=f"outbox:{entry.id}",
                title=entry.part_number,
                what=_what_entry(entry),
                reason=entry.reason,
                rejected=entry.state is State.REJECTED,
                since=entry.taken_at,
            )
            for entry in self.outbox.pending()
        ]
        return tuple(sorted((*commits, *entries), key=lambda waiting: waiting.since))

    def retry(self, waiting_id: str) -> None:
        """Let something rejected go again with the next :meth:`run`.

        For a file with another name than the item's this is a person's word that it is the same part.
        """
        kind, _, key = waiting_id.partition(":")
        if kind == "commit":
            self._refused.pop(key, None)
            if key in self._asked:
                self._renamed.add(key)
        else:
            self.outbox.retry(int(key))

    def discard(self, waiting_id: str) -> None:
        """Forget something that waits. The document itself is not touched."""
        kind, _, key = waiting_id.partition(":")
        if kind == "commit":
            for commit in self.spool.waiting():
                if commit.key == key:
                    self.spool.remove(commit)
            self._refused.pop(key, None)
        else:
            self.outbox.discard(int(key))

    # -- from the spool into the outbox -----------------------------------------------------------------

    def _forward(self, commit: Commit, client: SendApi) -> None:
        sent, request = self._prepare(commit, client)
        file = commit.file if commit.file is not None and self._is_news(commit, sent, client) else None
        if request is not None:
            request = request.model_copy(update={"document": _document(commit)})
        entries: Sequence[OutboxEntry] = ()
        if (file is not None or request is not None) and not self._is_there(sent):
            entries = self.outbox.add(
                client.base_url,
                sent.part_number,
                file=file,
                comment=commit.comment,
                bom=request,
                taken_at=commit.taken_at,
            )
        self.spool.remove(commit)
        self._refused.pop(commit.key, None)
        if entries:
            self._open[entries[0].commit_key] = _Open(sent, {entry.id for entry in entries})
        else:
            self.tell(sent)

    def _prepare(self, commit: Commit, client: SendApi) -> tuple[Sent, MergeRequest | None]:
        extraction = commit.snapshot.extraction
        if extraction is None or not commit.sync_bom:
            number = _part_number(commit, client)
            return Sent(number, commit), None
        resolved = resolve(extraction, client)
        number = resolved.assembly.part_number or _part_number(commit, client)
        sent = Sent(number, commit, resolved=resolved, sync_id=commit.key)
        plan = compare(resolved, client)
        if blocking(resolved) and not commit.allow_missing:
            return replace(sent, status=Status.BLOCKED, plan=plan), None
        if not plan.news:
            return replace(sent, status=Status.UNCHANGED, plan=plan), None
        request = merge_request(resolved, commit.key)
        return replace(sent, status=Status.MERGED, plan=plan), request

    def _is_news(self, commit: Commit, sent: Sent, client: SendApi) -> bool:
        """False where the server's newest revision is this very file."""
        if commit.file is None:
            return False
        try:
            known = client.revisions(sent.part_number)
        except NotFoundError:
            return True
        newest = max(known, key=lambda revision: revision.revision_number, default=None)
        stored = (newest.file_checksum or "").lower().removeprefix("sha256:") if newest is not None else ""
        if stored == commit.sha256:
            return False
        self._check_name(commit, sent, known)
        return True

    def _check_name(self, commit: Commit, sent: Sent, known: Sequence[Revision]) -> None:
        """Refuse a file that has another name than the item's: "Save As" copies the identity along.

        Sent unasked, the copy would become the newest revision of the part that it was made from.
        """
        before = other_name(commit.snapshot.path, known)
        if not before or commit.key in self._renamed:
            return
        text = translate(
            "Silo",
            "{name} carries the identity of {number}, whose file in Silo is {before}. Is it the same part "
            "under a new name? Press Retry. Is it a copy that became a new part? Press Discard, then "
            "choose Register Parts and in it: new part",
        )
        name = os.path.basename(commit.snapshot.path)
        for key, value in (("name", name), ("number", sent.part_number), ("before", before)):
            text = text.replace(f"{{{key}}}", value)
        self._asked.add(commit.key)
        raise ConflictError(text)

    def _is_there(self, sent: Sent) -> bool:
        """True where an interrupted run had put this commit into the outbox already."""
        return any(
            entry.kind is Kind.BOM and entry.payload.get("sync_id") == sent.sync_id
            for entry in self.outbox.pending()
            if sent.sync_id
        )

    # -- from the outbox to the server ------------------------------------------------------------------

    def _send(self, client: SendApi, control: Control, *, force: bool) -> SendReport:
        def progress(entry: OutboxEntry, done: int, total: int) -> None:
            text = translate("Silo", "{file} → {number}")
            name = str(entry.payload.get("file_name", ""))
            text = text.replace("{file}", name).replace("{number}", entry.part_number)
            control.progress(text, done / total if total else None)

        return self.outbox.send_all(
            client,
            cancelled=control.cancelled,
            on_progress=progress,
            on_delivery=self._delivered,
            force=force,
        )

    def _delivered(self, delivery: Delivery) -> None:
        entry = delivery.entry
        opened = self._open.get(entry.commit_key)
        if opened is None:
            # Taken by an earlier run of FreeCAD: what it was compared with is not known any more.
            opened = _Open(Sent(entry.part_number), set())
        opened.sent = _with(opened.sent, delivery)
        opened.left.discard(entry.id)
        if not opened.left:
            self._open.pop(entry.commit_key, None)
            self.tell(opened.sent)


def _concerns_all(error: SiloError) -> bool:
    stops = isinstance(error, (*_STOPS, AuthError, CancelledError))
    return stops and not isinstance(error, ForbiddenError)


def _with(sent: Sent, delivery: Delivery) -> Sent:
    if isinstance(delivery.result, Revision):
        return replace(sent, revision=delivery.result)
    sync_id = sent.sync_id or str(delivery.entry.payload.get("sync_id") or "")
    return replace(sent, status=Status.MERGED, result=delivery.result, sync_id=sync_id)


def _part_number(commit: Commit, client: SendApi) -> str:
    identity = commit.snapshot.identity
    item: Any = client.get_item_by_uuid(identity) if identity else None
    if item is None:
        raise NotFoundError(
            translate(
                "Silo", "Silo does not know {name}; register it, or check that this is the right server"
            ).replace("{name}", commit.snapshot.label)
        )
    return str(item["part_number"])


def _document(commit: Commit) -> SourceDocument:
    return SourceDocument(file=os.path.basename(commit.snapshot.path), sha256=commit.sha256 or None)


def _what(commit: Commit) -> str:
    if commit.file is None:
        return translate("Silo", "BOM")
    if commit.snapshot.is_assembly and commit.sync_bom:
        return translate("Silo", "file and BOM")
    return translate("Silo", "file")


def _what_entry(entry: OutboxEntry) -> str:
    if entry.kind is Kind.BOM:
        return translate("Silo", "BOM")
    return str(entry.payload.get("file_name") or translate("Silo", "file"))
