# SPDX-License-Identifier: LGPL-2.1-or-later
"""Broken links: each says what is missing; paths that leave the folder, networks and Windows names."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from fcstd_writer import Doc, XLink, container, locals_, part

from silo.bom.errors import DocumentError
from silo.bom.findings import FindingCode
from silo.bom.walk.document import LinkProblem
from silo.bom.walk.links import extract
from silo.fcstd import FcstdObject, Library, Limits, open_document
from silo.fcstd.contents import FileContents
from silo.locator import refusal


def problem(folder: Path, file: str, name: str = "Box", *, root: Path | None = None) -> LinkProblem:
    """What a link to ``file`` in ``folder`` has, if it has no target."""
    path = Doc().link("L", file, name).save(folder / "top.FCStd")
    link = open_document(path, root=root).Objects[0]
    assert link.LinkedObject is None
    found = link.LinkProblem
    assert isinstance(found, LinkProblem)
    return found


def target(folder: Path, file: str, name: str = "Box", **options: Path) -> FcstdObject:
    """The target of a link to ``file`` in ``folder``."""
    link = open_document(Doc().link("L", file, name).save(folder / "top.FCStd"), **options).Objects[0]
    assert link.LinkProblem is None
    found = link.LinkedObject
    assert isinstance(found, FcstdObject)
    return found


def test_a_missing_file(tmp_path: Path) -> None:
    """The file and the object are named as the link records them."""
    assert problem(tmp_path, "parts/none.FCStd") == LinkProblem(
        FindingCode.MISSING_FILE, "parts/none.FCStd", "Box"
    )


def test_a_missing_object(tmp_path: Path) -> None:
    """The file is there, the object is not."""
    part().save(tmp_path / "part.FCStd")
    assert problem(tmp_path, "part.FCStd", "Gone") == LinkProblem(
        FindingCode.MISSING_OBJECT, "part.FCStd", "Gone"
    )


def test_a_missing_object_of_the_same_document(tmp_path: Path) -> None:
    """A link within the document to what is no more."""
    assert problem(tmp_path, "", "Gone") == LinkProblem(FindingCode.MISSING_OBJECT, "", "Gone")


def test_a_link_that_was_never_set(tmp_path: Path) -> None:
    """No file and no object: not broken, but unset."""
    assert problem(tmp_path, "", "") == LinkProblem(FindingCode.UNSET_LINK)


def test_a_link_that_works_has_no_problem(tmp_path: Path) -> None:
    """Nor has an object that is no link."""
    part().save(tmp_path / "part.FCStd")
    box = target(tmp_path, "part.FCStd")
    assert box.LinkProblem is None


@pytest.mark.parametrize(
    ("content", "code", "words"),
    [
        (b"version https://git-lfs.github.com/spec/v1\noid", FindingCode.LFS_POINTER, "git lfs pull"),
        (b"rubbish", FindingCode.UNREADABLE_FILE, "no zip container"),
        (b"", FindingCode.UNREADABLE_FILE, "empty"),
        (part().bytes()[:-9], FindingCode.UNREADABLE_FILE, "cut short"),
        (container({"Document.xml": b"<Document>"}), FindingCode.UNREADABLE_FILE, "no well-formed XML"),
        (container({"Document.xml": b"<!DOCTYPE a><Document/>"}), FindingCode.UNREADABLE_FILE, "DOCTYPE"),
    ],
)
def test_a_file_that_cannot_be_read(tmp_path: Path, content: bytes, code: FindingCode, words: str) -> None:
    """Why not is reported in the link's problem; the assembly itself is still read."""
    (tmp_path / "part.FCStd").write_bytes(content)
    found = problem(tmp_path, "part.FCStd")
    assert (found.code, found.file, found.obj) == (code, "part.FCStd", "Box")
    assert words in found.detail


def test_a_damaged_part_behind_a_sound_head(tmp_path: Path) -> None:
    """What a walker will ask of a target is tried when the link is followed, so the damage is the link's."""
    xml = part().xml().replace('<Property name="Height"', "<Property")
    (tmp_path / "part.FCStd").write_bytes(
        container({"Document.xml": xml.replace("</Properties>", "", 2).encode()})
    )
    assert problem(tmp_path, "part.FCStd").code is FindingCode.UNREADABLE_FILE


