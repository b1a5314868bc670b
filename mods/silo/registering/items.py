# SPDX-License-Identifier: LGPL-2.1-or-later
"""Giving a component its item: create it in Silo, write the identity into its file, never twice.

The order is what keeps a crash harmless: the file can take an identity; the intent, with the UUID that the
item shall have, is on disk before the server is asked; the identity is in the file before the intent is
finished. Whatever is interrupted, the next run finds the intent and looks for the item that it may have made:
by its UUID, by the property that carries it, and, where a server shows neither, among the items of the same
description that were made since. Where that leaves a doubt, the user is asked.

All of that happens under the lock of the file's folder, and with the identity that the file has then:
another computer may have registered it. What is begun stands in that folder, so that another computer
continues it. Where others do not see the lock, the file itself carries the identity before the server is
asked.

A file may carry an identity that the server does not know, from another server or from another computer's
run. Its item gets that identity; what brings such a file here has asked the user.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any, Protocol

from silo.bom.entry import BomEntry
from silo.bom.errors import (
    BusyError,
    ConflictError,
    NotFoundError,
    NotSentError,
    ServerFaultError,
    SiloError,
    UnreachableError,
)
from silo.bom.items.proposal import Proposal
from silo.bom.message import message
from silo.bom.walk.identity import as_uuid
from silo.bom_sync.memory import Memory, server_of
from silo.bom_sync.standard_items import by_description, standard_item_memory
from silo.registering.journal import Journal, RegistrationRecord, Turn, component_key
from silo.registering.saved_file import on_disk

# Servers that give UUIDs of their own still keep properties: this one finds an item made before a crash.
REGISTRATION_PROPERTY = "registration_id"

PAGE, PAGES = 100, 50
CLOCKS_APART_S = 26 * 3600.0
"""Two clocks may differ by this much, time zones included."""


class RegistrationApi(Protocol):
    """What registering needs of a Silo; :class:`silo.api.client.SiloClient` has it."""

    def get_item_by_uuid(self, uuid: str, /) -> Mapping[str, Any] | None: ...

    def get_properties(self, part_number: str, /) -> Mapping[str, Any]: ...

    def search_items(self, query: str = "", /, *, limit: int = 50, offset: int = 0) -> Any: ...

    def create_item(
        self,
        schema: str,
        category: str,
        description: str,
        *,
        item_type: str,
        properties: Mapping[str, Any],
        idempotency_key: str,
        **texts: str | None,
    ) -> Mapping[str, Any]: ...

    def archive_item(self, part_number: str, /) -> None: ...


# Writes an identity into the component's file: (entry, uuid). Raises DocumentError if it cannot.
Stamp = Callable[[BomEntry, str], None]
# Raises DocumentError if an identity could not be written, before anything is made on the server.
Check = Callable[[BomEntry], None]
# Which of these items an interrupted run made for the component: one of them, or None for a new item.
Ask = Callable[[Proposal, Sequence[Mapping[str, Any]]], Mapping[str, Any] | None]


@dataclass(frozen=True)
class Registration:
    """What became of one component: its item, or the error that kept it from getting one.

    found
        the item was there already, made by an interrupted run or lost from the file since.
    """

    proposal: Proposal
    part_number: str | None = None
    item_id: str | None = None
    error: SiloError | None = None
    found: bool = False


def finished(record: RegistrationRecord, journal: Journal) -> bool:
    """Note in the journal, and return True, if the component's file names its item by now; another computer
    may have written it.
    """
    path, _, name = record.component.rpartition("#")
    uid, identity = on_disk(BomEntry(path, object_name=name))
    if identity.lower() not in (record.item_id.lower(), record.wanted.lower()):
        return False
    journal.done(record.component, uid)
    return True


def unclear(proposal: Proposal, matches: Sequence[Mapping[str, Any]]) -> Mapping[str, Any] | None:
    """Refuse to choose, if the user cannot be asked. Raises ConflictError that names the items."""
    numbers = ", ".join(str(item["part_number"]) for item in matches)
    raise ConflictError(
        message(
            "{name}: {numbers} may be its item: made by an interrupted run, or registered "
            "from this document before. The same part, or a copy of it? Look at that, then "
            "take it or make a new item",
            name=proposal.name,
            numbers=numbers,
        )
    )


def register(
    proposal: Proposal,
    api: RegistrationApi,
    journal: Journal,
    stamp: Stamp,
    *,
    schema: str = "kindred-rd",
    properties: Mapping[str, Any] | None = None,
    check: Check = lambda _entry: None,
    ask: Ask = unclear,
    copy: bool = False,
    tell: Callable[[str], object] = lambda _text: None,
) -> Registration:
    """Register one component; an error is returned, not raised, so that the others are still registered.

    properties
        further properties of the first revision, such as the file's hash.
    check, ask
        see :data:`Check` and :data:`Ask`.
    copy
        the component carries the identity of another part; it gets its own.
    tell
        receives who else registers in the file's folder, while this waits.
    """
    try:
        with journal.turn(proposal.entry.doc_path, component_key(proposal.entry), tell) as turn:
            run = _ItemRun(proposal, api, turn, stamp, schema, properties or {}, ask)
            item, existing = run.item(check, copy)
    except SiloError as error:
        return Registration(proposal, error=error)
    return Registration(
        proposal, part_number=str(item["part_number"]), item_id=str(item["id"]), found=existing
    )


@dataclass(frozen=True)
class _ItemRun:
    """The steps of one component's registration."""

    proposal: Proposal
    api: RegistrationApi
    turn: Turn
    stamp: Stamp
    schema: str
    properties: Mapping[str, Any]
    ask: Ask

    def item(self, check: Check, copy: bool) -> tuple[Mapping[str, Any], bool]:
        """Find or make the component's item, write its identity into the file, and return it; also, if it
        existed already.
        """
        entry = self.proposal.entry
        uid, now = on_disk(entry, shares_file=self.proposal.shares_file)
        carried = entry.silo_uuid or ""
        if now and now.lower() != carried.lower():
            return self._registered_meanwhile(now), True
        check(entry)
        item = None if copy or carried else self._lost(uid)
        if item is not None:
            self.stamp(entry, str(item["id"]))
            self.turn.done(uid)
            return item, True
        wanted = "" if copy else as_uuid(carried)  # a text that is no UUID cannot be the item's
        intent, begun = self.turn.begin(wanted, uid)
        if self.turn.unseen and not wanted:
            # If others see only the file, it gets the identity before the item is made.
            wanted = intent.wanted
            self.stamp(entry, wanted)
            _, now = on_disk(entry, shares_file=self.proposal.shares_file)
            if now and now.lower() != wanted:
                self.turn.forget()
                return self._registered_meanwhile(now), True
            entry = replace(entry, silo_uuid=wanted)
        item, existing = self._made(intent, begun, wanted)
        item_id = str(item["id"])
        if item_id.lower() != wanted:
            self.stamp(entry, item_id)
        self.turn.done(uid or on_disk(entry)[0])
        return item, existing

    def _registered_meanwhile(self, identity: str) -> Mapping[str, Any]:
        """Return the item that the component got elsewhere after it was read."""
        entry = self.proposal.entry
        item = self.api.get_item_by_uuid(identity)
        if item is None:
            raise ConflictError(
                message(
                    "{name}: {doc_path} carries the identity {identity} now, and this server has no "
                    "such item: another computer registers it just now, or at another server. Wait "
                    "for that and register again; --adopt takes it over",
                    name=self.proposal.name,
                    doc_path=entry.doc_path,
                    identity=identity,
                )
            )
        self.stamp(entry, identity)  # an open document does not have it yet
        return item

    def _lost(self, uid: str) -> Mapping[str, Any] | None:
        """Return the item of a document that was registered and lost its identity, if the user agrees.
        FreeCAD saved over it, or a copy with the same UUID is in its place.
        """
        record = self.turn.journal.find(self.turn.component)
        if record is None or not record.finished or not uid or record.document_uid != uid:
            return None
        item = self.api.get_item_by_uuid(record.item_id)
        return None if item is None else self.ask(self.proposal, (item,))

    def _made(self, intent: RegistrationRecord, begun: bool, wanted: str) -> tuple[Mapping[str, Any], bool]:
        """Find or make the component's item; also return if it existed already."""
        proposal, api = self.proposal, self.api
        item = self._made_before(intent) if begun or wanted else None
        was_there = item is not None
        if item is None:
            mark = {} if getattr(api, "keeps_item_ids", False) else {REGISTRATION_PROPERTY: intent.wanted}
            try:
                item = api.create_item(
                    self.schema,
                    proposal.category,
                    proposal.name,
                    item_type=proposal.item_type,
                    properties={**self.properties, **proposal.supply, **mark},
                    idempotency_key=intent.wanted,
                    **_sourcing(proposal),
                )
            except SiloError as error:
                if not _may_have_arrived(error):
                    if not begun and not (self.turn.unseen and intent.wanted != proposal.entry.silo_uuid):
                        self.turn.forget()
                    raise
                item = self._after_a_lost_answer(intent, error)
        if str(item["id"]) != intent.item_id:
            self.turn.replace(str(item["id"]))
        return item, was_there

    def _after_a_lost_answer(self, intent: RegistrationRecord, error: SiloError) -> Mapping[str, Any]:
        try:
            item = self._made_before(intent)
        except ConflictError:
            raise
        except SiloError:
            raise error from None  # The connection is still broken: the first reason says more.
        if item is None:
            raise error
        return item

    def _made_before(self, intent: RegistrationRecord) -> Mapping[str, Any] | None:
        """Find the item that this intent made, if it came that far."""
        api = self.api
        for identity in dict.fromkeys((intent.item_id, intent.wanted)):
            item = api.get_item_by_uuid(identity)
            if item is not None:
                return item
        if getattr(api, "keeps_item_ids", False):
            return None  # This server gives an item the UUID that we ask for, so there is none.
        others = self.turn.journal.item_ids() - {intent.item_id}
        doubtful: dict[str, Mapping[str, Any]] = {}
        for item in _of_the_same_name(self.proposal, api, intent.begun_at):
            mark = _mark(api, item)
            if mark == intent.wanted:
                return item
            if mark is None and str(item["id"]) not in others:
                doubtful[str(item["id"])] = item
        return self.ask(self.proposal, tuple(doubtful.values())) if doubtful else None


