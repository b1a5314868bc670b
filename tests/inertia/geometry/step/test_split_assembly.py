# SPDX-License-Identifier: LGPL-2.1-or-later
"""Split assemblies: geometry in files beside the assembly's (inertia-facts §9, cases 12 and 13)."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from step_writer import emptied

from silo.bom.errors import DocumentError
from silo.inertia.assembly import Assembly
from silo.inertia.geometry import read
from silo.inertia.geometry.options import ReadOptions
from silo.inertia.notes import GeometryCode


def volume_mm3(assembly: Assembly) -> float:
    """All instances together."""
    return sum(assembly.prototypes[i.prototype].volume_m3 for i in assembly.instances) * 1e9


@pytest.fixture(name="split")
def _split(box: Any, trsf: Any, step: Any, tmp_path: Path) -> Path:
    """An arm whose two parts lie in files of their own: two uses of "upper arm", one of "hand"."""
    folder = tmp_path / "arm"
    folder.mkdir()
    document = step()
    top = document.assembly("arm")
    upper, hand = document.part(box(10, 10, 100), "upper arm"), document.part(box(20, 20, 5), "hand")
    document.place(top, upper, trsf((0, 0, 0)), "left")
    document.place(top, upper, trsf((500, 0, 0)), "right")
    document.place(top, hand, trsf((0, 0, 100)), "hand")
    path = emptied(document.write(folder / "arm.STEP"), "upper arm", "hand")
    for name, shape in (("upper arm", box(10, 10, 100)), ("hand", box(20, 20, 5))):
        part = step()
        part.part(shape, name)
        part.write(folder / f"{name}.STEP")
    return path


def test_parts_come_from_files_named_after_them(split: Path, read_in: Any, codes_of: Any) -> None:
    """All engines read nothing from the assembly's file alone; with its siblings it is complete."""
    assembly = read_in(split)
    assert volume_mm3(assembly) == pytest.approx(2 * 10_000 + 2_000)
    assert [i.name for i in assembly.instances] == ["left", "right", "hand"]
    assert codes_of(assembly) == [GeometryCode.EXTERNAL_FILE]
    assert assembly.instances[1].transform[0, 3] == pytest.approx(0.5)


def test_case_and_suffix_of_a_sibling_do_not_matter(split: Path, read_in: Any) -> None:
    """UPPER ARM.stp is the file of "upper arm" as well."""
    (split.parent / "upper arm.STEP").rename(split.parent / "UPPER ARM.stp")
    assert volume_mm3(read_in(split)) == pytest.approx(22_000)


def test_a_missing_sibling_is_named_and_keeps_its_instances(split: Path, read_in: Any, codes_of: Any) -> None:
    """No file for "hand": it stays an instance without geometry, so that a BOM can still give its mass."""
    (split.parent / "hand.STEP").unlink()
    assembly = read_in(split)
    hand = assembly.prototypes[assembly.instances[2].prototype]
    assert (hand.name, hand.has_solid, hand.volume_m3) == ("hand", False, 0.0)
    assert codes_of(hand) == [GeometryCode.NO_GEOMETRY]
    assert "hand.STEP" in hand.problems[0].message
    assert GeometryCode.NO_GEOMETRY in codes_of(assembly)


def test_without_siblings_nothing_is_looked_for(split: Path, read_in: Any) -> None:
    """The user may say that only the file itself counts."""
    assembly = read_in(split, siblings=False)
    assert volume_mm3(assembly) == 0.0
    assert len(assembly.instances) == 3


def test_siblings_are_found_below_the_folder_to_a_depth(split: Path, read_in: Any) -> None:
    """``parts/hand.STEP`` is found, three levels down is too deep; the limit is the user's."""
    deep = split.parent / "a" / "b" / "c"
    deep.mkdir(parents=True)
    (split.parent / "hand.STEP").rename(deep / "hand.STEP")
    assert volume_mm3(read_in(split)) == pytest.approx(20_000)
    assert volume_mm3(read_in(split, sibling_depth=3)) == pytest.approx(22_000)


@pytest.mark.usefixtures("needs_symlinks")
def test_nothing_is_read_outside_of_the_folder(split: Path, read_in: Any) -> None:
    """A link that leaves the folder is no sibling, nor is a file one level up."""
    outside = split.parents[1] / "hand.STEP"
    (split.parent / "hand.STEP").rename(outside)
    assert volume_mm3(read_in(split)) == pytest.approx(20_000)
    (split.parent / "hand.STEP").symlink_to(outside)
    assert volume_mm3(read_in(split)) == pytest.approx(20_000)


