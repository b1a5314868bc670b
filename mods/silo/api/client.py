# SPDX-License-Identifier: LGPL-2.1-or-later
"""``SiloClient``: a Silo server as Python calls. A method is one question, :mod:`silo.api.transport` asks
it.

What comes back are the wire models, which also read as mappings. What goes wrong is one of
:mod:`silo.bom.errors`. Methods that may take long accept ``cancelled``, anything like a
:class:`threading.Event`; it is looked at before each attempt, between the pieces of an answer and in pauses.
"""

from __future__ import annotations

import hashlib
import secrets
import socket
from collections.abc import Iterator
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Self
from urllib.parse import quote

import requests

from silo.api.abilities import Abilities, load_abilities, save_abilities
from silo.api.address import ServerAddress
from silo.api.boms import BomCalls
from silo.api.events import SILENCE, HttpEventStream, open_stream
from silo.api.items import ItemCalls
from silo.api.policy import Retries
from silo.api.sse import ServerEvent
from silo.api.tables import TableCalls
from silo.api.transport import ApiCall, Cancel, Timeouts, Transport, stop_if
from silo.api.wire import ServerState, SystemState, User, login_code
from silo.bom.errors import SiloError
from silo.bom.message import message


@dataclass(frozen=True)
class BrowserLogin:
    """A login that a user confirms: the token to come, the page to open, the code that both sides show."""

    token: str
    page: str
    code: str


class SiloClient(ItemCalls, BomCalls, TableCalls):
    """A Silo server.

    base_url
        ``https://host[:port]``; an address with a path of its own is used as it is.
    token
        ``silo_…``; sent to this server only, never shown or logged.
    timeout
        seconds: one number, or (connect, read). ``total_timeout`` bounds a whole answer.
    session
        a :class:`requests.Session` of one's own (adapters, proxies); else the client makes one.
    verify
        True, False (no check of the certificate), or the path of a file with certificate authorities.
    retries
        how often and how soon a harmless request is repeated.
    max_bytes
        more than this is refused in an answer (downloads have their own limit).
    silence
        seconds after which an event stream without a byte counts as dead.
    memory
        a file in which what was learned about the server is kept for a day (:mod:`silo.api.abilities`).

    May be shared between threads. Close it, or use it as a context manager.
    """

    def __init__(
        self,
        base_url: str,
        token: str | None = None,
        *,
        timeout: float | tuple[float, float] = (5.0, 30.0),
        total_timeout: float = 300.0,
        session: requests.Session | None = None,
        verify: bool | str | Path = True,
        retries: Retries | None = None,
        max_bytes: int = 64 << 20,
        silence: float = SILENCE,
        memory: Path | None = None,
    ) -> None:
        connect, read = timeout if isinstance(timeout, tuple) else (timeout, timeout)
        self._address = ServerAddress.parse(base_url)
        self._silence = silence
        self._memory = memory
        self._asked_for_item_ids = False
        self.abilities = load_abilities(memory, self.base_url) if memory is not None else Abilities()
        self._known_before = self.abilities.model_copy(deep=True)
        self._transport = Transport(
            self._address,
            token,
            timeouts=Timeouts(connect, read, total_timeout),
            retries=retries or Retries(),
            verify=verify if isinstance(verify, bool) else str(verify),
            session=session,
            max_bytes=max_bytes,
        )

    def __repr__(self) -> str:
        return f"SiloClient({self.base_url!r}, token={'set' if self._transport.has_token else 'none'})"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections, and save what was learned about the server."""
        if self._memory is not None and self.abilities != self._known_before:
            save_abilities(self._memory, self.base_url, self.abilities)
        self._transport.close()

    @property
    def base_url(self) -> str:
        """Return the address of the server's pages, without a slash at the end."""
        return self._address.web_root

    @property
    def local(self) -> bool:
        """Return True if the server is on this machine."""
        return self._address.is_loopback

    def web_url(self, path: str, /) -> str:
        """Return the full address of a page such as ``resolve_url``. :class:`InputError` for a page of
        another server.
        """
        return self._address.web(path)

    def whoami(self) -> User:
        """Return the user to whom the token belongs; raises :class:`silo.bom.errors.AuthError` if the server
        does not accept it.
        """
        return self._get(message("who we are"), "auth", "me").model(User)

    def begin_login(self, program: str) -> BrowserLogin | None:
        """Make a secret and the page on which a user lets this program in; None if the server has no such
        page.

        The page shows the program and this computer. The program makes the secret itself, and the browser
        carries only its SHA-256.
        """
        if not self.ready().browser_login:
            return None
        secret = "silo_" + secrets.token_hex(20)
        proof = hashlib.sha256(secret.encode()).hexdigest()
        name = message(
            "{program} on {gethostname}",
            program=program,
            gethostname=socket.gethostname() or message("this computer"),
        )
        page = f"/login/program?name={quote(name, safe='')}&proof={proof}"
        return BrowserLogin(secret, self.web_url(page), login_code(proof))

    @property
    def keeps_item_ids(self) -> bool:
        """Return True if the server says, or has shown, that a new item gets the UUID that we propose. Asks
        once.
        """
        if not self.abilities.keeps_item_ids and not self._asked_for_item_ids:
            self._asked_for_item_ids = True
            with suppress(SiloError):
                self.abilities.keeps_item_ids = self.ready().takes_item_ids
        return self.abilities.keeps_item_ids

    def ready(self) -> ServerState:
        """Ask if the server takes changes: ``normal``, ``read-only`` or ``degraded``."""
        call = ApiCall("GET", f"{self._address.web_root}/ready", "/ready", repeatable=False)
        with self._transport.opened(call) as response:
            reply = self._transport.reply(response, call)
        # A server that is not ready says so with 503, and why in the same form.
        return ServerState.model_validate(reply.mapping(accept=(503,)))

    def system(self, forwarded_for: str) -> SystemState:
        """Return how the server is, and how the request reached it; for administrators.

        forwarded_for
            the address that the request claims to come from. Who believes the claim believes everybody.
        """
        call = ApiCall(
            "GET",
            f"{self._address.web_root}/api/admin/system",
            message("how it is"),
            headers={"X-Forwarded-For": forwarded_for},
            repeatable=True,
        )
        return self._transport.send(call).model(SystemState)

    def modules(self) -> list[str]:
        """Return the names of the server's modules that are on."""
        answer = self._get(message("its modules"), "modules").mapping()
        data = answer.get("modules", answer)
        if isinstance(data, dict):
            return [name for name, on in data.items() if not isinstance(on, dict) or on.get("enabled", True)]
        return [
            str(module.get("name", module)) if isinstance(module, dict) else str(module)
            for module in data or ()
        ]

    def open_events(self, last_event_id: str | None = None) -> HttpEventStream:
        """Open the event stream; :class:`silo.api.events.EventListener` keeps one open for good."""
        return open_stream(self._transport, last_event_id, self._silence)

    def events(
        self, last_event_id: str | None = None, *, cancelled: Cancel | None = None
    ) -> Iterator[ServerEvent]:
        """Yield the events of one connection, heartbeats included, until the server ends it.

        ``last_event_id``: the server sends the events after it again. ``cancelled`` is checked at each event.
        Raises :class:`silo.bom.errors.UnreachableError` if the stream stops or breaks.
        """
        with closing(self.open_events(last_event_id)) as stream:
            for event in stream:
                stop_if(cancelled)
                yield event
