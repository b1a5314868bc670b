# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a Silo can do, whoever answers: :class:`silo.api.client.SiloClient` over HTTP, or
:class:`silo.testing.FakeSilo` in memory. One contract suite runs over both.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from silo.api.files import Origin, Progress
from silo.api.sse import ServerEvent
from silo.api.transport import Cancel
from silo.api.wire import (
    BomLine,
    FlatLine,
    Item,
    MergeRequest,
    MergeResult,
    Revision,
    ServerState,
    User,
    WhereUsedLine,
)


class EventStream(Protocol):
    """One open stream of events. ``close`` may be called from another thread and ends the iteration."""

    @property
    def last_event_id(self) -> str | None: ...

    def __iter__(self) -> Iterator[ServerEvent]: ...

    def close(self) -> None: ...


class ItemsApi(Protocol):
    """Finding and making items."""

    def get_item_by_uuid(self, uuid: str, /) -> Mapping[str, Any] | None: ...

    def get_items_by_uuid(
        self, uuids: Iterable[str], /, *, cancelled: Cancel | None = None
    ) -> dict[str, Item]: ...

    def get_item(self, part_number: str, /) -> Item: ...

    def get_properties(self, part_number: str, /) -> dict[str, Any]: ...

    def search_items(
        self, query: str = "", *, item_type: str | None = None, limit: int = 50, offset: int = 0
    ) -> list[Item]: ...

    def create_item(
        self,
        schema: str,
        category: str,
        description: str = "",
        *,
        name: str | None = None,
        item_type: str = "part",
        properties: Mapping[str, Any] | None = None,
        projects: Sequence[str] | None = None,
        sourcing_type: str | None = None,
        long_description: str | None = None,
        idempotency_key: str | None = None,
    ) -> Item: ...

    def update_item(self, part_number: str, /, **changes: Any) -> Item: ...

    def generate_part_number(self, schema: str, category: str) -> str: ...

    def get_schema(self, name: str = "kindred-rd") -> dict[str, Any]: ...

    def get_schema_form(self, name: str = "kindred-rd", category: str | None = None) -> dict[str, Any]: ...

    def find_schema(self, wanted: str = "kindred-rd") -> str: ...

    def categories(self, name: str = "kindred-rd") -> dict[str, str]: ...


class BomApi(Protocol):
    """Reading and merging BOMs."""

    def get_bom(self, part_number: str, /) -> list[BomLine]: ...

    def get_boms(
        self, part_numbers: Iterable[str], /, *, cancelled: Cancel | None = None
    ) -> dict[str, list[BomLine]]: ...

    def get_bom_expanded(self, part_number: str, /, depth: int | None = None) -> list[BomLine]: ...

    def get_bom_flat(self, part_number: str, /) -> list[FlatLine]: ...

    def where_used(self, part_number: str, /) -> list[WhereUsedLine]: ...

    def get_bom_version(self, part_number: str, /) -> str | None: ...

    def add_bom_line(self, part_number: str, child: str, /, **values: Any) -> BomLine: ...

    def update_bom_line(self, part_number: str, child: str, /, **changes: Any) -> BomLine: ...

    def remove_bom_line(self, part_number: str, child: str, /) -> None: ...

    def merge_bom(
        self,
        part_number: str,
        request: MergeRequest,
        /,
        *,
        if_match: int | str | None = None,
        cancelled: Cancel | None = None,
    ) -> MergeResult: ...


class FilesApi(Protocol):
    """Revisions and their files."""

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


class ServerApi(Protocol):
    """The server itself."""

    @property
    def base_url(self) -> str: ...

    def web_url(self, path: str, /) -> str: ...

    def whoami(self) -> User: ...

    def ready(self) -> ServerState: ...

    def health(self) -> dict[str, Any]: ...

    def open_events(self, last_event_id: str | None = None) -> EventStream: ...


class SiloApi(ItemsApi, BomApi, FilesApi, ServerApi, Protocol):
    """A Silo."""