def test_a_damaged_subassembly_is_not_an_empty_one(tmp_path: Path) -> None:
    """A sub-assembly is read to its end before anybody counts what it holds."""
    sub = Doc().add("App::Part", "A")
    for number in range(200):
        sub.link(f"L{number}", "part.FCStd", "Box")
    xml = sub.xml()[:-60]
    (tmp_path / "sub.FCStd").write_bytes(container({"Document.xml": xml.encode()}))
    assert problem(tmp_path, "sub.FCStd", "A").code is FindingCode.UNREADABLE_FILE


def test_the_walker_reports_each_missing_file_once(tmp_path: Path) -> None:
    """From problem to finding: one per file, with those that use it, and the BOM blocked."""
    part().save(tmp_path / "part.FCStd")
    doc = (
        Doc().link("L1", "none.FCStd", "Box").link("L2", "none.FCStd", "Box").link("L3", "part.FCStd", "Box")
    )
    doc.add("App::Part", "A", Group=locals_("L1", "L2", "L3"))
    found = extract(open_document(doc.save(tmp_path / "top.FCStd")).getObject("A"))
    assert [(entry.quantity, entry.missing) for entry in found.entries] == [(2, True), (1, False)]
    assert [f.code for f in found.findings] == [FindingCode.MISSING_FILE]
    assert found.blocked
    assert "L1" in found.findings[0].message
    assert "L2" in found.findings[0].message


@pytest.mark.parametrize("file", ["../lib/part.FCStd", "./../lib//part.FCStd", "../asm/../lib/part.FCStd"])
def test_paths_are_relative_to_the_owner(tmp_path: Path, file: str) -> None:
    """``../`` is used freely in real projects."""
    part().save(tmp_path / "lib" / "part.FCStd")
    assert target(tmp_path / "asm", file).Document.FileName == os.path.realpath(
        tmp_path / "lib" / "part.FCStd"
    )


def test_absolute_paths(tmp_path: Path) -> None:
    """Written where no relative path exists."""
    path = part().save(tmp_path / "lib" / "part.FCStd")
    assert target(tmp_path / "asm", str(path)).Name == "Box"


def test_file_names_of_all_kinds(tmp_path: Path) -> None:
    """Names are UTF-8, escaped as XML."""
    name = "Teil & <größe> \"1\" '2' 日本.FCStd"
    part().save(tmp_path / name)
    assert target(tmp_path, name).Name == "Box"


@pytest.mark.usefixtures("needs_symlinks")
def test_joined_as_text_like_freecad(tmp_path: Path) -> None:
    """``..`` takes a name away before symlinks are followed, as FreeCAD does (observed, 0.20)."""
    part(uuid="right").save(tmp_path / "project" / "parts" / "p.FCStd")
    part(uuid="wrong").save(tmp_path / "elsewhere" / "parts" / "p.FCStd")
    (tmp_path / "elsewhere" / "asm").mkdir()
    (tmp_path / "project" / "asm").symlink_to("../elsewhere/asm")
    found = target(tmp_path / "project" / "asm", "../parts/p.FCStd")
    assert found.Document.Meta == {"SiloUUID": "right"}


@pytest.mark.usefixtures("needs_symlinks")
def test_found_from_where_the_owner_really_lies(tmp_path: Path) -> None:
    """A top file that was opened by a symlink still finds its parts."""
    part().save(tmp_path / "project" / "part.FCStd")
    Doc().link("L", "part.FCStd", "Box").save(tmp_path / "project" / "top.FCStd")
    (tmp_path / "shortcut.FCStd").symlink_to("project/top.FCStd")
    assert open_document(tmp_path / "shortcut.FCStd").Objects[0].LinkedObject.Name == "Box"


@pytest.mark.parametrize("file", ["https://example.org/p.FCStd", "file:///p.FCStd", "x-y+z.1://p"])
def test_web_addresses_are_not_followed(tmp_path: Path, file: str) -> None:
    """FreeCAD passes them through; nothing here goes to a network."""
    found = problem(tmp_path, file)
    assert found.code is FindingCode.MISSING_FILE
    assert "web address" in found.detail


