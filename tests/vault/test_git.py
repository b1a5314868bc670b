# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD files of git revisions, with a real git."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from silo.bom.errors import InputError
from silo.vault.git import Range, lay_out, parse_range, top_of

if shutil.which("git") is None:
    pytest.skip("git is not on this machine", allow_module_level=True)

# Nobody's own configuration: no signing, no hooks, no other branch name.
GIT_ENV = {
    **os.environ,
    "GIT_CONFIG_GLOBAL": os.devnull,
    "GIT_CONFIG_SYSTEM": os.devnull,
    **{f"GIT_{who}_{what}": "t" for who in ("AUTHOR", "COMMITTER") for what in ("NAME", "EMAIL")},
}


def git(folder: Path, *words: str) -> str:
    done = subprocess.run(
        ["git", *words], cwd=folder, env=GIT_ENV, capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


@pytest.fixture(scope="module")
def _repository(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two commits on main, and a branch that began at the first."""
    folder = tmp_path_factory.mktemp("git") / "repo"
    (folder / "cad" / "große Teile").mkdir(parents=True)
    git(folder, "init", "-q", "-b", "main")
    (folder / "cad" / "a.FCStd").write_bytes(b"one")
    (folder / "cad" / "große Teile" / "b b.fcstd").write_bytes(os.urandom(1_500_000))
    (folder / "notes.txt").write_text("no model")
    (folder / "cad" / "link.FCStd").symlink_to("a.FCStd")
    git(folder, "add", "-A")
    git(folder, "commit", "-qm", "first")
    git(folder, "branch", "other")
    (folder / "cad" / "a.FCStd").write_bytes(b"two")
    git(folder, "commit", "-qam", "second")
    git(folder, "checkout", "-q", "other")
    (folder / "c.FCStd").write_bytes(b"")
    git(folder, "add", "-A")
    git(folder, "commit", "-qm", "third")
    return folder


@pytest.fixture
def repository(_repository: Path, tmp_path: Path) -> Path:
    """A copy of it for each test."""
    return Path(shutil.copytree(_repository, tmp_path / "repo", symlinks=True))


def files(folder: Path) -> dict[str, bytes]:
    found = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in found}


def test_models_are_laid_out_as_they_were_and_nothing_else(repository: Path, tmp_path: Path) -> None:
    lay_out(str(repository), "main", tmp_path / "out")
    found = files(tmp_path / "out")
    assert found == {
        "cad/a.FCStd": b"two",
        "cad/link.FCStd": b"two",
        "cad/große Teile/b b.fcstd": (repository / "cad/große Teile/b b.fcstd").read_bytes(),
    }


def test_ranges_mean_what_git_means_by_them(repository: Path) -> None:
    where = str(repository)
    first, main, other = (git(repository, "rev-parse", name) for name in ("other~1", "main", "other"))
    assert parse_range(where, "main..other") == Range(main, other)
    assert parse_range(where, "main...other") == Range(first, other)
    assert parse_range(where, "main..") == Range(main, other)
    assert parse_range(where, "main") == Range(main, None)


@pytest.mark.parametrize("text", ["nowhere", "main..nowhere", "--help", "main:cad", ""])
def test_what_is_no_revision_is_refused_by_name(repository: Path, text: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_range(str(repository), text)
    assert text.split("..")[-1] in str(caught.value)


def test_a_folder_outside_any_repository_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is in no git repository"):
        top_of(tmp_path)
    with pytest.raises(InputError, match="is in no git repository"):
        top_of(tmp_path / "nowhere")
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="is not a folder"):
        top_of(tmp_path / "file")


def test_a_name_that_leaves_its_folder_is_refused(repository: Path, tmp_path: Path) -> None:
    """Git itself makes no such tree, but a hostile repository may hold one."""
    blob = git(repository, "rev-parse", "main:cad/a.FCStd")
    done = subprocess.run(
        ["git", "hash-object", "-t", "tree", "-w", "--stdin", "--literally"],
        cwd=repository,
        env=GIT_ENV,
        input=b"100644 ../evil.FCStd\0" + bytes.fromhex(blob),
        capture_output=True,
        check=True,
    )
    with pytest.raises(InputError, match="leaves its folder"):
        lay_out(str(repository), done.stdout.decode().strip(), tmp_path / "in" / "out")
    assert not (tmp_path / "in").exists()


def test_files_kept_in_git_lfs_are_taken_where_they_were_fetched(repository: Path, tmp_path: Path) -> None:
    oids = {"a": "ab" * 32, "b": "cd" * 32}
    for name, oid in oids.items():
        pointer = f"version https://git-lfs.github.com/spec/v1\noid sha256:{oid}\nsize 7\n"
        (repository / f"{name}.FCStd").write_text(pointer)
    git(repository, "add", "-A")
    git(repository, "commit", "-qm", "pointers")
    stored = repository / ".git/lfs/objects/ab/ab" / oids["a"]
    stored.parent.mkdir(parents=True)
    stored.write_bytes(b"content")
    lay_out(str(repository), "HEAD", tmp_path / "out")
    assert (tmp_path / "out/a.FCStd").read_bytes() == b"content"
    assert (tmp_path / "out/b.FCStd").read_bytes().startswith(b"version https://git-lfs")


@pytest.mark.usefixtures("needs_symlinks")
def test_links_are_laid_out_where_they_stay_inside(repository: Path, tmp_path: Path) -> None:
    """To files and to folders; one that leaves the repository, also by way of another one, is not there."""
    links = {
        "parts": "cad",
        "up.FCStd": "../secret.FCStd",
        "cad/root": "..",
        "cad/root.FCStd": "root/../secret.FCStd",
        "abs.FCStd": str(tmp_path / "secret.FCStd"),
    }
    for name, to in links.items():
        (repository / name).symlink_to(to)
    (tmp_path / "secret.FCStd").write_bytes(b"secret")
    git(repository, "add", "-A")
    git(repository, "commit", "-qm", "links")
    lay_out(str(repository), "HEAD", tmp_path / "deep" / "out")
    (tmp_path / "deep" / "secret.FCStd").write_bytes(b"secret")
    out = tmp_path / "deep" / "out"
    assert (out / "parts" / "a.FCStd").read_bytes() == b"one"
    assert (out / "cad/root/c.FCStd").is_file()
    assert not any(os.path.lexists(out / name) for name in ("up.FCStd", "abs.FCStd"))
    assert b"secret" not in files(out).values()


def test_a_tree_that_writes_through_its_own_link_writes_nothing_outside(
    repository: Path, tmp_path: Path
) -> None:
    """Git makes no tree with one name twice, but a hostile repository may hold one."""
    blob = git(repository, "rev-parse", "main:cad/a.FCStd")

    def made(kind: str, content: bytes) -> str:
        done = subprocess.run(
            ["git", "hash-object", "-t", kind, "-w", "--stdin", "--literally"],
            cwd=repository,
            env=GIT_ENV,
            input=content,
            capture_output=True,
            check=True,
        )
        return done.stdout.decode().strip()

    link = bytes.fromhex(made("blob", b"../outside"))
    inner = made("tree", b"100644 x.FCStd\0" + bytes.fromhex(blob) + b"120000 y.FCStd\0" + link)
    tree = made("tree", b"120000 a\0" + link + b"40000 a\0" + bytes.fromhex(inner))
    (tmp_path / "outside").mkdir()
    lay_out(str(repository), tree, tmp_path / "out")
    assert not any((tmp_path / "outside").iterdir())


def test_sub_modules_are_read_where_this_machine_has_them(repository: Path, tmp_path: Path) -> None:
    """At the commit that the revision names; one that was not fetched is reported with what fetches it."""
    above = tmp_path / "above"
    above.mkdir()
    git(above, "init", "-q", "-b", "main")
    git(above, "-c", "protocol.file.allow=always", "submodule", "add", "-q", str(repository), "lib")
    git(above, "commit", "-qm", "with a sub-module")
    git(above / "lib", "checkout", "-q", "main")
    assert lay_out(str(above), "HEAD", tmp_path / "out") == []
    assert set(files(tmp_path / "out" / "lib")) >= {"c.FCStd", "cad/a.FCStd"}
    git(tmp_path, "clone", "-q", str(above), "plain")
    ((path, why),) = lay_out(str(tmp_path / "plain"), "HEAD", tmp_path / "without")
    assert (path, "git submodule update --init" in why) == ("lib", True)


def test_the_repository_of_the_folder_is_meant_also_in_a_hook(
    repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Git names the repository of a hook in the environment, relative to the folder it starts hooks in."""
    other = tmp_path / "another"
    other.mkdir()
    git(other, "init", "-q")
    for name, value in (("GIT_DIR", ".git"), ("GIT_INDEX_FILE", ".git/index"), ("GIT_PREFIX", "")):
        monkeypatch.setenv(name, value)
    monkeypatch.chdir(other)
    assert top_of(repository / "cad") == (str(repository), "cad", True)


def test_a_bare_repository_has_revisions_and_no_work_tree(repository: Path, tmp_path: Path) -> None:
    git(tmp_path, "clone", "-q", "--bare", str(repository), "bare.git")
    top, below, work_tree = top_of(tmp_path / "bare.git")
    assert (top, below, work_tree) == (str(tmp_path / "bare.git"), "", False)
    lay_out(top, "main", tmp_path / "out")
    assert (tmp_path / "out" / "cad" / "a.FCStd").read_bytes() == b"two"


def test_a_shallow_clone_is_named_as_the_reason(repository: Path, tmp_path: Path) -> None:
    git(tmp_path, "clone", "-q", "--depth", "1", "--no-single-branch", f"file://{repository}", "shallow")
    for text in ("HEAD~1..HEAD", "origin/main...origin/other"):
        with pytest.raises(InputError, match="git fetch --unshallow"):
            parse_range(str(tmp_path / "shallow"), text)


def test_a_git_that_dies_is_an_error(
    repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not the end of a pipe whose reader has seen enough."""
    program = tmp_path / "bin" / "git"
    program.parent.mkdir()
    real = shutil.which("git")
    program.write_text(f'#!/bin/sh\n[ "$1" = cat-file ] && exec <&- >&- && exit 1\nexec {real} "$@"\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{program.parent}{os.pathsep}{os.environ['PATH']}")
    with pytest.raises(InputError, match="git has no content of"):
        lay_out(str(repository), "main", tmp_path / "out")
