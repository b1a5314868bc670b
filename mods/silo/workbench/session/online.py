# SPDX-License-Identifier: LGPL-2.1-or-later
"""The worker's side of a session: the client, the live connection, and sending. Imported in a worker only."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from silo.api.client import SiloClient
from silo.api.events import Connection, EventListener, Pauses
from silo.api.pause import Pause
from silo.api.sse import RESET, ServerEvent
from silo.bom.errors import ConfigError, InputError
from silo.outbox.entry import Entry as Waiting
from silo.outbox.report import Report, Sent
from silo.outbox.send import send_all
from silo.outbox.store import Store
from silo.workbench.activity.box import PaneEntry
from silo.workbench.activity.events import commit_of_event, of_event
from silo.workbench.activity.sent import of_sent
from silo.workbench.colleagues.announced import Newer
from silo.workbench.garbage import collection_off
from silo.workbench.session.last_events import LastIds
from silo.workbench.session.worker import Control
from silo.workbench.settings.command_line import file_server
from silo.workbench.settings.server import ServerChoice, ServerPreferences, TokenStore, choose_server
from silo.workbench.words import translate


class Online:
    """Talks to the server that the settings name.

    entry, sent, state, newer
        called with a box to show, a commit that arrived (with lines for the report view), the connection
        (kind, reason), and a commit that the server announced (identity, commit); from any thread.
    make_client
        makes the client of a server; :class:`SiloClient` unless given.
    """

    def __init__(
        self,
        outbox: Store,
        *,
        entry: Callable[[PaneEntry], None],
        sent: Callable[[Sent], None],
        state: Callable[[str, str], None],
        newer: Callable[[str, Newer | None], None] = lambda _identity, _newer: None,
        make_client: Callable[[ServerChoice], Any] | None = None,
    ) -> None:
        self._make_client = make_client or _client
        self._outbox = outbox
        self._entry, self._sent, self._state, self._newer = entry, sent, state, newer
        self._last_ids = LastIds(outbox.path.with_name("last-events.json"))
        self._own: set[str] = set()  # merges of ours whose event was not heard yet
        self._client: SiloClient | None = None
        self._server = ServerChoice()
        self._listener: EventListener | None = None

    @property
    def client(self) -> SiloClient:
        """Return the client; :class:`ConfigError` if no server is configured."""
        if self._client is None:
            raise ConfigError(
                translate("Silo", "No Silo server is set up yet. Enter its address in the Silo preferences.")
            )
        return self._client

    @property
    def address(self) -> str:
        """Return the address of the server in use; "" if none is configured."""
        return self._client.base_url if self._client is not None else ""

    def another(self) -> SiloClient:
        """Make one more client of the server for another thread, which closes it."""
        client: SiloClient = self._make_client(self._server)
        return client

    def send(self, control: Control, *, force: bool) -> Report:
        """Send what waits for this server."""

        def progress(waiting: Waiting, done: int, total: int) -> None:
            number = waiting.part_number
            text = translate("Silo", "{file} → {number}", file=waiting.file_name, number=number)
            control.progress(text, done / total if total else None)

        return send_all(
            self._outbox,
            self.client,
            cancelled=control.cancelled,
            on_progress=progress,
            on_sent=self._tell,
            force=force,
        )

    def connect(self, preferences: ServerPreferences, store: TokenStore, *, live: bool) -> ServerChoice:
        """Use the server of the settings; with ``live``, begin to listen to it."""
        self._use(choose_server(preferences, store, file_server=file_server()))
        if self.address:
            # Another token or address may be what was wanted.
            self._outbox.resume(self.address, told=False)
        self._listen(live=live)
        return self._server

    def need_client(self, preferences: ServerPreferences, store: TokenStore) -> None:
        """Make sure that there is a client; :class:`ConfigError` if no server is configured."""
        if self._client is None:
            self._use(choose_server(preferences, store, file_server=file_server()))
        _ = self.client

    def pause(self) -> Pause | None:
        """Return the pause that keeps anything from being sent to the server now; None if there is none."""
        pause = self._outbox.pause(self.address) if self.address else None
        return pause if pause is not None and pause.left(self._outbox.clock()) else None

    def wake(self) -> None:
        """Let the connection look again at a pause that has ended."""
        if self._listener is not None and self._listener.state.kind is not Connection.ONLINE:
            self._listener.retry_now()

    def close(self) -> None:
        """End the connection."""
        self._stop_listening()
        if self._client is not None:
            self._client.close()

    def _use(self, server: ServerChoice) -> None:
        if server == self._server and self._client is not None:
            return
        self._stop_listening()
        if self._client is not None:
            self._client.close()
        self._client = self._make_client(server) if server.url else None
        self._server = server

    def _listen(self, *, live: bool) -> None:
        self._stop_listening()
        if self._client is None or not live:
            self._state("stopped", "")
            return
        url = self._client.base_url
        self._listener = EventListener(
            self._client,
            on_event=lambda event: self._heard(event, url),
            on_state=lambda state: self._state(state.kind.value, state.message),
            last_event_id=self._last_ids.get(url),
            around=collection_off,
            pauses=_SharedPauses(self._outbox, url),
        )
        self._listener.start()

    def _stop_listening(self) -> None:
        if self._listener is not None:
            self._listener.stop(timeout=1.0)
            self._listener = None
            self._last_ids.save()

    def _heard(self, event: ServerEvent, url: str) -> None:
        if event.id is not None:
            self._last_ids.set(url, event.id)
        if event.merge is not None and event.merge.sync_id in self._own:
            # Its box was shown with the answer. After a crash the event must not bring it once more.
            self._own.discard(event.merge.sync_id or "")
            self._last_ids.save()
        if event.type == RESET:
            self._newer("", None)
        elif (announced := commit_of_event(event)) is not None:
            self._newer(*announced)
        entry = of_event(event, self.client.web_url)
        if entry is not None:
            self._entry(entry)

    def _tell(self, sent: Sent) -> None:
        if sent.result is not None:
            self._own.add(sent.sync_id)
            self._last_ids.save()  # the event may have come before the answer
        self._entry(of_sent(sent, self.client.web_url))
        self._sent(sent)


class _SharedPauses(Pauses):
    """The pause of a server, for its live connection."""

    def __init__(self, outbox: Store, url: str) -> None:
        self._outbox, self._url = outbox, url

    def clock(self) -> float:
        return self._outbox.clock()

    def get(self) -> Pause | None:
        with suppress(InputError):  # a disk that is full must not end the connection
            return self._outbox.pause(self._url)
        return None

    def set(self, pause: Pause | None) -> None:
        with suppress(InputError):
            self._outbox.set_pause(self._url, pause)


def _client(server: ServerChoice) -> SiloClient:
    return SiloClient(server.url, server.token or None, verify=server.verify)
