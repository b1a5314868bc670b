# SPDX-License-Identifier: LGPL-2.1-or-later
"""The items of standard parts on a server.

A standard part has one item per designation and server, for all users and projects. Its identity is
derived from the designation, so no file is stamped. A server that lets us choose an item's UUID has it under
that one. Another server (or one where the item was made by hand) has an item whose description is
exactly the designation; its UUID is remembered in the user's folder.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from silo.bom.entry import BomEntry, walk_entries
from silo.bom.errors import SiloError
from silo.bom_sync.memory import Memory, server_of
from silo.platform.user_folders import data_folder

# Each costs a request, and only while the part is not registered.
MOST_LOOKED_UP = 200


def standard_item_memory() -> Memory:
    """Open the memory of standard parts: server → UUID derived from the designation → UUID of the item."""
    return Memory(data_folder() / "standard-items.json")


def find_items(
    entries: Iterable[BomEntry], items_by_uuid: Mapping[str, Any], api: Any, memory: Memory | None = None
) -> dict[str, Mapping[str, Any]]:
    """Find the items of standard parts that the server does not know by their UUID: UUID → item.

    items_by_uuid
        what the server answered for the UUIDs of the whole tree.
    """
    wanted = {
        entry.silo_uuid: entry.standard
        for entry in walk_entries(entries)
        if entry.is_standard
        and entry.silo_uuid
        and entry.standard
        and items_by_uuid.get(entry.silo_uuid) is None
    }
    if not wanted:
        return {}
    memory = memory or standard_item_memory()
    items = dict(_remembered(wanted, api, memory))
    # A server that reports its last syncs keeps the UUIDs that it is given, so nothing more is asked.
    if any(item is not None and item.get("last_sync") is not None for item in items_by_uuid.values()):
        return items
    searched = {}
    for uuid, designation in [pair for pair in wanted.items() if pair[0] not in items][:MOST_LOOKED_UP]:
        if (item := by_description(designation, api)) is not None:
            searched[uuid] = item
    if searched:
        memory.remember(server_of(api), {uuid: str(item["id"]) for uuid, item in searched.items()})
    return items | searched


def _remembered(
    wanted: Mapping[str, str], api: Any, memory: Memory
) -> Iterator[tuple[str, Mapping[str, Any]]]:
    items = memory.known(server_of(api))
    for uuid, item_id in ((uuid, items[uuid]) for uuid in wanted if uuid in items):
        if (item := api.get_item_by_uuid(item_id)) is not None:
            yield uuid, item


def by_description(designation: str, api: Any) -> Mapping[str, Any] | None:
    """Find the one item whose description (or name) is exactly the designation; None if none or several have
    it.
    """
    search = getattr(api, "search_items", None)
    if not callable(search):
        return None
    try:
        items = {str(item["id"]): item for item in search(designation)}
    except SiloError:
        return None  # nothing is lost: the part reads as unregistered, and can be registered
    same = [
        item
        for item in items.values()
        if designation in (item.get("description"), item.get("name"))
        and str(item.get("item_type") or "part") != "assembly"
    ]
    return same[0] if len(same) == 1 else None
