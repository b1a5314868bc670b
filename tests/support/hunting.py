# SPDX-License-Identifier: LGPL-2.1-or-later
"""How much is tried: few examples and one database in each run, many and both where there is time."""

import os
from typing import Any

import pytest

LONG = bool(os.environ.get("SILO_LONG"))
# All suites that run over a database run over both.
_ALL = LONG or bool(os.environ.get("SILO_POSTGRES"))


def examples(usual: int) -> int:
    """Return ``usual``, and ten times as many with ``SILO_LONG``."""
    return usual * 10 if LONG else usual


def kinds(*usual: str) -> list[Any]:
    """Return these databases (``sqlite``, ``postgres``), and both with ``SILO_LONG`` or ``SILO_POSTGRES``."""
    return [
        pytest.param(kind, marks=[pytest.mark.postgres] if kind == "postgres" else [])
        for kind in ("sqlite", "postgres")
        if _ALL or kind in usual
    ]


def over(*usual: str) -> pytest.MarkDecorator:
    """Run over these databases, and over both with ``SILO_LONG`` or ``SILO_POSTGRES``."""
    return pytest.mark.parametrize("kind", kinds(*usual), indirect=True, scope="session")


BOTH = over("sqlite", "postgres")
