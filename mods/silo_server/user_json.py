# SPDX-License-Identifier: LGPL-2.1-or-later
"""JSON that users give us (properties, a line's metadata): what is let in, and how it is stored.

One guard (:func:`json_problem`) stands on every way in. What it accepts, :func:`dumps` and
``json_answer`` can always write.
"""

from __future__ import annotations

import json
import math
import sys
from decimal import Decimal
from typing import Any

from silo.bom.errors import RejectedError
from silo.bom.message import message
from silo.bom.text import character_problem

MAX_DEPTH = 32
MAX_BYTES = 256 * 1024
MAX_KEY = 200
# JSON does not tell 1e300 from a whole number of 301 digits, and so neither do we: what a double can hold.
MAX_NUMBER = sys.float_info.max
# The same as it is written, which is what the API document's readers compare with.
_MAX_WHOLE = int(Decimal(repr(MAX_NUMBER)))


def dumps(value: Any) -> str:
    """Write compact JSON text, as it is stored and sent."""
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False)


def json_problem(value: Any) -> str | None:
    """Say what is wrong with a JSON value that a user gave; None if nothing is."""
    stack = [(value, 1)]
    while stack:
        part, depth = stack.pop()
        if depth > MAX_DEPTH and isinstance(part, dict | list | tuple):
            return message("wanted at most {most} levels of nesting, got more", most=MAX_DEPTH)
        if isinstance(part, dict):
            for key in part:
                if problem := character_problem(key):
                    return problem
                if len(key) > MAX_KEY:
                    return message(
                        "wanted keys of at most {most} characters, got {got}",
                        most=MAX_KEY,
                        got=repr(key[:60]),
                    )
            stack.extend((below, depth + 1) for below in part.values())
        elif isinstance(part, list | tuple):
            stack.extend((below, depth + 1) for below in part)
        elif problem := _scalar_problem(part):
            return problem
    size = len(dumps(value).encode())
    if size > MAX_BYTES:
        return message(
            "wanted at most {most} KiB of JSON, got {size} KiB", most=MAX_BYTES // 1024, size=size // 1024
        )
    return None


def check_json(name: str, value: Any) -> None:
    """Raise RejectedError, naming the field, unless the value may be stored."""
    problem = json_problem(value)
    if problem is not None:
        raise RejectedError(f"{name}: {problem}", [f"{name}: {problem}"])


def merge_patch(target: Any, patch: Any) -> Any:
    """Apply a JSON merge patch (RFC 7386) to ``target``: null removes a member, objects merge.

    The patch has passed the guard, which bounds how deep this goes.
    """
    if not isinstance(patch, dict):
        return patch
    merged = dict(target) if isinstance(target, dict) else {}
    for key, value in patch.items():
        if value is None:
            merged.pop(key, None)
        else:
            merged[key] = merge_patch(merged.get(key), value)
    return merged


def _scalar_problem(value: Any) -> str | None:
    if isinstance(value, str):
        return character_problem(value)
    if isinstance(value, float) and not math.isfinite(value):
        return message("wanted finite numbers, got {got}", got=value)
    if isinstance(value, int) and not -_MAX_WHOLE <= value <= _MAX_WHOLE:
        return message("wanted numbers of at most 309 digits, got a longer one; send it as text")
    return None
