# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD is closed right after many commits: it saves and keeps them all, and the next start sends them."""

from __future__ import annotations

from pathlib import Path

import pytest
from freecad_cases.machines import WANTED
from gui_cases.window import window

pytestmark = [pytest.mark.freecad, pytest.mark.slow]


@pytest.mark.parametrize("version", WANTED)
def test_closed_right_after_many_commits(version: str, tmp_path: Path) -> None:
    """No modal question, none lost, none doubled."""
    with window(version, tmp_path.resolve()) as freecad:
        freecad.prepare()
        told = freecad.run("closing.py", env={"SILO_TEST_CLOSE": "1"})
        assert told["running"]
        freecad.run("closing.py")
        with freecad.server.client() as client:
            files = {
                name: [r.file_name for r in client.revisions(number) if r.file_name]
                for name, number in told["numbers"].items()
            }
    assert files == {name: [f"{name}.FCStd"] for name in told["numbers"]}
