# SPDX-License-Identifier: LGPL-2.1-or-later
"""A project committed on one computer and fetched on another: each file in its place, no edits lost."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from fcstd_writer import Doc, locals_, part
from hypothesis import given
from hypothesis import strategies as st

from silo.api.files import download_revision
from silo.api.wire import FrozenFile, LinkedFile, Release
from silo.bom.entry import Extraction
from silo.bom.errors import DocumentError, InputError, NotFoundError, ServerFaultError
from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly
from silo.fcstd import Library
from silo.fcstd.linked import place_of, recorded_paths
from silo.outbox.entry import Commit
from silo.outbox.send import send_all
from silo.outbox.store import Store
from silo.testing import FakeSilo
from silo.vault.pull import Pulled, PullState, Rules, lay_out, place
from silo.vault.revisions import RevisionBoms, words
from silo.vault.tree import fetched


def assembly(identity: str, *links: tuple[str, str, int]) -> Doc:
    """An assembly as Assembly4 makes it; links: (name, file, element count)."""
    doc = Doc("Top", meta={"SiloUUID": identity})
    for name, file, count in links:
        doc.link(name, file, "Box", ElementCount=count)
    return doc.add("App::Part", "Assembly", Type="Assembly", Group=locals_(*(name for name, _, _ in links)))


def bom(path: Path) -> list[tuple[str | None, float, bool]]:
    """(identity, quantity, missing) of the lines."""
    with Library() as library:
        found: Extraction = extract(choose_assembly(library.open(path)))
    return sorted((e.silo_uuid, e.quantity, e.missing) for e in found.entries)


@dataclass
class Project:
    """A project of three folders on the first computer, and a Silo.

    ``robot/arm/Arm.FCStd`` links ``parts/Plate.FCStd`` and ``../lib/Bolt.FCStd``; the bolt links
    ``../../vendor/Nut.FCStd``.
    """

    folder: Path
    silo: FakeSilo

    def __post_init__(self) -> None:
        self.ids = {
            name: self.silo.create_item("kindred-rd", category, name, item_type=kind).id
            for name, category, kind in (
                ("Arm", "A01", "assembly"),
                ("Plate", "M01", "part"),
                ("Bolt", "F01", "assembly"),
                ("Nut", "F01", "part"),
            )
        }
        self.store = Store(self.folder / "data" / "outbox.sqlite3")
        self.arm = self.folder / "work" / "robot" / "arm" / "Arm.FCStd"
        self.write(bolts=4)
        part("Plate", uuid=self.ids["Plate"]).save(self.path("arm/parts/Plate.FCStd"))
        part("Nut", uuid=self.ids["Nut"]).save(self.folder / "work" / "vendor" / "Nut.FCStd")
        nut = assembly(self.ids["Bolt"], ("Nut", "../../vendor/Nut.FCStd", 1)).add("Part::Box", "Box")
        nut.save(self.path("lib/Bolt.FCStd"))

    def path(self, below: str) -> Path:
        return self.folder / "work" / "robot" / below

    def write(self, bolts: int) -> None:
        links = (("Plate", "parts/Plate.FCStd", 0), ("Bolts", "../lib/Bolt.FCStd", bolts))
        assembly(self.ids["Arm"], *links).save(self.arm)

    def stored(self, name: str) -> Any:
        return next(s for s in self.silo.items.values() if s.item.name == name)

    def number(self, name: str) -> str:
        return str(self.stored(name).item.part_number)

    def commit(self, *names: str) -> None:
        paths = {
            "Arm": self.arm,
            "Plate": self.path("arm/parts/Plate.FCStd"),
            "Bolt": self.path("lib/Bolt.FCStd"),
            "Nut": self.folder / "work" / "vendor" / "Nut.FCStd",
        }
        for name in names or ("Nut", "Bolt", "Plate", "Arm"):
            path = paths[name]
            self.store.add(
                Commit(path=str(path), taken_at=1.0, label=name, identity=self.ids[name], file=path)
            )
        send_all(self.store, self.silo)
        assert self.store.entries() == ()

    def pull(self, into: Path, name: str = "Arm", revision: int | str | None = None, **rules: Any) -> Pulled:
        with fetched(self.silo, self.number(name), revision) as tree:
            return place(tree, into, Rules(**rules))


@pytest.fixture
def project(tmp_path: Path) -> Project:
    return Project(tmp_path, FakeSilo())


def states(pulled: Pulled, into: Path) -> dict[str, PullState]:
    return {one.path.relative_to(into.resolve()).as_posix(): one.state for one in pulled.files}


TREE = {
    "robot/arm/Arm.FCStd",
    "robot/arm/parts/Plate.FCStd",
    "robot/lib/Bolt.FCStd",
    "vendor/Nut.FCStd",
}


def test_a_tree_is_fetched_with_every_file_in_its_place(project: Project, tmp_path: Path) -> None:
    """Folders above the top have the names that they had; no link is missing, the BOMs are equal."""
    project.commit()
    into = tmp_path / "other computer"
    pulled = project.pull(into)
    assert states(pulled, into) == dict.fromkeys(TREE, PullState.NEW)
    assert pulled.complete
    assert pulled.top == (into / "robot" / "arm" / "Arm.FCStd").resolve()
    assert bom(pulled.top) == bom(project.arm)
    assert not any(missing for _, _, missing in bom(pulled.top))
    again = project.pull(into)
    assert set(states(again, into).values()) == {PullState.SAME}


def test_a_chosen_revision_brings_the_files_of_its_time(project: Project, tmp_path: Path) -> None:
    """And the newest brings the newest of all."""
    project.commit()
    part("Plate, thicker", uuid=project.ids["Plate"]).save(project.path("arm/parts/Plate.FCStd"))
    project.write(bolts=6)
    project.commit("Plate", "Arm")
    part("Plate, thickest", uuid=project.ids["Plate"]).save(project.path("arm/parts/Plate.FCStd"))
    project.commit("Plate")

    plates = [content for _, content in sorted(project.stored("Plate").files.items())]
    for revision, plate, bolts in ((1, plates[0], 4), (2, plates[1], 6), (None, plates[2], 6)):
        into = tmp_path / f"at {revision}"
        pulled = project.pull(into, revision=revision)
        assert pulled.complete
        assert (into / "robot/arm/parts/Plate.FCStd").read_bytes() == plate
        assert next(q for i, q, _ in bom(pulled.top) if i == project.ids["Bolt"]) == bolts


def test_a_release_brings_its_own_files_and_no_other(project: Project, tmp_path: Path) -> None:
    """The revisions that it names, also of a file without a link; a file that it lacks is reported."""
    project.commit()
    part("Plate, thicker", uuid=project.ids["Plate"]).save(project.path("arm/parts/Plate.FCStd"))
    project.commit("Plate")
    files = [
        FrozenFile(
            document=project.ids[name],
            revision=1,
            file_name=f"{name}.FCStd",
            file_path=f"{place}{name}.FCStd",
        )
        for name, place in (("Arm", "robot/arm/"), ("Plate", "robot/arm/parts/"), ("Nut", "vendor/"))
    ]
    release = Release(label="B", status="released", files=files)
    project.silo.releases[project.number("Arm"), "B"] = release
    pulled = project.pull(tmp_path / "B", revision="B")
    there = {"arm/Arm.FCStd", "arm/parts/Plate.FCStd", "vendor/Nut.FCStd"}
    assert set(states(pulled, tmp_path / "B")) == there
    plate = sorted(project.stored("Plate").files.items())[0][1]
    assert (tmp_path / "B/arm/parts/Plate.FCStd").read_bytes() == plate
    assert [lost.path for lost in pulled.lost] == ["../lib/Bolt.FCStd"]
    assert not pulled.complete
    empty = Release(label="C", status="released")
    project.silo.releases[project.number("Arm"), "C"] = empty
    with pytest.raises(InputError, match="no file in revision C"):
        project.pull(tmp_path / "C", revision="C")
    with pytest.raises(NotFoundError, match="no revision 'Q'"):
        project.pull(tmp_path / "Q", revision="Q")


def test_local_edits_are_not_overwritten_unasked(project: Project, tmp_path: Path) -> None:
    """An older revision is replaced, an edited file is not; at the user's word it is, and a copy is kept."""
    project.commit()
    into = tmp_path / "mine"
    project.pull(into)
    project.write(bolts=6)
    part("Plate, thicker", uuid=project.ids["Plate"]).save(project.path("arm/parts/Plate.FCStd"))
    project.commit("Plate", "Arm")
    plate = into / "robot/arm/parts/Plate.FCStd"
    part("mine", uuid=project.ids["Plate"]).save(plate)
    edited = plate.read_bytes()
    pulled = project.pull(into)
    told = states(pulled, into)
    assert told["robot/arm/Arm.FCStd"] is PullState.UPDATED
    assert told["robot/arm/parts/Plate.FCStd"] is PullState.EDITED
    assert not pulled.complete
    assert plate.read_bytes() == edited
    pulled = project.pull(into, overwrite=True, keep=project.store.keep_aside)
    (one,) = [one for one in pulled.files if one.state is PullState.OVERWRITTEN]
    assert one.kept is not None
    assert one.kept.read_bytes() == edited
    assert plate.read_bytes() == project.path("arm/parts/Plate.FCStd").read_bytes()


