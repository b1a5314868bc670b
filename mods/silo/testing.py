# SPDX-License-Identifier: LGPL-2.1-or-later
"""For tests, ours and those of scripts that use silo-mod: a Silo in memory. No other package imports it.

What :class:`silo.testing.FakeSilo` holds, and how it changes: items, revisions, BOMs, the event log.

``FakeSilo``: a Silo in memory with the methods of ``SiloClient``, for tests without a server.

It follows the same rules (the merge is :func:`silo.bom.compare.merge.plan_merge`, which the server uses
too), and one contract suite runs over it and over the embedded server. ``before`` and ``after`` are called
with the method's name around each change: raise there what the network or a crash would do, before or after
it acted. The file of a commit counts as a model, whatever its bytes are: a test need not make one.
"""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Self
from uuid import uuid4

from silo.api.boms import LineBody
from silo.api.caller import as_json, body
from silo.api.files import DocumentId, Origin
from silo.api.items import ItemBody, ItemChanges, LookAlike
from silo.api.merging import result_of
from silo.api.multipart import Progress
from silo.api.sse import MERGE, STATE, ServerEvent
from silo.api.transport import Cancel, stop_if
from silo.api.wire import (
    Attachment,
    BomLine,
    Document,
    HeldBom,
    HeldItem,
    HeldReport,
    Item,
    KnownContent,
    LastSync,
    LeftOutPart,
    MergeEvent,
    MergeRequest,
    MergeResult,
    ProductSummary,
    Release,
    Revision,
    ServerState,
    User,
)
from silo.bom.compare.answer import summary
from silo.bom.compare.base_revision import base_revision_of, would_undo
from silo.bom.compare.merge import apply_merge, plan_merge
from silo.bom.errors import (
    ConflictError,
    CycleError,
    DocumentError,
    NewerRevisionError,
    NotFoundError,
    ReadOnlyError,
    RejectedError,
    VersionConflictError,
)
from silo.bom.find_numbers import NewLine, give_numbers
from silo.bom.left_out import Reason, remembered, what_holds
from silo.bom.text import name_key
from silo.bom.units import counts_pieces
from silo.bom.walk.identity import as_uuid
from silo.file_kind import ATTACHMENT_KINDS, MODEL, kind_of

__all__ = ["FakeSilo"]


CATEGORIES = {
    "A01": "Mechanical assembly",
    "C01": "Adhesives and thread lockers",
    "F01": "Screws and bolts",
    "M01": "Machined parts",
    "X99": "Other",
}


@dataclass
class Stored:
    """An item with all that hangs on it."""

    item: Item
    revisions: list[Revision] = field(default_factory=list)
    files: dict[int, bytes] = field(default_factory=dict)
    held: list[HeldItem] = field(default_factory=list)  # what is in its newest file
    became: str = ""  # the document that its file is now
    attached: list[str] = field(default_factory=list)  # the documents of its attachments
    kind: str = MODEL  # of a document
    lines: list[dict[str, Any]] = field(default_factory=list)
    gone: dict[str, str] = field(default_factory=dict)  # find number → part of the lines that were removed

    @property
    def newest(self) -> Revision | None:
        """Return the newest revision with a file; None if it has none."""
        return next((revision for revision in reversed(self.revisions) if revision.file_checksum), None)

    def search_text(self) -> str:
        """Return the text in which a search looks: number, name, and the hashes of its files."""
        return "\n".join((self.item.part_number, self.item.name, *self.hashes())).casefold()

    def hashes(self) -> list[str]:
        """Return the known SHA-256 of its files."""
        checksums = [self.item.properties.get("file_sha256"), *(r.file_checksum for r in self.revisions)]
        return [str(checksum).removeprefix("sha256:") for checksum in checksums if checksum]


def check_base(stored: Stored, base: int | None, checksum: str | None) -> None:
    """Raise :class:`NewerRevisionError` for a file that would undo the newest one."""
    newest = stored.newest
    if newest is None or not would_undo(newest, base, checksum):
        return
    raise NewerRevisionError(
        f"{newest.created_by} committed revision {newest.revision_number} of {stored.item.part_number}",
        newest.model_dump(mode="json"),
    )


