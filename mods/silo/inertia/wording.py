# SPDX-License-Identifier: LGPL-2.1-or-later
"""Small pieces of sentences for people. Pure."""

from __future__ import annotations

from collections.abc import Sequence


def counted(number: int, one: str, many: str = "") -> str:
    """ "1 item", "2 items"; ``many`` where it is not ``one`` with an s."""
    return f"{number} {one if number == 1 else many or one + 's'}"


def listed(names: Sequence[str], limit: int = 4) -> str:
    """Some names, and how many more: “a”, “b” and 3 more."""
    shown = ", ".join(f"“{name}”" for name in names[:limit])
    return shown + (f" and {len(names) - limit} more" if len(names) > limit else "")
