# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod register --declare``: parts modelled in the assembly's own file become components, and back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from fcstd_writer import Doc, Raw, locals_, part

from silo.fcstd import open_document


@pytest.fixture
def machine(tmp_path: Path) -> Path:
    """One file: two equal motors placed apart, a jig, no link at all."""
    doc = Doc(label="machine")
    doc.add("Part::Feature", "Motor", Shape=doc.shape("Motor", "a motor"))
    doc.add("Part::Feature", "Motor001", Shape=doc.shape("Motor001", "a motor", "1\n1 0 0 7\n"))
    doc.add("Part::Feature", "Jig", Shape=doc.shape("Jig", "a jig", "1\n1 0 0 7\n"))
    doc.add("App::Part", "Top", Group=locals_("Motor", "Motor001", "Jig"), Type="Assembly")
    return doc.save(tmp_path / "machine.FCStd")


def test_register_lists_what_is_modelled_in_the_file(run: Any, silo: Any, machine: Path) -> None:
    """With no check mark: --yes takes none of it, and says how to."""
    done = run("register", machine, "--yes")
    assert "Modelled in this file, not counted:" in done.out
    assert "2 × Motor (Motor, 2 copies of one shape)" in done.out
    assert "--declare" in done.out
    rows = run("register", machine, "--yes", "--json").json()["modelled"]
    assert [(row["objects"], row["quantity"]) for row in rows] == [(["Motor", "Motor001"], 2), (["Jig"], 1)]
    wrong = run("register", machine, "--yes", "--declare", "Moter")
    assert (wrong.code, "there is: Motor, Jig" in wrong.err) == (2, True)
    assert run("bom", machine, "--flat", "--json").json() == []


def test_declared_copies_are_one_item_and_can_be_taken_back(run: Any, silo: Any, machine: Path) -> None:
    """One press for all equal ones; each copy counts; the file is as before once it is undone."""
    assert run("register", machine, "--yes", "--declare", "Motor").code == 0
    (row,) = run("bom", machine, "--flat", "--resolve", "--json").json()
    assert (row["name"], row["quantity"], bool(row["part_number"])) == ("Motor", 2, True)
    again = run("register", machine, "--yes", "--declare", "Motor")
    assert again.code != 0
    assert "component already" in again.err
    assert run("register", machine, "--undeclare", "Motor", "--yes").code == 0
    assert run("bom", machine, "--flat", "--json").json() == []
    document = open_document(machine)
    assert not any("SiloItemId" in obj.PropertiesList for obj in document.Objects)
    assert not [key for key in document.Meta if "Motor" in key]


def test_what_is_no_part_is_answered_once(run: Any, silo: Any, machine: Path) -> None:
    """One press for all equal ones, kept in the file: no list has them again, and bom is content."""
    assert run("bom", machine).code == 1
    before = machine.read_bytes()
    assert run("register", machine, "--not-a-part", "Moter").code == 2
    assert machine.read_bytes() == before
    done = run("register", machine, "--not-a-part", "Motor", "--json")
    assert (done.code, done.json()) == (0, {"undeclared": ["Motor", "Motor001"]})
    rows = run("register", machine, "--yes", "--json").json()["modelled"]
    assert [row["objects"] for row in rows] == [["Jig"]]
    assert run("bom", machine).code == 1
    assert run("register", machine, "--yes", "--declare", "Jig").code == 0
    assert "No part of any BOM: Jig" in run("register", machine, "--not-a-part", "Jig").out
    found = run("bom", machine, "--json")
    assert (found.code, found.json()["entries"], "own" in found.json()) == (0, [], False)
    document = open_document(machine)
    answered = [obj for obj in document.Objects if getattr(obj, "SiloBomExclude", False)]
    assert [obj.Name for obj in answered] == ["Motor", "Motor001", "Jig"]
    assert not any("SiloItemId" in obj.PropertiesList for obj in answered)


def test_what_is_no_part_can_be_taken_back(run: Any, silo: Any, machine: Path) -> None:
    """It is undecided again, as before; it cannot be declared while it is no part."""
    before = run("bom", machine, "--json").json()
    assert run("register", machine, "--not-a-part", "Motor").code == 0
    refused = run("register", machine, "--yes", "--declare", "Motor")
    assert refused.code == 2
    assert "no part, as somebody said; --undeclare takes that back" in refused.err
    assert run("register", machine, "--not-a-part", "Motor").code == 2
    assert "Undecided again: Motor, Motor001" in run("register", machine, "--undeclare", "Motor").out
    assert not any("SiloBomExclude" in obj.PropertiesList for obj in open_document(machine).Objects)
    assert run("bom", machine, "--json").json() == before
    assert run("register", machine, "--undeclare", "Motor").code == 2