def test_what_freecad_has_open_is_left_alone(project: Project, tmp_path: Path) -> None:
    """Its next save would undo what is written."""
    project.commit()
    into = tmp_path / "mine"
    project.pull(into)
    project.write(bolts=6)
    project.commit("Arm")
    pulled = project.pull(into, is_open=lambda path: path.endswith("Arm.FCStd"))
    assert states(pulled, into)["robot/arm/Arm.FCStd"] is PullState.OPEN
    assert bom(pulled.top) != bom(project.arm)


def test_a_part_goes_where_the_folder_has_it_already(project: Project, tmp_path: Path) -> None:
    """Fetched alone it would begin a second copy beside the project."""
    project.commit()
    into = tmp_path / "mine"
    project.pull(into)
    part("Plate, thicker", uuid=project.ids["Plate"]).save(project.path("arm/parts/Plate.FCStd"))
    project.commit("Plate")
    pulled = project.pull(into, "Plate")
    assert states(pulled, into) == {"robot/arm/parts/Plate.FCStd": PullState.UPDATED}
    alone = tmp_path / "alone"
    assert set(states(project.pull(alone, "Plate"), alone)) == {"Plate.FCStd"}


def test_what_is_not_in_silo_is_reported(project: Project, tmp_path: Path) -> None:
    """A part that was never committed: the rest comes, and the pull is not complete."""
    project.commit("Nut", "Bolt", "Arm")
    pulled = project.pull(tmp_path / "into")
    (lost,) = pulled.lost
    assert (lost.position, lost.path) == ("arm/Arm.FCStd", "parts/Plate.FCStd")
    assert "has no file in Silo" in lost.reason
    assert len(pulled.files) == 3
    with pytest.raises(InputError, match="no file with the revision 9"):
        project.pull(tmp_path / "into", revision=9)
    with pytest.raises(InputError, match="no file yet"):
        project.pull(tmp_path / "into", "Plate")


