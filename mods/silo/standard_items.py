# SPDX-License-Identifier: LGPL-2.1-or-later
"""Items of standard parts: one per designation and server, whoever registers it and in whatever project.

The identity of a standard part is derived from its designation, so no file is stamped. A server that lets us
choose an item's UUID has it under that one. Another server (or one where somebody made the item by hand) has
an item whose description is exactly the designation; which one it is, is remembered in the user's folder.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from silo.bom.errors import SiloError
from silo.bom.model import BomEntry, walk_entries
from silo.platform import data_folder, read_memory, write_memory

# Each costs a request, and only while nobody has registered the part.
MOST_LOOKED_UP = 200


class Memory:
    """Server → UUID derived from the designation → UUID of the item there. One small file."""

    def __init__(self, path: Path | None = None) -> None:
        self.path = path or data_folder() / "standard-items.json"

    def known(self, server: str) -> dict[str, str]:
        """What is known of a server; nothing where the file cannot be read, which only costs a search."""
        return self._read().get(server, {})

    def remember(self, server: str, found: Mapping[str, str]) -> None:
        """Keep what was found or made; what cannot be written costs a search."""
        servers = self._read()
        before = servers.get(server, {})
        if found.items() <= before.items():
            return
        write_memory(self.path, {**servers, server: {**before, **found}})

    def _read(self) -> dict[str, dict[str, str]]:
        return {server: known for server, known in read_memory(self.path).items() if isinstance(known, dict)}


def find_items(
    entries: Iterable[BomEntry], known: Mapping[str, Any], api: Any, memory: Memory | None = None
) -> dict[str, Mapping[str, Any]]:
    """The items of standard parts that the server does not know by their UUID: UUID → item.

    known
        what the server answered for the UUIDs of the whole tree.
    """
    wanted = {
        entry.silo_uuid: entry.standard
        for entry in walk_entries(entries)
        if entry.is_standard and entry.silo_uuid and entry.standard and known.get(entry.silo_uuid) is None
    }
    if not wanted:
        return {}
    memory = memory or Memory()
    found = dict(_remembered(wanted, api, memory))
    # A server that reports its last syncs keeps the UUIDs that it is given, so nothing more is asked.
    if any(item is not None and item.get("last_sync") is not None for item in known.values()):
        return found
    searched = {}
    for uuid, designation in [pair for pair in wanted.items() if pair[0] not in found][:MOST_LOOKED_UP]:
        if (item := by_description(designation, api)) is not None:
            searched[uuid] = item
    if searched:
        memory.remember(server_of(api), {uuid: str(item["id"]) for uuid, item in searched.items()})
    return found | searched


def _remembered(
    wanted: Mapping[str, str], api: Any, memory: Memory
) -> Iterator[tuple[str, Mapping[str, Any]]]:
    known = memory.known(server_of(api))
    for uuid, item_id in ((uuid, known[uuid]) for uuid in wanted if uuid in known):
        if (item := api.get_item_by_uuid(item_id)) is not None:
            yield uuid, item


def by_description(designation: str, api: Any) -> Mapping[str, Any] | None:
    """The one item whose description (or name) is exactly the designation; None for none and for several."""
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


def server_of(api: Any) -> str:
    """How a memory names the server."""
    return str(getattr(api, "base_url", ""))
