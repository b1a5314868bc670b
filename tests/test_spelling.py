# SPDX-License-Identifier: LGPL-2.1-or-later
"""One path per file, on disks of both kinds: those that distinguish spellings, and those that do not."""

from __future__ import annotations

import json
import os
import unicodedata
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from fcstd_writer import Doc, XLink, locals_
from hunting import examples
from hypothesis import given, settings
from hypothesis import strategies as st
from other_disk import other_disk

from silo.bom.errors import DocumentError
from silo.bom.view.tree_json import bom_json
from silo.cli.reading import read_assembly
from silo.fcstd import Library
from silo.platform.spelling import Spelling

NFD = unicodedata.normalize("NFD", "Büchse")


@pytest.fixture(scope="module", params=[(), ("each-spelling",)], ids=["one-number", "each-spelling"])
def root(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Iterator[Path]:
    """A disk that finds a name in any case and normal form: the machine's own, or a mount."""
    folder = tmp_path_factory.mktemp("disk")
    (folder / "ask-Ü").touch()
    if not request.param and (folder / unicodedata.normalize("NFD", "ASK-ü")).exists():
        yield Path(os.path.realpath(folder))
        return
    with other_disk(folder, *request.param) as mounted:
        yield mounted


@pytest.fixture
def disk(root: Path) -> Path:
    """An empty folder on such a disk."""
    folder = root / str(uuid.uuid4())
    folder.mkdir()
    return folder


def real(path: Path | str) -> str:
    return Spelling().real(os.fspath(path))


def test_every_spelling_of_a_file_is_one_path(disk: Path) -> None:
    (disk / "Parts" / "Sub").mkdir(parents=True)
    wanted = disk / "Parts" / "Sub" / "Bolt.FCStd"
    wanted.write_text("x")
    session = Spelling()
    for spelt in (
        "Parts/Sub/Bolt.FCStd",
        "parts/SUB/bolt.fcstd",
        "PARTS/sub/BOLT.FCSTD",
        "parts/../parts/sub/bolt.fcstd",
    ):
        assert real(disk / spelt) == str(wanted), spelt
        assert session.real(str(disk / spelt)) == str(wanted), spelt
    wanted = disk / "Büchse" / "Büchse.FCStd"
    wanted.parent.mkdir()
    wanted.touch()
    for folder in (NFD, NFD.upper()):
        assert real(disk / folder / f"{NFD}.FCStd") == str(wanted), "every normal form"


@pytest.mark.usefixtures("needs_case")  # of the disk below the simulated one
def test_a_letter_without_a_counterpart_keeps_no_name_from_being_found(tmp_path: Path) -> None:
    """Windows takes ß for no SS; one part was two components where a link wrote it in another case."""
    with other_disk(tmp_path, "by-letter") as disk:
        wanted = disk / "Straße" / "Büchse ß.FCStd"
        wanted.parent.mkdir()
        wanted.touch()
        (disk / "STRASSE").mkdir()
        assert real(disk / "straße" / "BÜCHSE ß.fcstd") == str(wanted)
        assert real(disk / "strasse") == str(disk / "STRASSE")


class OtherNumbers(Spelling):
    """A disk that numbers files in its listings otherwise, as some network disks do."""

    def _listing(self, folder: str) -> dict[str, list[tuple[str, int]]]:
        listed = super()._listing(folder)
        return {key: [(name, -number) for name, number in names] for key, names in listed.items()}


def test_a_listing_with_other_numbers_has_the_names(disk: Path) -> None:
    wanted = disk / "Büchse" / "Büchse.FCStd"
    wanted.parent.mkdir()
    wanted.write_text("x")
    (wanted.parent / "Bolt.FCStd").write_text("y")
    assert OtherNumbers().real(str(disk / NFD.upper() / f"{NFD}.FCStd")) == str(wanted)
    assert OtherNumbers().real(str(disk / "büchse" / "BOLT.fcstd")) == str(wanted.with_name("Bolt.FCStd"))


def test_a_name_that_another_file_had_a_moment_ago(disk: Path) -> None:
    """A disk may still answer for the file that was deleted under another spelling."""
    for _ in range(5):
        (disk / "Büchse").touch()
        assert (disk / NFD.upper()).exists()
        (disk / "Büchse").unlink()
        wanted = disk / "Büchse" / "Bolt.FCStd"
        wanted.parent.mkdir()
        wanted.touch()
        assert real(disk / NFD.upper() / "BOLT.fcstd") == str(wanted)
        wanted.unlink()
        wanted.parent.rmdir()


def test_a_path_that_is_not_there_is_spelt_as_far_as_it_goes(disk: Path) -> None:
    (disk / "Parts").mkdir()
    assert real(disk / "PARTS" / "new.FCStd") == str(disk / "Parts" / "new.FCStd")


@pytest.mark.usefixtures("needs_case")
def test_where_names_differ_by_case_they_are_two_files(tmp_path: Path) -> None:
    for name in ("Bolt.FCStd", "bOLT.fcsTD"):
        (tmp_path / name).write_text(name)
    for name in ("Bolt.FCStd", "bOLT.fcsTD"):
        assert real(tmp_path / name) == str(tmp_path / name)


@pytest.mark.usefixtures("needs_symlinks", "needs_case")
def test_hard_links_and_symlinks(tmp_path: Path) -> None:
    """Both names of a hard link are listed, so each stays what it is; a symlink is its target."""
    (tmp_path / "Bolt.FCStd").write_text("x")
    os.link(tmp_path / "Bolt.FCStd", tmp_path / "bOLT.fcsTD")
    (tmp_path / "link.FCStd").symlink_to("Bolt.FCStd")
    assert real(tmp_path / "bOLT.fcsTD") == str(tmp_path / "bOLT.fcsTD")
    assert real(tmp_path / "link.FCStd") == str(tmp_path / "Bolt.FCStd")


def project(folder: Path, *recorded: str, names: tuple[str, ...] = ("Büchse",)) -> Path:
    """An assembly with one link for each recorded spelling of ``Parts/Büchse.FCStd`` or another part."""
    (folder / "Parts").mkdir(exist_ok=True)
    for name in names:
        Doc("part").add("Part::Box", "Box").save(folder / "Parts" / f"{name}.FCStd")
    top = Doc("top")
    for number, file in enumerate(recorded):
        top.add("App::Link", f"L{number}", LinkedObject=XLink(file, "Box"))
    links = locals_(*(f"L{number}" for number in range(len(recorded))))
    top.add("Assembly::AssemblyObject", "A", Group=links).save(folder / "Top.FCStd")
    return folder / "Top.FCStd"


def counted(top: Path) -> list[tuple[str, int]]:
    return [(os.path.basename(entry.doc_path), entry.quantity) for entry in read_assembly(str(top)).entries]


def test_two_spellings_of_a_part_are_one_component(disk: Path) -> None:
    top = project(disk, "Parts/Büchse.FCStd", "parts/büchse.fcstd", f"PARTS/{NFD}.FCStd")
    assert counted(top) == [("Büchse.FCStd", 3)]
    assert counted(disk / "TOP.fcstd") == [("Büchse.FCStd", 3)]
    assert any("differs in case" in finding.message for finding in read_assembly(str(top)).findings)


def test_how_the_user_spells_the_folder_is_no_matter_of_the_links(disk: Path) -> None:
    (disk / "Vault").mkdir()
    project(disk / "Vault", "Parts/Büchse.FCStd")
    found = read_assembly(str(disk / "VAULT" / "top.fcstd"))
    assert [f.code.value for f in found.findings if "differs" in f.message] == []


def test_the_folder_that_may_be_read_may_be_spelt_in_any_way(disk: Path) -> None:
    (disk / "Vault").mkdir()
    project(disk / "Vault", "Parts/Büchse.FCStd")
    assert Library(root=disk / "VAULT").open(disk / "vault" / "top.fcstd").Objects
    with pytest.raises(DocumentError, match="lies outside"):
        Library(root=disk / "VAULT" / "parts").open(disk / "vault" / "top.fcstd")


NAMES = ("Büchse", "Ölwanne", "Straße", "M8x20")


@st.composite
def respelt(draw: st.DrawFn) -> str:
    """A part's recorded path as some system may have spelt it."""
    text = f"Parts/{draw(st.sampled_from(NAMES))}.FCStd"
    other = "".join(
        draw(st.sampled_from((c, c.lower(), c.upper() if len(c.upper()) == 1 else c))) for c in text
    )
    return unicodedata.normalize(draw(st.sampled_from(("NFC", "NFD"))), other)


@settings(max_examples=examples(8))
@given(recorded=st.lists(respelt(), min_size=1, max_size=6), folder=st.uuids())
def test_any_spelling_gives_the_same_bom_on_every_disk(
    disk: Path, tmp_path: Path, recorded: list[str], folder: uuid.UUID
) -> None:
    """What Linux counts as three spellings of one part, Windows and macOS find as that part: equal JSON."""
    read: list[Any] = []
    for place in (tmp_path / "usual" / folder.hex, disk / folder.hex):
        place.mkdir(parents=True, exist_ok=True)
        read.append(json.dumps(bom_json(read_assembly(str(project(place, *recorded, names=NAMES))))))
        read[-1] = read[-1].replace(str(place), "")
    assert read[0] == read[1]
    table = json.loads(read[0])
    assert "missing" not in json.dumps([f["code"] for f in table["findings"]])


def test_of_several_names_the_number_of_the_file_decides(tmp_path: Path) -> None:
    """Where a disk has both, and finds one of them under a third spelling."""
    for name in ("äB", "ÄB"):
        (tmp_path / name).write_text(name)
    if len(os.listdir(tmp_path)) == 1:
        pytest.skip("this disk takes both for one file")
    for name in ("äB", "ÄB"):
        assert Spelling()._listed(str(tmp_path), "Äb", os.lstat(tmp_path / name)) == name


def test_a_folder_without_end_is_listed_to_a_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Names beyond it stay as they were given."""
    monkeypatch.setattr("silo.platform.spelling._LISTED_AT_MOST", 3)
    for number in range(9):
        (tmp_path / f"part {number}").touch()
    assert sum(map(len, Spelling()._listing(str(tmp_path)).values())) == 3