def test_without_what_the_commit_wrote_down_the_bom_says_it(project: Project, tmp_path: Path) -> None:
    """Files of an older client or another server: by the BOM's components, else by the files' names."""
    project.commit()
    for stored in project.silo.items.values():
        stored.revisions[:] = [
            r.model_copy(update={"links": [], "file_path": None}) for r in stored.revisions
        ]
    for parent, children in (("Arm", ("Plate", "Bolt")), ("Bolt", ("Nut",))):
        for child in children:
            project.silo.add_bom_line(project.number(parent), project.number(child), quantity=1)
    into = tmp_path / "into"
    pulled = project.pull(into)
    assert pulled.complete
    assert bom(pulled.top) == bom(project.arm)


def test_a_hostile_path_leaves_the_folder_alone(project: Project, tmp_path: Path) -> None:
    """Absolute, on the network, a device, and no FreeCAD file."""
    bad = ("/etc/passwd.FCStd", "//host/x.FCStd", "C:/x.FCStd", "NUL.FCStd", "../.bashrc", "parts/run.py")
    links = tuple((f"L{n}", path, 0) for n, path in enumerate(bad))
    assembly(project.ids["Arm"], *links, ("Plate", "parts/Plate.FCStd", 0)).save(project.arm)
    project.commit("Plate", "Arm")
    # A server that lies has an item for each of them.
    (revision,) = (one for one in project.stored("Arm").revisions if one.file_name)
    revision.links.extend(LinkedFile(path=path, item=project.ids["Plate"]) for path in bad)
    into = tmp_path / "into"
    pulled = project.pull(into)
    assert {lost.path for lost in pulled.lost} == set(bad)
    reasons = [lost.reason for lost in pulled.lost]
    assert not any("no item in Silo" in reason for reason in reasons)
    assert sum("absolute path" in reason for reason in reasons) == 3
    assert sum("not a FreeCAD file" in reason for reason in reasons) == 2
    assert set(states(pulled, into)) == {"Arm.FCStd", "parts/Plate.FCStd"}


