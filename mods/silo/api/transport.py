# SPDX-License-Identifier: LGPL-2.1-or-later
"""One request, done with care: time-outs, bounded repeats, redirects, bounded answers, and the token.

The rules of this module:

* a request is repeated only as :mod:`silo.api.policy` allows, a few times, with growing pauses;
* the token goes to the configured server only, never along a redirect to another, never from https to http;
* a changing request (POST, PUT) follows a redirect only within the configured server and with its body;
* an answer has an upper size and an upper duration, however slowly it drips.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from typing import Any, Protocol
from urllib.parse import urljoin, urlsplit

import requests
import urllib3
from requests.adapters import HTTPAdapter
from requests.auth import AuthBase

from silo.api.address import Origin, ServerAddress, may_carry_token, origin_of
from silo.api.foreign import Where, translated
from silo.api.policy import Retries
from silo.api.replies import Reply, error_of
from silo.bom.errors import (
    AuthError,
    CancelledError,
    ConfigError,
    ServerFaultError,
    SiloError,
    UnreachableError,
)
from silo.bom.message import message
from silo.bom.numbers import whole_number

MAX_REDIRECTS = 5
MAX_ERROR = 1 << 20
_CAN_UNPACK = hasattr(urllib3.HTTPResponse, "read1")
_CHUNK = 1 << 16
_LOGIN = frozenset(("login", "log-in", "logon", "signin", "sign-in", "sign_in", "oauth2", "sso", "saml"))


class Cancel(Protocol):
    """What stops a long call; :class:`threading.Event` is one."""

    def is_set(self) -> bool: ...

    def wait(self, timeout: float | None = None) -> bool: ...


@dataclass(frozen=True)
class Timeouts:
    """Seconds: to connect, between two pieces of a request or an answer, and for a whole answer."""

    connect: float = 5.0
    read: float = 30.0
    total: float = 300.0


@dataclass(frozen=True)
class ApiCall:
    """One request. ``body`` makes the content again for each attempt.

    ``endless`` answers (downloads) have no overall time limit.
    """

    method: str
    url: str
    subject: str
    params: Mapping[str, str | int] = field(default_factory=dict)
    body: Callable[[], Any] | None = None
    headers: Mapping[str, str] = field(default_factory=dict)
    repeatable: bool = False
    max_bytes: int | None = None
    endless: bool = False
    cancelled: Cancel | None = None

    @property
    def writing(self) -> bool:
        return self.method not in ("GET", "HEAD")


class _Bearer(AuthBase):
    # Given as `auth` for every request, also without a token: otherwise requests would look into ~/.netrc and
    # send what it finds there.
    def __init__(self, token: str | None) -> None:
        self._token = token

    def __call__(self, request: requests.PreparedRequest) -> requests.PreparedRequest:
        if self._token:
            request.headers["Authorization"] = f"Bearer {self._token}"
        return request

    def __repr__(self) -> str:
        return "Bearer ***" if self._token else message("no token")


class Transport:
    """Sends calls to one server over a :class:`requests.Session`; safe to share between threads."""

    def __init__(
        self,
        address: ServerAddress,
        token: str | None,
        *,
        timeouts: Timeouts,
        retries: Retries,
        verify: bool | str = True,
        session: requests.Session | None = None,
        max_bytes: int = 64 << 20,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.address = address
        self.timeouts = timeouts
        self._retries = retries
        self._token = (token or "").strip() or None
        if not all("!" <= c <= "~" for c in self._token or ""):  # never quoted
            raise ConfigError(
                message("the token holds blanks or characters that HTTP does not allow; copy it again")
            )
        self._verify = verify
        self._session = session or _new_session(timeouts.read)
        self._max_bytes, self._clock = max_bytes, clock

    @property
    def has_token(self) -> bool:
        return self._token is not None

    def where(self, subject: str) -> Where:
        """Describe where an error happened, for messages about this server."""
        return Where(self.address.host, subject, self.timeouts.connect, self.timeouts.read)

    def close(self) -> None:
        self._session.close()

    def send(self, call: ApiCall) -> Reply:
        """Send the request, again after a pause if it may be repeated. Returns the server's good answer;
        raises one of :mod:`silo.bom.errors` for everything else.
        """
        attempt = 0
        while True:
            attempt += 1
            stop_if(call.cancelled)
            try:
                return self._attempt(call)
            except SiloError as error:
                wait = self._retries.pause(attempt, error, harmless=call.repeatable)
                if wait is None:
                    raise
                self._retries.tell(wait, error)
            self._pause(wait, call.cancelled)

    def _attempt(self, call: ApiCall) -> Reply:
        with self.opened(call) as response:
            reply = self.reply(response, call)
        if not reply.ok:
            raise error_of(reply, writing=call.writing)
        return reply

    @contextmanager
    def opened(self, call: ApiCall, read_timeout: float | None = None) -> Iterator[requests.Response]:
        """Send the request, follow redirects, and yield the response with its body unread. Closes it at the
        end.
        """
        with closing(self.open(call, read_timeout)) as response:
            yield response

    def open(self, call: ApiCall, read_timeout: float | None = None) -> requests.Response:
        """Send the request as :meth:`opened` does; the caller closes the response."""
        url, params, home = call.url, dict(call.params), self.address.origin
        for _ in range(MAX_REDIRECTS + 1):
            carry = may_carry_token(home, origin_of(url))
            response = self._exchange(call, url, params, carry, read_timeout)
            if not response.is_redirect:
                return response
            with closing(response), translated(self.where(call.subject)):
                target = urljoin(url, response.headers["Location"])
                _check_redirect(
                    call, self.address, origin_of(url), origin_of(target), target, response.status_code
                )
                url, params = target, {}
        raise ServerFaultError(
            message(
                "{asked} redirects in a circle; check the server address",
                asked=self.where(call.subject).asked,
            )
        )

    def _exchange(
        self, call: ApiCall, url: str, params: dict[str, Any], carry: bool, read_timeout: float | None
    ) -> requests.Response:
        # A server on this computer is never behind a proxy, whatever the environment says.
        proxies = {"no_proxy": self.address.origin[1]} if self.address.is_loopback else None
        packing = "gzip, deflate" if _CAN_UNPACK else "identity"
        with translated(self.where(call.subject)):
            return self._session.request(
                call.method,
                url,
                params=params,
                data=call.body() if call.body else None,
                headers={"Accept-Encoding": packing, "User-Agent": "silo-mod", **call.headers},
                auth=_Bearer(self._token if carry else None),
                timeout=(self.timeouts.connect, read_timeout or self.timeouts.read),
                allow_redirects=False,
                stream=True,
                verify=self._verify,
                proxies=proxies,
            )

    def reply(self, response: requests.Response, call: ApiCall) -> Reply:
        """Read the whole response within the call's limits."""
        content = b"".join(self.pieces(response, call))
        return Reply(response.status_code, content, self.where(call.subject), response.headers, self._token)

    def pieces(self, response: requests.Response, call: ApiCall) -> Iterator[bytes]:
        """Yield the pieces of the body as they arrive. Raises an error if the body is too large or takes too
        long.
        """
        where = self.where(call.subject)
        deadline = self._clock() + self.timeouts.total
        size, limit = 0, call.max_bytes or self._max_bytes
        with translated(where):
            while piece := read_some(response):
                stop_if(call.cancelled)
                size += len(piece)
                if size > limit:
                    raise ServerFaultError(
                        message(
                            "{asked} answered more than {limit} MB, which is refused",
                            asked=where.asked,
                            limit=f"{limit / 1000000.0:g}",
                        )
                    )
                yield piece
                if self._clock() > deadline and not call.endless:
                    raise UnreachableError(
                        message(
                            "{asked} took more than {total} s to answer; try again later",
                            asked=where.asked,
                            total=f"{self.timeouts.total:g}",
                        )
                    )

            _check_length(response, size, where)

    def _pause(self, seconds: float, cancelled: Cancel | None) -> None:
        if cancelled is None:
            self._retries.sleep(seconds)
        else:
            cancelled.wait(seconds)
            stop_if(cancelled)


