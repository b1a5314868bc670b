# SPDX-License-Identifier: LGPL-2.1-or-later
"""A Silo over HTTP, written from what the real one's public documents say, not from our own server.

Every point that the documents leave open is a switch of :class:`Moods`. ``faults`` makes single requests go
wrong. The store is looked at directly: what a test asserts is what the server holds, not what it said.
"""

from __future__ import annotations

import copy
import email
import email.policy
import hashlib
import json
import os
import re
import threading
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from datetime import UTC, datetime
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs, unquote, urlsplit

TOKEN = "silo_emulated"
CATEGORIES = {
    "A01": "Mechanical assembly",
    "C01": "Adhesives and thread lockers",
    "F01": "Screws and bolts",
    "M01": "Machined parts",
    "X99": "Other",
}


@dataclass(frozen=True)
class Moods:
    """How the server behaves where the documents leave it open; the defaults are our best reading."""

    null_lists: bool = False  # Go's nil for an empty list
    list_key: str = ""  # lists bare, or under this key
    wrapped: bool = False  # a new item comes as {"item": {…}}
    odd_created: bool = False  # a new item is answered by {"ok": true}
    properties: str = "revision"  # shown on the "item", the "revision", or "nowhere"
    drops_unknown_properties: bool = False
    own_ids: bool = True  # the client's id is ignored
    batch: int = 404  # POST /api/items/by-uuid: 200, or how it is refused
    search: str = "finds"  # "finds", "nothing" (an index that is late), "missing"
    created_at: bool = True
    merge: str = "json"  # "json", "missing", "empty", "null", "fails"
    manual_409: bool = False  # a merge with a child that is a manual line
    strict: bool = False  # 400 for an unknown key
    checksums: bool = True
    sizes: bool = True
    upload: str = "multipart"  # or "presigned", or "missing"
    storage: str = "up"  # of files: "down" (503 without a name), "none" (501), "gone" (its files are lost)
    schemas: tuple[str, ...] = ("kindred-rd",)
    errors: str = "code"  # {"error": code, "message"}, or "text": {"error": text}, or "bare"
    event: str = "bom.merged"  # or "bom_merge"
    auth_me: bool = True
    role: str = "editor"
    mode: str = "normal"
    expired: bool = False  # the session is over: everything leads to the login page
    revisions_route: bool = True
    numbers: bool = True  # POST /api/generate-part-number
    page: int = 0  # the most rows in one answer; 0: all
    total: str = ""  # how a page says that there is more: in the "header", the "body", "next", "link", or not
    first_page_only: bool = False  # the offset is ignored
    oldest_first: bool = False  # revisions


MOODS = {
    "null lists": Moods(null_lists=True),
    "wrapped lists": Moods(list_key="items"),
    "lists under results": Moods(list_key="results"),
    "wrapped items": Moods(wrapped=True),
    "odd answer to a new item": Moods(odd_created=True),
    "odd answer, properties nowhere": Moods(odd_created=True, properties="nowhere"),
    "properties on the item": Moods(properties="item"),
    "unknown properties dropped": Moods(drops_unknown_properties=True),
    "takes our ids": Moods(own_ids=False),
    "batch look-up": Moods(batch=200),
    "batch refused by role": Moods(batch=403),
    "batch refused by mode": Moods(batch=503),
    "a late index": Moods(search="nothing"),
    "no search": Moods(search="missing"),
    "no creation time": Moods(created_at=False),
    "no merge": Moods(merge="missing"),
    "no merge, strict": Moods(merge="missing", strict=True),
    "merge answers {}": Moods(merge="empty"),
    "merge answers null": Moods(merge="null"),
    "409 for manual lines": Moods(manual_409=True),
    "strict": Moods(strict=True),
    "no checksums": Moods(checksums=False),
    "no checksums, no sizes": Moods(checksums=False, sizes=False),
    "uploads in two steps": Moods(upload="presigned"),
    "another schema": Moods(schemas=("acme",)),
    "errors as text": Moods(errors="text"),
    "errors bare": Moods(errors="bare"),
    "the other dialect": Moods(event="bom_merge"),
    "no auth/me": Moods(auth_me=False),
    "no revisions": Moods(revisions_route=False, properties="item"),
    "no numbers": Moods(numbers=False),
    "pages of 2, counted": Moods(page=2, total="header", oldest_first=True),
    "pages of 2, counted in the body": Moods(page=2, total="body", oldest_first=True, batch=200),
    "pages of 2, next": Moods(page=2, total="next", oldest_first=True, batch=200),
    "pages of 2, linked": Moods(page=2, total="link", batch=200),
}