def test_a_file_knows_its_place_and_links(project: Project) -> None:
    """Each recorded path once, with the identity in the file and its hash."""
    found = place_of(project.arm, str(project.arm))
    assert found.path == "arm/Arm.FCStd"
    assert {link.path: link.item for link in found.links} == {
        "parts/Plate.FCStd": project.ids["Plate"],
        "../lib/Bolt.FCStd": project.ids["Bolt"],
    }
    assert all(len(link.sha256) == 64 for link in found.links)
    project.path("lib/Bolt.FCStd").unlink()
    gone = place_of(project.arm, str(project.arm))
    assert [(link.item, link.sha256) for link in gone.links if "Bolt" in link.path] == [("", "")]
    assert set(recorded_paths(project.arm)) == {link.path for link in gone.links}


def test_the_bom_of_each_revision(project: Project) -> None:
    """Read from the files as if they lay where the user's file lies."""
    project.commit()
    project.write(bolts=6)
    project.commit("Arm")
    with RevisionBoms(project.silo, project.number("Arm"), str(project.arm)) as boms:
        assert words(boms.change(1, 2)) == "Box 4 → 6"
        assert words(boms.change(None, 1)).startswith("+ ")
        assert words(boms.change(1, 2) * 9).endswith("Box 4 → 6 and 3 more")
    with RevisionBoms(project.silo, project.number("Plate"), "/nowhere/Plate.FCStd") as boms:
        assert boms.change(None, 1) == ()


NAMES = st.sampled_from(["a", "b", "c"])


@given(st.lists(NAMES, max_size=4), st.lists(st.tuples(st.lists(NAMES, max_size=3), NAMES), max_size=6))
def test_relative_places_are_kept_whatever_the_folders(
    top: list[str], others: list[tuple[list[str], str]]
) -> None:
    """A law: wherever the files lie, laid out again each is in the same place relative to the top."""
    import posixpath

    files = {"/".join(["root", *folders, f"{name}.FCStd"]) for folders, name in others}
    top_path = "/".join(["root", *top, "Top.FCStd"])
    positions = ["Top.FCStd", *(posixpath.relpath(one, posixpath.dirname(top_path)) for one in sorted(files))]
    places = lay_out((position, None) for position in positions)
    assert not any(".." in one.split("/") for one in places)
    for position, where in zip(positions, places, strict=True):
        assert posixpath.relpath(where, posixpath.dirname(places[0]) or ".") == position


def test_a_file_below_is_that_of_the_tops_time(project: Project, tmp_path: Path) -> None:
    """A nut that was committed again between the bolt that links to it and the arm above both."""
    project.commit()
    nut = project.folder / "work" / "vendor" / "Nut.FCStd"
    before = nut.read_bytes()
    part("Nut, greased", uuid=project.ids["Nut"]).save(nut)
    project.commit("Nut")
    project.write(bolts=6)
    project.commit("Arm")
    then = nut.read_bytes()
    part("Nut, rusty", uuid=project.ids["Nut"]).save(nut)
    project.commit("Nut")
    for revision, content in ((1, before), (2, then)):
        into = tmp_path / f"at {revision}"
        assert project.pull(into, revision=revision).complete
        assert (into / "vendor/Nut.FCStd").read_bytes() == content


def test_a_file_that_is_not_what_was_committed_is_refused(project: Project, tmp_path: Path) -> None:
    """Damaged in the server's store, or by a server that lies: nothing is written, nothing is learned."""
    project.commit()
    files = project.stored("Plate").files
    files[1] = files[1][:-100]
    learned: list[str] = []
    with pytest.raises(ServerFaultError, match="revision 1, is not the one that was committed"):
        project.pull(tmp_path / "into", learn=lambda sha256, _item, _number: learned.append(sha256))
    assert not (tmp_path / "into").exists()
    assert learned == []
    target = tmp_path / "one.FCStd"
    with pytest.raises(ServerFaultError):
        download_revision(project.silo, project.number("Plate"), target, 1, "0" * 64)
    assert not target.exists()
    assert download_revision(project.silo, project.number("Plate"), target, 1, "") != ""