def test_copies_that_are_different_parts_are_taken_apart(run: Any, silo: Any, machine: Path) -> None:
    """The person decides, not the shape."""
    done = run("register", machine, "--yes", "--declare", "Motor", "--apart", "--json").json()
    assert len({row["part_number"] for row in done["registered"]}) == 2
    assert [row["quantity"] for row in run("bom", machine, "--flat", "--resolve", "--json").json()] == [1, 1]


def test_what_a2plus_imported_joins_the_item_of_its_file(run: Any, silo: Any, tmp_path: Path) -> None:
    """It is that part, and no other: it counts with the links to it."""
    source = part("bearing", "Bearing").save(tmp_path / "bearing.FCStd")
    top = Doc(label="top").add(
        "Part::FeaturePython", "B1", sourceFile="./bearing.FCStd", a2p_Version="V0.4", Label="b_bearing"
    )
    top.link("Link", "bearing.FCStd", "Bearing").add("App::Part", "Top", Group=locals_("B1", "Link"))
    path = top.save(tmp_path / "top.FCStd")
    done = run("register", path, "--yes", "--json").json()
    (row,) = run("bom", path, "--flat", "--resolve", "--json").json()
    registered = {one["silo_uuid"]: one["part_number"] for one in done["registered"]}
    identity = open_document(source).Meta["SiloUUID"]
    assert (row["quantity"], row["part_number"]) == (2, registered[identity])


@pytest.fixture
def looked_into(tmp_path: Path) -> Path:
    """A case with a hidden terminal, a hidden link and a link that only supports a binder."""
    part("plate", "Box").save(tmp_path / "plate.FCStd")
    doc = Doc(label="case").add("PartDesign::Body", "Case")
    doc.add("PartDesign::Body", "Terminal", Visibility=False, Label="Terminal +")
    for name in ("Quiet", "Ref"):
        doc.link(name, "plate.FCStd", "Box", Visibility=False)
    support = Raw(
        "App::PropertyXLinkSubList",
        '<XLinkSubList count="1"><XLink name="Ref" sub="Face1"/></XLinkSubList>',
    )
    doc.add("PartDesign::SubShapeBinder", "Binder", Support=support)
    names = locals_("Case", "Terminal", "Quiet", "Ref", "Binder")
    doc.add("App::Part", "Top", Group=names, Type="Assembly")
    return doc.save(tmp_path / "case.FCStd")


def pieces(run: Any, top: Path) -> tuple[int, set[str], dict[str, str]]:
    """Linked pieces, own parts, and the standing of each hidden object."""
    found = run("bom", top, "--json").json()
    hidden = {
        place["object"]: place["standing"]
        for finding in found["findings"]
        if finding["code"] == "hidden"
        for place in finding["where"]
    }
    own = found["assembly"].get("own", found.get("own", []))
    return sum(row["quantity"] for row in found["entries"]), {row["object"] for row in own}, hidden


def test_each_hidden_object_counts_or_not_by_one_word(run: Any, looked_into: Path) -> None:
    """The file keeps each answer, and nobody is asked about it again."""
    before = {"Terminal": "not counted", "Quiet": "counts", "Ref": "reference"}
    assert pieces(run, looked_into) == (1, {"Case"}, before)
    done = run("register", looked_into, "--count-hidden", "Terminal +", "--count-hidden", "Ref", "--json")
    assert (done.code, done.json()) == (0, {"counted": ["Terminal", "Ref"], "references": []})
    counting = dict.fromkeys(before, "counts")
    assert pieces(run, looked_into) == (2, {"Case", "Terminal"}, counting)
    done = run("register", looked_into, "--reference", "Quiet", "--reference", "Terminal")
    assert (done.code, "counts nowhere: Terminal +" in done.out) == (0, False)
    assert "Quiet, Terminal +" in done.out
    assert pieces(run, looked_into) == (1, {"Case"}, {"Ref": "counts"})
    assert run("register", looked_into, "--count-hidden", "Quiet").code == 0
    assert "says so already" in run("register", looked_into, "--count-hidden", "Quiet").out
    assert pieces(run, looked_into)[0] == 2


@pytest.mark.parametrize(
    "words",
    [
        ("--count-hidden", "Case"),
        ("--reference", "Nothing"),
        ("--count-hidden", "Quiet", "--reference", "Quiet"),
        ("--count-hidden", "Quiet", "--declare", "Case"),
    ],
)
def test_a_wrong_answer_about_hidden_objects_changes_nothing(
    run: Any, looked_into: Path, words: tuple[str, ...]
) -> None:
    before = looked_into.read_bytes()
    assert run("register", looked_into, *words).code == 2
    assert looked_into.read_bytes() == before
