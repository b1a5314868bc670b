# SPDX-License-Identifier: LGPL-2.1-or-later
"""Times of the server: how the database stores them, and how clients get them."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime

Clock = Callable[[], datetime]


def utc_now() -> datetime:
    """Return the present time, in UTC."""
    return datetime.now(UTC)


def stamp(when: datetime) -> str:
    """Write a time as it is stored (``2026-02-08T22:15:00.000000Z``): text order is time order."""
    return when.astimezone(UTC).replace(tzinfo=None).isoformat(timespec="microseconds") + "Z"


def wire_time(stored: str | None) -> str | None:
    """Write a stored time as clients get it, to the microsecond: when it comes back, it means the same.

    Without the fraction if that is 0, as in the spec (``2026-02-08T22:15:00Z``).
    """
    return None if stored is None else stored.replace(".000000Z", "Z")


def spec_time(stored: str) -> str:
    """Write a time as the spec's events have it: whole seconds (``2026-02-08T22:15:00Z``)."""
    return stored[:19] + "Z"