MIXTURES = (
    (),
    (
        "null lists",
        "wrapped items",
        "a late index",
        "merge answers {}",
        "batch refused by role",
        "errors as text",
    ),
    ("wrapped lists", "no merge", "no checksums", "odd answer to a new item", "batch look-up", "no auth/me"),
    ("lists under results", "merge answers null", "uploads in two steps", "no search", "errors bare"),
    ("pages of 2, counted", "no merge, strict", "no checksums, no sizes", "properties on the item"),
    ("pages of 2, counted in the body", "409 for manual lines", "no creation time", "the other dialect"),
    ("pages of 2, next", "strict", "takes our ids", "unknown properties dropped", "no numbers"),
    ("pages of 2, linked", "uploads in two steps", "no checksums", "another schema", "batch refused by mode"),
    ("no revisions", "no merge", "errors as text", "null lists"),
    ("odd answer, properties nowhere", "uploads in two steps", "a late index"),
)
"""Each mood at least once, beside others that do not hide it: what is done in all moods, is done in these."""


def mixed(names: Sequence[str]) -> Moods:
    """All switches that differ in these moods."""
    switches = {
        one.name: value
        for name in names
        for one in fields(Moods)
        if (value := getattr(MOODS[name], one.name)) != one.default
    }
    return Moods(**switches)


@dataclass
class Item:
    """An item as the server holds it."""

    id: str
    part_number: str
    description: str
    item_type: str
    created_at: str
    revisions: list[dict[str, Any]] = field(default_factory=list)
    files: dict[int, bytes] = field(default_factory=dict)
    attachments: list[tuple[str, bytes]] = field(default_factory=list)
    lines: list[dict[str, Any]] = field(default_factory=list)


@dataclass(frozen=True)
class Page:
    """An answer with headers of its own."""

    content: Any
    headers: dict[str, str]


class Refused(Exception):
    """A status with a code and a text."""

    def __init__(self, status: int, code: str, text: str = "") -> None:
        super().__init__(text)
        self.status, self.code, self.text = status, code, text or code


class PlainError(Exception):
    """What the router, not a handler, answers."""


