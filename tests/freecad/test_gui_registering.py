# SPDX-License-Identifier: LGPL-2.1-or-later
"""Register Parts in FreeCAD's window, from the dialog to the BOM on a real server."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import uuid
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest
from freecad_cases import machines
from freecad_cases.machines import MOSTLY_ENDS
from gui_cases.window import Window

from silo.bom.entry import Extraction, walk_entries
from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly
from silo.fcstd import Library
from silo.freecads.run import run_freecad

RESAVE = Path(__file__).parent / "freecad_cases" / "resave.py"
VERSIONS = MOSTLY_ENDS

pytestmark = [pytest.mark.freecad, pytest.mark.slow]


@pytest.fixture(name="said", scope="module")
def _said(freecad: Window) -> Iterator[dict[str, Any]]:
    with freecad.server.client() as client:
        client.create_item("kindred-rd", "M01", "Twin")
    with ExitStack() as other:
        freecad.answers["open Construction elsewhere"] = lambda: other.enter_context(another_freecad(freecad))
        yield freecad.run("registering.py")


@contextmanager
def another_freecad(freecad: Window) -> Iterator[str]:
    """What a second FreeCAD that has Construction.FCStd open keeps in the user's cache."""
    import fcntl

    cache = freecad.home / "temp"
    digest = hashlib.sha1(bytes(freecad.vault / "Construction.FCStd")).hexdigest()
    (cache / f"FreeCAD_Doc_{uuid.uuid4()}_{digest[:6]}_1").mkdir()
    with (cache / "FreeCAD_1.lock").open("w") as lock:
        fcntl.lockf(lock, fcntl.LOCK_EX)
        yield lock.name


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


def test_a_file_open_in_another_freecad_is_not_registered_unasked(said: dict[str, Any]) -> None:
    """That one would overwrite the identity with its next save; the person may do it anyway."""
    name, kind, category, checked, note = said["offered"]["Construction.FCStd"]
    assert (name, kind, checked) == ("Construction", "part", False)
    assert note == "open in another FreeCAD: close it there first, or saving there undoes this"
    assert category


def test_freecad_keeps_open_files_in_its_cache_as_we_think(freecad: Window, said: dict[str, Any]) -> None:
    """The names that tell what is open; another version may change them."""
    digest = hashlib.sha1(os.fsencode(said["path"])).hexdigest()
    found = re.fullmatch(rf"(.+)_Doc_[0-9a-f-]{{36}}_{digest[:6]}_(\d+)", Path(said["folder"]).name)
    assert found is not None
    assert (freecad.home / "temp" / f"{found[1]}_{found[2]}.lock").exists()


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


def test_another_version_reads_and_keeps_the_identities(
    freecad: Window, said: dict[str, Any], tmp_path: Path
) -> None:
    """Opened and saved by an older or by a newer one: each component is the item that it was made."""
    with freecad.server.client() as client:
        wanted = {number: client.get_item(number).id for number in said["registered"].values()}
    folder = tmp_path.resolve() / "vault"
    shutil.copytree(freecad.vault, folder)
    top, other = folder / "Top.FCStd", machines.need("0.20" if freecad.freecad.short != "0.20" else "1.1")
    env = other.profile(tmp_path / "profile")
    ((_, live),) = run_freecad([str(top)], command=other.command, env=env)
    assert isinstance(live, Extraction), live
    assert identities(live) == set(wanted.values())

    files = [str(path) for path in sorted(folder.glob("*.FCStd")) if path.stem not in ("Top", "Fixed")]
    other.must_run(RESAVE, {**env, "SILO_FILES": json.dumps([*files, str(top)])}, cwd=tmp_path)
    with Library() as library:
        assert identities(extract(choose_assembly(library.open(top)))) == set(wanted.values())


def identities(found: Extraction) -> set[str]:
    return {e.silo_uuid for e in walk_entries((found.assembly, *found.entries)) if e.silo_uuid}


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
    assert said["button_after_skipping"] == "Skip All"


def test_a_copied_identity_is_not_decided_by_registering_others(said: dict[str, Any]) -> None:
    """It stays a question, and there is nothing to register until it is answered."""
    assert said["asked"] == {"Bracket.FCStd": "ask", "BracketCopy.FCStd": "ask"}
    assert not said["selected_before"]


def test_the_same_part_is_kept_and_not_asked_for_again(said: dict[str, Any]) -> None:
    """One answer stands for both files; the next time there is nothing left."""
    assert set(said["answered"].values()) == {"same"}
    assert said["notes"] == ["stays as it is"] * 2
    assert said["button"] == "Close"
    assert said["left_to_ask"] == []


def test_a_partly_loaded_document_with_edits_has_its_own_row_state(said: dict[str, Any]) -> None:
    """FreeCAD could not save it; the edit is still there afterwards."""
    assert said["partial"] == [True, True]
    assert said["half"] == [False, "has edits, but is loaded only in part: open the file itself first"]
    assert said["half_edit"] == 44.0


def test_a_partly_loaded_document_without_edits_is_opened_whole_and_registered(said: dict[str, Any]) -> None:
    """Saving it as it was would have written nothing, or thrown half of it away."""
    assert said["quiet"] == "registered"
    assert said["objects"] == ["Box", "Unused"]