@pytest.mark.parametrize("file", ["//host/share/p.FCStd", "\\\\host\\share\\p.FCStd"])
def test_network_paths_are_not_touched(tmp_path: Path, file: str) -> None:
    """On Windows the mere look at a foreign host sends the user's credentials there."""
    found = problem(tmp_path, file)
    assert found.code is FindingCode.OUTSIDE_ROOT
    assert "network" in found.detail


@pytest.mark.parametrize(
    "file", ["C:/parts/p.FCStd", "a" * 5000, "/".join("abcdefgh" * 40), "part.FCStd/", "."]
)
def test_paths_that_lead_nowhere(tmp_path: Path, file: str) -> None:
    """Other systems' paths and absurd ones are plainly missing or unreadable."""
    assert problem(tmp_path, file).code in (FindingCode.MISSING_FILE, FindingCode.UNREADABLE_FILE)


def test_backslashes_of_other_writers(tmp_path: Path) -> None:
    """FreeCAD always writes ``/``; a tool on Windows may not."""
    part().save(tmp_path / "parts" / "p.FCStd")
    assert target(tmp_path, "parts\\p.FCStd").Name == "Box"


@pytest.mark.parametrize("inside", ["part.FCStd", "sub/../part.FCStd", "../project/part.FCStd"])
def test_links_within_the_root(tmp_path: Path, inside: str) -> None:
    """A root limits where files may lie, not how they are named."""
    part().save(tmp_path / "project" / "part.FCStd")
    assert target(tmp_path / "project", inside, root=tmp_path / "project").Name == "Box"


@pytest.mark.parametrize(
    "way", ["../secret.FCStd", "absolute", "symlink.FCStd", "folder/secret.FCStd", "../none.FCStd"]
)
@pytest.mark.usefixtures("needs_symlinks")
def test_links_that_leave_the_root(tmp_path: Path, way: str) -> None:
    """By name or by symlink; whether there is a file out there is not reported either."""
    secret = part().save(tmp_path / "secret.FCStd")
    project = tmp_path / "project"
    project.mkdir()
    (project / "symlink.FCStd").symlink_to(secret)
    (project / "folder").symlink_to(tmp_path)
    file = str(secret) if way == "absolute" else way
    assert problem(project, file, root=project) == LinkProblem(FindingCode.OUTSIDE_ROOT, file, "Box")


def test_a_top_file_outside_the_root_is_refused(tmp_path: Path) -> None:
    """The limit holds for the first file as well."""
    path = part().save(tmp_path / "top.FCStd")
    with pytest.raises(DocumentError, match="outside"):
        open_document(path, root=tmp_path / "project")


def test_a_root_is_no_prefix_of_a_name(tmp_path: Path) -> None:
    """``/project-old`` is not in ``/project``."""
    part().save(tmp_path / "project-old" / "part.FCStd")
    found = problem(tmp_path / "project", "../project-old/part.FCStd", root=tmp_path / "project")
    assert found.code is FindingCode.OUTSIDE_ROOT


@pytest.mark.usefixtures("needs_case")
def test_a_name_in_other_case(tmp_path: Path) -> None:
    """Written on Windows, read on Linux: taken and reported, where only one file fits."""
    part().save(tmp_path / "Parts" / "bolt.FCStd")
    path = Doc().link("L", "parts/Bolt.fcstd", "Box").save(tmp_path / "top.FCStd")
    with Library() as library:
        found = library.open(path).Objects[0].LinkedObject
        assert found.Document.FileName.endswith(os.path.join("Parts", "bolt.FCStd"))
        assert len(library.notes) == 1
        assert "parts/Bolt.fcstd" in library.notes[0]


@pytest.mark.usefixtures("needs_case")
def test_a_name_in_other_case_that_fits_two_files(tmp_path: Path) -> None:
    """Two files differ in case only: neither is guessed."""
    part().save(tmp_path / "bolt.FCStd")
    part().save(tmp_path / "BOLT.FCStd")
    found = problem(tmp_path, "Bolt.FCStd")
    assert found.code is FindingCode.MISSING_FILE
    assert "BOLT.FCStd, bolt.FCStd" in found.detail


def test_case_is_not_looked_up_outside_the_root(tmp_path: Path) -> None:
    """No list of foreign folders is read for a link that leaves the root."""
    part().save(tmp_path / "secret.FCStd")
    (tmp_path / "project").mkdir()
    found = problem(tmp_path / "project", "../SECRET.FCStd", root=tmp_path / "project")
    assert found.code is FindingCode.OUTSIDE_ROOT


