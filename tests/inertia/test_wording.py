# SPDX-License-Identifier: LGPL-2.1-or-later
"""Counts and lists in sentences for people."""

from __future__ import annotations

import pytest

from silo.inertia.wording import counted, listed


@pytest.mark.parametrize(
    ("number", "text"), [(0, "0 links"), (1, "1 link"), (2, "2 links"), (1000, "1000 links")]
)
def test_counted(number: int, text: str) -> None:
    """Never "1 links"."""
    assert counted(number, "link") == text


def test_counted_with_another_plural() -> None:
    """Words that take no s."""
    assert (counted(1, "body", "bodies"), counted(2, "body", "bodies")) == ("1 body", "2 bodies")


def test_listed() -> None:
    """As many as fit, and how many more."""
    assert listed(["a", "b"]) == "“a”, “b”"
    assert listed(list("abcdef")) == "“a”, “b”, “c”, “d” and 2 more"
