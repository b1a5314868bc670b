# SPDX-License-Identifier: LGPL-2.1-or-later
"""How much is tried: few examples and one database in each run, many and both where there is time."""

import os

import pytest

LONG = bool(os.environ.get("SILO_LONG"))


def examples(usual: int) -> int:
    """Return ``usual``, and ten times as many with ``SILO_LONG``."""
    return usual * 10 if LONG else usual


def over(kind: str) -> pytest.MarkDecorator:
    """Run over this database only (``sqlite`` or ``postgres``), and over both with ``SILO_LONG``."""
    kinds = ["sqlite", "postgres"] if LONG else [kind]
    marks = {"sqlite": [], "postgres": [pytest.mark.postgres]}
    rows = [pytest.param(name, marks=marks[name]) for name in kinds]
    return pytest.mark.parametrize("kind", rows, indirect=True, scope="session")
