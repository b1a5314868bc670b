# SPDX-License-Identifier: LGPL-2.1-or-later
"""A proxy on loopback that hands requests on to a real server, and spoils some of them as a test says."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.client import HTTPConnection
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import urlsplit

SLOW_S = 8.0


@dataclass(frozen=True)
class Fault:
    """What becomes of a request: answered with ``status`` and ``page``, or handed on and then spoilt.

    spoil
        changes the body of the server's answer, and says how much of it is sent; None sends nothing at all.
    """

    status: int = 0
    page: bytes = b""
    kind: str = "text/html"
    headers: Mapping[str, str] = field(default_factory=dict)
    spoil: Callable[[bytes], tuple[bytes, int] | None] | None = None


def _wrong_checksum(body: bytes) -> tuple[bytes, int]:
    data: Any = json.loads(body)
    if isinstance(data, dict) and data.get("file_checksum"):
        data["file_checksum"] = "0" * 64
    changed = json.dumps(data).encode()
    return changed, len(changed)


FAULTS = {
    "500": Fault(500, b'{"error": "internal", "message": "a bug"}', "application/json"),
    "502 page": Fault(502, b"<html><title>Bad Gateway</title></html>"),
    "404 page": Fault(404, b"<html><title>Not Found</title></html>"),
    "truncated": Fault(spoil=lambda body: (body, len(body) // 2)),
    "slow": Fault(spoil=lambda _body: None),
    "wrong checksum": Fault(spoil=_wrong_checksum),
}


@dataclass
class Proxy:
    """``fault`` is met by every request whose path has ``item`` in it; None hands all on.

    left
        so many requests more; negative: all.
    met
        set when the first one was.
    """

    url: str = ""
    fault: Fault | None = None
    item: str = ""
    left: int = -1
    ended: threading.Event = field(default_factory=threading.Event)
    met: threading.Event = field(default_factory=threading.Event)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def meets(self, path: str) -> Fault | None:
        with self._lock:
            if self.fault is None or self.item not in path or not self.left:
                return None
            self.left -= 1
        self.met.set()
        return self.fault


@contextmanager
def fault_proxy(target: str) -> Iterator[Proxy]:
    """A proxy before the server at ``target``."""
    proxy = Proxy()
    host = urlsplit(target).netloc

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def log_message(self, *_: object) -> None:
            return

        def do_GET(self) -> None:
            fault = proxy.meets(self.path)
            body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
            if fault is not None and fault.status:
                self._answer(
                    fault.status, {"Content-Type": fault.kind, **fault.headers}, fault.page, len(fault.page)
                )
                return
            upstream = HTTPConnection(host, timeout=60)
            upstream.request(self.command, self.path, body, dict(self.headers))
            reply = upstream.getresponse()
            content: bytes = reply.read()
            upstream.close()
            spoilt: tuple[bytes, int] | None = (content, len(content))
            if fault is not None and fault.spoil is not None:
                spoilt = fault.spoil(content)
            if spoilt is None:
                proxy.ended.wait(SLOW_S)
                self.close_connection = True
                return
            kept = ("content-encoding", "content-type", "etag")
            headers = {name: value for name, value in reply.getheaders() if name.lower() in kept}
            self._answer(reply.status, headers, *spoilt)

        do_POST = do_PUT = do_PATCH = do_DELETE = do_GET

        def _answer(self, status: int, headers: dict[str, str], body: bytes, sent: int) -> None:
            self.send_response(status)
            for name, value in headers.items():
                self.send_header(name, value)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body[:sent])
            self.close_connection = sent < len(body)

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    proxy.url = f"http://127.0.0.1:{server.server_address[1]}"
    try:
        yield proxy
    finally:
        proxy.ended.set()
        server.shutdown()
        server.server_close()
