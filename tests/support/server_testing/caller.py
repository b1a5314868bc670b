# SPDX-License-Identifier: LGPL-2.1-or-later
"""A small caller of a server, and its event stream."""

from __future__ import annotations

import asyncio
import http.client
import json
import threading
import time
import uuid
from collections.abc import Callable, Coroutine, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Self, TypeVar
from urllib.parse import quote, urlsplit

from model_file import model_file
from urllib3.util import wait_for_read

TIMEOUT = 300  # [s], reached only if the test fails; a busy machine may need minutes
R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class Answer:
    """A status, headers (lower case), and the body."""

    status: int
    headers: Mapping[str, str]
    body: bytes

    def json(self) -> Any:
        """The body as JSON."""
        return json.loads(self.body)


class Api:
    """Calls a server; may be shared between threads, each has its connection.

    Close it, or use it as a context manager; that closes those of :meth:`as_` as well.
    """

    def __init__(
        self, base_url: str, token: str | None = None, opened: list[http.client.HTTPConnection] | None = None
    ) -> None:
        self.base_url = base_url
        self.token = token
        self._opened = [] if opened is None else opened
        parts = urlsplit(base_url)
        self._host, self._port = parts.hostname or "127.0.0.1", parts.port or 80
        self._local = threading.local()

    def as_(self, token: str | None) -> Self:
        """The same server with another token."""
        return type(self)(self.base_url, token, self._opened)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close all connections."""
        while self._opened:
            self._opened.pop().close()

    def call(
        self,
        method: str,
        path: str,
        value: Any = None,
        *,
        body: bytes | None = None,
        headers: Mapping[str, str] | None = None,
    ) -> Answer:
        """One request; ``value`` is sent as JSON, ``body`` as it is."""
        sent = dict(headers or {})
        if self.token is not None:
            sent.setdefault("Authorization", f"Bearer {self.token}")
        if value is not None:
            body = json.dumps(value).encode()
            sent.setdefault("Content-Type", "application/json")
        connection = getattr(self._local, "connection", None)
        if (
            connection is not None
            and connection.sock is not None
            and wait_for_read(connection.sock, timeout=0)
        ):
            # The server has closed what stood idle for a while, as servers may.
            self.forget_connection()
            connection = None
        if connection is None:
            connection = http.client.HTTPConnection(self._host, self._port, timeout=TIMEOUT)
            self._local.connection = connection
            self._opened.append(connection)
        try:
            connection.request(method, path, body, sent)
            response = connection.getresponse()
            return Answer(response.status, {k.lower(): v for k, v in response.getheaders()}, response.read())
        except (OSError, http.client.HTTPException):
            self.forget_connection()
            raise

    def forget_connection(self) -> None:
        """Close this thread's connection; the next call opens a new one."""
        connection = getattr(self._local, "connection", None)
        if connection is not None:
            connection.close()
            self._local.connection = None

    def get(self, path: str) -> Any:
        """The JSON of a good answer; AssertionError for any other."""
        return self.good("GET", path)

    def good(self, method: str, path: str, value: Any = None, **more: Any) -> Any:
        """The JSON (None where there is no body) of a 2xx answer; AssertionError for any other."""
        answer = self.call(method, path, value, **more)
        assert 200 <= answer.status < 300, (method, path, answer.status, answer.body[:500])
        return answer.json() if answer.body else None

    def bad(self, status: int, method: str, path: str, value: Any = None, **more: Any) -> Any:
        """The error body of an answer that must have this status, in the one shape."""
        answer = self.call(method, path, value, **more)
        assert answer.status == status, (method, path, answer.status, answer.body[:500])
        error = answer.json()
        assert isinstance(error["error"], str), error
        assert isinstance(error["message"], str), error
        assert "Value error" not in str(error)  # pydantic's words, which say nothing to people
        return error

    def item(self, part_number: str | None = None, **values: Any) -> str:
        """Make an item; returns its part number (a new one where none is given)."""
        number = part_number or "T-" + uuid.uuid4().hex[:10]
        self.good("POST", "/api/items", {"part_number": number, "name": number, **values})
        return number

    def items(self, count: int, **values: Any) -> list[str]:
        """Make several items."""
        return [self.item(**values) for _ in range(count)]

    def parts(self, numbers: Iterable[str]) -> list[str]:
        """Make a part with each of these numbers in one request; they are in a BOM of their own as well."""
        made = list(numbers)
        rows = "".join(f"{number},1\n" for number in made)
        self.good("POST", bom(self.item(), "import?make=M01"), body=f"PN,Qty\n{rows}".encode())
        return made

    def merge(self, parent: str, entries: Mapping[str, float], **more: Any) -> Any:
        """Merge ``entries`` (part number → quantity); the answer."""
        return self.good("POST", bom(parent, "merge"), merge_body(entries, **more))

    def add_line(self, parent: str, child: str, **fields: Any) -> Any:
        """Add a line by hand; the line."""
        return self.good("POST", bom(parent), {"child_part_number": child, **fields})

    def edit_line(self, parent: str, child: str, **fields: Any) -> Any:
        """Change a line by hand; the line."""
        return self.good("PUT", bom(parent, child), fields)

    def upload(
        self, item: str, content: bytes = model_file(b"x"), name: str = "x.FCStd", **parts: str
    ) -> Any:
        """Upload a file; its revision."""
        body, headers = form_body({"file": (name, content), **parts})
        return self.good("POST", f"/api/items/{quote(item)}/file", body=body, headers=headers)

    def lines(self, parent: str) -> dict[str, Any]:
        """The BOM's lines by child part number."""
        return {line["child_part_number"]: line for line in self.get(bom(parent))}

    def quantities(self, parent: str) -> dict[str, float]:
        """The BOM as part number → quantity."""
        return {number: line["quantity"] for number, line in self.lines(parent).items()}

    def events(self, query: str = "", last_event_id: int | str | None = None) -> EventReader:
        """Open the event stream."""
        return EventReader(self, query, last_event_id)