def check_document(stored: Stored, base: int | None, checksum: str | None) -> None:
    """Check the same for the BOM of a file."""
    same = [r.revision_number for r in stored.revisions if checksum and r.file_checksum == checksum]
    check_base(stored, base_revision_of(base, checksum, max(same, default=None)), checksum)


def _nothing(name: str) -> None:
    return None


class FakeStore:
    """The memory of a fake Silo. ``before`` and ``after`` see the name of each change; they may raise."""

    user = "designer"

    def __init__(
        self, base_url: str = "http://silo.invalid", *, clock: Callable[[], datetime] | None = None
    ) -> None:
        self.base_url = base_url
        self.mode = "normal"
        self.freecad = ""
        self.before: Callable[[str], None] = _nothing
        self.after: Callable[[str], None] = _nothing
        self.items: dict[str, Stored] = {}  # by case-folded part number
        self.documents: dict[str, Stored] = {}  # those without an item, by UUID
        self.log: list[ServerEvent] = []
        self.releases: dict[tuple[str, str], Release] = {}  # (part number, label) → what was frozen
        self.answers: dict[tuple[str, str], tuple[Any, Any]] = {}  # (subject, key) → (request, answer)
        self.models: dict[str, dict[str, bytes]] = {}  # SHA-256 of a file → geometry, structure
        self._clock = clock or (lambda: datetime.now(UTC))
        self._lock = threading.RLock()
        self._news = threading.Condition(self._lock)

    def _earlier(self, subject: str, key: str | None, request: Any) -> Any:
        """Return the answer to the same earlier request; ConflictError if another request had its key."""
        asked, answer = self.answers.get((subject, key or ""), (request, None))
        if asked != request:
            raise ConflictError(f"{key!r} was used before for another request")
        return answer

    def _keep(self, subject: str, key: str | None, request: Any, answer: Any) -> None:
        if key:
            self.answers[subject, key] = (request, answer)

    @contextmanager
    def _changing(self, name: str, *, reads: bool = False) -> Iterator[None]:
        self.before(name)
        with self._lock:
            if self.mode == "read-only" and not reads:
                raise ReadOnlyError(f"{self.base_url} takes no changes now; it can be sent later")
            yield
        self.after(name)

    def _stored(self, part_number: str, *, make: bool = False) -> Stored:
        if isinstance(part_number, DocumentId):
            return self._document(as_uuid(part_number), make=make)
        stored = self.items.get(part_number.casefold())
        if stored is None:
            raise NotFoundError(f"{self.base_url} has no item {part_number}")
        return stored

    def _document(self, uuid: str, *, make: bool) -> Stored:
        for stored in self.items.values():
            if stored.item.id.lower() == uuid:
                return stored
        if make and uuid not in self.documents:
            # It has no item; this is only a place for its revisions.
            self.documents[uuid] = Stored(Item(id=uuid, part_number=f"document {uuid}"))
        if uuid not in self.documents:
            raise NotFoundError(f"{self.base_url} has no document {uuid}")
        return self.documents[uuid]

    def _document_of(self, stored: Stored) -> Document | None:
        if (newest := stored.newest) is None:
            return None
        own = stored.item.id not in self.documents
        numbers = {item.item.id: item.item.part_number for item in self.items.values()}
        held = [held_item for held_item in stored.held if held_item.item in numbers]
        if own and stored.item.id not in {held_item.item for held_item in held}:
            held.append(HeldItem(item=stored.item.id))
        return Document(
            id=stored.item.id,
            part_number=stored.item.part_number if own else "",
            holds=[
                held_item.model_copy(update={"part_number": numbers[held_item.item]}) for held_item in held
            ],
            **newest.model_dump(exclude={"properties", "labels", "status", "links"}),
        )

    def _files(self) -> dict[str, Stored]:
        return {stored.item.id: stored for stored in (*self.items.values(), *self.documents.values())}

    def _checksums(self) -> set[str]:
        stored_models = (stored for stored in self._files().values() if stored.kind == MODEL)
        revisions = (revision for stored in stored_models for revision in stored.revisions)
        return {revision.file_checksum for revision in revisions if revision.file_checksum}

    def _next_number(self, category: str) -> str:
        if category not in CATEGORIES:
            raise RejectedError(f"there is no category {category}; wanted one of {', '.join(CATEGORIES)}")
        serial = 1
        while f"{category}-{serial:04d}".casefold() in self.items:
            serial += 1
        return f"{category}-{serial:04d}"

    def _find_line(self, part_number: str, child: str) -> dict[str, Any]:
        for line in self._stored(part_number).lines:
            if line["child_part_number"].casefold() == child.casefold():
                return line
        raise NotFoundError(f"{child} is not on the BOM of {part_number}")

    def _line(self, stored: Stored, line: Mapping[str, Any]) -> BomLine:
        child = self._stored(line["child_part_number"]).item
        return BomLine.model_validate(
            {
                **line,
                "parent_part_number": stored.item.part_number,
                "child_id": child.id,
                "child_name": child.name,
                "child_description": child.description,
                "child_item_type": child.item_type,
            }
        )

    def _write(
        self, stored: Stored, lines: list[dict[str, Any]] | None, event: str, data: dict[str, Any]
    ) -> None:
        if lines is not None:
            stored.lines = numbered(stored, lines)
            stored.item = stored.item.model_copy(update={"bom_version": (stored.item.bom_version or 0) + 1})
        self._announce(event, data)

    def _revise(
        self,
        stored: Stored,
        comment: str,
        properties: Mapping[str, Any] | None,
        content: bytes | None = None,
        file_name: str | None = None,
        origin: Origin | None = None,
    ) -> Revision:
        all_properties = (
            {**stored.item.properties, **(properties or {})} if content is not None else properties or {}
        )
        as_json(all_properties)
        revision = Revision(
            revision_number=len(stored.revisions) + 1,
            comment=comment,
            properties=dict(all_properties),
            file_name=file_name,
            file_checksum=hashlib.sha256(content).hexdigest() if content is not None else None,
            file_size=len(content) if content is not None else None,
            created_by=self.user,
            created_at=self._clock(),
            base_revision=origin.base_revision if origin else None,
            file_path=(origin.file_path or None) if origin else None,
            links=(origin.links or []) if origin else [],
            kind=None if content is None else stored.kind,
        )
        stored.revisions.append(revision)
        if content is not None:
            stored.files[revision.revision_number] = content
            stored.held = list((origin.items if origin else None) or ())
            former = origin.former.lower() if origin else ""
            stored.became = ""
            if former and former != stored.item.id.lower() and (before := self._files().get(former)):
                before.became = stored.item.id
        stored.item = stored.item.model_copy(
            update={"current_revision": revision.revision_number, "properties": dict(all_properties)}
        )
        number = stored.item.part_number
        data = {
            "part_number": number,
            "id": stored.item.id,
            "revision_number": revision.revision_number,
            "comment": comment,
            "file_name": file_name,
            "user": self.user,
        }
        if stored.item.id in self.documents:
            self._announce("document.revised", {"document": stored.item.id, **data})
        else:
            self._announce("revision.created", data)
        return revision

    def _announce(self, kind: str, data: dict[str, Any]) -> None:
        merge = MergeEvent.model_validate(data) if kind == MERGE else None
        with self._news:
            self.log.append(ServerEvent(str(len(self.log) + 1), kind, data, merge))
            self._news.notify_all()


