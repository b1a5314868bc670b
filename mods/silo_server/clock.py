# SPDX-License-Identifier: LGPL-2.1-or-later
"""Time as the server stores and sends it: UTC, ISO 8601."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime

Clock = Callable[[], datetime]


def utc_now() -> datetime:
    """Now, in UTC."""
    return datetime.now(UTC)


def stamp(when: datetime) -> str:
    """As stored: microseconds always, so that text order is time order (``2026-02-08T22:15:00.000000Z``)."""
    return when.astimezone(UTC).replace(tzinfo=None).isoformat(timespec="microseconds") + "Z"


def wire(stored: str | None) -> str | None:
    """As sent to clients, to the microsecond, so that a time that came from here means the same moment again.

    Without the fraction where there is none, as in the spec (``2026-02-08T22:15:00Z``).
    """
    return None if stored is None else stored.replace(".000000Z", "Z")


def spec_time(stored: str) -> str:
    """As the spec's events have it: whole seconds (``2026-02-08T22:15:00Z``)."""
    return stored[:19] + "Z"