def _sourcing(proposal: Proposal) -> dict[str, str | None]:
    return {"sourcing_type": proposal.sourcing} if proposal.sourcing else {}


def _may_have_arrived(error: SiloError) -> bool:
    put_off = isinstance(error, (NotSentError, BusyError))
    return isinstance(error, (UnreachableError, ServerFaultError)) and not put_off


def _of_the_same_name(proposal: Proposal, api: RegistrationApi, since: float) -> Iterator[Mapping[str, Any]]:
    """Yield the items with this description made since then, each once; those of a search first, then those
    of the whole list.
    """
    name, seen = proposal.name.casefold(), set()
    for item in _all_items(proposal.name, api):
        if str(item["id"]) in seen:
            continue
        seen.add(str(item["id"]))
        made = _time(item.get("created_at"))
        texts = (str(item.get("description") or "").casefold(), str(item.get("name") or "").casefold())
        if name in texts and (made is None or made >= since - CLOCKS_APART_S):
            yield item


def _all_items(name: str, api: RegistrationApi) -> Iterator[Mapping[str, Any]]:
    yield from api.search_items(name)
    # A search may be fuzzy, late or short: what is not in it may exist anyway.
    seen, before = 0, frozenset[str]()
    while seen < PAGE * PAGES:
        try:
            items = list(api.search_items("", limit=PAGE, offset=seen))
        except NotFoundError:
            return
        ids = frozenset(str(item["id"]) for item in items)
        if not ids or ids == before:  # the end, or a server that knows no pages
            return
        yield from items
        seen, before = seen + len(items), ids