@dataclass(frozen=True, slots=True)
class Event:
    """One event of the stream; ``mark`` is its id as it was sent, to come back with."""

    id: int | None
    name: str
    data: Any
    mark: str = ""


class EventReader:
    """The event stream as a list of events to come; a context manager."""

    def __init__(self, api: Api, query: str, last_event_id: int | str | None) -> None:
        headers = {"Authorization": f"Bearer {api.token}"}
        if last_event_id is not None:
            headers["Last-Event-ID"] = str(last_event_id)
        parts = urlsplit(api.base_url)
        self._connection = http.client.HTTPConnection(
            parts.hostname or "127.0.0.1", parts.port or 80, timeout=TIMEOUT
        )
        self._connection.request("GET", "/api/events" + query, headers=headers)
        self.response = self._connection.getresponse()
        assert self.response.status == 200, self.response.read()
        # The greeting comes at once, so that a test need not guess when the stream stands.
        assert self.response.readline() == b": connected\n"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Hang up."""
        self._connection.close()
        self.response.close()

    def next(self, *names: str) -> Event:
        """The next event with one of these names; without names: any that is no heartbeat."""
        deadline = time.monotonic() + TIMEOUT
        while time.monotonic() < deadline:
            event = self._read()
            # A heartbeat is sent if its time is due or a credential changed: at any moment, for a test.
            if event.name in names or (not names and event.name != "heartbeat"):
                return event
        raise AssertionError(f"no event {names} within {TIMEOUT} s")

    def _read(self) -> Event:
        fields: dict[str, str] = {}
        while True:
            raw = self.response.readline()
            assert raw, "the stream ended"
            line = raw.decode().rstrip("\n")
            if line == "" and "event" in fields:
                mark = fields.get("id", "")
                number = int(mark.partition("-")[0]) if mark else None
                return Event(number, fields["event"], json.loads(fields["data"]), mark)
            if line == "":
                fields.clear()  # the greeting: an id, and no event
                continue
            name, _, value = line.partition(": ")
            fields[name] = value


def another_user(api: Api, role: str = "editor", *, approver: bool = False) -> Api:
    """Another caller, with a token of this user's own."""
    name, password = "u" + uuid.uuid4().hex[:8], "correct horse battery"
    api.good("POST", "/api/users", {"username": name, "role": role, "password": password})
    if approver:
        api.good("PUT", f"/api/users/{name}", {"approver": True})
    session = api.as_(None).call("POST", "/api/auth/login", {"username": name, "password": password})
    headers = {
        "Cookie": session.headers["set-cookie"].partition(";")[0],
        "X-CSRF-Token": session.json()["csrf_token"],
    }
    made = api.as_(None).good("POST", "/api/auth/tokens", {"name": "own"}, headers=headers)
    return api.as_(made["token"])


def bom(part_number: str, rest: str = "") -> str:
    """The path of a BOM, or of something below it."""
    path = f"/api/items/{quote(part_number, safe='')}/bom"
    return f"{path}/{rest}" if rest else path


def merge_body(entries: Mapping[str, float], **more: Any) -> dict[str, Any]:
    """A merge request in the spec's form."""
    listed = [
        {"child_part_number": number, "quantity": quantity, "source": "assembly"}
        for number, quantity in entries.items()
    ]
    return {"source": "assembly", "entries": listed, **more}


def form_body(parts: Mapping[str, str | tuple[str, bytes]]) -> tuple[bytes, dict[str, str]]:
    """A multipart body and its headers; a file is (name, content)."""
    boundary = uuid.uuid4().hex
    out = b""
    for name, value in parts.items():
        file = isinstance(value, tuple)
        disposition = f'form-data; name="{name}"' + (f'; filename="{value[0]}"' if file else "")
        content = value[1] if isinstance(value, tuple) else value.encode()
        out += f"--{boundary}\r\nContent-Disposition: {disposition}\r\n".encode()
        out += (b"Content-Type: application/octet-stream\r\n\r\n" if file else b"\r\n") + content + b"\r\n"
    out += f"--{boundary}--\r\n".encode()
    return out, {"Content-Type": f"multipart/form-data; boundary={boundary}"}


def run_alone(work: Coroutine[Any, Any, R]) -> R:
    """Run a coroutine to its end, beside the running loop that a browser's tests leave in this thread."""
    with ThreadPoolExecutor(1) as other:
        return other.submit(asyncio.run, work).result()


def wait_until(true: Callable[[], bool], what: str, seconds: float = 60.0) -> None:
    """Poll ``true()`` until it is; AssertionError after ``seconds``."""
    deadline = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < deadline, f"{what} did not happen within {seconds} s"
        time.sleep(0.01)