def test_a_bounded_number_of_files(tmp_path: Path) -> None:
    """A session opens so many files and no more; the links beyond say so."""
    doc = Doc()
    for number in range(4):
        part().save(tmp_path / f"p{number}.FCStd")
        doc.link(f"L{number}", f"p{number}.FCStd", "Box")
    links = open_document(doc.save(tmp_path / "top.FCStd"), limits=Limits(documents=3)).Objects
    assert [link.LinkedObject is not None for link in links] == [True, True, False, False]
    assert "more than 3 files" in links[3].LinkProblem.detail


def test_documents_that_link_to_each_other(tmp_path: Path) -> None:
    """A ring of files is read without end of neither time nor memory."""
    Doc().link("L", "b.FCStd", "L").save(tmp_path / "b.FCStd")
    Doc().link("L", "b.FCStd", "L").save(tmp_path / "a.FCStd")
    link = open_document(tmp_path / "a.FCStd").Objects[0]
    assert link.LinkedObject.LinkedObject is link.LinkedObject


def test_a_copy_on_change_source(tmp_path: Path) -> None:
    """The original of a variant is followed like any link."""
    part().save(tmp_path / "part.FCStd")
    doc = (
        Doc()
        .add("Part::Box", "Copy")
        .link("L", "", "Copy", LinkCopyOnChangeSource=XLink("part.FCStd", "Box"))
    )
    link = open_document(doc.save(tmp_path / "top.FCStd")).getObject("L")
    assert link is not None
    assert link.LinkedObject.Document is link.Document
    assert link.LinkCopyOnChangeSource.Document.FileName.endswith("part.FCStd")


class _Rewriting(FileContents):
    """A session in which somebody saves the file between the first look and the second."""

    def _read(self, path):  # type: ignore[no-untyped-def]
        try:
            return super()._read(path)
        except DocumentError:
            part().save(Path(path))
            raise


def test_a_file_that_is_just_being_written_is_read_again(tmp_path: Path) -> None:
    """One more look, if the file has changed since the first."""
    path = tmp_path / "part.FCStd"
    path.write_bytes(part().bytes()[:300])
    assert [o.Name for o in Library(contents=_Rewriting()).open(path).Objects] == ["Box"]


def test_a_damaged_file_is_read_once(tmp_path: Path) -> None:
    """Without a change, a second look would show the same."""
    path = tmp_path / "part.FCStd"
    path.write_bytes(part().bytes()[:300])
    looks: list[str] = []

    class Counting(FileContents):
        def _read(self, path):  # type: ignore[no-untyped-def]
            looks.append(path)
            return super()._read(path)

    library = Library(contents=Counting())
    for _ in range(3):
        with pytest.raises(DocumentError):
            library.open(path)
    assert len(looks) == 1


REFUSED = {
    FindingCode.OUTSIDE_ROOT: (
        *("//evil/share/x.FCStd", "\\\\evil\\share\\x.FCStd", "\\/evil/share/x.FCStd"),
        *("/\\evil\\share\\x.FCStd", "//./pipe/x", "\\\\.\\pipe\\x", "//?/C:/x.FCStd", "/\\/evil/x.FCStd"),
    ),
    FindingCode.MISSING_FILE: (
        *("NUL", "parts/con", "aux.FCStd", "sub/COM1.txt", "prn .FCStd", "nul:", "x.FCStd:stream", "conin$"),
    ),
    None: (
        *("part.FCStd", "../parts/part.FCStd", "C:/vault/part.FCStd", "C:\\vault\\part.FCStd"),
        *("/vault/part.FCStd", "console.FCStd", "auxiliary/nullpart.FCStd", "COM.FCStd", "com10.FCStd"),
        *("a:b.FCStd", "", "./x.FCStd"),
    ),
}


@pytest.mark.parametrize(("code", "recorded"), [(code, path) for code in REFUSED for path in REFUSED[code]])
def test_paths_that_are_not_looked_at(code: FindingCode | None, recorded: str) -> None:
    """Other hosts, to which Windows sends the user's credentials with the first look; devices and streams."""
    found = refusal(recorded)
    assert (found.code if found else None) is code
