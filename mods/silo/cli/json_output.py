# SPDX-License-Identifier: LGPL-2.1-or-later
"""JSON on standard output, in characters that the output can encode."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from typing import Any


def print_json(data: Any) -> None:
    """Print JSON on standard output; escaped if that is not UTF-8, or if a file's name is not."""
    print(json_text(data, indent=2))


def print_json_list(items: Sequence[Any], total: int | None = None) -> None:
    """Print a list in the one envelope of lists; ``total``: how many there are, if not all are printed."""
    print_json({"items": list(items), "total": len(items) if total is None else total})


def json_text(data: Any, indent: int | None = None) -> str:
    """Write JSON with characters that standard output can encode."""
    text = json.dumps(data, indent=indent, ensure_ascii=False)
    unicode = (getattr(sys.stdout, "encoding", None) or "utf-8").lower().replace("-", "") == "utf8"
    try:
        text.encode("utf-8" if unicode else "ascii")
    except UnicodeEncodeError:
        return json.dumps(data, indent=indent)
    return text
