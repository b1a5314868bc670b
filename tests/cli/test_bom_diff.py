# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod bom-diff`` as a user runs it: two folders, and two revisions of a repository; no server."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path
from typing import Any

import pytest
from fcstd_writer import Doc, XLink, locals_, part

from silo.cli.setup.demo_edits import remove_from_assembly, set_element_count


@pytest.fixture
def changed(gearbox: Path, tmp_path: Path) -> tuple[Path, Path]:
    """The example, and a copy without its cover and with four more bolts."""
    old, new = gearbox.parent, tmp_path / "changed"
    shutil.copytree(old, new)
    remove_from_assembly(new / gearbox.name, "Cover")
    set_element_count(new / gearbox.name, "CoverBolts", added=4)
    return old, new


def changes(data: Any) -> dict[str, dict[str, tuple[Any, Any]]]:
    return {
        change["doc_path"]: {
            line["object"]: (line["old_quantity"], line["new_quantity"]) for line in change["lines"]
        }
        for change in data["changes"]
    }


WANTED = {"TopAssembly.FCStd": {"M8x20Bolt": (12, 16), "Cover": (1, None)}}


def test_two_folders(run: Any, changed: tuple[Path, Path], tmp_path: Path) -> None:
    """As text, as JSON, and in the reports for a pull request."""
    assert changes(run("bom-diff", *changed, "--json").json()) == WANTED
    reports = [tmp_path / "diff.md", tmp_path / "diff.json"]
    shown = run("bom-diff", *changed, *(word for path in reports for word in ("--report", path)))
    assert shown.code == 0
    assert "12 → 16" in shown.out
    assert "Cover" in shown.out
    assert changes(json.loads(reports[1].read_text("utf-8"))) == WANTED
    out = reports[0].read_text("utf-8")
    assert "### TopAssembly.FCStd" in out
    assert "| quantity changed | M8x20 Bolt | 12 → 16 | parts/M8x20Bolt.FCStd |" in out
    assert run("bom-diff", *changed, "--check").code == 1
    same = run("bom-diff", changed[0], changed[0], "--check")
    assert (same.code, "No BOM changed; assemblies compared: 2." in same.out) == (0, True)


def test_two_revisions_and_the_work_tree(
    run: Any, git: Any, changed: tuple[Path, Path], tmp_path: Path
) -> None:
    old, new = changed
    repository = tmp_path / "repo"
    models = repository / "cad"
    shutil.copytree(old, models)

    git(repository, "init", "-q", "-b", "main")
    git(repository, "add", "-A")
    git(repository, "commit", "-qm", "first")
    shutil.copytree(new, models, dirs_exist_ok=True)
    in_repository = {f"cad/{path}": lines for path, lines in WANTED.items()}
    assert changes(run("bom-diff", "--git", "HEAD", repository, "--json").json()) == in_repository
    git(repository, "commit", "-qam", "second")
    assert changes(run("bom-diff", "--git", "HEAD~1..HEAD", repository, "--json").json()) == in_repository
    # Of one folder, its own files; the work tree stays as it is.
    assert changes(run("bom-diff", "--git", "HEAD~1..HEAD", models, "--json").json()) == WANTED
    assert run("bom-diff", "--git", "nowhere..HEAD", repository).code == 2


def test_an_unreadable_file_and_a_missing_one_are_reported(run: Any, tmp_path: Path) -> None:
    """A part whose file is not there is still a line; the exit code says that the new state is not whole."""
    for name in ("old", "new"):
        folder = tmp_path / name
        folder.mkdir()
        Doc("part").add("Part::Box", "Box").save(folder / "part.FCStd")
        top = Doc("top").add("App::Link", "L", LinkedObject=XLink("part.FCStd", "Box"))
        top.add("Assembly::AssemblyObject", "A", Group=locals_("L")).save(folder / "top.FCStd")
    (tmp_path / "new" / "part.FCStd").unlink()
    (tmp_path / "new" / "other.FCStd").write_text(
        "version https://git-lfs.github.com/spec/v1\noid sha256:" + "0" * 64 + "\nsize 12345\n"
    )
    ran = run("bom-diff", tmp_path / "old", tmp_path / "new", "--json")
    data = ran.json()
    assert ran.code == 1
    assert data["old"]["complete"] is True
    assert data["new"]["complete"] is False
    assert [row["file"] for row in data["new"]["unreadable"]] == ["other.FCStd"]
    assert [finding["code"] for finding in data["new"]["findings"]] == ["missing_file"]
    # Nothing was taken out of the assembly.
    assert data["changes"] == []
    shown = run("bom-diff", tmp_path / "old", tmp_path / "new")
    assert "other.FCStd" in shown.out
    assert "part.FCStd" in shown.out
    # From damaged to whole is no failure.
    assert run("bom-diff", tmp_path / "new", tmp_path / "old").code == 0


