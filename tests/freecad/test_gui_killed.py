# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD is killed in the worst moment; after a restart nothing is lost and nothing is doubled."""

from __future__ import annotations

from pathlib import Path

import pytest
from freecad_cases.machines import WANTED
from gui_cases.window import window

pytestmark = [pytest.mark.freecad, pytest.mark.slow]

KILLED = -9


@pytest.mark.parametrize("version", WANTED)
@pytest.mark.parametrize("call", ["upload_file", "merge_bom"])
def test_killed_in_the_middle_of_a_commit(version: str, call: str, tmp_path: Path) -> None:
    """After the upload, before the BOM; or after the merge, before its answer: the next start finishes it."""
    with window(version, tmp_path.resolve()) as freecad:
        freecad.prepare()
        numbers = freecad.run("killed.py", env={"SILO_TEST_KILL": call}, code=KILLED)["numbers"]
        said = freecad.run("killed.py")
        assert said["waiting"] == []
        assert len(said["boxes"]) == 1
        with freecad.server.client() as client:
            files = [r.file_name for r in client.revisions(numbers["Top"]) if r.file_name]
            lines = {line.child_part_number: line.quantity for line in client.get_bom(numbers["Top"])}
    assert files == ["Top.FCStd"]
    assert lines == {numbers["Bolt"]: 5}


@pytest.mark.parametrize("version", WANTED)
def test_killed_between_item_and_identity(version: str, tmp_path: Path) -> None:
    """The item exists, no file names it: registering again finds it, and makes no second one."""
    with window(version, tmp_path.resolve()) as freecad:
        freecad.prepare()
        freecad.run("killed.py", env={"SILO_TEST_KILL": "create_item"}, code=KILLED)
        with freecad.server.client() as client:
            made = client.search_items()
        assert [item.name for item in made] == ["Bolt"]
        freecad.run("killed.py", env={"SILO_TEST_REGISTER": "1"})
        with freecad.server.client() as client:
            items = {item.name: item for item in client.search_items()}
            lines = [line.child_part_number for line in client.get_bom(items["Top"].part_number)]
    assert sorted(items) == ["Bolt", "Top"]
    assert items["Bolt"].id == made[0].id
    assert lines == [made[0].part_number]
