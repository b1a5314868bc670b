# SPDX-License-Identifier: LGPL-2.1-or-later
"""``SiloClient``: a Silo server as Python calls. A method is one question, :mod:`silo.api.transport` asks it.

What comes back are the wire models, which also read as mappings. What goes wrong is one of
:mod:`silo.bom.errors`. Methods that may take long accept ``cancelled``, anything like a
:class:`threading.Event`; it is looked at before each attempt, between the pieces of an answer and in pauses.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, suppress
from pathlib import Path
from typing import Any, Protocol, Self

import requests

from silo.api.address import ServerAddress
from silo.api.boms import BomCalls
from silo.api.caller import Abilities, load_abilities, save_abilities
from silo.api.events import SILENCE, HttpEventStream, open_stream
from silo.api.files import Origin, Progress
from silo.api.items import ItemCalls
from silo.api.policy import Retries
from silo.api.sse import ServerEvent
from silo.api.transport import Call, Cancel, Timeouts, Transport, stop_if
from silo.api.wire import MergeRequest, MergeResult, Revision, ServerState, User
from silo.bom.errors import SiloError


class SiloClient(ItemCalls, BomCalls):
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
        a file in which what was learned about the server is kept for a day (:mod:`silo.api.caller`).

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
        """Give the connections back, and keep what was learned about the server."""
        if self._memory is not None and self.abilities != self._known_before:
            save_abilities(self._memory, self.base_url, self.abilities)
        self._transport.close()

    @property
    def base_url(self) -> str:
        """The address of the server's pages, without a slash at the end."""
        return self._address.web_root

    def web_url(self, path: str, /) -> str:
        """The full address of a page such as ``resolve_url``; :class:`InputError` for another server's."""
        return self._address.web(path)

    def whoami(self) -> User:
        """Who the token belongs to; raises :class:`silo.bom.errors.AuthError` where it is not accepted."""
        return self._get("who we are", "auth", "me").model(User)

    @property
    def keeps_item_ids(self) -> bool:
        """True where the server says that a new item gets the UUID that we propose, or was seen to do it."""
        if not self.abilities.keeps_item_ids and not self._asked_for_item_ids:
            self._asked_for_item_ids = True
            with suppress(SiloError):
                self.abilities.keeps_item_ids = self.ready().takes_item_ids
        return self.abilities.keeps_item_ids

    def ready(self) -> ServerState:
        """Whether the server takes changes: ``normal``, ``read-only`` or ``degraded``."""
        call = Call("GET", f"{self._address.web_root}/ready", "/ready", repeatable=False)
        with self._transport.opened(call) as response:
            reply = self._transport.reply(response, call)
        # A server that is not ready says so with 503, and why in the same form.
        return ServerState.model_validate(reply.mapping(accept=(503,)))

    def modules(self) -> list[str]:
        """The names of the server's modules that are on."""
        said = self._get("its modules", "modules").mapping()
        found = said.get("modules", said)
        if isinstance(found, dict):
            return [name for name, on in found.items() if not isinstance(on, dict) or on.get("enabled", True)]
        return [str(one.get("name", one)) if isinstance(one, dict) else str(one) for one in found or ()]

    def open_events(self, last_event_id: str | None = None) -> HttpEventStream:
        """Open the event stream; :class:`silo.api.events.EventListener` keeps one open for good."""
        return open_stream(self._transport, last_event_id, self._silence)

    def events(
        self, last_event_id: str | None = None, *, cancelled: Cancel | None = None
    ) -> Iterator[ServerEvent]:
        """The events from one connection, heartbeats included, until the server ends it.

        ``last_event_id`` replays what came after. ``cancelled`` is looked at with each event.
        Raises :class:`silo.bom.errors.UnreachableError` when the stream falls silent or breaks.
        """
        with closing(self.open_events(last_event_id)) as stream:
            for event in stream:
                stop_if(cancelled)
                yield event


class SendApi(Protocol):
    """What the outbox needs of a Silo.

    :class:`SiloClient` has it over HTTP, :class:`silo.testing.FakeSilo` in memory; one suite tests both.
    """

    @property
    def base_url(self) -> str: ...

    def get_item_by_uuid(self, uuid: str, /) -> Mapping[str, Any] | None: ...

    def get_bom(self, part_number: str, /) -> Sequence[Any]: ...

    def merge_bom(
        self, part_number: str, request: MergeRequest, /, *, cancelled: Cancel | None = None
    ) -> MergeResult: ...

    def ready(self) -> ServerState: ...

    def revisions(
        self, part_number: str, /, *, newest: int | None = None, after: int = 0
    ) -> list[Revision]: ...

    def get_revision(self, part_number: str, number: int, /) -> Revision: ...

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
    ) -> Revision: ...

    def download_file(
        self,
        part_number: str,
        path: Path | str,
        revision: int | None = None,
        on_progress: Progress | None = None,
        *,
        cancelled: Cancel | None = None,
    ) -> str: ...
