# SPDX-License-Identifier: LGPL-2.1-or-later
"""The FreeCAD files of a git revision, laid out in a folder without touching the work tree.

Blobs are streamed from ``git cat-file --batch``, so that no checkout, filter or hook runs. For a Git LFS
pointer the file itself is taken where the repository has fetched it (``git lfs fetch``); else the pointer is
laid out as it is, and the reader reports that the file is not there.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import BinaryIO

from silo.bom.errors import InputError
from silo.platform import WINDOWS, child_options

_CHUNK = 1 << 20
_POINTER = re.compile(rb"version https://git-lfs\.github\.com/spec/v1\n(?:.*\n)*?oid sha256:([0-9a-f]{64})\n")
_POINTER_SIZE = 1024  # by the Git LFS specification
_FILES = (b"100644", b"100755")  # neither symlinks nor sub-modules


@dataclass(frozen=True, slots=True)
class Range:
    """Two states to compare. ``new`` None: the files as they are in the work tree."""

    old: str
    new: str | None


def parse_range(repository: str, text: str) -> Range:
    """``A..B``, ``A...B`` (from where B branched off A), or ``A`` (against the work tree).

    Raises InputError where git does not know a revision.
    """
    for dots in ("...", ".."):
        if dots in text:
            first, _, second = text.partition(dots)
            old, new = _commit(repository, first or "HEAD"), _commit(repository, second or "HEAD")
            if dots == "...":
                old = _git(repository, "merge-base", old, new).decode().strip()
            return Range(old, new)
    return Range(_commit(repository, text), None)


def top_of(folder: Path | str) -> tuple[str, str]:
    """The work tree that a folder lies in, and the folder below it with ``/`` ("" for the top itself)."""
    real = os.path.realpath(folder)
    if not os.path.isdir(real):
        raise InputError(f"{folder} is no folder. Name a folder inside a git repository.")
    top = os.path.realpath(os.fsdecode(_git(real, "rev-parse", "--show-toplevel").rstrip(b"\n")))
    below = os.path.relpath(real, top)
    return top, "" if below == os.curdir else below.replace(os.sep, "/")


def lay_out(repository: str, revision: str, below: str, target: Path) -> None:
    """Write the FreeCAD files of a revision below ``target``. Raises InputError, OSError."""
    blobs = list(_listed(repository, revision, below))
    if not blobs:
        return
    common = Path(repository, os.fsdecode(_git(repository, "rev-parse", "--git-common-dir").rstrip(b"\n")))
    with _batch(repository) as (ask, answer):
        for blob, name in blobs:
            path = target.joinpath(*PurePosixPath(name).parts)
            path.parent.mkdir(parents=True, exist_ok=True)
            ask.write(blob.encode() + b"\n")
            ask.flush()
            _copy(answer, path, name)
            _take_from_lfs(common / "lfs" / "objects", path)


def _listed(repository: str, revision: str, below: str) -> Iterator[tuple[str, str]]:
    words = ["ls-tree", "-r", "-z", "--full-tree", revision, "--", *([below] if below else [])]
    for record in _git(repository, *words).split(b"\0"):
        head, _, raw = record.partition(b"\t")
        name = os.fsdecode(raw)
        if not name.lower().endswith(".fcstd") or head.split()[0] not in _FILES:
            continue
        parts = PurePosixPath(name).parts
        # Git refuses such names; a repository made by something else may hold them.
        if name.startswith("/") or ".." in parts or (WINDOWS and any(c in name for c in ":\\")):
            raise InputError(f"The revision {revision} holds a file named {name!r}, which leaves its folder.")
        yield head.split()[2].decode(), name


@contextmanager
def _batch(repository: str) -> Iterator[tuple[BinaryIO, BinaryIO]]:
    with subprocess.Popen(
        ["git", "cat-file", "--batch"],
        cwd=repository,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        **child_options(),
    ) as process:
        assert process.stdin is not None  # both are pipes
        assert process.stdout is not None
        yield process.stdin, process.stdout  # type: ignore[misc]


def _copy(answer: BinaryIO, path: Path, name: str) -> None:
    head = answer.readline().split()
    if len(head) != 3:
        raise InputError(f"git has no content of {name}: {b' '.join(head).decode(errors='replace')}")
    left = int(head[2])
    with path.open("wb") as file:
        while left > 0:
            piece = answer.read(min(left, _CHUNK))
            if not piece:
                raise InputError(f"git stopped in the middle of {name}.")
            file.write(piece)
            left -= len(piece)
    answer.read(1)  # the line feed behind each object


def _take_from_lfs(objects: Path, path: Path) -> None:
    """Replace a pointer by its file, where that was fetched."""
    if path.stat().st_size > _POINTER_SIZE or (found := _POINTER.match(path.read_bytes())) is None:
        return
    oid = found[1].decode()
    stored = objects / oid[:2] / oid[2:4] / oid
    if stored.is_file():
        shutil.copyfile(stored, path)


def _commit(repository: str, revision: str) -> str:
    # The two dashes: a revision that begins with a dash is no option.
    found = _git(repository, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{revision}^{{commit}}")
    return found.decode().strip()


def _git(repository: str, *words: str) -> bytes:
    program = shutil.which("git")
    if program is None:
        raise InputError("git is not on the PATH; it is needed to read revisions.")
    command = [program, *words]
    done: subprocess.CompletedProcess[bytes] = subprocess.run(
        command, cwd=repository, capture_output=True, check=False, **child_options()
    )
    if done.returncode:
        said = done.stderr.decode(errors="replace").strip() or "it does not know this revision"
        raise InputError(f"git {words[0]} {_last(words)} failed in {repository}: {said}")
    return done.stdout


def _last(words: Sequence[str]) -> str:
    return words[-1].removesuffix("^{commit}")
