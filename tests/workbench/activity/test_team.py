# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the pane says if the team works with another FreeCAD."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from activities import entry_text

from silo.workbench.activity.team import of_team

if TYPE_CHECKING:
    pass


@pytest.mark.parametrize(
    ("wanted", "here", "said"),
    [
        (
            "1.0",
            (1, 1),
            "that is saved here may hold objects that the FreeCAD of your colleagues does not know",
        ),
        ("1.1", (1, 0), "You are asked before a save removes"),
        ("1.1", (1, 1), ""),
        ("", (1, 1), ""),
    ],
)
def test_a_team_s_freecad(wanted: str, here: tuple[int, int], said: str) -> None:
    """Who has another is told what that means; the real Silo says nothing."""
    entry = of_team(wanted, here)
    assert (entry is not None) == bool(said)
    if entry is not None:
        assert said in entry_text(entry)
        assert f"FreeCAD {wanted}" in entry.title
