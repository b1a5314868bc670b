# SPDX-License-Identifier: LGPL-2.1-or-later
"""What this computer remembers of each server: one small file for one kind of fact."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from silo.platform.memory_file import read_memory, write_memory


class Memory:
    """Server → name → value. One small file."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def known(self, server: str) -> dict[str, str]:
        """Return what is remembered of a server; {} if the file cannot be read, which only costs a search."""
        return self._read().get(server, {})

    def remember(self, server: str, items: Mapping[str, str]) -> None:
        """Keep what was found or made. If it cannot be written, that costs a search."""
        servers = self._read()
        before = servers.get(server, {})
        if items.items() <= before.items():
            return
        write_memory(self.path, {**servers, server: {**before, **items}})

    def _read(self) -> dict[str, dict[str, str]]:
        return {server: items for server, items in read_memory(self.path).items() if isinstance(items, dict)}


def server_of(api: Any) -> str:
    """Return the name by which a memory knows the server."""
    return str(getattr(api, "base_url", ""))