@pytest.mark.usefixtures("needs_symlinks")
def test_no_folder_is_made_outside(project: Project, tmp_path: Path) -> None:
    """A link that leads out is noticed before anything is made behind it."""
    assembly(project.ids["Arm"], ("Plate", "parts/new/Plate.FCStd", 0)).save(project.arm)
    (project.arm.parent / "parts" / "new").mkdir()
    (project.arm.parent / "parts" / "Plate.FCStd").rename(project.arm.parent / "parts/new/Plate.FCStd")
    plate = project.arm.parent / "parts/new/Plate.FCStd"
    project.store.add(Commit(path=str(plate), taken_at=1.0, identity=project.ids["Plate"], file=plate))
    project.commit("Arm")
    elsewhere, other = tmp_path / "elsewhere", tmp_path / "other"
    elsewhere.mkdir()
    other.mkdir()
    (other / "parts").symlink_to(elsewhere)
    (lost,) = (one for one in project.pull(other).lost if "leads out of" in one.reason)
    assert lost.path.endswith("Plate.FCStd")
    assert (other / "Arm.FCStd").exists()
    assert list(elsewhere.iterdir()) == []


@pytest.mark.usefixtures("needs_symlinks")
def test_a_link_to_a_file_stays_a_link(project: Project, tmp_path: Path) -> None:
    """The file is replaced where it is; a second path of it sees the same."""
    project.commit()
    into = tmp_path / "into"
    project.pull(into)
    plate, real = into / "robot/arm/parts/Plate.FCStd", into / "library" / "Plate-1.FCStd"
    real.parent.mkdir()
    plate.rename(real)
    plate.symlink_to(real)
    part("Plate, thicker", uuid=project.ids["Plate"]).save(project.path("arm/parts/Plate.FCStd"))
    project.commit("Plate")
    assert states(project.pull(into), into)["robot/arm/parts/Plate.FCStd"] is PullState.UPDATED
    assert plate.is_symlink()
    assert real.read_bytes() == project.path("arm/parts/Plate.FCStd").read_bytes()


@pytest.mark.usefixtures("needs_symlinks")
@pytest.mark.parametrize("overwrite", [False, True])
def test_two_files_that_are_one_on_this_disk(project: Project, tmp_path: Path, *, overwrite: bool) -> None:
    """By a link here, elsewhere by case or Unicode form: the second does not replace the first."""
    arm = project.arm.parent
    for folder, name in (("a", "Plate"), ("b", "Nut")):
        (arm / folder).mkdir()
        part(name, uuid=project.ids[name]).save(arm / folder / "P.FCStd")
        path = arm / folder / "P.FCStd"
        project.store.add(Commit(path=str(path), taken_at=1.0, identity=project.ids[name], file=path))
    assembly(project.ids["Arm"], ("A", "a/P.FCStd", 0), ("B", "b/P.FCStd", 0)).save(project.arm)
    project.commit("Arm")
    into = tmp_path / "into"
    (into / "a").mkdir(parents=True)
    (into / "b").symlink_to(into / "a")
    pulled = project.pull(into, overwrite=overwrite, keep=project.store.keep_aside)
    assert (into / "a/P.FCStd").read_bytes() == (arm / "a/P.FCStd").read_bytes()
    (lost,) = pulled.lost
    assert (lost.path, not pulled.complete) == ("b/P.FCStd", True)
    assert "has the same place on this disk" in lost.reason


def test_what_the_top_links_to_is_what_its_designer_had(project: Project, tmp_path: Path) -> None:
    """A colleague's newer plate was in Silo already, but not in the folder that was committed."""
    project.commit()
    plate = project.path("arm/parts/Plate.FCStd")
    then = plate.read_bytes()
    newer = tmp_path / "colleague" / "Plate.FCStd"
    part("Plate, by a colleague", uuid=project.ids["Plate"]).save(newer)
    project.silo.upload_file(project.number("Plate"), newer, "thicker")
    project.write(bolts=6)
    project.commit("Arm")
    for revision, content in ((2, then), (None, newer.read_bytes())):
        into = tmp_path / f"at {revision}"
        project.pull(into, revision=revision)
        assert (into / "robot/arm/parts/Plate.FCStd").read_bytes() == content


def test_a_file_below_that_was_sent_after_the_top(project: Project, tmp_path: Path) -> None:
    """Its upload had to be repeated: what the file above it names counts, not only the time."""
    project.commit("Nut")
    nut = project.folder / "work" / "vendor" / "Nut.FCStd"
    part("Nut, greased", uuid=project.ids["Nut"]).save(nut)
    project.commit("Arm", "Plate", "Bolt", "Nut")
    into = tmp_path / "into"
    assert project.pull(into, revision=1).complete
    assert (into / "vendor/Nut.FCStd").read_bytes() == nut.read_bytes()