class FakeStream:
    """An open stream of a :class:`FakeSilo`; waits for what is new until it is closed."""

    def __init__(self, news: threading.Condition, log: list[ServerEvent], start: int) -> None:
        self._news, self._log, self._next = news, log, start
        self._closed = False

    @property
    def last_event_id(self) -> str | None:
        return str(self._next)

    def __iter__(self) -> Iterator[ServerEvent]:
        while True:
            with self._news:
                self._news.wait_for(lambda: self._closed or self._next < len(self._log))
                if self._closed:
                    return
                event = self._log[self._next]
                self._next += 1
            yield event

    def close(self) -> None:
        with self._news:
            self._closed = True
            self._news.notify_all()


Bom = Callable[[str], Sequence[BomLine]]


def entries_of(request: MergeRequest, numbers: Mapping[str, str]) -> list[dict[str, Any]]:
    """Return the request's entries under the server's own numbers (``numbers``: case-folded → number).

    Raises :class:`RejectedError` with all unknown children at once, each with its index.
    """
    problems = [
        f"entries[{index}].child_part_number: {entry.child_part_number!r} does not exist on this server"
        for index, entry in enumerate(request.entries)
        if entry.child_part_number.casefold() not in numbers
    ]
    if problems:
        raise RejectedError(
            f"{len(problems)} of the entries cannot be merged: {'; '.join(problems)}", problems
        )
    return [
        {
            "child_part_number": numbers[entry.child_part_number.casefold()],
            "quantity": entry.quantity,
            "components": [component.model_dump() for component in entry.components or ()],
            "find_number": entry.find_number,
        }
        for entry in request.entries
    ]


