# SPDX-License-Identifier: LGPL-2.1-or-later
"""What could not be sent yet: file revisions and BOM snapshots, kept until the server has them.

An entry is taken at commit time and sent in order per item when the server answers again, also after a crash.
Sending twice does no harm: a BOM by its ``sync_id``, a file by a look at the revisions that the server got
since the first attempt. What the server rejects stays visible with its reason and holds up nobody.
"""

from __future__ import annotations

import json
import random
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from uuid import uuid4

from silo.api.events import Backoff
from silo.api.multipart import as_json
from silo.api.outbox_send import Delivery, EntryProgress, OutboxApi, Sender, SendReport
from silo.api.outbox_store import Kind, OutboxEntry, State, Store
from silo.api.transport import Cancel
from silo.api.wire import MergeRequest
from silo.bom.errors import ConflictError, InputError
from silo.folders import data_folder

__all__ = ["Delivery", "Kind", "Outbox", "OutboxEntry", "SendReport", "State", "default_path"]


def default_path() -> Path:
    """The user's outbox."""
    return data_folder() / "outbox.sqlite3"


class Outbox:
    """A durable queue in one SQLite file (mode 0600); several processes and threads may share it.

    path
        the file; beside it lies a folder with copies of the files to send.
    backoff
        pauses after a passing failure, in seconds.
    clock, chance
        the time (seconds since 1970) and the dice for those pauses; for tests.
    """

    def __init__(
        self,
        path: Path | None = None,
        *,
        backoff: Backoff | None = None,
        clock: Callable[[], float] = time.time,
        chance: Callable[[], float] = random.random,
    ) -> None:
        self._store = Store(path or default_path())
        self._backoff = backoff or Backoff(first=5.0, longest=900.0)
        self._clock, self._chance = clock, chance

    @property
    def path(self) -> Path:
        return self._store.path

    def add(
        self,
        server: str,
        part_number: str,
        *,
        file: Path | None = None,
        comment: str = "",
        properties: Mapping[str, Any] | None = None,
        bom: MergeRequest | None = None,
        taken_at: float | None = None,
    ) -> tuple[OutboxEntry, ...]:
        """Put a commit aside: its file, its BOM, or both (the file is sent first). On disk when it returns.

        server
            the client's ``base_url``: an entry goes to the server it was meant for, and to no other.
        file
            copied now, so that it may be edited further.
        bom
            a ``sync_id`` is given where it has none.
        """
        if file is None and bom is None:
            raise InputError(f"{part_number}: neither a file nor a BOM to keep; give at least one")
        common = {
            "commit_key": str(uuid4()),
            "server": server,
            "part_number": part_number,
            "taken_at": self._clock() if taken_at is None else taken_at,
        }
        rows = []
        if file is not None:
            rows.append({**common, **self._file_row(file, comment, properties)})
        if bom is not None:
            rows.append({**common, **_bom_row(bom)})
        ids = self._store.insert(rows)
        return tuple(entry for entry in map(self._store.entry, ids) if entry is not None)

    def _file_row(self, file: Path, comment: str, properties: Mapping[str, Any] | None) -> dict[str, Any]:
        key = str(uuid4())
        # Checked before the copy is made: what is no JSON now will not be later.
        known = json.loads(as_json(dict(properties or {})))
        name = f"{key}{file.suffix[:20]}"
        sha256, size = self._store.copy_in(file, name)
        payload = {
            "path": str(file),
            "copy": name,
            "file_name": file.name,
            "sha256": sha256,
            "size": size,
            "comment": comment,
            "properties": known,
        }
        return {"key": key, "kind": Kind.FILE, "payload": json.dumps(payload)}

    def pending(self) -> tuple[OutboxEntry, ...]:
        """Everything that is not sent, oldest first: what waits, and what was rejected."""
        return self._store.entries()

    def send_all(
        self,
        client: OutboxApi,
        *,
        cancelled: Cancel | None = None,
        on_progress: EntryProgress | None = None,
        on_delivery: Callable[[Delivery], object] | None = None,
        force: bool = False,
    ) -> SendReport:
        """Send what waits for this client's server and is due, oldest first, in order per item.

        Never raises for what the server or the network does: the report says it, entry by entry. Where
        another process or thread is sending, it says ``busy`` and leaves it to that one.

        force
            also what is to be tried later only (a person pressed the button, the connection came back).
        """
        with self._store.send_lock() as mine:
            if not mine:
                return SendReport(busy=True, waiting=self._waiting(client.base_url))
            self._store.sweep()
            sender = Sender(self._store, client, self._backoff, self._clock, self._chance)
            return sender.run(cancelled, on_progress, on_delivery, force=force)

    def _waiting(self, server: str) -> int:
        return sum(1 for e in self.pending() if e.state is State.WAITING and e.server == server)

    def retry(self, entry_id: int, server: str | None = None) -> OutboxEntry:
        """Let a rejected or pausing entry go again with the next :meth:`send_all`.

        server
            send it there instead (the server moved).

        Raises :class:`ConflictError` where something newer of the same item has arrived since.
        """
        entry = self._known(entry_id)
        if entry.superseded:
            thing = "file" if entry.kind is Kind.FILE else "BOM"
            raise ConflictError(
                f"{entry.part_number}: a newer {thing} was sent since, and this one would undo it. Discard it"
            )
        changed: dict[str, Any] = {"state": State.WAITING, "reason": "", "next_attempt": 0.0}
        if server is not None and server != entry.server:
            # What was seen of the old server says nothing of the new one.
            changed |= {"server": server, "base_revision": None}
        self._store.update(entry_id, **changed)
        return self._known(entry_id)

    def discard(self, entry_id: int) -> None:
        """Forget an entry and its copy of the file; the file itself is not touched."""
        self._store.remove(self._known(entry_id))

    def _known(self, entry_id: int) -> OutboxEntry:
        entry = self._store.entry(entry_id)
        if entry is None:
            raise InputError(f"the outbox has no entry {entry_id}; it was sent or discarded meanwhile")
        return entry


def _bom_row(bom: MergeRequest) -> dict[str, Any]:
    request = bom if bom.sync_id else bom.model_copy(update={"sync_id": str(uuid4())})
    payload = request.model_dump_json(by_alias=True, exclude_none=True)
    # The row's key is its own: two entries may carry one sync_id, and the server tells them apart from us.
    return {"key": str(uuid4()), "kind": Kind.BOM, "payload": payload}