def test_a_folder_in_the_way_keeps_no_other_file(project: Project, tmp_path: Path) -> None:
    """It is reported with the rest; where the top itself has no place, that is an error."""
    project.commit()
    into = tmp_path / "into"
    (into / "robot/arm/parts/Plate.FCStd").mkdir(parents=True)
    pulled = project.pull(into, overwrite=True)
    (lost,) = pulled.lost
    assert (lost.path, lost.reason) == ("robot/arm/parts/Plate.FCStd", "a folder has its place and name")
    assert not pulled.complete
    assert set(states(pulled, into)) == TREE - {"robot/arm/parts/Plate.FCStd"}
    other = tmp_path / "other"
    (other / "robot/arm/Arm.FCStd").mkdir(parents=True)
    with pytest.raises(DocumentError, match="a folder has its place"):
        project.pull(other)
    assert [path.name for path in other.rglob("*.FCStd")] == ["Arm.FCStd"]


def test_a_tree_without_an_end_is_an_error(project: Project, tmp_path: Path) -> None:
    """A file that links to itself in a folder below has a place for each turn."""
    assembly(project.ids["Arm"], ("Again", "deeper/Arm.FCStd", 0)).save(project.arm)
    project.commit("Arm")
    (revision,) = (one for one in project.stored("Arm").revisions if one.file_name)
    revision.links[:] = [LinkedFile(path="deeper/Arm.FCStd", item=project.ids["Arm"])]
    with (
        pytest.raises(InputError, match="more than 9 files"),
        fetched(project.silo, project.number("Arm"), most=9),
    ):
        pass


def test_files_of_one_moment_count_as_there(tmp_path: Path) -> None:
    """A clock without fractions of a second, and a server that wrote no links down."""
    project = Project(tmp_path, FakeSilo(clock=lambda: datetime(2026, 1, 2, tzinfo=UTC)))
    project.commit()
    part("Plate, thicker", uuid=project.ids["Plate"]).save(project.path("arm/parts/Plate.FCStd"))
    project.commit("Plate")
    for stored in project.silo.items.values():
        stored.revisions[:] = [one.model_copy(update={"links": []}) for one in stored.revisions]
    for child in ("Plate", "Bolt"):
        project.silo.add_bom_line(project.number("Arm"), project.number(child), quantity=1)
    into = tmp_path / "into"
    project.pull(into, revision=1)
    now = project.path("arm/parts/Plate.FCStd").read_bytes()
    assert (into / "arm/parts/Plate.FCStd").read_bytes() == now


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("NUL.FCStd", "_NUL.FCStd"),
        ("../../.bashrc", "bashrc.FCStd"),
        ("C:\\Users\\x\\Arm.FCStd", "Arm.FCStd"),
        ("..", "file.FCStd"),
    ],
)
def test_the_top_has_a_name_of_a_file(project: Project, tmp_path: Path, name: str, place: str) -> None:
    """Whatever the server calls it."""
    project.commit("Nut")
    stored = project.stored("Nut")
    stored.revisions[:] = [
        one.model_copy(update={"file_name": name, "file_path": name if name != ".." else None})
        for one in stored.revisions
    ]
    into = tmp_path / "into"
    assert set(states(project.pull(into, "Nut"), into)) == {place}


def test_two_items_that_want_one_place(project: Project, tmp_path: Path) -> None:
    """The first stays, and the second is reported."""
    links = (("Plate", "../lib/Nut.FCStd", 0), ("Bolts", "../lib/Bolt.FCStd", 4))
    assembly(project.ids["Arm"], *links).save(project.arm)
    assembly(project.ids["Bolt"], ("Nut", "Nut.FCStd", 1)).save(project.path("lib/Bolt.FCStd"))
    project.commit()
    for name, path, item in (("Arm", "../lib/Nut.FCStd", "Plate"), ("Bolt", "Nut.FCStd", "Nut")):
        (revision,) = (one for one in project.stored(name).revisions if one.file_name)
        revision.links[:] = [
            *(one for one in revision.links if one.path != path),
            LinkedFile(path=path, item=project.ids[item]),
        ]
    pulled = project.pull(tmp_path / "into")
    (lost,) = pulled.lost
    assert lost.path == "lib/Nut.FCStd"
    assert lost.reason == f"{project.number('Plate')} and {project.number('Nut')} want the same place"


def test_two_copies_in_the_folder_are_no_place(project: Project, tmp_path: Path) -> None:
    """Which of them is meant is not guessed."""
    project.commit()
    into = tmp_path / "mine"
    for folder in ("a", "b"):
        project.pull(into / folder, "Plate")
    assert states(project.pull(into, "Plate"), into) == {"Plate.FCStd": PullState.NEW}
