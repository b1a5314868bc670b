# SPDX-License-Identifier: LGPL-2.1-or-later
"""The arguments of a job inside FreeCAD."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path


def job_text(env: Mapping[str, str]) -> str | None:
    """Read the arguments of a job inside FreeCAD from the file that ``SILO_ARGS_FILE`` names, else from
    ``SILO_ARGS``.

    An environment variable ends at 32 767 characters on Windows, and at 128 KiB on Linux. Raises OSError.
    """
    if name := env.get("SILO_ARGS_FILE"):
        return Path(name).read_text(encoding="utf-8")
    return env.get("SILO_ARGS")
