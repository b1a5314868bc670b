# SPDX-License-Identifier: LGPL-2.1-or-later
"""The FreeCAD files of a git revision, laid out in a folder without touching the work tree.

Blobs are streamed from ``git cat-file --batch``, so that no checkout, filter or hook runs. For a Git LFS
pointer the file itself is taken where the repository has fetched it (``git lfs fetch``); else the pointer is
laid out as it is, and the reader reports that the file is not there. Symbolic links that stay inside are laid
out, and sub-modules from where this machine has them.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path, PurePosixPath
from typing import BinaryIO

from silo.bom.errors import DocumentError, InputError
from silo.bom.message import message
from silo.files import IGNORE_FILE
from silo.platform.processes import child_options
from silo.platform.system import WINDOWS
from silo.platform.whole_files import remove_patiently

_CHUNK = 1 << 20
_POINTER = re.compile(rb"version https://git-lfs\.github\.com/spec/v1\n(?:.*\n)*?oid sha256:([0-9a-f]{64})\n")
_NO_REPOSITORY = 128  # what git ends with where it finds none
_POINTER_SIZE = 1024  # by the Git LFS specification
_FILES = (b"100644", b"100755")
_LINK, _SUBMODULE = b"120000", b"160000"
# A hook's git commands name its repository here. The one that is meant is that of the folder.
_OF_HOOKS = ("GIT_DIR", "GIT_WORK_TREE", "GIT_INDEX_FILE", "GIT_PREFIX", "GIT_COMMON_DIR")


@dataclass(frozen=True, slots=True)
class Range:
    """Two states to compare. ``new`` None: the files as they are in the work tree."""

    old: str
    new: str | None


def parse_range(repository: str, text: str) -> Range:
    """Parse ``A..B``, ``A...B`` (from where B branched off A), or ``A`` (compared with the work tree).

    Raises InputError if git does not know a revision.
    """
    for dots in ("...", ".."):
        if dots in text:
            first, _, second = text.partition(dots)
            old, new = _commit(repository, first or "HEAD"), _commit(repository, second or "HEAD")
            if dots == "...":
                old = _git(repository, "merge-base", old, new).decode().strip()
            return Range(old, new)
    return Range(_commit(repository, text), None)


def top_of(folder: Path | str) -> tuple[str, str, bool]:
    """Find the repository of a folder, the folder's path in it with ``/`` ("" for the top), and if it has a
    work tree.

    The folder need not exist now: an older revision may have it. Raises InputError.
    """
    wanted = real = os.path.realpath(folder)
    while not os.path.isdir(real) and os.path.dirname(real) != real and not os.path.lexists(real):
        real = os.path.dirname(real)
    if not os.path.isdir(real):
        raise InputError(
            message("{folder} is not a folder. Name a folder inside a git repository.", folder=folder)
        )
    if _git(real, "rev-parse", "--is-bare-repository").strip() == b"true":
        return _path(real, "--absolute-git-dir"), "", False
    top = _path(real, "--show-toplevel")
    below = os.path.relpath(wanted, top)
    return top, "" if below == os.curdir else below.replace(os.sep, "/"), True


def _path(repository: str, option: str) -> str:
    return os.path.realpath(os.fsdecode(_git(repository, "rev-parse", option).rstrip(b"\n")))


def lay_out(
    repository: str, revision: str, target: Path, laid: dict[str, Path] | None = None
) -> list[tuple[str, str]]:
    """Write what a reader needs of a revision below ``target``: FreeCAD files, links, ``.siloignore``.

    laid
        blob → the place where it was written already; such a file is linked, not written again.

    Returns the path of each missing file, and the reason. Raises InputError, OSError.
    """
    laid = {} if laid is None else laid
    lost: list[tuple[str, str]] = []
    links: list[tuple[Path, str]] = []
    entries = list(_listed(repository, revision))
    if not entries:
        return lost
    common = Path(repository, os.fsdecode(_git(repository, "rev-parse", "--git-common-dir").rstrip(b"\n")))
    with _batch(repository) as (ask, answer):
        for kind, blob, name in entries:
            path = target.joinpath(*PurePosixPath(name).parts)
            if kind == _SUBMODULE:
                lost += _submodule(common, Path(repository, name), name, blob, path, laid)
                continue
            if kind == _LINK:
                try:
                    links.append((path, os.fsdecode(_content(ask, answer, blob, name))))
                except DocumentError as error:
                    lost.append((name, error.reason))
                continue
            path.parent.mkdir(parents=True, exist_ok=True)
            if blob in laid:
                _link_or_copy(laid[blob], path)
                continue
            try:
                with path.open("wb") as file:
                    _copy(ask, answer, blob, name, file)
            except DocumentError as error:
                lost.append((name, error.reason))
                remove_patiently(path)
                continue
            _take_from_lfs(common / "lfs" / "objects", path)
            laid[blob] = path
    for path, to in links:  # last, so that nothing is written through one
        _lay_link(path, to, target)
    for path, _ in links:  # one may lead outside by way of another
        if path.is_symlink() and not _is_below(path, target):
            remove_patiently(path)
    return lost


def _listed(repository: str, revision: str) -> Iterator[tuple[bytes, str, str]]:
    """Yield mode, object and path of each file that is laid out."""
    for record in _git(repository, "ls-tree", "-r", "-z", "--full-tree", revision).split(b"\0"):
        head, _, raw = record.partition(b"\t")
        name = os.fsdecode(raw)
        parts = PurePosixPath(name).parts
        if not parts:
            continue
        kind, _, blob = head.split()
        needed = name.lower().endswith(".fcstd") or parts[-1] == IGNORE_FILE
        if kind not in (_LINK, _SUBMODULE) and not (kind in _FILES and needed):
            continue
        # Git refuses such names; a repository made by something else may hold them.
        if name.startswith("/") or ".." in parts or (WINDOWS and any(c in name for c in ":\\")):
            raise InputError(
                message(
                    "The revision {revision} holds a file named {name}, which leaves its folder.",
                    revision=revision,
                    name=repr(name),
                )
            )
        yield kind, blob.decode(), name


def _submodule(
    common: Path, here: Path, name: str, commit: str, target: Path, laid: dict[str, Path]
) -> list[tuple[str, str]]:
    """Lay out a sub-module at its commit."""
    paths = [
        folder for folder in (here, common / "modules" / name) if (folder / ".git").exists() or folder != here
    ]
    for repository in filter(os.path.isdir, paths):
        try:
            lost = lay_out(os.fspath(repository), _commit(os.fspath(repository), commit), target, laid)
        except InputError:
            continue
        return [(f"{name}/{path}", why) for path, why in lost]
    return [
        (
            name,
            message(
                "this sub-module is not here at {commit} (git submodule update --init --recursive)",
                commit=commit[:12],
            ),
        )
    ]


def _lay_link(path: Path, to: str, target: Path) -> None:
    """Make a symbolic link, if it stays inside. If the system cannot make links, its file is missing."""
    meant = os.path.join(os.path.dirname(path), to)
    inside = _is_below(path.parent, target) and _is_below(Path(os.path.normpath(meant)), target)
    if inside and not os.path.isabs(to) and not os.path.lexists(path):
        with suppress(OSError):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.symlink_to(to)


def _is_below(path: Path, folder: Path) -> bool:
    return Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder))


def _link_or_copy(source: Path, target: Path) -> None:
    try:
        os.link(source, target)
    except OSError:
        shutil.copyfile(source, target)


@contextmanager
def _batch(repository: str) -> Iterator[tuple[BinaryIO, BinaryIO]]:
    with subprocess.Popen(
        ["git", "cat-file", "--batch"],
        cwd=repository,
        env=_environment(),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        **child_options(),
    ) as process:
        assert process.stdin is not None  # both are pipes
        assert process.stdout is not None
        try:
            yield process.stdin, process.stdout  # type: ignore[misc]
        finally:
            with suppress(BrokenPipeError):  # git died, and does not take what is left
                process.stdin.close()


def _content(ask: BinaryIO, answer: BinaryIO, blob: str, name: str) -> bytes:
    held = BytesIO()
    _copy(ask, answer, blob, name, held)
    return held.getvalue()


def _copy(ask: BinaryIO, answer: BinaryIO, blob: str, name: str, file: BinaryIO) -> None:
    """Write git's content of an object. DocumentError if git lacks the object, InputError if git ended."""
    try:
        ask.write(blob.encode() + b"\n")
        ask.flush()
        head = answer.readline().split()
    except BrokenPipeError:
        head = [b"git ended"]
    if head[1:] == [b"missing"]:
        raise DocumentError(name, message("this clone of the repository lacks its content (git fetch)"))
    if len(head) != 3:
        raise InputError(
            message(
                "git has no content of {name}: {errors}",
                name=name,
                errors=b" ".join(head).decode(errors="replace"),
            )
        )
    left = int(head[2])
    while left > 0:
        piece = answer.read(min(left, _CHUNK))
        if not piece:
            raise InputError(message("git stopped in the middle of {name}.", name=name))
        file.write(piece)
        left -= len(piece)
    answer.read(1)  # the line feed behind each object