def missing_of(request: MergeRequest) -> list[tuple[str, str]]:
    """Return the components that are missing in the assembly."""
    return [(part.file, part.object) for part in request.left_out or () if part.reason == Reason.MISSING]


def with_components(
    lines: Sequence[Mapping[str, Any]], entries: Iterable[Mapping[str, Any]], kept: Iterable[str]
) -> list[dict[str, Any]]:
    """Add to each line its components in the CAD model."""
    before = {line["child_part_number"]: line.get("components", []) for line in lines}
    after = remembered(before, entries, kept)
    return [{**line, "components": after.get(line["child_part_number"], [])} for line in lines]


def numbered(stored: Stored, lines: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Give each new line its find number, as a server does."""
    before = {line["child_part_number"]: line for line in stored.lines}
    after = {line["child_part_number"] for line in lines}
    for number, line in before.items():
        if number not in after and line.get("find_number"):
            stored.gone[line["find_number"]] = number
    new = [line for line in lines if line["child_part_number"] not in before]
    there = [line["find_number"] for line in lines if line.get("find_number") and line not in new]
    asking = [
        NewLine(line["child_part_number"], line.get("find_number"), line["source"] == "manual")
        for line in new
    ]
    numbers, stored.gone = give_numbers(asking, there, stored.gone)
    given = {line["child_part_number"]: number for line, number in zip(new, numbers, strict=True)}
    return [
        {**line, "find_number": given.get(line["child_part_number"], line.get("find_number"))}
        for line in lines
    ]


def check_cycle(bom: Bom, parent: str, children: Sequence[str]) -> None:
    """Raise :class:`CycleError` if one of the children contains the parent."""
    for child in children:
        path = _path_to(bom, child, parent, (parent,))
        if path is not None:
            raise CycleError(path)


def _path_to(bom: Bom, here: str, goal: str, path: tuple[str, ...]) -> tuple[str, ...] | None:
    path = (*path, here)
    if here == goal:
        return path
    for line in bom(here):
        found = _path_to(bom, line.child_part_number, goal, path)
        if found is not None:
            return found
    return None


class FakeSilo(FakeStore):
    """A Silo in memory. ``items`` and ``log`` may be looked at; :meth:`set_mode` makes it read-only."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        return None

    # -- the server itself ------------------------------------------------------------------------------

    def web_url(self, path: str, /) -> str:
        return f"{self.base_url}/{path.lstrip('/')}"

    def whoami(self) -> User:
        return User(username=self.user, display_name="Designer", role="editor")

    def ready(self) -> ServerState:
        self.before("ready")
        return ServerState(mode=self.mode, status="ready", freecad=self.freecad)

    def set_mode(self, mode: str) -> None:
        """Set ``normal``, ``read-only`` or ``degraded``, and announce it as the server does."""
        with self._lock:
            self.mode = mode
            self._announce(STATE, {"mode": mode})

    def open_events(self, last_event_id: str | None = None) -> FakeStream:
        """Open the stream of events after ``last_event_id``; None: only new ones."""
        self.before("open_events")
        with self._lock:
            start = len(self.log) if last_event_id is None else min(int(last_event_id), len(self.log))
        return FakeStream(self._news, self.log, start)

    # -- items ------------------------------------------------------------------------------------------

    def get_item_by_uuid(self, uuid: str, /) -> Item | None:
        return self.get_items_by_uuid([uuid]).get(uuid)

    def get_items_by_uuid(
        self, uuids: Iterable[str], /, *, cancelled: Cancel | None = None
    ) -> dict[str, Item]:
        stop_if(cancelled)
        items = {as_uuid(stored.item.id): stored.item for stored in self.items.values()}
        return {uuid: items[key] for uuid in uuids if (key := as_uuid(uuid)) in items}

    def get_item(self, part_number: str, /) -> Item:
        return self._stored(part_number).item

    def get_properties(self, part_number: str, /) -> dict[str, Any]:
        return dict(self._stored(part_number).item.properties)

    def search_items(
        self, query: str = "", *, item_type: str | None = None, limit: int = 50, offset: int = 0
    ) -> list[Item]:
        words = query.casefold().removeprefix("sha256:").split()
        items = [
            stored.item
            for _, stored in sorted(self.items.items())
            if all(word in stored.search_text() for word in words)
            and item_type in (None, stored.item.item_type)
        ]
        return items[offset : offset + limit]

    def find_look_alikes(
        self, wanted: Iterable[tuple[str, str]], /, *, cancelled: Cancel | None = None
    ) -> dict[tuple[str, str], list[LookAlike]]:
        return {(name, digest): self._look_alikes(name, digest) for name, digest in wanted}

    def _look_alikes(self, name: str, digest: str) -> list[LookAlike]:
        matches = []
        for _, stored in sorted(self.items.items()):
            item, same_file = stored.item, bool(digest) and digest in stored.hashes()
            if same_file or (name and name_key(item.name) == name_key(name)):
                matches.append(
                    LookAlike(id=item.id, part_number=item.part_number, name=item.name, same_file=same_file)
                )
        return sorted(matches, key=lambda match: not match.same_file)[:12]

    def create_item(
        self,
        schema: str,
        category: str,
        description: str = "",
        *,
        name: str | None = None,
        item_type: str = "part",
        properties: Mapping[str, Any] | None = None,
        projects: Sequence[str] | None = None,
        idempotency_key: str | None = None,
        **texts: str | None,
    ) -> Item:
        values = {"schema": schema, "category": category, "item_type": item_type, **texts}
        body(ItemBody, values, "an item")
        with self._changing("create_item"):
            request = (values, description, name, properties)
            made = self._earlier("item", idempotency_key, request)
            if made is not None:
                return self.get_items_by_uuid([made])[made]
            if idempotency_key and self.get_item_by_uuid(idempotency_key) is not None:
                raise ConflictError(f"id: {idempotency_key} is that of another item")
            item = Item(
                last_sync=LastSync(),
                id=idempotency_key or str(uuid4()),
                part_number=self._next_number(category),
                name=name or description,
                description=description or name or "",
                item_type=item_type,
                **texts,  # type: ignore[arg-type]  # pydantic checks them
                category=category,
                bom_version=0,
                created_at=self._clock(),
            )
            stored = self.items[item.part_number.casefold()] = Stored(item)
            if properties:
                self._revise(stored, "created", properties)
            self._announce("item.created", {"part_number": item.part_number, "item_type": item_type})
            self._keep("item", idempotency_key, request, item.id)
            return stored.item

    def archive_item(self, part_number: str, /) -> None:
        with self._changing("archive_item"):
            del self.items[self._stored(part_number).item.part_number.casefold()]
            self._announce("item.deleted", {"part_number": part_number})

    def update_item(self, part_number: str, /, **changes: Any) -> Item:
        wanted = body(ItemChanges, changes, "an item")
        with self._changing("update_item"):
            stored = self._stored(part_number)
            given = wanted.model_dump(exclude_none=True, exclude={"properties", "comment"})
            number = given.get("part_number", stored.item.part_number)
            if number.casefold() in set(self.items) - {part_number.casefold()}:
                raise ConflictError(f"{number} is taken by another item")
            if wanted.properties is not None and wanted.properties != stored.item.properties:
                self._revise(stored, wanted.comment or "", wanted.properties)
            stored.item = stored.item.model_copy(update=given)
            self.items[number.casefold()] = self.items.pop(part_number.casefold())
            self._announce("item.updated", {"part_number": number, "revision": stored.item.current_revision})
            return stored.item

    def generate_part_number(self, schema: str, category: str) -> str:
        return self._next_number(category)

    def get_schema(self, name: str = "kindred-rd") -> dict[str, Any]:
        if name != "kindred-rd":
            raise NotFoundError(f"there is no schema {name}")
        return {"name": name, "separator": "-", "segments": [{"name": "category", "values": CATEGORIES}]}

    def find_schema(self, wanted: str = "kindred-rd") -> str:
        return wanted if wanted == "kindred-rd" or not wanted else str(self.get_schema(wanted)["name"])

    def categories(self, name: str = "kindred-rd") -> dict[str, str]:
        return dict(self.get_schema(name)["segments"][0]["values"])

    # -- BOM --------------------------------------------------------------------------------------------

    def get_bom(self, part_number: str, /) -> list[BomLine]:
        stored = self._stored(part_number)
        return [self._line(stored, line) for line in stored.lines]

    def get_boms(
        self, part_numbers: Iterable[str], /, *, cancelled: Cancel | None = None
    ) -> dict[str, list[BomLine]]:
        stop_if(cancelled)
        self.before("get_boms")
        numbers = [number for number in part_numbers if number.casefold() in self.items]
        return {number: self.get_bom(number) for number in numbers}

    def get_bom_version(self, part_number: str, /) -> str | None:
        return str(self._stored(part_number).item.bom_version)

    def get_summary(self, part_number: str, /) -> ProductSummary | None:
        """Return None: this Silo keeps no summaries."""
        return None

    def add_bom_line(self, part_number: str, child: str, /, **values: Any) -> BomLine:
        line = body(LineBody, {"quantity": 1, **values, "child_part_number": child}, "a BOM line")
        with self._changing("add_bom_line"):
            stored, number = self._stored(part_number), self.get_item(child).part_number
            if any(line_there["child_part_number"] == number for line_there in stored.lines):
                raise ConflictError(f"{number} is in the BOM of {part_number} already")
            check_cycle(self.get_bom, stored.item.part_number, [number])
            new = {**line.model_dump(exclude_none=True), "child_part_number": number, "source": "manual"}
            self._write(stored, [*stored.lines, new], "bom.updated", {"item": stored.item.part_number})
            return self._line(stored, stored.lines[-1])

    def update_bom_line(self, part_number: str, child: str, /, **changes: Any) -> BomLine:
        given = body(LineBody, changes, "a BOM line").model_dump(exclude_none=True)
        with self._changing("update_bom_line"):
            stored, before = self._stored(part_number), self._find_line(part_number, child)
            after = {**before, **given}
            if after["quantity"] != before["quantity"] or not counts_pieces(after.get("unit")):
                # If a user sets quantity or unit, the line is theirs; a merge reports it as a conflict.
                after |= {"source": "manual", "unreferenced_since": None}
            lines = [after if line is before else line for line in stored.lines]
            self._write(stored, lines, "bom.updated", {"item": stored.item.part_number})
            return self._line(stored, after)

    def remove_bom_line(self, part_number: str, child: str, /) -> None:
        with self._changing("remove_bom_line"):
            stored, gone = self._stored(part_number), self._find_line(part_number, child)
            lines = [line for line in stored.lines if line is not gone]
            self._write(stored, lines, "bom.updated", {"item": stored.item.part_number})

    def merge_bom(
        self,
        part_number: str,
        request: MergeRequest,
        /,
        *,
        if_match: int | str | None = None,
        cancelled: Cancel | None = None,
    ) -> MergeResult:
        stop_if(cancelled)
        with self._changing("merge_bom", reads=request.dry_run):
            stored = self._stored(part_number)
            answer: MergeResult | None = self._earlier(f"merge {stored.item.id}", request.sync_id, request)
            if answer is not None:
                return answer
            if if_match is not None and str(if_match).strip('"') != str(stored.item.bom_version):
                raise VersionConflictError(
                    f"the BOM of {part_number} is at version {stored.item.bom_version}"
                )
            if request.document is not None:
                check_document(stored, request.document.revision, request.document.sha256)
            return self._merge(stored, request)

    def hold_bom(
        self, part_number: str, report: HeldReport, /, *, cancelled: Cancel | None = None
    ) -> HeldBom:
        stop_if(cancelled)
        with self._changing("hold_bom"):
            stored = self._stored(part_number)
            last = stored.item.last_sync or LastSync()
            file = report.document.file if report.document is not None else None
            since = last.held.since if last.held is not None else self._clock()
            held = HeldBom(since=since, user=self.user, left_out=report.left_out, document_file=file)
            message = f"held by {self.user}: {what_holds(part.model_dump() for part in held.left_out)}"
            gaps = [part for part in last.left_out if part.reason != Reason.HELD]
            gaps.append(LeftOutPart(reason=Reason.HELD, message=message))
            last = last.model_copy(update={"held": held, "left_out": gaps})
            stored.item = stored.item.model_copy(update={"last_sync": last})
            return held

    def _merge(self, stored: Stored, request: MergeRequest) -> MergeResult:
        number = stored.item.part_number
        numbers = {key: other.item.part_number for key, other in self.items.items()}
        entries = entries_of(request, numbers)
        plan = plan_merge(entries, stored.lines, missing_of(request))
        check_cycle(self.get_bom, number, [change.part_number for change in plan.diff.added])
        result = result_of(plan.diff, number, request)
        if not request.dry_run:
            event = MergeEvent(
                item=number,
                user=self.user,
                timestamp=self._clock(),
                summary=summary(plan.diff),
                diff=result.diff,
                resolve_url=result.resolve_url,
                sync_id=request.sync_id,
                left_out=result.left_out,
            )
            lines = apply_merge(stored.lines, plan, self._clock().isoformat()) if plan.writes else None
            proposed = {entry["child_part_number"]: entry["find_number"] for entry in entries[::-1]}
            added = {change.part_number for change in plan.diff.added}
            for line in lines or ():
                if line["child_part_number"] in added:
                    line["find_number"] = proposed[line["child_part_number"]]
            self._write(stored, lines, MERGE, event.model_dump(mode="json", exclude_none=True))
            kept = [change.part_number for change in plan.diff.kept]
            stored.lines = with_components(stored.lines, entries, kept)
            last = LastSync(at=self._clock(), left_out=request.left_out or [])
            stored.item = stored.item.model_copy(update={"last_sync": last})
            self._keep(f"merge {stored.item.id}", request.sync_id, request, result)
        return result

    # -- files ------------------------------------------------------------------------------------------

    def lacking_models(self, sha256: Iterable[str], /) -> set[str]:
        return {
            checksum
            for checksum in self._checksums().intersection(sha256)
            if len(self.models.get(checksum, {})) < 2
        }

    def put_model(self, sha256: str, part: str, body: bytes, /) -> None:
        if sha256 not in self._checksums():
            raise NotFoundError(f"no revision has a file with the SHA-256 {sha256}; commit the file first")
        self.models.setdefault(sha256, {})[part] = body

    def get_documents(self, uuids: Iterable[str], /) -> dict[str, Document]:
        files, wanted = self._files(), [uuid.lower() for uuid in uuids]
        documents = [self._document_of(files[uuid]) for uuid in wanted if uuid in files]
        return {document.id: document for document in documents if document is not None}

    def get_contents(self, sha256: Iterable[str], /) -> list[KnownContent]:
        wanted, files, found = set(sha256), self._files(), list[KnownContent]()
        for stored in files.values():
            now, seen = stored, set[str]()
            while now.became in files and now.item.id not in seen:
                seen.add(now.item.id)
                now = files[now.became]
            number = "" if now.item.id in self.documents else now.item.part_number
            found += [
                KnownContent(
                    sha256=revision.file_checksum or "",
                    document=stored.item.id,
                    revision_number=revision.revision_number,
                    file_path=revision.file_path,
                    now=now.item.id,
                    part_number=number,
                )
                for revision in reversed(stored.revisions)
                if revision.file_checksum in wanted
            ]
        return found

    def get_document(self, uuid: str, /) -> Document:
        stored = self._document(uuid.lower(), make=False)
        now, newest = self._document_of(stored), stored.newest
        if now is None or newest is None:
            raise NotFoundError(f"{self.base_url} has no document {uuid}")
        files = self._files()
        links = {key: self._targets(other) for key, other in files.items()}
        linked = [self._document_of(files[link]) for link in links[stored.item.id] if link in files]
        users = [self._document_of(files[key]) for key, targets in links.items() if stored.item.id in targets]
        return now.model_copy(
            update={
                "links": newest.links,
                "linked": [document for document in linked if document is not None],
                "used_by": [user for user in users if user is not None],
            }
        )

    def _targets(self, stored: Stored) -> set[str]:
        newest = stored.newest
        return {link.document or link.item for link in newest.links} if newest else set()

    def documents_of(self, part_number: str, /) -> list[Document]:
        item = self.get_item(part_number)
        documents = filter(None, map(self._document_of, self._files().values()))
        return sorted(
            (document for document in documents if item.id in {held.item for held in document.holds}),
            key=lambda document: document.id != item.id,
        )

    def get_release(self, part_number: str, label: str, /) -> Release:
        item = self.get_item(part_number)
        release = self.releases.get((item.part_number, label))
        if release is None:
            raise NotFoundError(f"{item.part_number} has no revision {label!r}")
        return release

    def revisions(self, part_number: str, /, *, newest: int | None = None, after: int = 0) -> list[Revision]:
        self.before("revisions")
        newest_first = reversed(self._stored(part_number).revisions)
        return [revision for revision in newest_first if revision.revision_number > after][:newest]

    def get_revision(self, part_number: str, number: int, /) -> Revision:
        for revision in self._stored(part_number).revisions:
            if revision.revision_number == number:
                return revision
        raise NotFoundError(f"{part_number} has no revision {number}")

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
        sha256: str | None = None,
        origin: Origin | None = None,
        cancelled: Cancel | None = None,
    ) -> Revision:
        stop_if(cancelled)
        try:
            content = Path(path).read_bytes()
        except OSError as error:
            raise DocumentError(str(path), f"the file cannot be read ({error.strerror})") from error
        if on_progress is not None:
            on_progress(len(content), len(content))
        if sha256 and hashlib.sha256(content).hexdigest() != sha256:
            raise RejectedError(f"sha256: {part_number}: another content arrived than was sent")
        with self._changing("upload_file"):
            stored = self._stored(part_number, make=True)
            request = (content, comment, properties, file_name or Path(path).name, origin)
            made: Revision | None = self._earlier(f"upload {stored.item.id}", idempotency_key, request)
            if made is not None:
                return made
            check_base(stored, origin.base_revision if origin else None, hashlib.sha256(content).hexdigest())
            revision = self._revise(
                stored, comment, properties, content, file_name or Path(path).name, origin
            )
            self._keep(f"upload {stored.item.id}", idempotency_key, request, revision)
            return revision

    def attachments(self, part_number: str, /) -> list[Attachment]:
        shown = []
        for uuid in self._stored(part_number).attached:
            document = self.documents[uuid]
            newest = document.revisions[-1]
            values = newest.model_dump(
                exclude_none=True, exclude={"properties", "links", "draft", "document"}
            )
            about = {"id": uuid, "part_number": part_number, "kind": document.kind}
            shown.append(Attachment.model_validate(values | about))
        return shown

    def attach_file(
        self,
        part_number: str,
        path: Path | str,
        file_name: str,
        *,
        kind: str = "",
        cancelled: Cancel | None = None,
    ) -> None:
        stop_if(cancelled)
        content, kind = Path(path).read_bytes(), kind or kind_of(path, file_name)
        if kind not in ATTACHMENT_KINDS:
            raise RejectedError(f"kind: {file_name} is a {kind}, and no attachment")
        with self._changing("attach_file"):
            stored = self._stored(part_number)
            for uuid in stored.attached:
                document = self.documents[uuid]
                if (document.kind, document.revisions[-1].file_name) == (kind, file_name):
                    break
            else:
                uuid = str(uuid4())
                document = Stored(Item(id=uuid, part_number=f"document {uuid}"), kind=kind)
                self.documents[uuid] = document
                stored.attached.append(uuid)
            self._revise(document, "", None, content, file_name)

    def download_file(
        self,
        part_number: str,
        path: Path | str,
        revision: int | None = None,
        on_progress: Progress | None = None,
        *,
        cancelled: Cancel | None = None,
    ) -> str:
        stop_if(cancelled)
        files = self._stored(part_number).files
        content = files.get(revision if revision is not None else max(files, default=0))
        if content is None:
            raise NotFoundError(f"{part_number} has no such file")
        Path(path).write_bytes(content)
        if on_progress is not None:
            on_progress(len(content), len(content))
        return hashlib.sha256(content).hexdigest()