def test_two_siblings_of_one_name_are_not_guessed(split: Path, read_in: Any, codes_of: Any) -> None:
    """Two files of equal nearness could be meant: none is taken, both are named."""
    for folder in ("old", "new"):
        (split.parent / folder).mkdir()
    (split.parent / "new" / "hand.STEP").write_bytes((split.parent / "hand.STEP").read_bytes())
    (split.parent / "hand.STEP").rename(split.parent / "old" / "hand.step")
    assembly = read_in(split)
    hand = assembly.prototypes[assembly.instances[2].prototype]
    assert "several files are named after it" in hand.problems[0].message


def test_a_damaged_sibling_does_not_stop_the_rest(split: Path, read_in: Any, codes_of: Any) -> None:
    """A truncated part file is a problem of that part."""
    path = split.parent / "hand.STEP"
    path.write_bytes(path.read_bytes()[:2000])
    assembly = read_in(split)
    hand = assembly.prototypes[assembly.instances[2].prototype]
    assert volume_mm3(assembly) == pytest.approx(20_000)
    assert "ends in the middle" in hand.problems[0].message


def test_a_sibling_may_be_split_itself(box: Any, trsf: Any, step: Any, tmp_path: Path, read_in: Any) -> None:
    """robot → gripper (a file) → finger (another file): placements multiply, paths go all the way down."""
    robot = step()
    top = robot.assembly("robot")
    robot.place(top, robot.part(box(1, 1, 1), "gripper"), trsf((100, 0, 0)), "gripper_1")
    path = emptied(robot.write(tmp_path / "robot.step"), "gripper")
    gripper = step()
    sub = gripper.assembly("gripper")
    gripper.place(sub, gripper.part(box(2, 2, 2), "finger"), trsf((0, 30, 0)), "finger_1")
    emptied(gripper.write(tmp_path / "gripper.step"), "finger")
    finger = step()
    finger.part(box(2, 2, 2), "finger")
    finger.write(tmp_path / "finger.step")
    assembly = read_in(path)
    (instance,) = assembly.instances
    assert instance.name == "gripper_1/finger_1"
    assert instance.transform[:3, 3] == pytest.approx([0.1, 0.03, 0.0])
    assert volume_mm3(assembly) == pytest.approx(8)


def test_assemblies_that_need_each_other_end(
    box: Any, step: Any, tmp_path: Path, read_in: Any, codes_of: Any
) -> None:
    """a needs b, b needs a: the ring is cut where it closes, and said."""
    for name, other in (("a", "b"), ("b", "a")):
        document = step()
        top = document.assembly(name)
        document.place(top, document.part(box(1, 1, 1), other), name=f"{other}_1")
        emptied(document.write(tmp_path / f"{name}.step"), other)
    assembly = read_in(tmp_path / "a.step")
    assert volume_mm3(assembly) == 0.0
    assert len(assembly.instances) == 1


def test_a_named_external_file_is_found_by_its_bare_name(
    box: Any, trsf: Any, step: Any, tmp_path: Path, read_in: Any
) -> None:
    """AP214 references name a file; it is looked for here, whatever folder the reference says."""
    folder = tmp_path / "here"
    folder.mkdir()
    document = step()
    top = document.assembly("top")
    document.place(top, document.part(box(3, 3, 3), "cube"), trsf((7, 0, 0)), "cube_1")
    path = document.write(folder / "top.step", external=True)
    written = folder / "cube.stp"
    assert written.is_file()
    written.rename(folder / "vendor-4711.stp")
    text = path.read_text("ascii").replace("'cube.stp'", r"'..\\elsewhere\\vendor-4711.stp'")
    path.write_text(text, "ascii")
    assert volume_mm3(read_in(path)) == pytest.approx(27)


def test_a_named_external_file_is_never_opened_elsewhere(
    box: Any, step: Any, tmp_path: Path, read_in: Any, codes_of: Any
) -> None:
    """The kernel would open an absolute path that a file names; we give it no name to open."""
    folder = tmp_path / "here"
    folder.mkdir()
    document = step()
    top = document.assembly("top")
    document.place(top, document.part(box(3, 3, 3), "cube"), name="cube_1")
    path = document.write(folder / "top.step", external=True)
    secret = tmp_path / "cube.stp"
    (folder / "cube.stp").rename(secret)
    text = path.read_text("ascii").replace("'cube.stp'", f"'{secret}'")
    path.write_text(text, "ascii")
    assembly = read_in(path)
    assert volume_mm3(assembly) == 0.0
    assert GeometryCode.NO_GEOMETRY in codes_of(assembly)


