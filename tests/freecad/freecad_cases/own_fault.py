# SPDX-License-Identifier: LGPL-2.1-or-later
"""A witness with a fault of its own, on purpose: what the job of the command line says of each file."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "mods"))

from silo.workbench import headless
from silo.workbench.freecad import witness


def accounts(extraction: object, *, hardware: bool) -> list[object]:
    """Fail as a fault of the program does, for one of the files."""
    if "plain_link" in str(extraction):
        raise KeyError("no such role")
    return []


witness.accounts = accounts  # type: ignore[assignment]
headless.main()
