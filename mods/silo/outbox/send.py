# SPDX-License-Identifier: LGPL-2.1-or-later
"""Sending what the outbox holds: in order per item, each thing once, whatever dies on the way.

For each entry: look the item up, send the file, compare the BOM, merge it. What has arrived is noted at
once, so that a run which dies is continued by the next one. What an error means is :mod:`silo.api.policy`'s
to say.
"""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from silo.api.address import canonical
from silo.api.arrived import MayHaveArrivedError, SentFile, find_arrived, is_there
from silo.api.client import SiloClient
from silo.api.files import DocumentId, Origin
from silo.api.policy import QUEUE_PAUSES, Backoff, ErrorScope, Then, is_certain, judge, pause_after
from silo.api.revisions import Standing, checksum_of, is_newest, newest_number, other_name
from silo.api.transport import Cancel, stop_if
from silo.api.wire import (
    HeldItem,
    LinkedFile,
    MergeRequest,
    ProductSummary,
    Revision,
    SourceDocument,
)
from silo.bom.errors import (
    CancelledError,
    ConflictError,
    DocumentError,
    InputError,
    MissingRevisionError,
    NewerRevisionError,
    NotFoundError,
    ReadOnlyError,
    RouteMissingError,
    SiloError,
)
from silo.bom.message import message
from silo.bom.snapshot import from_plain
from silo.bom.system_refusals import why_refused
from silo.bom.view.folders import project_folder
from silo.bom_sync.held import report_held, why_held
from silo.bom_sync.memory import server_of
from silo.bom_sync.reported_lines import remember_reported
from silo.bom_sync.resolved import Resolved, resolve
from silo.bom_sync.steps import Status, decide, merge_request, server_lines
from silo.file_state import is_seen, is_set_back, stands
from silo.outbox.entry import ASKED, SAME_PART, Entry, InFile, State, new_key
from silo.outbox.held_here import HeldHere
from silo.outbox.recorded import former_document, note_arrived
from silo.outbox.report import Report, Sent
from silo.outbox.store import OutboxError, Store
from silo.project_folder import record_of


def went_alone(entry: Entry) -> list[str]:
    """Say which half of a commit with file and BOM the server has, if it refused the other half."""
    if not entry.has_file or entry.file_left == entry.bom_left:
        return []
    there, left = ("BOM", "file") if entry.file_left else ("file", "BOM")
    return [message("Its {there} is in Silo; only the {left} is not", there=there, left=left)]


def send_all(
    store: Store,
    client: SiloClient,
    *,
    cancelled: Cancel | None = None,
    on_progress: Callable[[Entry, int, int], object] | None = None,
    on_sent: Callable[[Sent], object] | None = None,
    force: bool = False,
    backoff: Backoff = QUEUE_PAUSES,
    chance: Callable[[], float] = random.random,
) -> Report:
    """Send what waits for this client's server, oldest first, in order per item; nothing in a pause.

    Never raises for an error of the server or the network; the report has it. An error that concerns all
    entries is a pause of the server and changes no entry; a passing error of one item is a pause of that
    item.

    force
        end all pauses of this server first: the user pressed the button.
    """
    with store.send_lock() as mine:
        if not mine:
            return Report(busy=True)
        store.sweep()
        if force:
            store.resume(client.base_url)
            for entry in store.entries():
                is_set_back = entry.newer.get("set_back") and not entry.superseded
                if is_set_back and entry.server == canonical(client.base_url):
                    with suppress(InputError):  # discarded in this moment
                        store.retry(entry.id)
        run = _SendRun(store, client, cancelled, on_progress, on_sent, backoff, chance)
        run.all()
        run.report.pause = store.pause(client.base_url)
        return run.report


class _OtherNameError(ConflictError):
    """The file has another name than the item's: the user says whether it is the same part."""


class _PassingError(SiloError):
    """This computer's disk did not answer; nothing is wrong with the entry."""