def test_wrong_words_are_explained(run: Any, tmp_path: Path) -> None:
    for words, named in (
        ((), "two folders"),
        (("a",), "two folders"),
        (("--git", "A..B", "a", "b"), "at most one folder"),
        ((tmp_path, tmp_path / "nowhere"), "nowhere"),
    ):
        ran = run("bom-diff", *words)
        assert (ran.code, named in ran.err) == (2, True)


def test_a_folder_that_uses_what_lies_beside_it(run: Any, git: Any, tmp_path: Path) -> None:
    """Its parts are read, though only its own BOMs are compared; also where it is gone by now."""

    def assembly(*files: str) -> Doc:
        doc = Doc("asm")
        for number, file in enumerate(files):
            doc.add("App::Link", f"L{number}", LinkedObject=XLink(file, "Box"))
        return doc.add("App::Part", "Assembly", Group=locals_(*doc.objects))

    for folder in ("parts", "asm", "old"):
        (tmp_path / folder).mkdir()
    Doc("part").add("Part::Box", "Box").save(tmp_path / "parts/P.FCStd")
    assembly("../parts/P.FCStd").save(tmp_path / "asm/A.FCStd")
    assembly("../parts/P.FCStd").save(tmp_path / "old/O.FCStd")
    (tmp_path / ".siloignore").write_text("old/\n")
    git(tmp_path, "init", "-q", "-b", "main")
    git(tmp_path, "add", "-A")
    git(tmp_path, "commit", "-qm", "first")
    # What is ignored is ignored on both sides.
    assert run("bom-diff", "--git", "HEAD", tmp_path, "--check").code == 0
    assembly("../parts/P.FCStd", "../parts/P.FCStd").save(tmp_path / "asm/A.FCStd")
    ran = run("bom-diff", "--git", "HEAD", tmp_path / "asm", "--json")
    assert changes(ran.json()) == {"A.FCStd": {"Box": (1, 2)}}
    assert ran.json()["new"]["complete"] is True
    shutil.rmtree(tmp_path / "asm")
    ran = run("bom-diff", "--git", "HEAD", tmp_path / "asm", "--json")
    assert changes(ran.json()) == {"A.FCStd": {"Box": (1, None)}}
    assert not (tmp_path / "asm").exists()
    assert run("bom-diff", "--git", "HEAD", tmp_path / "nowhere").code == 2


@pytest.fixture
def beside(git: Any, tmp_path: Path) -> Path:
    """A repository whose assembly uses a library beside its folder, and a part of it that is not there."""
    repository = tmp_path / "repo"
    (repository / "cad").mkdir(parents=True)
    (repository / "lib").mkdir()
    part("part", "Box").save(repository / "lib" / "part.FCStd")
    two = Doc(label="two").add("Part::Box", "Left", Label="Plate").add("Part::Box", "Right", Label="Plate")
    two.save(repository / "cad" / "two.FCStd")
    files = {"L1": "../lib/part.FCStd", "L2": "../lib/gone.FCStd"}
    for names in (["L1", "L2"], ["L1", "L2", "L3", "L4"]):
        top = Doc(label="top")
        for name in names:
            target = {"L3": "Left", "L4": "Right"}.get(name, "Box")
            top.link(name, files.get(name, "two.FCStd"), target)
        top.add("App::Part", "Top", Label="Top", Group=locals_(*names), Type="Assembly")
        top.save(repository / "cad" / "top.FCStd")
        if not (repository / ".git").exists():
            git(repository, "init", "-q", "-b", "main")
        git(repository, "add", "-A")
        git(repository, "commit", "-q", "-m", "x")
    return repository


def test_no_path_is_a_temporary_one_and_objects_are_told_apart(
    run: Any, beside: Path, tmp_path: Path
) -> None:
    """Revisions are laid out somewhere; people know the paths of the repository. Two objects of one file have
    one label.
    """
    report = tmp_path / "diff.md"
    ran = run("bom-diff", "--git", "main~1..main", beside / "cad", "--report", report)
    assert ran.out.count("two.FCStd#Left") == ran.out.count("two.FCStd#Right") == 1
    data = run("bom-diff", "--git", "main~1..main", beside / "cad", "--json")
    for out in (ran.out, report.read_text("utf-8"), data.out):
        assert "../lib/gone.FCStd is missing" in out
        assert "silo-bom-diff" not in out + ran.err + data.err


@pytest.mark.parametrize("lost", ["cad/top.FCStd", "lib/part.FCStd", "cad/two.FCStd"])
def test_a_blob_that_is_not_there_is_a_finding(run: Any, git: Any, beside: Path, lost: str) -> None:
    """As in a partial clone. The rest is compared, and what was not read has not lost its assembly."""
    blob = git(beside, "rev-parse", f"main:{lost}")
    os.remove(beside / ".git" / "objects" / blob[:2] / blob[2:])
    ran = run("bom-diff", "--git", "main~1..main", beside / "cad")
    assert ran.code == 1
    assert f"{os.path.relpath(lost, 'cad')} could not be read: this clone of the repository lacks" in ran.out
    assert "removed" not in ran.out
    assert ("two.FCStd#Left" in ran.out) is (lost != "cad/top.FCStd")