def read_some(response: requests.Response) -> bytes:
    """Read and decode what has arrived. Waits only for the first byte; b"" at the end."""
    # `iter_content` waits until a chunk is full, so a slow server could delay us without end.
    raw: Any = response.raw
    if hasattr(raw, "read1"):
        return bytes(raw.read1(_CHUNK, decode_content=True) or b"")
    # urllib3 1 (Debian 12, so FreeCAD 0.20 there) only has it one level deeper, without decoding.
    return bytes(raw._fp.read1(_CHUNK) or b"")


def _check_length(response: requests.Response, size: int, where: Where) -> None:
    # urllib3 1 takes an early end for the end.
    length = whole_number(response.headers.get("Content-Length", ""))
    packed = "Content-Encoding" in response.headers or response.request.method == "HEAD"
    if length is not None and not packed and size < length:
        raise UnreachableError(
            message(
                "{asked} closed the connection after {size} of {length} bytes; try again",
                asked=where.asked,
                size=size,
                length=length,
            )
        )


def stop_if(cancelled: Cancel | None) -> None:
    """Raise :class:`CancelledError` if the caller asked to stop."""
    if cancelled is not None and cancelled.is_set():
        raise CancelledError(message("stopped; what was sent before stays sent"))


def _check_redirect(
    call: ApiCall, home: ServerAddress, here: Origin, there: Origin, target: str, status: int
) -> None:
    shown = f"{there[0]}://{urlsplit(target).netloc}"
    words = urlsplit(target).path.lower().strip("/").split("/")
    if _LOGIN.intersection(words) or words[:2] == ["auth", "oidc"]:
        at = "" if there[1] == here[1] else message(" at {shown}", shown=shown)
        raise AuthError(
            message(
                "{host} wants a login{at}: there is no token, or it is not valid any more. Give a valid "
                "token (SILO_API_TOKEN, or the settings)",
                host=home.host,
                at=at,
            )
        )
    if here[0] == "http" and there[:2] == ("https", here[1]) and not may_carry_token(here, there):
        raise ConfigError(
            message(
                "{host} is served by https: set {shown} as the server address", host=home.host, shown=shown
            )
        )
    if here[0] == "https" and there[0] == "http":
        raise ServerFaultError(
            message(
                "{host} redirects from https to {shown}, which is not secure: refused",
                host=home.host,
                shown=shown,
            )
        )
    if call.writing and not (status in (307, 308) and may_carry_token(here, there)):
        raise ServerFaultError(
            message(
                "{host} redirects a change to {shown}: not followed. If that is the Silo server, set it "
                "as the server address",
                host=home.host,
                shown=shown,
            )
        )


