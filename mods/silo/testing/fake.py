# SPDX-License-Identifier: LGPL-2.1-or-later
"""``FakeSilo``: a Silo in memory with the methods of ``SiloClient``, for tests without a server.

It follows the same rules (the merge is :func:`silo.bom.merge.plan_merge`, which the server uses too), and one
contract suite runs over it and over the embedded server. ``before`` and ``after`` are called with the
method's name around each change: raise there what the network or a crash would do, before or after it acted.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Self
from uuid import UUID, uuid4

from silo.api.boms import LineBody
from silo.api.caller import body
from silo.api.files import Origin, Progress
from silo.api.items import ItemBody, ItemChanges, LookAlike
from silo.api.merging import result_of
from silo.api.sse import MERGE, STATE
from silo.api.transport import Cancel, stop_if
from silo.api.wire import (
    BomLine,
    Item,
    LastSync,
    MergeEvent,
    MergeRequest,
    MergeResult,
    Revision,
    ServerState,
    User,
    WhereUsedLine,
)
from silo.bom.errors import (
    ConflictError,
    DocumentError,
    NotFoundError,
    RejectedError,
    VersionConflictError,
)
from silo.bom.merge import apply_merge, plan_merge, summary
from silo.bom.naming import name_key
from silo.testing.store import (
    CATEGORIES,
    FakeStore,
    FakeStream,
    Stored,
    check_base,
    check_cycle,
    check_document,
    entries_of,
    missing_of,
    with_components,
)


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
        return ServerState(mode=self.mode, status="ready")

    def set_mode(self, mode: str) -> None:
        """``normal``, ``read-only`` or ``degraded``; announced as the server does."""
        with self._lock:
            self.mode = mode
            self._announce(STATE, {"mode": mode})

    def open_events(self, last_event_id: str | None = None) -> FakeStream:
        """The events after ``last_event_id``; None = only what is new."""
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
        known = {UUID(stored.item.id): stored.item for stored in self.items.values()}
        return {uuid: known[key] for uuid in uuids if (key := _uuid(uuid)) in known}

    def get_item(self, part_number: str, /) -> Item:
        return self._stored(part_number).item

    def get_properties(self, part_number: str, /) -> dict[str, Any]:
        return dict(self._stored(part_number).item.properties)

    def search_items(
        self, query: str = "", *, item_type: str | None = None, limit: int = 50, offset: int = 0
    ) -> list[Item]:
        words = query.casefold().removeprefix("sha256:").split()
        found = [
            stored.item
            for _, stored in sorted(self.items.items())
            if all(word in stored.search_text() for word in words)
            and item_type in (None, stored.item.item_type)
        ]
        return found[offset : offset + limit]

    def find_look_alikes(
        self, wanted: Iterable[tuple[str, str]], /, *, cancelled: Cancel | None = None
    ) -> dict[tuple[str, str], list[LookAlike]]:
        return {(name, digest): self._look_alikes(name, digest) for name, digest in wanted}

    def _look_alikes(self, name: str, digest: str) -> list[LookAlike]:
        found = []
        for _, stored in sorted(self.items.items()):
            item, same_file = stored.item, bool(digest) and digest in stored.hashes()
            if same_file or (name and name_key(item.name) == name_key(name)):
                found.append(
                    LookAlike(id=item.id, part_number=item.part_number, name=item.name, same_file=same_file)
                )
        return sorted(found, key=lambda one: not one.same_file)[:12]

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
        sourcing_type: str | None = None,
        long_description: str | None = None,
        idempotency_key: str | None = None,
    ) -> Item:
        values = {"schema": schema, "category": category, "item_type": item_type}
        body(ItemBody, values, "an item")
        with self._changing("create_item"):
            known = self.get_item_by_uuid(idempotency_key) if idempotency_key else None
            if known is not None:
                return known
            item = Item(
                last_sync=LastSync(),
                id=idempotency_key or str(uuid4()),
                part_number=self._next_number(category),
                name=name or description,
                description=description or name or "",
                item_type=item_type,
                sourcing_type=sourcing_type,
                long_description=long_description,
                category=category,
                bom_version=0,
                created_at=self._clock(),
            )
            stored = self.items[item.part_number.casefold()] = Stored(item)
            if properties:
                self._revise(stored, "created", properties)
            self._announce("item.created", {"part_number": item.part_number, "item_type": item_type})
            return stored.item

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
        known = [number for number in part_numbers if number.casefold() in self.items]
        return {number: self.get_bom(number) for number in known}

    def get_bom_version(self, part_number: str, /) -> str | None:
        return str(self._stored(part_number).item.bom_version)

    def where_used(self, part_number: str, /) -> list[WhereUsedLine]:
        number = self.get_item(part_number).part_number
        return [
            WhereUsedLine(
                parent_part_number=stored.item.part_number,
                parent_description=stored.item.description,
                quantity=line["quantity"],
                source=line["source"],
            )
            for _, stored in sorted(self.items.items())
            for line in stored.lines
            if line["child_part_number"] == number
        ]

    def add_bom_line(self, part_number: str, child: str, /, **values: Any) -> BomLine:
        line = body(LineBody, {"quantity": 1, **values, "child_part_number": child}, "a BOM line")
        with self._changing("add_bom_line"):
            stored, number = self._stored(part_number), self.get_item(child).part_number
            if any(known["child_part_number"] == number for known in stored.lines):
                raise ConflictError(f"{number} is in the BOM of {part_number} already")
            check_cycle(self.get_bom, stored.item.part_number, [number])
            new = {**line.model_dump(exclude_none=True), "child_part_number": number, "source": "manual"}
            self._write(stored, [*stored.lines, new], "bom.updated", {"item": stored.item.part_number})
            return self._line(stored, new)

    def update_bom_line(self, part_number: str, child: str, /, **changes: Any) -> BomLine:
        given = body(LineBody, changes, "a BOM line").model_dump(exclude_none=True)
        with self._changing("update_bom_line"):
            stored, before = self._stored(part_number), self._find_line(part_number, child)
            after = {**before, **given}
            if after["quantity"] != before["quantity"]:
                # A person's quantity is a person's line; a merge reports it as a conflict from now on.
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
            content = sorted((e.child_part_number.casefold(), e.quantity) for e in request.entries)
            if request.sync_id in stored.answers:
                asked, answer = stored.answers[request.sync_id or ""]
                if asked != content:
                    raise ConflictError(f"sync_id {request.sync_id} was used before for another BOM")
                return answer
            if if_match is not None and str(if_match).strip('"') != str(stored.item.bom_version):
                raise VersionConflictError(
                    f"the BOM of {part_number} is at version {stored.item.bom_version}"
                )
            if request.document is not None:
                check_document(stored, request.document.revision, request.document.sha256)
            return self._merge(stored, request, content)

    def _merge(self, stored: Stored, request: MergeRequest, content: list[tuple[str, float]]) -> MergeResult:
        number = stored.item.part_number
        known = {key: other.item.part_number for key, other in self.items.items()}
        entries = entries_of(request, known)
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
            self._write(stored, lines, MERGE, event.model_dump(mode="json", exclude_none=True))
            kept = [change.part_number for change in plan.diff.kept]
            stored.lines = with_components(stored.lines, entries, kept)
            last = LastSync(at=self._clock(), left_out=request.left_out or [])
            stored.item = stored.item.model_copy(update={"last_sync": last})
            if request.sync_id:
                stored.answers[request.sync_id] = (content, result)
        return result

    # -- files ------------------------------------------------------------------------------------------

    def revisions(self, part_number: str, /, *, newest: int | None = None, after: int = 0) -> list[Revision]:
        self.before("revisions")
        known = reversed(self._stored(part_number).revisions)
        return [revision for revision in known if revision.revision_number > after][:newest]

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
            stored = self._stored(part_number)
            if idempotency_key is not None and idempotency_key in stored.uploads:
                number, known = stored.uploads[idempotency_key]
                if known != hashlib.sha256(content).hexdigest():
                    raise ConflictError(
                        f"this Idempotency-Key was used before for another file of {part_number}"
                    )
                return self.get_revision(part_number, number)
            check_base(stored, origin.base_revision if origin else None, hashlib.sha256(content).hexdigest())
            revision = self._revise(
                stored, comment, properties, content, file_name or Path(path).name, origin
            )
            if idempotency_key is not None:
                stored.uploads[idempotency_key] = (revision.revision_number, revision.file_checksum or "")
            return revision

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


def _uuid(text: str) -> UUID | None:
    try:
        return UUID(text)
    except ValueError:
        return None
