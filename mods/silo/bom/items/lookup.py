# SPDX-License-Identifier: LGPL-2.1-or-later
"""The items of Silo UUIDs, in as few requests as the server allows (spec bom-sync §2)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Protocol


class ItemLookup(Protocol):
    """What is needed of a client.

    ``get_items_by_uuid(uuids)`` is used where the client has it; it gives a mapping UUID → item (or None), or
    the items found, each naming its UUID as ``id``, ``uuid`` or ``silo_uuid``.
    """

    def get_item_by_uuid(self, uuid: str, /) -> Mapping[str, Any] | None: ...


Known = Mapping[str, Mapping[str, Any] | None]

_UUID_KEYS = ("id", "uuid", "silo_uuid")


def look_up(uuids: Iterable[str], api_client: ItemLookup) -> Known:
    """Look up the items of these UUIDs, each once; None (or absent) if the server has none."""
    wanted = list(dict.fromkeys(uuids))
    batch = getattr(api_client, "get_items_by_uuid", None)
    if callable(batch) and wanted:
        items = _by_uuid(batch(wanted))
        return {uuid: items.get(uuid) or items.get(uuid.lower()) for uuid in wanted}
    return {uuid: api_client.get_item_by_uuid(uuid) for uuid in wanted}


def _by_uuid(answer: Any) -> Known:
    if isinstance(answer, Mapping):
        return answer
    items = [item for item in answer or () if item is not None]
    return {str(item[key]): item for item in items for key in _UUID_KEYS if item.get(key)}
