# SPDX-License-Identifier: LGPL-2.1-or-later
"""One request, done with care: time-outs, bounded repeats, redirects, bounded answers, and the token.

The rules of this module:

* a request is repeated only as :mod:`silo.api.policy` allows, a few times, with growing pauses;
* the token goes to the configured server only, never along a redirect to another, never from https to http;
* a changing request (POST, PUT) follows a redirect only within the configured server and with its body;
* an answer has an upper size and an upper duration, however slowly it drips.

What the calls of a client share: how a question becomes a request, and what was learned of the server.
"""

from __future__ import annotations

import json
import logging
import re
import time
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, TypeVar
from urllib.parse import urljoin, urlsplit

import requests
import urllib3
from pydantic import BaseModel, ValidationError
from requests.adapters import HTTPAdapter
from requests.auth import AuthBase

from silo.api.config import Origin, ServerAddress, may_carry_token, origin_of
from silo.api.policy import Reply, Retries, Where, error_of, translated
from silo.bom.errors import (
    AuthError,
    BusyError,
    CancelledError,
    ConfigError,
    ForbiddenError,
    InputError,
    NotFoundError,
    ReadOnlyError,
    RejectedError,
    ServerFaultError,
    SiloError,
    UnreachableError,
)
from silo.bom.numbers import whole_number
from silo.bom.resolve import character_problem, with_allowed_characters
from silo.platform import cache_folder, read_memory, write_memory

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

    ``endless`` answers (downloads) may take as long as they come at all.
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
        return "Bearer ***" if self._token else "no token"


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
            raise ConfigError("the token holds blanks or characters that HTTP does not allow; copy it again")
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
            f"{self.where(call.subject).asked} redirects in a circle; check the server address"
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
                        f"{where.asked} answered more than {limit / 1e6:g} MB, which is refused"
                    )
                yield piece
                if self._clock() > deadline and not call.endless:
                    raise UnreachableError(
                        f"{where.asked} took more than {self.timeouts.total:g} s to answer; try again later"
                    )

            _check_length(response, size, where)

    def _pause(self, seconds: float, cancelled: Cancel | None) -> None:
        if cancelled is None:
            self._retries.sleep(seconds)
        else:
            cancelled.wait(seconds)
            stop_if(cancelled)


def as_json(data: object) -> bytes:
    """Write the data as strict JSON. Raises :class:`InputError` for NaN, bytes, or a value that holds itself.

    A character that no server takes, as in the name of a file, becomes U+FFFD.
    """
    try:
        written = json.dumps(data, ensure_ascii=False, allow_nan=False)
        if "\\u00" in written or character_problem(written):
            written = json.dumps(_sendable(json.loads(written)), ensure_ascii=False)
        return written.encode()
    except (TypeError, ValueError, RecursionError) as error:
        raise InputError(f"this cannot be sent as JSON: {error}") from error


def _sendable(value: Any) -> Any:
    if isinstance(value, dict):
        return {with_allowed_characters(key): _sendable(below) for key, below in value.items()}
    if isinstance(value, list):
        return [_sendable(below) for below in value]
    return with_allowed_characters(value) if isinstance(value, str) else value


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
            f"{where.asked} closed the connection after {size} of {length} bytes; try again"
        )


def stop_if(cancelled: Cancel | None) -> None:
    """Raise :class:`CancelledError` if the caller asked to stop."""
    if cancelled is not None and cancelled.is_set():
        raise CancelledError("stopped; what was sent before stays sent")


