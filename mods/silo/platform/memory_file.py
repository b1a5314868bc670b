# SPDX-License-Identifier: LGPL-2.1-or-later
"""A small file of JSON in which a program remembers something: damaged or unreadable, it holds nothing."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from silo.platform.whole_files import replacing


def read_memory(path: Path) -> dict[str, Any]:
    """Read a small JSON file; {} if it is missing, damaged, or no JSON object.

    For files whose loss costs only a repeated question.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return data if isinstance(data, dict) else {}


def write_memory(path: Path, content: Mapping[str, Any]) -> OSError | None:
    """Write what :func:`read_memory` reads, for its owner only. Returns the error if that fails."""
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with replacing(path) as file:
            file.write(json.dumps(content, indent=1, sort_keys=True).encode())
    except OSError as error:
        return error
    return None