def _take_from_lfs(objects: Path, path: Path) -> None:
    """Replace a pointer by its file, if that was fetched."""
    if path.stat().st_size > _POINTER_SIZE or (match := _POINTER.match(path.read_bytes())) is None:
        return
    oid = match[1].decode()
    stored = objects / oid[:2] / oid[2:4] / oid
    if stored.is_file():
        shutil.copyfile(stored, path)


def _commit(repository: str, revision: str) -> str:
    if revision == "HEAD" and not _git(repository, "rev-list", "-n", "1", "--all"):
        # Before the first commit there is nothing: git knows the empty tree without having it.
        return _git(repository, "hash-object", "-t", "tree", os.devnull).decode().strip()
    # The two dashes: a revision that begins with a dash is no option.
    output = _git(
        repository, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{revision}^{{commit}}"
    )
    return output.decode().strip()


def _environment() -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if name not in _OF_HOOKS}


def _git(repository: str, *words: str) -> bytes:
    program = shutil.which("git")
    if program is None:
        raise InputError(message("git is not on the PATH; it is needed to read revisions."))
    command = [program, *words]
    done: subprocess.CompletedProcess[bytes] = subprocess.run(
        command, cwd=repository, env=_environment(), capture_output=True, check=False, **child_options()
    )
    if done.returncode:
        if done.returncode == _NO_REPOSITORY and "--is-bare-repository" in words:
            raise InputError(
                message(
                    "{folder} is in no git repository; name a folder inside it, or run this there",
                    folder=repository,
                )
            )
        said = done.stderr.decode(errors="replace").strip() or _no_answer(repository, words)
        what = f"{words[0]} {words[-1].removesuffix('^{commit}')}"
        raise InputError(
            message("git {what} failed in {repository}: {said}", what=what, repository=repository, said=said)
        )
    return done.stdout


def _no_answer(repository: str, words: Sequence[str]) -> str:
    """Say why git may have answered nothing."""
    reason = (
        message("there is no common ancestor")
        if words[0] == "merge-base"
        else message("it does not know this revision")
    )
    if _git(repository, "rev-parse", "--is-shallow-repository").strip() == b"true":
        reason += message("; the clone is shallow, so fetch more of it (git fetch --unshallow)")
    return reason
