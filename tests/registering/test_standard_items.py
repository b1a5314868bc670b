# SPDX-License-Identifier: LGPL-2.1-or-later
"""Standard parts on the server: one item per designation, whoever registers it, and no file written."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from silo.bom.entry import BomEntry, Extraction
from silo.bom.items.proposal import Proposal, crowded_files
from silo.bom.walk.standard import standard_uuid
from silo.bom_sync.memory import Memory
from silo.bom_sync.resolved import resolve
from silo.bom_sync.standard_items import by_description, find_items
from silo.registering.items import register_standard
from silo.testing import FakeSilo

SCREW = "ISO 4762 M4×16"


def screw(designation: str = SCREW) -> BomEntry:
    return BomEntry("/v/top.FCStd", standard_uuid(designation), object_name="Screw", standard=designation)


def proposal(designation: str = SCREW) -> Proposal:
    return Proposal(screw(designation), designation, "part", "F01")


class Stubborn:
    """A server that gives its items UUIDs of its own, as the real Silo does."""

    base_url = "http://real.invalid"

    def __init__(self) -> None:
        self.items: dict[str, dict[str, Any]] = {}
        self.searches = 0

    def get_item_by_uuid(self, uuid: str, /) -> Mapping[str, Any] | None:
        return self.items.get(uuid)

    def search_items(self, query: str = "", /, *, limit: int = 50, offset: int = 0) -> Any:
        self.searches += 1
        return [item for item in self.items.values() if query.split()[0] in item["description"]]

    def create_item(self, schema: str, category: str, description: str, **more: Any) -> Mapping[str, Any]:
        number = len(self.items) + 1
        item = {"id": f"own-{number}", "part_number": f"F01-{number:04d}", "description": description}
        self.items[item["id"]] = item
        return item

    def get_properties(self, part_number: str, /) -> Mapping[str, Any]:
        return {}


@pytest.fixture
def memory(tmp_path: Path) -> Memory:
    return Memory(tmp_path / "standard-items.json")


def test_the_item_has_the_derived_uuid(memory: Memory) -> None:
    """Where the server takes it; a second project, or a second press, finds the same item."""
    silo = FakeSilo()
    first = register_standard(proposal(), silo, schema="kindred-rd", memory=memory)
    assert first.error is None
    assert (first.item_id, first.found) == (standard_uuid(SCREW), False)
    again = register_standard(proposal(), silo, schema="kindred-rd", memory=memory)
    assert (again.part_number, again.found) == (first.part_number, True)
    assert len(silo.items) == 1
    assert silo.get_item(first.part_number or "").description == SCREW


def test_a_server_with_ids_of_its_own_is_remembered(memory: Memory) -> None:
    """Found by its exact description once, by memory afterwards; a similar one is not taken."""
    silo = Stubborn()
    silo.create_item("", "", "ISO 4762 M4×160")
    made = register_standard(proposal(), silo, schema="kindred-rd", memory=memory)
    assert (made.part_number, made.found) == ("F01-0002", False)
    assert register_standard(proposal(), silo, schema="", memory=memory).part_number == "F01-0002"
    assert len(silo.items) == 2
    before = silo.searches
    (found,) = find_items([screw()], {}, silo, memory).values()
    assert (found["part_number"], silo.searches) == ("F01-0002", before)
    assert memory.known("http://other.invalid") == {}


def test_another_user_finds_it_by_its_description(memory: Memory, tmp_path: Path) -> None:
    """Nothing but the server is shared between two people."""
    silo = Stubborn()
    register_standard(proposal(), silo, schema="kindred-rd", memory=memory)
    other = Memory(tmp_path / "other.json")
    assert find_items([screw()], {}, silo, other)[standard_uuid(SCREW)]["part_number"] == "F01-0001"
    before = silo.searches
    find_items([screw()], {}, silo, other)
    assert silo.searches == before


def test_two_items_with_the_designation_are_nobodys(memory: Memory) -> None:
    """A person decides which one is meant; none is guessed."""
    silo = Stubborn()
    silo.create_item("", "", SCREW)
    silo.create_item("", "", SCREW)
    assert by_description(SCREW, silo) is None
    assert find_items([screw()], {}, silo, memory) == {}


def test_an_item_that_somebody_made_by_hand_is_joined(memory: Memory) -> None:
    """With another UUID, on a server that keeps UUIDs; a sync then finds it."""
    silo = FakeSilo()
    made = silo.create_item("kindred-rd", "F01", SCREW, item_type="part", properties={})
    joined = register_standard(proposal(), silo, schema="kindred-rd", memory=memory)
    assert (joined.part_number, joined.found) == (made.part_number, True)
    assert find_items([screw()], {}, silo, memory)[standard_uuid(SCREW)]["part_number"] == made.part_number


def test_a_registered_screw_resolves_and_a_file_is_not_crowded_by_it(tmp_path: Path) -> None:
    """The assembly's own file keeps the identity of the assembly, whatever screws lie in it."""
    silo = FakeSilo()
    register_standard(proposal(), silo, schema="kindred-rd", memory=Memory(tmp_path / "m.json"))
    top = BomEntry("/v/top.FCStd", object_name="Assembly", is_assembly=True)
    resolved = resolve(Extraction(top, (screw(),)), silo)
    (made,) = silo.items.values()
    assert [entry.part_number for entry in resolved.entries] == [made.item.part_number]
    assert crowded_files((top, screw(), screw("ISO 7089 M4"))) == frozenset()


def test_a_memory_that_cannot_be_read_costs_a_search_only(memory: Memory) -> None:
    """It is replaced with the next thing that is found."""
    memory.path.write_text("no json")
    silo = Stubborn()
    silo.create_item("", "", SCREW)
    assert find_items([screw()], {}, silo, memory)
    assert memory.known(silo.base_url) == {standard_uuid(SCREW): "own-1"}


@pytest.mark.parametrize("place", ["a file/memory.json", "a folder"])
def test_a_memory_that_cannot_be_written_costs_a_search_only(tmp_path: Path, place: str) -> None:
    """A full disk, or a home that nobody may write: the item is made, and its run does not fail."""
    (tmp_path / "a file").touch()
    (tmp_path / "a folder").mkdir()
    silo, memory = Stubborn(), Memory(tmp_path / place)
    made = register_standard(proposal(), silo, schema="kindred-rd", memory=memory)
    assert (made.error, made.part_number) == (None, "F01-0001")
    assert find_items([screw()], {}, silo, memory)
    assert silo.searches == 2