class _Adapter(HTTPAdapter):
    """Connections that wait for the server as long in sending as in reading.

    urllib3 leaves the time-out of connecting, which is short, on a new socket until the request is sent: an
    upload over a line that stalls for some seconds would break.
    """

    def __init__(self, patience: float) -> None:
        self._patience = patience
        super().__init__(pool_connections=4, pool_maxsize=16, max_retries=0)

    def init_poolmanager(self, *args: Any, **options: Any) -> None:
        super().init_poolmanager(*args, **options)
        self._make_patient(self.poolmanager)

    def proxy_manager_for(self, *args: Any, **options: Any) -> Any:
        return self._make_patient(super().proxy_manager_for(*args, **options))

    def _make_patient(self, manager: Any) -> Any:
        kinds = dict(manager.pool_classes_by_scheme)
        manager.pool_classes_by_scheme = {
            name: _patient(pool, self._patience) for name, pool in kinds.items()
        }
        return manager


def _patient(pool: Any, patience: float) -> Any:
    """Make a class of the pool whose connections wait ``patience`` seconds for data once they are
    connected.
    """

    class Connection(pool.ConnectionCls):  # type: ignore[misc]
        def connect(self) -> None:
            super().connect()
            if self.sock is not None:
                self.sock.settimeout(patience)

    return type(pool.__name__, (pool,), {"ConnectionCls": Connection})


def _new_session(patience: float) -> requests.Session:
    from http.cookiejar import DefaultCookiePolicy

    session = requests.Session()
    adapter = _Adapter(patience)
    session.mount("http://", adapter)
    session.mount("https://", adapter)
    # The token is the only thing that says who we are; a session cookie would outlive its withdrawal.
    session.cookies.set_policy(DefaultCookiePolicy(allowed_domains=[]))
    return session
