# SPDX-License-Identifier: LGPL-2.1-or-later
"""Register Parts in FreeCAD's window, from the dialog to the BOM on a real server."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from freecad_cases.machines import WANTED
from gui_cases.window import Window, window

pytestmark = [pytest.mark.freecad, pytest.mark.slow]


@pytest.fixture(name="freecad", scope="module", params=WANTED)
def _freecad(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Window]:
    with window(request.param, tmp_path_factory.mktemp("registering").resolve()) as freecad:
        freecad.prepare()
        yield freecad


@pytest.fixture(name="said", scope="module")
def _said(freecad: Window) -> dict[str, Any]:
    with freecad.server.client() as client:
        client.create_item("kindred-rd", "M01", "Twin")
    return freecad.run("registering.py")


def test_every_component_is_offered_with_a_proposal(said: dict[str, Any]) -> None:
    """Name from the label, type from the document, category from the schema; the assembly comes last."""
    offered = said["offered"]
    assert list(offered)[-1] == "Top.FCStd"
    assert offered["Top.FCStd"][:4] == ["Top", "assembly", "A01", True]
    assert offered["Bracket.FCStd"] == ["Bracket", "part", "S06", True, "its unsaved edits are saved too"]
    assert offered["Two.FCStd · Left jaw"][0] == "Left jaw"


def test_a_probable_duplicate_is_told_before_it_is_made(said: dict[str, Any]) -> None:
    """The server has an item of that name."""
    assert said["offered"]["Twin.FCStd"][4] == "Silo has M01-0001 with the same name"


def test_a_read_only_file_has_its_own_row_state_and_the_rest_goes_on(said: dict[str, Any]) -> None:
    """It is not checked and stays unregistered."""
    assert said["offered"]["Fixed.FCStd"][3:] == [False, "the file is read-only"]
    assert sorted(said["left"]) == ["Construction.FCStd", "Fixed.FCStd"]


def test_the_items_are_on_the_server(freecad: Window, said: dict[str, Any]) -> None:
    """With the names that the person gave."""
    with freecad.server.client() as client:
        names = {number: client.get_item(number).name for number in said["registered"].values()}
    registered = said["registered"]
    assert names[registered["MotorMount.FCStd"]] == "Motor mount"
    assert len(set(registered.values())) == 6


def test_the_bom_has_them(freecad: Window, said: dict[str, Any]) -> None:
    """Those that were registered, and no others."""
    registered = dict(said["registered"])
    top = registered.pop("Top.FCStd")
    with freecad.server.client() as client:
        lines = {line.child_part_number: line.quantity for line in client.get_bom(top)}
    assert lines == dict.fromkeys(registered.values(), 1)


def test_their_files_are_on_the_server(freecad: Window, said: dict[str, Any]) -> None:
    """As a revision each; a file that gives two parts is neither's."""
    with freecad.server.client() as client:
        for component, number in said["registered"].items():
            files = [r.file_name for r in client.revisions(number) if r.file_name]
            assert files == ([] if component.startswith("Two") else [component])


def test_identity_survives_in_this_version(said: dict[str, Any]) -> None:
    """In ``Meta`` always, on the object always, as a document property where FreeCAD has such."""
    bracket = said["identities"]["Bracket"]
    (identity,) = bracket["objects"].values()
    assert bracket["meta"] == {"SiloUUID": identity}
    assert bracket["property"] == (identity if said["properties"] else None)


def test_two_parts_of_one_file_have_an_identity_each(said: dict[str, Any]) -> None:
    """And the file as a whole has none."""
    two = said["identities"]["Two"]
    assert set(two["objects"]) == {"Left", "Right"}
    assert two["objects"]["Left"] != two["objects"]["Right"]
    assert two["meta"] == {f"SiloUUID/{name}": identity for name, identity in two["objects"].items()}
    assert not two["property"]


def test_an_unsaved_edit_is_not_lost(said: dict[str, Any]) -> None:
    """It was saved along with the identity."""
    assert said["edit"] == 33.0


def test_skipped_ones_are_asked_for_at_the_next_commit(said: dict[str, Any]) -> None:
    """Spec §2, point 5."""
    assert sorted(said["asked_again"]) == ["Construction.FCStd", "Fixed.FCStd"]
    assert said["button"] == "Skip All"
