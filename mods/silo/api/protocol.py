# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the event listener and the outbox need of a Silo.

:class:`silo.api.client.SiloClient` has it over HTTP, :class:`silo.testing.FakeSilo` in memory; one contract
suite runs over both.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from silo.api.files import Origin
from silo.api.multipart import Progress
from silo.api.sse import ServerEvent
from silo.api.transport import Cancel
from silo.api.wire import MergeRequest, MergeResult, Revision, ServerState


class EventStream(Protocol):
    """One open stream of events. ``close`` may be called from another thread and ends the iteration."""

    @property
    def last_event_id(self) -> str | None: ...

    def __iter__(self) -> Iterator[ServerEvent]: ...

    def close(self) -> None: ...


class SendApi(Protocol):
    """What sending needs of a Silo."""

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