@dataclass
class _SendRun:
    store: Store
    client: SiloClient
    cancelled: Cancel | None
    on_progress: Callable[[Entry, int, int], object] | None
    on_sent: Callable[[Sent], object] | None
    backoff: Backoff
    chance: Callable[[], float]
    report: Report = field(default_factory=Report)
    blocked_items: set[str] = field(default_factory=set)  # items whose older entry has to go first
    _documents: bool | None = None  # whether the server knows documents; None: not asked yet
    _sums_up: bool = True  # until it answers that it keeps no summaries

    def all(self) -> None:
        if self._is_paused():
            return
        last = 0
        # Read again each time: what is added or discarded meanwhile counts.
        while self.report.stopped_by is None and (
            due_entry := self.store.next_due(self.client.base_url, last)
        ):
            last = due_entry.id
            if due_entry.state is State.KEEPING and not self.store.is_coming(due_entry.key):
                # The copy that an earlier run of the program could not make any more.
                self.store.finish(due_entry.key)
            if (entry := self.store.entry(due_entry.id)) is None:
                continue
            is_ready = entry.state is State.WAITING and not entry.keys & self.blocked_items
            if not is_ready or self._is_paused(entry.item):
                self.blocked_items |= entry.keys
                continue
            self._try(entry)

    def _is_paused(self, item: str = "") -> bool:
        pause = self.store.pause(self.client.base_url, item)
        return pause is not None and pause.left(self.store.clock()) > 0

    def _pause(self, error: SiloError, item: str = "") -> None:
        server = self.client.base_url
        before, now = self.store.pause(server, item), self.store.clock()
        self.store.set_pause(server, pause_after(error, before, now, self.backoff, self.chance()), item)

    def _go_well(self, item: str) -> None:
        for name in ("", item):
            if self.store.pause(self.client.base_url, name) is not None:
                self.store.set_pause(self.client.base_url, None, name)

    def _try(self, entry: Entry) -> None:
        refused: list[SiloError] = []
        try:
            stop_if(self.cancelled)
            server = entry.server or canonical(self.client.base_url)
            if server != entry.server:
                # On disk before a byte is sent: the next run after a crash knows that it may have arrived.
                self.store.update(entry.id, server=server)
            sent = self._send(replace(entry, server=server), refused)
        except SiloError as error:
            self._failed(entry, error)
            return
        waits = [error for error in refused if _waits(error)]
        if len(waits) < len(refused):
            self._hold(entry, refused)
        elif waits:
            self._later(entry, refused[0], self._reasons(entry, refused))
        elif sent is not None:
            self._go_well(entry.item)
            sent = replace(sent, summary=self._summary(sent))
            self.report.sent.append(sent)
            if self.on_sent is not None:
                self.on_sent(sent)

    def _failed(self, entry: Entry, error: SiloError) -> None:
        if isinstance(error, OutboxError):
            raise error
        if isinstance(error, CancelledError):
            self.report.stopped_by = error
            return
        if isinstance(error, _PassingError):
            self._later(entry, error, str(error))
            return
        verdict = judge(error, self.client.ready)
        if verdict.scope is ErrorScope.ALL:
            self.report.stopped_by = error
            self._pause(error)
        elif verdict.then is Then.PERSON:
            self._hold(entry, [error])
        else:
            self._later(entry, error, str(error))

    def _later(self, entry: Entry, error: SiloError, reason: str) -> None:
        """Let an entry that failed alone, for a while, wait with its reason; later entries of its item wait
        too.
        """
        self._pause(error, entry.item)
        self.store.update(entry.id, reason=reason)
        now = self.store.entry(entry.id) or entry
        self.report.failed.append(now)
        self.blocked_items |= now.keys

    def _reasons(self, entry: Entry, errors: Sequence[SiloError]) -> str:
        now = self.store.entry(entry.id) or entry
        return "\n".join([*map(str, errors), *(went_alone(now) if any(self.store.bom(entry.id)) else ())])

    def _hold(self, entry: Entry, errors: Sequence[SiloError]) -> None:
        self.store.update(entry.id, state=State.HELD, reason=self._reasons(entry, errors))
        self.report.held.append(self.store.entry(entry.id) or entry)

    # -- one entry --------------------------------------------------------------------------------------

    def _send(self, entry: Entry, refused: list[SiloError]) -> Sent | None:
        """Bring an entry to the server; None if it must wait for an older one of the same item.

        If the file is refused, the BOM is sent anyway, and the other way round; ``refused`` has the reasons.
        """
        extraction, request = self.store.bom(entry.id)
        resolved = self._resolved(entry, extraction) if extraction and entry.bom_left else None
        number = (resolved and resolved.assembly.part_number) or self._number(entry)
        if number.casefold() in self.blocked_items:
            return None
        item, entry = entry.part_number, replace(entry, part_number=number)
        if not number:
            return self._attach(entry)
        if number != item and not isinstance(number, DocumentId):
            self.store.update(entry.id, part_number=number)
        if entry.has_file and not entry.file_left and not self._is_there(entry):
            entry = self._again(entry)
        sent = Sent(entry, number, resolved=resolved, revision=entry.revision)
        if entry.file_left:
            try:
                sent = self._send_file(sent)
                entry = replace(sent.entry, file_left=False)
            except SiloError as error:
                # An upload whose answer was lost may have arrived, so it keeps its BOM back.
                _refuse(error, refused, alone=is_certain(error))
                if isinstance(error, MayHaveArrivedError):
                    # A user who presses Retry has looked at these revisions.
                    self.store.update(entry.id, base_revision=error.newest)
                if isinstance(error, NewerRevisionError):
                    # So that the user can look at it.
                    self.store.update(entry.id, newer=json.dumps(dict(error.revision)))
                if isinstance(error, NewerRevisionError | _OtherNameError):
                    return sent
        if entry.bom_left and self.store.entry(entry.id) is not None:  # discarded meanwhile
            try:
                return self._send_bom(replace(sent, entry=entry), request)
            except SiloError as error:
                _refuse(error, refused, alone=not _waits(error) and is_certain(error))
        return sent

    def _summary(self, sent: Sent) -> ProductSummary | None:
        if not self._sums_up or sent.status not in (Status.MERGED, Status.UNCHANGED):
            return None
        try:
            summary = self.client.get_summary(sent.number)
        except SiloError:  # the commit has arrived; a very large product is being summed up
            return None
        self._sums_up = summary is not None
        return summary

    def _is_there(self, entry: Entry) -> bool:
        """Return False if the server no longer has a file that was sent, so that its BOM would go alone: it
        was restored.
        """
        try:
            revisions = self.client.revisions(entry.part_number)
        except RouteMissingError:
            return True
        except NotFoundError:
            return False
        return is_there(revisions, entry.file_name, entry.sha256, entry.revision)

    def _again(self, entry: Entry) -> Entry:
        """Send the file once more, since what was seen of the server may no longer be true."""
        again: dict[str, Any] = {"file_left": True, "base_revision": None, "revision": None}
        self.store.update(entry.id, **again)
        return replace(entry, **again)

    def _resolved(self, entry: Entry, extraction: str) -> Resolved:
        try:
            return resolve(from_plain(json.loads(extraction)), self.client)
        except ValueError as error:
            raise InputError(
                message("{label}: its BOM cannot be read any more; commit it again", label=entry.label)
            ) from error

    def _number(self, entry: Entry) -> str:
        """Find the item or document to which the file goes; "" for an attachment of the assembly that needs
        it.
        """
        within = InFile.of(entry.document)
        if within.own and self._knows_documents():
            return DocumentId(entry.identity)
        if entry.part_number and not entry.identity:
            return entry.part_number
        if within.own and not within.items:
            return ""
        identity = within.items[0][0] if within.own else entry.identity
        if not identity:
            raise InputError(
                message(
                    "{file_name}: it is not known which item it belongs to. Save a copy of it",
                    file_name=entry.file_name,
                )
            )
        item: Any = self.client.get_item_by_uuid(identity) if identity else None
        if item is None:
            raise NotFoundError(
                message(
                    "Silo does not know {path}; register it, or check that this is the right server",
                    path=entry.label or entry.path,
                )
            )
        return str(item["part_number"])

    def _knows_documents(self) -> bool:
        if self._documents is None:
            try:
                self.client.get_documents(["00000000-0000-0000-0000-000000000000"])
                self._documents = True
            except RouteMissingError:
                self._documents = False
        return self._documents

    def _attach(self, entry: Entry) -> Sent:
        """Send a file without an item to a Silo that knows no documents: it becomes an attachment."""
        user: Any = self.client.get_item_by_uuid(InFile.of(entry.document).user)
        if user is None:
            raise NotFoundError(
                message(
                    "{path}: this Silo keeps a file without a part number as an attachment of the "
                    "assembly that links to it, and that assembly has none; register it",
                    path=entry.label or entry.path,
                )
            )
        number = str(user["part_number"])
        self.client.attach_file(number, self._copy(entry), entry.file_name, cancelled=self.cancelled)
        # Such a Silo lists no revisions of it: the record alone keeps the next run from sending it again.
        note_arrived(entry, Revision(revision_number=0, file_checksum=entry.sha256))
        self.store.arrived(entry, "file")
        text = message("This Silo keeps it as an attachment of {number}, without revisions", number=number)
        return Sent(replace(entry, remark=text), number)

    def _send_file(self, sent: Sent) -> Sent:
        entry = sent.entry
        mine: Revision | None = None
        # The newest one decides it nearly always; an item may have hundreds.
        newest = self._revisions(sent.part_number, newest=1)
        if is_newest(entry.sha256, newest):
            there = self._arrived(entry, newest[0])
            # The BOM is the BOM of that revision, even if another commit uploaded it.
            new = None if entry.base_revision is None else there.revision
            return replace(sent, entry=there, revision=new)
        if entry.base_revision is None:
            revisions = self._revisions(sent.part_number)
            self._check_name(entry, revisions)
            base = self._base(entry, revisions)
            # Note what the server had before us. Otherwise, a file that equals an older revision could
            # not be distinguished from our own that had already arrived.
            self.store.update(entry.id, base_revision=newest_number(revisions))
        else:
            revisions = self._revisions(sent.part_number, after=entry.base_revision)
            mine = find_arrived(
                self.client,
                sent.part_number,
                SentFile(entry.file_name, entry.sha256, entry.size, entry.base_revision),
                revisions,
                cancelled=self.cancelled,
            )
            base = self._base(entry, self._revisions(sent.part_number)) if mine is None else None
        before = max(newest_number(newest), entry.base_revision or 0)
        revision = mine or self._upload(entry, base)
        undone = () if mine or base is None else self._undone(sent.part_number, before, revision)
        there = self._arrived(entry, revision, revision.base_revision)
        return replace(sent, entry=there, revision=there.revision, uploaded=revision, undone=undone)

    def _undone(self, part_number: str, before: int, made: Revision) -> tuple[Revision, ...]:
        """Return what colleagues committed after the look and before the upload, oldest first."""
        if made.revision_number <= before + 1 or made.base_revision is not None:
            return ()  # a server that keeps the base has checked it
        try:
            later = self._revisions(part_number, after=before)
        except SiloError:
            later = [Revision(revision_number=made.revision_number - 1)]
        between = [one for one in later if before < one.revision_number < made.revision_number]
        named = [
            one for one in between if one.file_name or one.file_checksum or one.file_key or one.file_size
        ]
        told = any(one.file_name or one.file_checksum for one in later)
        return tuple(sorted(named if told else between, key=lambda one: one.revision_number))

    def _arrived(self, entry: Entry, revision: Revision, base: int | None = None) -> Entry:
        number = revision.revision_number
        self.store.learn(entry.server, entry.sha256, entry.identity, number)
        note_arrived(entry, revision)
        self.store.arrived(entry, "file", number, base=base)
        return replace(entry, revision=number)

    def _base(self, entry: Entry, revisions: Sequence[Revision]) -> int | None:
        """Return the revision from which the file was made; None if nothing is to be checked. Raises
        NewerRevisionError if sending it would undo a colleague's; the server checks again, since a colleague
        may commit before the upload.
        """
        if not entry.origin:
            return None
        made_from = self._standing(entry, revisions, entry.origin.split())
        self._check_set_back(entry, revisions, made_from.newest)
        made_from.check(entry.part_number)
        return max(made_from.base_number, 0)

    def _check_set_back(self, entry: Entry, revisions: Sequence[Revision], newest: Revision | None) -> None:
        """Raise NewerRevisionError if the server has lost the revision from which the file was made, and has
        nothing later. Nothing of a colleague would be undone.
        """
        if newest is None or not checksum_of(newest) or is_seen(newest, entry.on_top_of):
            return
        record = record_of(entry.path) if entry.path else None
        before = any(
            pending.newer.get("set_back") and pending.item == entry.item for pending in self.store.entries()
        )
        is_ours = self._known(entry, checksum_of(newest)) == newest.revision_number
        nearest = self._nearest(entry)
        there = {checksum_of(revision) for revision in revisions}
        is_lost = nearest[1] > newest.revision_number if nearest[0] else before
        was_sent = record is not None and record.sha256 == entry.sha256
        if (is_ours and is_lost and nearest[0] not in there) or (
            is_set_back(newest, record, entry.server) and not was_sent
        ):
            raise NewerRevisionError(
                message(
                    "The server was restored from a backup: it has revision {revision_number} of "
                    "{part_number}, and this is newer and came after what it has lost. Retry all "
                    "sends it again",
                    revision_number=newest.revision_number,
                    part_number=entry.part_number,
                ),
                {**newest.model_dump(mode="json", exclude={"properties", "links"}), "set_back": True},
            )

    def _nearest(self, entry: Entry) -> tuple[str, int]:
        """Return the nearest origin that is known here as a revision, and its number; ("", 0) if none is."""
        for content in entry.origin.split():
            if (number := self._known(entry, content)) is not None:
                return content, number
        return "", 0

    def _known(self, entry: Entry, content: str) -> int | None:
        return self.store.known_revision(entry.server, content, entry.identity)

    def _standing(self, entry: Entry, revisions: Sequence[Revision], origins: Sequence[str]) -> Standing:
        return stands(
            entry.sha256, origins, revisions, lambda content: self._known(entry, content), entry.on_top_of
        )

    def _upload(self, entry: Entry, base: int | None) -> Revision:
        progress = self.on_progress
        links = [LinkedFile.model_validate(link) for link in json.loads(entry.links)] if entry.links else None
        held = [HeldItem(item=item, object=name) for item, name in InFile.of(entry.document).items]
        try:
            return self.client.upload_file(
                entry.part_number,
                self._copy(entry),
                entry.comment,
                on_progress=None if progress is None else lambda done, total: progress(entry, done, total),
                file_name=entry.file_name,
                idempotency_key=entry.key,
                sha256=entry.sha256,
                origin=Origin(
                    base_revision=base,
                    file_path=entry.place,
                    links=links,
                    items=held or None,
                    former=former_document(entry),
                ),
                cancelled=self.cancelled,
            )
        except DocumentError as error:  # users know their own file, not our copy
            raise self._unreadable(entry, error.reason) from error

    def _copy(self, entry: Entry) -> Path:
        try:
            return self.store.verified(entry)
        except FileNotFoundError as error:
            text = message(
                "the copy kept for sending is gone, so it was not sent. Commit the document again, then "
            )
            raise InputError(
                message("{file_name}: {text}discard this", file_name=entry.path or entry.file_name, text=text)
            ) from error
        except OSError as error:
            raise self._unreadable(entry, why_refused(error)) from error

    def _unreadable(self, entry: Entry, reason: str) -> _PassingError:
        # This is an error of the disk, not damage: the hash of a damaged copy differs.
        text = message("the copy kept for sending cannot be read ({reason})", reason=reason)
        return _PassingError(
            message("{file_name}: {text}", file_name=entry.path or entry.file_name, text=text)
        )

    def _revisions(
        self, part_number: str, *, newest: int | None = None, after: int = 0
    ) -> Sequence[Revision]:
        try:
            return self.client.revisions(part_number, newest=newest, after=after)
        except RouteMissingError:
            # Their number is all that such a server shows; the files say whether an upload has arrived.
            is_document = isinstance(part_number, DocumentId)
            last = 0 if is_document else self.client.get_item(part_number).current_revision
            return [Revision(revision_number=number) for number in range(last, after, -1)]
        except NotFoundError:
            if not isinstance(part_number, DocumentId):
                raise
            return ()  # its first upload makes it

    def _check_name(self, entry: Entry, revisions: Sequence[Revision]) -> None:
        """Refuse a file that has another name than the item's: "Save As" copies the identity along.

        If it were sent without a question, the copy would become the newest revision of the part from which
        it was made.
        """
        before = other_name(entry.file_name, revisions) if entry.identity else ""
        if before and entry.renamed != SAME_PART:
            self.store.update(entry.id, renamed=ASKED)
            raise _OtherNameError(
                message(
                    "{file_name} carries the identity of {part_number}, whose file in Silo is "
                    "{before}. Is it the same part under a new name? Press Same part. Is it a copy "
                    "that became a new part? Press Discard, then choose Register Parts and in it: "
                    "new part",
                    file_name=entry.file_name,
                    part_number=entry.part_number,
                    before=before,
                )
            )

    def _send_bom(self, sent: Sent, request: str) -> Sent:
        entry = sent.entry
        if not request:
            resolved = sent.resolved
            assert resolved is not None  # an entry with a BOM has an extraction or a request
            lines = server_lines(resolved, self.client)
            where = server_of(self.client)
            decided = decide(resolved, lines, allow_missing=entry.allow_missing, server=where)
            sent = replace(sent, plan=decided.plan, status=decided.status, sync_id=entry.key)
            self._note_held(sent)
            if decided.status is not Status.MERGED:
                self.store.arrived(entry, "bom", note=decided.status is Status.UNCHANGED)
                return sent
            request = merge_request(resolved, entry.key).model_dump_json(by_alias=True, exclude_none=True)
        try:
            wanted = self._named(self._at_revision(entry), request)
            before = MergeRequest.model_validate_json(request).document
            if before is not None and before != wanted.document:
                # It was sent so; the server knows that name with another content.
                wanted = wanted.model_copy(update={"sync_id": new_key()})
            # A repeat must be the same as now: the server knows a merge by its sync_id and its content.
            self.store.update(entry.id, request=wanted.model_dump_json(by_alias=True, exclude_none=True))
            result = self.client.merge_bom(sent.part_number, wanted, cancelled=self.cancelled)
        except NewerRevisionError as error:
            # The colleague's file was made from this one, so their BOM has this one's changes.
            self.store.arrived(entry, "bom", note=False)
            self.store.free_bom(self.client.base_url, entry.identity)
            remark = "Its BOM was not sent: {} has committed revision {} since, whose BOM counts".format(
                error.revision.get("created_by") or "somebody", error.revision.get("revision_number", "?")
            )
            return replace(sent, status=None, entry=replace(entry, remark=remark))
        except MissingRevisionError as error:
            if not entry.has_file:
                raise
            self._again(entry)
            raise _PassingError(str(error)) from error
        self.store.arrived(entry, "bom")
        if sent.resolved is not None and sent.resolved.assembly.silo_uuid:
            self.store.free_bom(self.client.base_url, sent.resolved.assembly.silo_uuid)
        if sent.resolved is not None and sent.plan is not None:
            remember_reported(sent.resolved, sent.plan, server_of(self.client))
        return replace(sent, status=Status.MERGED, result=result, sync_id=wanted.sync_id or "")

    def _note_held(self, sent: Sent) -> None:
        """Remember here whether a BOM is held, and let the server know that it is.

        Raises SiloError if the server cannot take the report now: the commit waits until it can.
        """
        entry, resolved = sent.entry, sent.resolved
        if resolved is None or not (identity := resolved.assembly.silo_uuid):
            return
        server = canonical(self.client.base_url)
        if sent.status is not Status.BLOCKED:
            if sent.status is Status.UNCHANGED:
                self.store.free_bom(server, identity)
            return
        label = entry.label or Path(entry.path).name
        why, since = why_held(resolved), self.store.clock()
        self.store.hold_bom(HeldHere(server, identity, sent.number, entry.path, label, why, since))
        document = SourceDocument(file=Path(entry.path).name, folder=project_folder(entry.path))
        try:
            report_held(resolved, self.client, document if entry.path else None)
        except SiloError as error:
            if _waits(error) or isinstance(error, CancelledError):
                raise

    def _at_revision(self, entry: Entry) -> Entry:
        """Give an entry without a file the revision that its document is, or was made from."""
        if entry.has_file or not entry.origin or entry.revision is not None:
            return entry
        revisions = self._revisions(entry.part_number)
        made_from = self._standing(entry, revisions, (entry.sha256, *entry.origin.split()))
        made_from.check(entry.part_number)
        base = made_from.base
        return (
            entry if base is None else replace(entry, revision=base.revision_number, sha256=checksum_of(base))
        )

    def _named(self, entry: Entry, request: str) -> MergeRequest:
        """Give the request a name and a document, if it has none yet."""
        try:
            wanted = MergeRequest.model_validate_json(request)
        except ValidationError as error:
            raise InputError(
                message("{label}: its BOM cannot be read any more; commit it again", label=entry.label)
            ) from error
        document = wanted.document
        if document is None and entry.path:
            document = SourceDocument(
                file=Path(entry.path).name, folder=project_folder(entry.path), sha256=entry.sha256 or None
            )
        if document is not None and (document.revision is None or entry.has_file):
            document = document.model_copy(update={"revision": entry.revision})
        return wanted.model_copy(update={"sync_id": wanted.sync_id or entry.key, "document": document})


def _refuse(error: SiloError, refused: list[SiloError], *, alone: bool) -> None:
    """Note an error that concerns only one half of a commit; any other error ends the entry's turn."""
    if not alone or isinstance(error, _PassingError | OutboxError | CancelledError):
        raise error
    refused.append(error)


def _waits(error: SiloError) -> bool:
    """Return True if the refusal of one half may end by itself."""
    return isinstance(error, ReadOnlyError) or judge(error, lambda: None).then is Then.RETRY
