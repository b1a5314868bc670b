# SPDX-License-Identifier: LGPL-2.1-or-later
"""The model in FreeCAD's window: what is lit, and another revision as a ghost."""

from __future__ import annotations

from typing import Any

import pytest
from freecad_cases.machines import NEWEST
from gui_cases.window import Window

from silo.api.files import Origin
from silo.checksums import content_hash

VERSIONS = NEWEST

pytestmark = [pytest.mark.freecad, pytest.mark.slow]


@pytest.fixture(name="told", scope="module")
def _told(freecad: Window) -> dict[str, Any]:
    def lacking() -> list[str]:
        with freecad.server.client() as client:
            files = {content_hash(path): path.name for path in freecad.vault.glob("*.FCStd")}
            return sorted(files[one] for one in client.lacking_models(files))

    def colleague() -> None:
        """Commit the first revision once more, on top of the newest."""
        with freecad.server.client() as client:
            (top,) = client.search_items("Top")
            old, path = client.get_revision(top.part_number, 1), freecad.folder / "Top.FCStd"
            client.download_file(top.part_number, path, 1)
            origin = Origin(base_revision=2, file_path=old.file_path, links=old.links)
            client.upload_file(top.part_number, path, "as it was", origin=origin)

    freecad.answers |= {"drawn": lacking, "colleague": colleague}
    return freecad.run("seen.py")


def test_the_scene_of_a_revision_is_as_it_was_recorded(told: dict[str, Any], freecad: Window) -> None:
    """The occurrences of both, with the models that a FreeCAD without a window drew after the commits."""
    assert told["drawn"] == []
    with freecad.server.client() as client:
        scenes = [client.get_scene(told["numbers"]["Top"], number) for number in (1, 2)]
    paths = [sorted(".".join(one.path) for one in scene.occurrences) for scene in scenes]
    assert paths[0] == ["Bolt", "Gone", "Plate", "Row.0", "Row.1", "Row.2"]
    assert paths[1] == ["Bolt", "New", "Plate", "Row.0", "Row.1", "Row.2"]
    assert all(one.geometry is not None for scene in scenes for one in scene.occurrences)


def test_parts_are_lit_and_a_revision_is_a_ghost(told: dict[str, Any]) -> None:
    """Three of a row, until something else is selected; no document is marked as edited."""
    assert (told["lit"], told["selected"], told["unlit"]) == (1, 1, True)
    assert told["said"] == "Ghost: 1 only in revision 1, 1 elsewhere there. Only here: 1."
    assert (told["ghost"], told["after"]) == (3, 0)
    assert told["modified"] == told["modified_before"] == []


def test_a_held_commit_is_compared_with_the_colleagues_revision(told: dict[str, Any]) -> None:
    """By its button in the pane: what is only there, elsewhere or only here; pressed again, it goes."""
    assert told["held_said"] == "Ghost: 1 only in revision 3, 1 elsewhere there. Only here: 1."
    assert (told["held_ghost"], told["held_after"]) == (3, True)
    assert told["held_modified"] == told["modified_before"]