class RealSilo(ThreadingHTTPServer):
    """The server; ``seen`` lists the requests, ``faults`` maps a request's number (from 0) to a fault.

    faults_of
        "METHOD path" → the faults of the next requests of this kind, "" for none.
    answered_creations
        after so many items were made no answer arrives any more; None for no such end.
    """

    daemon_threads = True
    allow_reuse_address = True

    def __init__(self, moods: Moods) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.moods = moods
        self.token = TOKEN  # a new one: those that were given out have expired
        self.items: dict[str, Item] = {}
        self.uploads: dict[str, bytes] = {}
        self.events: list[tuple[str, dict[str, Any]]] = []
        self.news = threading.Condition()
        self.seen: list[str] = []
        self.faults: dict[int, str] = {}
        self.faults_of: dict[str, list[str]] = {}
        self.answered_creations: int | None = None
        self.lock = threading.RLock()
        self.ending = threading.Event()
        threading.Thread(target=self.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_address[1]}"

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A client that hung up."""

    def end(self) -> None:
        self.ending.set()
        with self.news:
            self.news.notify_all()
        self.shutdown()
        self.server_close()

    def next_fault(self, method: str, path: str) -> str:
        with self.lock:
            self.seen.append(f"{method} {path}")
            if self.answered_creations is not None:
                self.answered_creations -= (method, path) == ("POST", "/api/items")
                if self.answered_creations < 0:
                    return "drop after"
            if kind := self.faults_of.get(self.seen[-1]):
                return kind.pop(0)
            return self.faults.pop(len(self.seen) - 1, "")

    # -- what is held -------------------------------------------------------------------------------------

    def holds(self) -> dict[str, int]:
        """Description → how many items have it."""
        counts: dict[str, int] = {}
        for item in self.items.values():
            counts[item.description] = counts.get(item.description, 0) + 1
        return counts

    def backup(self) -> dict[str, Item]:
        """All that it holds, for a later :meth:`restore`."""
        with self.lock:
            return copy.deepcopy(self.items)

    def restore(self, items: dict[str, Item]) -> None:
        """Hold what it held then: whatever came since is lost, and its numbers are given again."""
        with self.lock:
            self.items = copy.deepcopy(items)

    def make(
        self, category: str, description: str, item_type: str = "part", given: str | None = None
    ) -> Item:
        """A new item, without a revision."""
        serial = sum(1 for number in self.items if number.startswith(category.casefold())) + 1
        number, now = f"{category}-{serial:04d}", datetime.now(UTC).isoformat()
        item = Item(given or str(uuid.uuid4()), number, description, item_type, now)
        self.items[number.casefold()] = item
        return item

    def check_storage(self) -> None:
        if self.moods.storage == "down":
            raise Refused(503, "", "")
        if self.moods.storage == "none":
            raise Refused(501, "not_implemented", "no file storage is configured")

    def named(self, description: str) -> Item:
        return next(item for item in self.items.values() if item.description == description)

    def announce(self, event: str, data: dict[str, Any]) -> None:
        with self.news:
            self.events.append((event, data))
            self.news.notify_all()

    # -- the routes ---------------------------------------------------------------------------------------

    def answer(self, method: str, path: str, query: dict[str, str], body: Any, head: Any) -> tuple[int, Any]:
        """Status and content of one request."""
        segments = [unquote(part) for part in path.strip("/").split("/")]
        if segments in (["health"], ["ready"]):
            return 200, {"status": "ok", "mode": self.moods.mode, "version": "0.1.0"}
        if segments[:1] == ["upload"] and method == "PUT":
            self.uploads["/".join(segments[1:])] = body
            return 200, {}
        self._check_caller(method, head)
        for pattern, verb, handler in _ROUTES:
            found = re.fullmatch(pattern, "/".join(segments))
            if found and verb == method:
                return handler(self, query, body, *found.groups())
        raise PlainError("404 page not found")

    def _check_caller(self, method: str, head: Any) -> None:
        if head.get("Authorization") != f"Bearer {self.token}":
            raise Refused(401, "unauthorized")
        if method != "GET" and self.moods.role == "viewer":
            raise Refused(403, "forbidden", "requires editor")
        if method != "GET" and self.moods.mode == "read-only":
            raise Refused(503, "read_only", "server is in read-only mode")

    def one(self, number: str) -> Item:
        found = self.items.get(number.casefold())
        if found is None:
            raise Refused(404, "not_found", f"item {number} not found")
        return found

    def shown(self, item: Item) -> dict[str, Any]:
        data = {
            "id": item.id,
            "part_number": item.part_number,
            "item_type": item.item_type,
            "description": item.description,
            "current_revision": len(item.revisions),
            "sourcing_type": None,
        }
        if self.moods.created_at:
            data["created_at"] = item.created_at
        if self.moods.properties == "item" and item.revisions:
            data["properties"] = item.revisions[-1]["properties"]
        return data

    def listed(self, rows: list[Any], query: dict[str, str] | None = None) -> Any:
        """A list; with its ``query``, one page of it."""
        if query is None or not self.moods.page:
            content = None if self.moods.null_lists and not rows else rows
            return {self.moods.list_key: content} if self.moods.list_key else content
        start = 0 if self.moods.first_page_only else int(query.get("offset", 0))
        size = min(self.moods.page, int(query.get("limit", self.moods.page)))
        shown, more = rows[start : start + size], start + size < len(rows)
        following = f"/api/elsewhere?offset={start + size}&limit={size}"
        how = self.moods.total
        headers = {"X-Total-Count": str(len(rows))} if how == "header" else {}
        links = f'</api/x?offset=0>; rel="first", <{following}>; rel="next"'
        headers |= {"Link": links} if how == "link" and more else {}
        if how not in ("body", "next"):
            return Page(shown, headers)
        told = {"total": len(rows)} if how == "body" else {"next": following if more else None}
        return {self.moods.list_key or "items": shown, **told}

    def keys(self, body: Any, *known: str) -> None:
        unknown = sorted(set(body) - set(known)) if self.moods.strict else []
        if unknown:
            raise Refused(400, "bad_request", f'json: unknown field "{unknown[0]}"')

    def revise(
        self, item: Item, comment: str, properties: Any, content: bytes | None = None
    ) -> dict[str, Any]:
        """A new revision with a full set of properties."""
        before = item.revisions[-1]["properties"] if item.revisions else {}
        number = len(item.revisions) + 1
        kept = dict(properties if properties is not None else before)
        if self.moods.drops_unknown_properties:
            kept.pop("registration_id", None)
        row: dict[str, Any] = {"revision_number": number, "comment": comment, "properties": kept}
        if content is not None:
            item.files[number] = content
            row |= {"file_key": f"items/{item.part_number}/rev{number}.fcstd"}
            row |= {"file_checksum": hashlib.sha256(content).hexdigest()} if self.moods.checksums else {}
            row |= {"file_size": len(content)} if self.moods.sizes else {}
        item.revisions.append(row)
        data = {"part_number": item.part_number, "revision_number": number, "comment": comment}
        self.announce("revision.created", data)
        return self.shown_revision(row)

    def shown_revision(self, row: dict[str, Any]) -> dict[str, Any]:
        hidden = () if self.moods.properties == "revision" else ("properties",)
        return {key: value for key, value in row.items() if key not in hidden}


Answer = tuple[int, Any]


def _list(silo: RealSilo, query: dict[str, str], _body: Any) -> Answer:
    wanted = query.get("search", "").casefold()
    found = [
        i for _, i in sorted(silo.items.items()) if wanted in f"{i.part_number} {i.description}".casefold()
    ]
    if silo.moods.page:
        return 200, silo.listed([silo.shown(item) for item in found], query)
    start, limit = int(query.get("offset", 0)), int(query.get("limit", 50))
    return 200, silo.listed([silo.shown(item) for item in found[start : start + limit]])


def _search(silo: RealSilo, query: dict[str, str], body: Any) -> Answer:
    if silo.moods.search == "missing":
        raise Refused(404, "not_found", "item search not found")  # read as a part number
    if silo.moods.search == "nothing":
        return 200, silo.listed([])
    return _list(silo, {"search": query.get("q", ""), "limit": query.get("limit", "50")}, body)


def _create(silo: RealSilo, _query: dict[str, str], body: Any) -> Answer:
    known = ("schema", "category", "description", "item_type", "projects", "sourcing_type")
    silo.keys(body, *known, "long_description", "properties")
    if body["schema"] not in silo.moods.schemas or body["category"] not in CATEGORIES:
        raise Refused(400, "bad_request", "no such category")
    given = None if silo.moods.own_ids else body.get("id")
    if given and any(item.id == given for item in silo.items.values()):
        return 201, silo.shown(next(item for item in silo.items.values() if item.id == given))
    item = silo.make(body["category"], body.get("description", ""), body.get("item_type", "part"), given)
    silo.revise(item, "created", body.get("properties") or {})
    if silo.moods.odd_created:
        return 201, {"ok": True}
    return 201, {"item": silo.shown(item)} if silo.moods.wrapped else silo.shown(item)


def _item(silo: RealSilo, _query: dict[str, str], _body: Any, number: str) -> Answer:
    return 200, silo.shown(silo.one(number))


def _by_uuid(silo: RealSilo, _query: dict[str, str], _body: Any, wanted: str) -> Answer:
    for item in silo.items.values():
        if item.id == wanted.lower():
            return 200, silo.shown(item)
    raise Refused(404, "not_found")


def _batch(silo: RealSilo, _query: dict[str, str], body: Any) -> Answer:
    if silo.moods.batch != 200:
        raise Refused(silo.moods.batch, "refused")
    found = [silo.shown(item) for item in silo.items.values() if item.id in body["uuids"]]
    return 200, silo.listed(found, {} if silo.moods.total else None)


def _update(silo: RealSilo, _query: dict[str, str], body: Any, number: str) -> Answer:
    silo.keys(body, "part_number", "description", "item_type", "sourcing_type", "properties", "comment")
    item = silo.one(number)
    if body.get("properties") is not None:
        silo.revise(item, body.get("comment", ""), body["properties"])
    item.description = body.get("description", item.description)
    return 200, silo.shown(item)


def _revisions(silo: RealSilo, query: dict[str, str], _body: Any, number: str) -> Answer:
    if not silo.moods.revisions_route:
        raise PlainError("404 page not found")
    rows = silo.one(number).revisions
    rows = rows if silo.moods.oldest_first else rows[::-1]
    return 200, silo.listed([silo.shown_revision(row) for row in rows], query)


def _revision(silo: RealSilo, _query: dict[str, str], _body: Any, number: str, revision: str) -> Answer:
    rows = [row for row in silo.one(number).revisions if row["revision_number"] == int(revision)]
    if not rows or not silo.moods.revisions_route:
        raise Refused(404, "not_found")
    return 200, silo.shown_revision(rows[0])


def _upload(silo: RealSilo, _query: dict[str, str], body: Any, number: str) -> Answer:
    item = silo.one(number)
    if silo.moods.upload == "missing":
        raise PlainError("404 page not found")
    silo.check_storage()
    if isinstance(body, dict):  # associate what was uploaded to the store before
        content = silo.uploads.pop(body["object_key"])
        return 201, silo.revise(item, body.get("comment", ""), body.get("properties"), content)
    if silo.moods.upload == "presigned":
        raise Refused(415, "unsupported", "upload to the store first")
    parts = {part.get_param("name", header="content-disposition"): part for part in body.iter_parts()}
    content = parts["file"].get_payload(decode=True)
    comment = parts["comment"].get_payload(decode=True).decode() if "comment" in parts else ""
    return 201, silo.revise(item, comment, None, content)


def _attach(silo: RealSilo, _query: dict[str, str], body: Any, number: str) -> Answer:
    (part,) = body.iter_parts()
    name = part.get_param("filename", header="content-disposition")
    silo.one(number).attachments.append((str(name), part.get_payload(decode=True)))
    return 201, {"id": str(uuid.uuid4()), "filename": name}


def _attached(silo: RealSilo, _query: dict[str, str], _body: Any, number: str) -> Answer:
    rows = [
        {"id": str(uuid.uuid5(uuid.NAMESPACE_OID, name)), "filename": name, "size": len(content)}
        for name, content in silo.one(number).attachments
    ]
    return 200, rows


def _download(silo: RealSilo, _query: dict[str, str], _body: Any, number: str, revision: str = "") -> Answer:
    silo.check_storage()
    files = {} if silo.moods.storage == "gone" else silo.one(number).files
    content = files.get(int(revision)) if revision else files.get(max(files, default=0))
    if content is None:
        raise Refused(404, "not_found")
    return 200, content


def _presign(silo: RealSilo, _query: dict[str, str], body: Any) -> Answer:
    if silo.moods.upload == "missing":
        raise PlainError("404 page not found")
    silo.check_storage()
    if silo.moods.upload != "presigned":
        raise Refused(501, "not_implemented")
    key = f"uploads/tmp/{uuid.uuid4()}/{body['filename']}"
    return 200, {
        "object_key": key,
        "upload_url": f"{silo.url}/upload/{key}?signature=x",
        "expires_at": "2099-01-01",
    }


def _bom(silo: RealSilo, query: dict[str, str], _body: Any, number: str) -> Answer:
    return 200, silo.listed([dict(line) for line in silo.one(number).lines], query)


def _where_used(silo: RealSilo, query: dict[str, str], _body: Any, number: str) -> Answer:
    child = silo.one(number).part_number
    lines = [
        {"parent_part_number": item.part_number, "quantity": line["quantity"]}
        for item in silo.items.values()
        for line in item.lines
        if line["child_part_number"] == child
    ]
    return 200, silo.listed(lines, query)


def _line_of(silo: RealSilo, item: Item, child: str) -> dict[str, Any]:
    for line in item.lines:
        if line["child_part_number"].casefold() == child.casefold():
            return line
    raise Refused(404, "not_found")


def _add_line(silo: RealSilo, _query: dict[str, str], body: Any, number: str) -> Answer:
    silo.keys(body, "child_part_number", "rel_type", "quantity", "unit", "source", "metadata")
    item, child = silo.one(number), silo.one(body["child_part_number"])
    if any(line["child_part_number"] == child.part_number for line in item.lines):
        raise Refused(409, "conflict", "child exists")
    line = {
        "child_part_number": child.part_number,
        "quantity": body.get("quantity"),
        "rel_type": "component",
        "source": body.get("source", "manual"),
    }
    item.lines.append(line)
    return 201, line


def _change_line(silo: RealSilo, _query: dict[str, str], body: Any, number: str, child: str) -> Answer:
    line = _line_of(silo, silo.one(number), child)
    line["quantity"] = body.get("quantity", line["quantity"])
    return 200, line


def _merge(silo: RealSilo, _query: dict[str, str], body: Any, number: str) -> Answer:
    if silo.moods.merge == "missing":
        raise PlainError("404 page not found")
    silo.keys(body, "entries")
    item = silo.one(number)
    for entry in body["entries"]:
        silo.keys(entry, "child_part_number", "quantity")
        if entry["child_part_number"].casefold() not in silo.items:
            raise Refused(400, "bad_request", f"unknown child {entry['child_part_number']}")
    if silo.moods.merge == "fails":
        return 200, {"status": "error", "message": "deadlock detected"}
    known = {line["child_part_number"]: line for line in item.lines}
    wanted = {silo.one(e["child_part_number"]).part_number: e["quantity"] for e in body["entries"]}
    if silo.moods.manual_409 and any(known.get(n, {}).get("source") == "manual" for n in wanted):
        raise Refused(409, "conflict", "a child is a manual line")
    diff: dict[str, list[Any]] = {"added": [], "removed": [], "quantity_changed": [], "unchanged": []}
    for child, quantity in wanted.items():
        line, row = known.get(child), {"part_number": child, "quantity": quantity}
        if line is None:
            new = {"child_part_number": child, "quantity": quantity, "rel_type": "component"}
            item.lines.append({**new, "source": "assembly"})
            diff["added"].append(row)
        elif line["source"] == "manual" or line["quantity"] == quantity:
            diff["unchanged"].append(row)
        else:
            change = {"part_number": child, "old_quantity": line["quantity"], "new_quantity": quantity}
            diff["quantity_changed"].append(change)
            line["quantity"] = quantity
    for child, line in known.items():
        if child not in wanted and line["source"] == "assembly":
            diff["removed"].append({"part_number": child, "quantity": line["quantity"]})
    warnings = [{"type": "unreferenced", "part_number": row["part_number"]} for row in diff["removed"]]
    url = f"/items/{item.part_number}/bom"
    key = "part_number" if silo.moods.event == "bom.merged" else "item"
    silo.announce(silo.moods.event, {key: item.part_number, "user": "x", "diff": diff, "resolve_url": url})
    answer = {"status": "merged", "diff": diff, "warnings": warnings, "resolve_url": url}
    return 200, {"json": answer, "empty": {}, "null": None}[silo.moods.merge]


def _schemas(silo: RealSilo, _query: dict[str, str], _body: Any) -> Answer:
    return 200, silo.listed([{"name": name} for name in silo.moods.schemas])


def _schema(silo: RealSilo, _query: dict[str, str], _body: Any, name: str) -> Answer:
    if name not in silo.moods.schemas:
        raise Refused(404, "not_found")
    return 200, {"name": name, "segments": [{"name": "category", "values": CATEGORIES}]}


def _number(silo: RealSilo, _query: dict[str, str], body: Any) -> Answer:
    if not silo.moods.numbers:
        raise PlainError("404 page not found")
    return 200, {"part_number": f"{body['category']}-9999"}


def _me(silo: RealSilo, _query: dict[str, str], _body: Any) -> Answer:
    if not silo.moods.auth_me:
        raise PlainError("404 page not found")
    return 200, {"username": "x", "role": silo.moods.role}


_N = "([^/]+)"
_ROUTES: tuple[tuple[str, str, Callable[..., Answer]], ...] = (
    ("api/items", "GET", _list),
    ("api/items", "POST", _create),
    ("api/items/search", "GET", _search),
    ("api/items/by-uuid", "POST", _batch),
    (f"api/items/by-uuid/{_N}", "GET", _by_uuid),
    (f"api/items/{_N}", "GET", _item),
    (f"api/items/{_N}", "PUT", _update),
    (f"api/items/{_N}/revisions", "GET", _revisions),
    (f"api/items/{_N}/revisions/{_N}", "GET", _revision),
    (f"api/items/{_N}/files", "GET", _attached),
    (f"api/items/{_N}/files", "POST", _attach),
    (f"api/items/{_N}/file", "POST", _upload),
    (f"api/items/{_N}/file", "GET", _download),
    (f"api/items/{_N}/file/{_N}", "GET", _download),
    (f"api/items/{_N}/bom", "GET", _bom),
    (f"api/items/{_N}/bom", "POST", _add_line),
    (f"api/items/{_N}/bom/where-used", "GET", _where_used),
    (f"api/items/{_N}/bom/merge", "POST", _merge),
    (f"api/items/{_N}/bom/{_N}", "PUT", _change_line),
    ("api/uploads/presign", "POST", _presign),
    ("api/schemas", "GET", _schemas),
    (f"api/schemas/{_N}", "GET", _schema),
    ("api/generate-part-number", "POST", _number),
    ("api/auth/me", "GET", _me),
)


FAULTS = (
    "drop before",
    "drop after",
    "401",
    "403",
    "429",
    "502 before",
    "502 after",
    "503",
    "login",
    "cut",
    "slow",
)
"""What may happen to one request; "after": the server did what was asked, and the answer was lost."""

REFUSALS: dict[str, tuple[int, str, str]] = {
    "401": (401, "unauthorized", ""),
    "403": (403, "forbidden", ""),
    "404": (404, "not_found", "no such item"),
    "409": (409, "conflict", "the item is checked out"),
    "413": (413, "too_large", ""),
    "422": (422, "unprocessable", "no such kind of file"),
    "500": (500, "internal", "a bug"),
    "501": (501, "not_implemented", "no file storage is configured"),
    "read-only": (503, "read_only", "server is in read-only mode"),
    "no storage": (503, "unavailable", "file storage is down"),
}
"""Status, code and text, in the words of the mood."""


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    wbufsize = 1 << 16  # an answer in one piece
    server: RealSilo

    def log_message(self, *_: object) -> None:
        return None

    def _any(self) -> None:
        raw = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        parts = urlsplit(self.path)
        fault = self.server.next_fault(self.command, parts.path)
        if fault == "drop before":
            return self._hang_up()
        early = {
            "429": (429, {"error": "slow down"}, {"Retry-After": "40"}),
            "502 before": (502, "<html><title>502 Bad Gateway</title></html>", {"Content-Type": "text/html"}),
            "503": (503, "", {}),
            "503 later": (503, "", {"Retry-After": "70"}),
            "503 in 2099": (503, "", {"Retry-After": "Thu, 01 Jan 2099 00:00:00 GMT"}),
            "login": (302, "", {"Location": f"/login?next={parts.path}"}),
        }
        if fault in early:
            return self._write(*early[fault])
        if self.server.moods.expired and parts.path.startswith("/api/"):
            return self._write(302, "", {"Location": f"/login?next={parts.path}"})
        if parts.path == "/api/events" and not fault:
            return self._stream()
        query = {k: v[0] for k, v in parse_qs(parts.query).items()}
        status, content = self._answer(parts.path, query, raw, fault)
        if fault == "drop after":
            return self._hang_up()
        if fault == "502 after":
            return self._write(*early["502 before"])
        if fault == "slow":
            self.server.ending.wait(1.0)  # longer than the client waits for an answer
        page = content if isinstance(content, Page) else Page(content, {})
        return self._write(status, page.content, page.headers, cut=fault == "cut")

    do_GET = do_POST = do_PUT = do_DELETE = _any

    def _answer(self, path: str, query: dict[str, str], raw: bytes, fault: str) -> tuple[int, Any]:
        kind = self.headers.get("Content-Type", "")
        if kind.startswith("multipart/"):
            text = b"Content-Type: " + kind.encode() + b"\r\n\r\n" + raw
            body: Any = email.message_from_bytes(text, policy=email.policy.HTTP)
        elif kind.startswith("application/json"):
            body = json.loads(raw)
        else:
            body = raw
        try:
            if fault == "no route":
                raise PlainError("404 page not found")
            if fault in REFUSALS:
                raise Refused(*REFUSALS[fault])
            with self.server.lock:
                return self.server.answer(self.command, path, query, body, self.headers)
        except PlainError as error:
            return 404, str(error)
        except Refused as error:
            shape = self.server.moods.errors
            if shape == "bare":
                return error.status, error.text
            told = {"error": error.text} if shape == "text" else {"error": error.code, "message": error.text}
            return error.status, told

    def _write(self, status: int, content: Any, headers: dict[str, str], *, cut: bool = False) -> None:
        plain = isinstance(content, str)
        data = (
            content
            if isinstance(content, bytes)
            else content.encode()
            if plain
            else json.dumps(content).encode()
        )
        self.send_response(status)
        kind = "application/octet-stream" if isinstance(content, bytes) else "application/json"
        for name, value in {"Content-Type": "text/plain" if plain else kind, **headers}.items():
            self.send_header(name, value)
        self.send_header("Content-Length", str(len(data) + (7 if cut else 0)))
        self.end_headers()
        self.wfile.write(data[: len(data) // 2] if cut else data)
        if cut:
            self._hang_up()

    def _hang_up(self) -> None:
        self.close_connection = True
        self.wfile.flush()

    def _stream(self) -> None:
        if self.headers.get("Authorization") != f"Bearer {self.server.token}":
            return self._write(401, {"error": "unauthorized"}, {})
        self.send_response(200)
        self.send_header("Content-Type", "text/event-stream")
        self.end_headers()
        self.wfile.flush()
        self.close_connection = True
        number = int(self.headers.get("Last-Event-ID") or 0)
        while not self.server.ending.is_set():
            with self.server.news:
                if number == len(self.server.events):
                    self.server.news.wait(20)
                news = self.server.events[number:]
            for name, data in news:
                number += 1
                self.wfile.write(f"id: {number}\nevent: {name}\ndata: {json.dumps(data)}\n\n".encode())
                self.wfile.flush()
        return None


@contextmanager
def real_silo(moods: Moods | None = None) -> Iterator[RealSilo]:
    """A running server."""
    running = RealSilo(moods or Moods())
    try:
        yield running
    finally:
        running.end()


HOMES = ("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME")


def register_elsewhere(top: str, url: str, home: str) -> int:
    """Register a project as another computer does, with data of its own; how many errors it reports."""
    from silo.api.client import SiloClient
    from silo.api.policy import Retries
    from silo.cli.reading import read_assembly
    from silo.registering.closed_files import proposals_for, register_all

    for name in HOMES:
        os.environ[name] = home
    extraction = read_assembly(top)
    retries = Retries(tries=2, sleep=lambda _s: None)
    with SiloClient(url, TOKEN, timeout=60, retries=retries) as client:
        proposals = proposals_for(extraction, client, client.find_schema("kindred-rd"))
        return sum(r.error is not None for r in register_all(proposals, client, schema="kindred-rd"))
