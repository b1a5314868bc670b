# SPDX-License-Identifier: LGPL-2.1-or-later
"""How a running registration reports its progress, and how it is stopped."""

from __future__ import annotations

from typing import Protocol


class RegisterControl(Protocol):
    """A running job's way to the outside."""

    def progress(self, detail: str = "", fraction: float | None = None) -> None: ...

    def check(self) -> None:
        """Raise CancelledError if the user wants the job to stop."""
