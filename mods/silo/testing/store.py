# SPDX-License-Identifier: LGPL-2.1-or-later
"""What :class:`silo.testing.FakeSilo` holds, and how it changes: items, revisions, BOMs, the event log."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

from silo.api.files import Origin
from silo.api.sse import MERGE, ServerEvent
from silo.api.transport import as_json
from silo.api.wire import (
    BomLine,
    Item,
    MergeEvent,
    MergeRequest,
    MergeResult,
    Revision,
)
from silo.bom.errors import CycleError, NewerRevisionError, NotFoundError, ReadOnlyError, RejectedError
from silo.bom.left_out import Reason, remembered
from silo.bom.merge import base_of, would_undo

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
    lines: list[dict[str, Any]] = field(default_factory=list)
    answers: dict[str, tuple[list[tuple[str, float]], MergeResult]] = field(default_factory=dict)
    uploads: dict[str, tuple[int, str]] = field(default_factory=dict)  # key → (revision, hash)

    def search_text(self) -> str:
        """What a search looks into: number, name, and the hashes of its files."""
        return "\n".join((self.item.part_number, self.item.name, *self.hashes())).casefold()

    def hashes(self) -> list[str]:
        """The SHA-256 of its files, as far as they are known."""
        known = [self.item.properties.get("file_sha256"), *(r.file_checksum for r in self.revisions)]
        return [str(one).removeprefix("sha256:") for one in known if one]


def check_base(stored: Stored, base: int | None, checksum: str | None) -> None:
    """Raise :class:`NewerRevisionError` for a file that would undo the newest one."""
    newest = next((r for r in reversed(stored.revisions) if r.file_checksum), None)
    if newest is None or not would_undo(newest, base, checksum):
        return
    raise NewerRevisionError(
        f"{newest.created_by} committed revision {newest.revision_number} of {stored.item.part_number}",
        newest.model_dump(mode="json"),
    )


def check_document(stored: Stored, base: int | None, checksum: str | None) -> None:
    """The same for the BOM of a file."""
    same = [r.revision_number for r in stored.revisions if checksum and r.file_checksum == checksum]
    check_base(stored, base_of(base, checksum, max(same, default=None)), checksum)


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
        self.before: Callable[[str], None] = _nothing
        self.after: Callable[[str], None] = _nothing
        self.items: dict[str, Stored] = {}  # by case-folded part number
        self.log: list[ServerEvent] = []
        self._clock = clock or (lambda: datetime.now(UTC))
        self._lock = threading.RLock()
        self._news = threading.Condition(self._lock)

    @contextmanager
    def _changing(self, name: str, *, reads: bool = False) -> Iterator[None]:
        self.before(name)
        with self._lock:
            if self.mode == "read-only" and not reads:
                raise ReadOnlyError(f"{self.base_url} takes no changes now; it can be sent later")
            yield
        self.after(name)

    def _stored(self, part_number: str) -> Stored:
        stored = self.items.get(part_number.casefold())
        if stored is None:
            raise NotFoundError(f"{self.base_url} has no item {part_number}")
        return stored

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
            stored.lines = lines
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
        known = {**stored.item.properties, **(properties or {})} if content is not None else properties or {}
        as_json(known)
        revision = Revision(
            revision_number=len(stored.revisions) + 1,
            comment=comment,
            properties=dict(known),
            file_name=file_name,
            file_checksum=hashlib.sha256(content).hexdigest() if content is not None else None,
            file_size=len(content) if content is not None else None,
            created_by=self.user,
            created_at=self._clock(),
            base_revision=origin.base_revision if origin else None,
            file_path=(origin.file_path or None) if origin else None,
            links=(origin.links or []) if origin else [],
        )
        stored.revisions.append(revision)
        if content is not None:
            stored.files[revision.revision_number] = content
        stored.item = stored.item.model_copy(
            update={"current_revision": revision.revision_number, "properties": dict(known)}
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
