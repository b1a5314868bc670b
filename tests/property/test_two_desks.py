# SPDX-License-Identifier: LGPL-2.1-or-later
"""Two designers with files that link to each other, in the window and on the command line, in any order.

After each step of a walk: no revision is lost or lacks an edit of the one before without a choice, nobody is
in conflict with themselves, each state is what the bytes say, one part is one item, and a commit without a
remark is proven by a pull elsewhere and by the BOM. What a walk found is a short story below it.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from two_desks import World, changed, play, said, story

from silo.file_state import FileState
from silo.vault.pull import PullState

LONG = bool(os.environ.get("SILO_LONG"))
SEEDS, STEPS = (20, 300) if LONG else (4, 16)
FIRST = int(os.environ.get("SILO_FIRST_SEED", "0"))


@pytest.fixture(autouse=True)
def _alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("SILO_API_URL", "SILO_API_TOKEN"):
        monkeypatch.delenv(name, raising=False)
    for name in ("XDG_CONFIG_HOME", "XDG_CACHE_HOME", "XDG_DATA_HOME"):
        monkeypatch.setenv(name, str(tmp_path / name))


@pytest.mark.parametrize("seed", range(FIRST, FIRST + SEEDS))
def test_what_is_in_silo_is_what_they_have(seed: int, tmp_path: Path) -> None:
    """A law, for any days of two designers."""
    steps = story(seed, STEPS)
    broken = play(tmp_path / "world", steps)
    assert not broken, f"seed {seed}: {broken}\n" + "\n".join(map(str, steps))


# --- stories ---------------------------------------------------------------------------------------------


@pytest.fixture(name="world")
def _world(tmp_path: Path) -> Iterator[World]:
    made = World(tmp_path / "world")
    yield made
    made.close()


def states(world: World) -> dict[str, FileState]:
    """How the files of the second designer stand."""
    return {Path(standing.file.path).stem: standing.state for standing in world.bob.standings()}


def test_a_part_that_a_colleague_registered_is_newer(world: World) -> None:
    """It was a document, and is an item now: the untouched file is no edit, and a pull brings the item's."""
    world.alice.register()
    world.alice.command()
    assert states(world) == dict.fromkeys(("Plate", "Skeleton", "Sub", "Top"), FileState.SAME) | {
        "Bracket": FileState.NEWER
    }
    pulled = world.bob.pull()
    assert pulled is not None
    assert {file.path.stem: file.state for file in pulled.files}["Bracket"] is PullState.UPDATED
    assert world.bob.on_disk("Bracket").identity == world.alice.on_disk("Bracket").identity != ""
    assert set(states(world).values()) == {FileState.SAME}


def test_edits_of_a_part_that_a_colleague_registered_are_a_question(world: World) -> None:
    """Nothing sends them to a document that no pull reads any more, nor over the part without its number."""
    world.alice.register()
    world.alice.command()
    mine = world.bob.path("Bracket")
    mine.write_bytes(changed(mine.read_bytes(), *world.next_edit()))
    before = world.files()
    for on_top in (False, True):
        world.bob.command(on_top=on_top)
        assert world.bob.committed is not None
        assert [Path(one.file.path).stem for one in world.bob.committed.behind] == ["Bracket"]
        assert not world.bob.committed.done
    assert world.files() == before
    pulled = world.bob.pull()
    assert pulled is not None
    assert not pulled.complete
    assert said(mine.read_bytes()).edits == {world.count}