def test_the_number_of_siblings_is_limited(split: Path, read_in: Any) -> None:
    """One file allowed, two needed: the second product says so."""
    assembly = read_in(split, max_siblings=1)
    messages = [p.message for prototype in assembly.prototypes.values() for p in prototype.problems]
    assert any("more than 1 files belong" in message for message in messages)


def test_an_assembly_file_alone_is_an_error_nowhere_but_a_problem(split: Path, read_in: Any) -> None:
    """A split assembly without its parts is read: its BOM may still give all masses."""
    for name in ("hand", "upper arm"):
        (split.parent / f"{name}.STEP").unlink()
    try:
        assembly = read_in(split)
    except DocumentError as error:  # pragma: no cover - the behaviour under test
        pytest.fail(f"it must be read: {error}")
    assert "put their files into its folder" in assembly.problems[0].message


@pytest.mark.parametrize("name", ["hand_prt.stp", "HAND.prt.stp", "hand.prt.12.step", "hand_asm.STEP"])
def test_the_kind_in_the_name_of_a_sibling_does_not_matter(
    name: str, split: Path, read_in: Any, codes_of: Any
) -> None:
    """Pro/E and Creo write the kind of a file behind its name."""
    (split.parent / "hand.STEP").rename(split.parent / name)
    assembly = read_in(split)
    assert volume_mm3(assembly) == pytest.approx(22_000)
    assert codes_of(assembly) == [GeometryCode.EXTERNAL_FILE]


def test_a_file_of_that_product_is_found_under_any_name(split: Path, read_in: Any) -> None:
    """A company's number as the file's name: the only product in it says what it is."""
    (split.parent / "hand.STEP").rename(split.parent / "4711-02.stp")
    assembly = read_in(split)
    assert volume_mm3(assembly) == pytest.approx(22_000)
    assert "4711-02.stp" in assembly.problems[0].message


def test_two_files_of_one_product_are_a_question(split: Path, read_in: Any, codes_of: Any) -> None:
    data = (split.parent / "hand.STEP").read_bytes()
    (split.parent / "hand.STEP").rename(split.parent / "4711-02.stp")
    (split.parent / "4711-03.stp").write_bytes(data)
    assembly = read_in(split)
    assert volume_mm3(assembly) == pytest.approx(20_000)
    assert (
        "4711-02.stp, 4711-03.stp" in assembly.prototypes[assembly.instances[2].prototype].problems[0].message
    )


def test_the_file_that_the_text_names_is_found(split: Path, read_in: Any) -> None:
    """Pro/E and CATIA refer to the file itself, without a document in between; its folder is not opened."""
    text = split.read_text("ascii")
    product = re.search(r"#(\d+) = PRODUCT\('hand'", text)
    assert product is not None
    formation = re.search(rf"#(\d+) = PRODUCT_DEFINITION_FORMATION\([^#]*#{product[1]}\)", text)
    assert formation is not None
    definition = re.search(rf"#(\d+) = PRODUCT_DEFINITION\([^#]*#{formation[1]},", text)
    assert definition is not None
    named = (
        "#90000=DOCUMENT_TYPE('');\n#90001=DOCUMENT_FILE('C:\\\\parts\\\\x17.stp','','',#90000,'','');\n"
        f"#90002=APPLIED_DOCUMENT_REFERENCE(#90001,'',(#{definition[1]}));\n"
    )
    split.write_text(text.replace("ENDSEC;\nEND-ISO", f"{named}ENDSEC;\nEND-ISO"), "ascii")
    file = split.parent / "hand.STEP"
    # Another product in it, so that its name and its content do not lead there.
    text = file.read_text("ascii").replace("'hand'", "'thing'")
    file.unlink()
    (split.parent / "x17.stp").write_text(text, "ascii")
    assert volume_mm3(read_in(split)) == pytest.approx(22_000)


def test_a_part_that_appears_under_another_name_ends_a_kept_reading(split: Path, tmp_path: Path) -> None:
    options = ReadOptions(isolate=True, cache_dir=tmp_path / "kept", processes=1)
    hand = split.parent / "hand.STEP"
    data = hand.read_bytes()
    hand.unlink()
    assert volume_mm3(read(split, options=options)) == pytest.approx(20_000)
    (split.parent / "4711-02.stp").write_bytes(data)
    assert volume_mm3(read(split, options=options)) == pytest.approx(22_000)