def _mark(api: RegistrationApi, item: Mapping[str, Any]) -> str | None:
    """Read the registration that an item names; None if it names none that can be read."""
    mark = (item.get("properties") or {}).get(REGISTRATION_PROPERTY)
    if mark is None:
        try:
            mark = api.get_properties(str(item["part_number"])).get(REGISTRATION_PROPERTY)
        except (NotFoundError, ServerFaultError):
            return None
    return str(mark) if mark is not None else None


def _time(value: Any) -> float | None:
    try:
        made = value if isinstance(value, datetime) else datetime.fromisoformat(str(value))
    except ValueError:
        return None
    return (made if made.tzinfo else made.replace(tzinfo=UTC)).timestamp()


def register_standard(
    proposal: Proposal, api: RegistrationApi, *, schema: str, memory: Memory | None = None
) -> Registration:
    """Register a standard part: join the item that the server has, or make one. Writes no file.

    Repeating it is harmless, because the derived UUID is the key of the request.
    """
    entry = proposal.entry
    uuid, designation = entry.silo_uuid or "", entry.standard or ""
    memory = memory or standard_item_memory()
    try:
        item = api.get_item_by_uuid(uuid) or by_description(designation, api)
        existing = item is not None
        if item is None:
            item = api.create_item(
                schema,
                proposal.category,
                designation,
                item_type=proposal.item_type,
                properties={"standard": designation, **proposal.supply},
                idempotency_key=uuid,
                **_sourcing(proposal),
            )
        item_id = str(item["id"])
        if item_id.lower() != uuid.lower():
            memory.remember(server_of(api), {uuid: item_id})
    except SiloError as error:
        return Registration(proposal, error=error)
    return Registration(proposal, part_number=str(item["part_number"]), item_id=item_id, found=existing)