def _check_redirect(
    call: ApiCall, home: ServerAddress, here: Origin, there: Origin, target: str, status: int
) -> None:
    shown = f"{there[0]}://{urlsplit(target).netloc}"
    words = urlsplit(target).path.lower().strip("/").split("/")
    if _LOGIN.intersection(words) or words[:2] == ["auth", "oidc"]:
        at = "" if there[1] == here[1] else f" at {shown}"
        raise AuthError(
            f"{home.host} wants a login{at}: there is no token, or it is not valid any more. "
            "Give a valid token (SILO_API_TOKEN, or the settings)"
        )
    if here[0] == "http" and there[:2] == ("https", here[1]) and not may_carry_token(here, there):
        raise ConfigError(f"{home.host} is served by https: set {shown} as the server address")
    if here[0] == "https" and there[0] == "http":
        raise ServerFaultError(f"{home.host} redirects from https to {shown}, which is not secure: refused")
    if call.writing and not (status in (307, 308) and may_carry_token(here, there)):
        raise ServerFaultError(
            f"{home.host} redirects a change to {shown}: not followed. If that is the Silo server, "
            "set it as the server address"
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


log = logging.getLogger("silo.api")

KEPT_S = 24 * 3600.0


class Abilities(BaseModel):
    """What a server can do, kept for a day, so that each run need not try it again; None: nobody tried yet.

    Rights and modes are not kept, they change.

    batch
        many identities in one question.
    boms
        the BOMs of many items in one question.
    look_alikes
        the items that many components may be already, in one question.
    strict
        it refuses keys that it does not know.
    keeps_item_ids
        a new item gets the UUID that the client proposes.
    schemas
        the part-number schema that is taken for a wanted one.
    """

    batch: bool | None = None
    boms: bool | None = None
    look_alikes: bool | None = None
    strict: bool = False
    keeps_item_ids: bool = False
    schemas: dict[str, str] = {}


class _KeptAbilities(Abilities):
    learned_at: float


def abilities_path() -> Path:
    """Return the file in which this user's programs keep what they learned about servers."""
    return cache_folder() / "servers.json"


def load_abilities(path: Path, server: str, *, clock: Callable[[], float] = time.time) -> Abilities:
    """Read what is known of a server; nothing if that is older than a day."""
    try:
        memory = _KeptAbilities.model_validate(read_memory(path).get(server), strict=True)
    except ValidationError:
        return Abilities()
    fresh = 0 <= clock() - memory.learned_at < KEPT_S
    return Abilities(**memory.model_dump(exclude={"learned_at"})) if fresh else Abilities()


def save_abilities(
    path: Path, server: str, abilities: Abilities, *, clock: Callable[[], float] = time.time
) -> None:
    """Write what is known of a server into one small JSON file for all servers. Ignores a failed write.

    It is only a memory: a file that is lost, old or damaged costs some requests, never an answer.
    """
    content = {**read_memory(path), server: {**abilities.model_dump(), "learned_at": clock()}}
    if (error := write_memory(path, content)) is not None:
        log.info("%s: what was learned about %s is not kept (%s)", path, server, error)


T = TypeVar("T")
K = TypeVar("K", bound=Hashable)
Body = TypeVar("Body", bound=BaseModel)

LISTS = ("items", "entries", "lines", "bom", "results", "data")
"""The keys under which servers put a list that is not bare."""

MAX_IN_BATCH = 1000
"""Things in one batch question."""

MAX_WORKERS = 8
"""Questions at once where the server has no batch look-up."""

_UNKNOWN_KEY = re.compile(
    r"(unknown|unrecogni[sz]ed|unexpected|additional|extra|unsupported)\s+(json\s+)?"
    r"(fields?|keys?|propert|inputs?|parameters?|attributes?)|not permitted",
    re.IGNORECASE,
)

Params = Mapping[str, str | int]


class Caller:
    """Base of the client's parts: an address and a transport."""

    _address: ServerAddress
    _transport: Transport
    abilities: Abilities
    _refused: frozenset[str] = frozenset()  # batch requests, for this token and mode

    def _get(self, subject: str, *segments: str, params: Params | None = None) -> Reply:
        """Send a GET request, which may be repeated freely."""
        return self._transport.send(
            ApiCall(
                "GET",
                self._address.api(*segments),
                subject,
                params=params or {},
                headers={"Accept": "application/json"},
                repeatable=True,
            )
        )

    def _all(
        self, kind: type[Body], subject: str, *segments: str, keys: Sequence[str] = (), **params: str | int
    ) -> Iterator[tuple[list[Body], int]]:
        """Yield the rows of a list to its end, page by page, each page with the total number of rows.

        Raises :class:`ServerFaultError` if the server has more rows and does not show them: an incomplete
        list is no answer.
        """
        more, rows, last = dict(params), 0, list[Body]()
        while True:
            reply = self._get(subject, *segments, params=more)
            page = reply.models(kind, *keys, *LISTS)
            fresh = [] if page == last else page  # a server that knows no pages sends the same once more
            rows, following = rows + len(fresh), reply.next if page else {}
            total = max(reply.total, rows + bool(following))
            yield fresh, total
            if rows >= total:
                return
            if not fresh:
                raise ServerFaultError(
                    f"{subject}: {self._address.host} has more of them than the {rows} that it shows, "
                    "whatever page is asked for. Its administrator can make the pages of lists larger"
                )
            last, more = page, {**params, **(following or {"offset": rows})}

    def _ask(self, subject: str, *segments: str, cancelled: Cancel | None = None, **asked: Any) -> Reply:
        """Ask a question that is too long for an address: a POST that may be repeated freely."""
        return self._change("POST", subject, *segments, body=asked, repeatable=True, cancelled=cancelled)

    def _change(
        self,
        method: str,
        subject: str,
        *segments: str,
        body: BaseModel | Mapping[str, Any],
        headers: Mapping[str, str] | None = None,
        repeatable: bool = False,
        cancelled: Cancel | None = None,
        extensions: Sequence[str] = (),
    ) -> Reply:
        """Send a model, or the values for one, as JSON.

        extensions
            keys that only our own server knows, also inside lists of objects. A strict server refuses them:
            it gets the request once more without them, and never gets any again.
        """
        # Not pydantic's own JSON, which writes NaN as null: a value that JSON lacks is an error, not a gap.
        values = body.model_dump(by_alias=True, exclude_none=True) if isinstance(body, BaseModel) else body
        bare = _without(values, extensions)

        def send(data: Any) -> Reply:
            content = as_json(data)
            return self._transport.send(
                ApiCall(
                    method,
                    self._address.api(*segments),
                    subject,
                    body=lambda: content,
                    headers={
                        "Accept": "application/json",
                        "Content-Type": "application/json",
                        **(headers or {}),
                    },
                    repeatable=repeatable,
                    cancelled=cancelled,
                )
            )

        if self.abilities.strict or bare == values:
            return send(bare)
        try:
            return send(values)
        except RejectedError as error:
            if not _UNKNOWN_KEY.search(f"{error} {' '.join(error.problems)}"):
                raise
        reply = send(bare)
        self.abilities.strict = True
        return reply

    def _many(
        self,
        ability: str,
        keys: Iterable[K],
        batch: Callable[[Sequence[K]], Mapping[K, T]],
        single: Callable[[K], T | None],
        cancelled: Cancel | None = None,
    ) -> dict[K, T]:
        """Ask about many things: in few requests if the server can answer these, else one by one in a bounded
        pool.

        ability
            the field of :class:`Abilities` that says if the server has such a request.
        """
        wanted = list(dict.fromkeys(keys))
        answers: dict[K, T] = {}
        chunks = [wanted[start : start + MAX_IN_BATCH] for start in range(0, len(wanted), MAX_IN_BATCH)]
        while chunks:
            stop_if(cancelled)
            chunk = chunks.pop(0)
            answer = None
            if ability not in self._refused and getattr(self.abilities, ability) is not False:
                try:
                    answer = batch(chunk)
                    setattr(self.abilities, ability, True)
                except NotFoundError:
                    setattr(self.abilities, ability, False)
                except (ForbiddenError, ReadOnlyError, BusyError):
                    # No POST for viewers and on a read-only server: GET is allowed anyway.
                    self._refused = self._refused | {ability}
                except RejectedError:
                    # Too many at once, or a malformed key, which spoils the batch: alone, it is unknown.
                    if len(chunk) > 1:
                        half = len(chunk) // 2
                        chunks[:0] = [chunk[:half], chunk[half:]]
                        continue
            answers.update(_one_by_one(chunk, single, cancelled) if answer is None else answer)
        return answers

    def _delete(self, subject: str, *segments: str) -> None:
        self._transport.send(ApiCall("DELETE", self._address.api(*segments), subject))


def body(kind: type[Body], values: Mapping[str, Any], thing: str) -> Body:
    """Make a request from the values. :class:`InputError` lists all values that do not fit."""
    unknown = sorted(set(values) - set(kind.model_fields) - {"schema"})
    if unknown:
        text = ", ".join(kind.model_fields)
        raise InputError(f"{', '.join(unknown)}: no field of {thing}; wanted some of {text}")
    try:
        return kind.model_validate(values)
    except ValidationError as error:
        wrong = "; ".join(f"{'.'.join(map(str, e['loc']))}: {e['msg']}" for e in error.errors())
        raise InputError(f"these values do not fit {thing}: {wrong}") from error


def _one_by_one(keys: Sequence[K], single: Callable[[K], T | None], cancelled: Cancel | None) -> dict[K, T]:
    def one(key: K) -> T | None:
        stop_if(cancelled)
        return single(key)

    with ThreadPoolExecutor(min(MAX_WORKERS, len(keys)), "silo-lookup") as pool:
        try:
            results = list(pool.map(one, keys))
        except BaseException:
            # One failed, so the rest is no longer needed.
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return {key: value for key, value in zip(keys, results, strict=True) if value is not None}


def _without(data: Any, keys: Sequence[str]) -> Any:
    """Return the data without these keys, here and in lists of objects; other values stay as they are."""
    if not keys or not isinstance(data, dict):
        return data
    return {
        key: [_without(member, keys) for member in value] if isinstance(value, list) else value
        for key, value in data.items()
        if key not in keys
    }
