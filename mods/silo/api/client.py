# SPDX-License-Identifier: LGPL-2.1-or-later
"""``SiloClient``: a Silo server as Python calls. A method is one question, :mod:`silo.api.transport` asks
it.

What comes back are the wire models, which also read as mappings. What goes wrong is one of
:mod:`silo.bom.errors`. Methods that may take long accept ``cancelled``, anything like a
:class:`threading.Event`; it is looked at before each attempt, between the pieces of an answer and in pauses.
"""

from __future__ import annotations

import socket
from collections.abc import Iterator, Mapping
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self
from urllib.parse import quote, urlencode

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
from silo.api.wire import DeviceCodes, DeviceToken, ServerState, SystemState, User
from silo.bom.errors import AuthError, SiloError
from silo.bom.message import message

DEVICE_GRANT = "urn:ietf:params:oauth:grant-type:device_code"
# However seldom a server wants to be asked.
MOST_INTERVAL_S = 30.0


@dataclass(frozen=True)
class BrowserLogin:
    """A login that waits for a user (RFC 8628): the page to open, and the code that it asks for.

    interval_s
        the seconds to wait before each :meth:`SiloClient.asked_again`.
    lives_s
        how long the login waits in all.
    token
        "" until the user let the program in.
    """

    device_code: str
    page: str
    code: str
    interval_s: float
    lives_s: float
    token: str = ""


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
        """Ask the server for a code, with which a user lets this program in on a page of the server; None if
        the server has no such page.
        """
        if not self.ready().device_login:
            return None
        asked = {"client_id": program, "machine": socket.gethostname()[:60]}
        codes = self._transport.send(self._form(asked)).model(DeviceCodes)
        # The page is one of the server that was asked, whatever the answer says.
        page = self.web_url(f"/login/device?code={quote(codes.user_code, safe='')}")
        interval = min(max(codes.interval, 1.0), MOST_INTERVAL_S)
        return BrowserLogin(codes.device_code, page, codes.user_code, interval, codes.expires_in)

    def asked_again(self, login: BrowserLogin) -> BrowserLogin:
        """Ask if the user let the program in, and return the login with its token if so.

        Raises AuthError if the user refused, or the login is over.
        """
        asked = {"grant_type": DEVICE_GRANT, "device_code": login.device_code, "client_id": "silo-mod"}
        call = self._form(asked, "token")
        with self._transport.opened(call) as response:
            reply = self._transport.reply(response, call)
        answer = DeviceToken.model_validate(reply.mapping(accept=(400,)))
        if answer.access_token:
            return replace(login, token=answer.access_token)
        if answer.error == "authorization_pending":
            return login
        if answer.error == "slow_down":  # by five seconds, as RFC 8628 has it
            return replace(login, interval_s=min(login.interval_s + 5.0, MOST_INTERVAL_S))
        if answer.error == "access_denied":
            raise AuthError(message("the login was refused on the server's page"))
        raise AuthError(
            message(
                "the login is over: nobody let the program in within {minutes} minutes; begin again",
                minutes=round(login.lives_s / 60),
            )
        )

    def _form(self, fields: Mapping[str, str], *more: str) -> ApiCall:
        return ApiCall(
            "POST",
            self._address.api("auth", "device", *more),
            message("a login"),
            body=lambda: urlencode(fields),
            headers={"Content-Type": "application/x-www-form-urlencoded"},
        )

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
