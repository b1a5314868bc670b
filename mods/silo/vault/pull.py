# SPDX-License-Identifier: LGPL-2.1-or-later
"""Put the files of an item, each in its place; nothing of the user's is lost.

::

    fetch      the file, its recorded links, their items, their files, and so on  → Tree (silo.vault.fetch)
    lay out    where each file goes: the relative paths of the links              → paths below the folder
    place      new files are written; a file that is an older revision is replaced; edited ones stay
"""

from __future__ import annotations

import os
import posixpath
import shutil
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from silo.bom.errors import DocumentError
from silo.durable import replacing
from silo.fcstd import Library
from silo.fcstd.linked import identity_in
from silo.fcstd.locate import refusal
from silo.files import content_hash
from silo.spelling import one_path
from silo.vault.fetch import Fetched, Lost, Tree


class State(StrEnum):
    """What became of a file."""

    NEW = "new"  # was not there
    SAME = "same"  # was there already
    UPDATED = "updated"  # replaced an older revision
    EDITED = "edited"  # local edits that are not in Silo: not touched
    OVERWRITTEN = "overwritten"  # local edits, replaced at the user's word; a copy is kept
    OPEN = "open"  # FreeCAD has it open: not touched


@dataclass(frozen=True)
class Placed:
    """A file in the user's folder. ``kept``: where the copy of an overwritten one is."""

    path: Path
    part_number: str
    revision: int
    state: State
    kept: Path | None = None


@dataclass(frozen=True)
class Pulled:
    """What became of a pull: the top file, all files, and the links that lead nowhere."""

    top: Path
    files: tuple[Placed, ...]
    lost: tuple[Lost, ...]

    @property
    def complete(self) -> bool:
        """True where every file is there as wanted."""
        return not self.lost and not any(one.state in (State.EDITED, State.OPEN) for one in self.files)


# --- lay out ---------------------------------------------------------------------------------------------


def lay_out(files: Iterable[tuple[str, str | None]]) -> list[str]:
    """Where each file goes below one folder: its position, with names for the folders above the top's.

    files
        (position, ``file_path`` of the revision); the paths name folders that the positions only step out of.
    """
    split = [(*_ups(position), (told or "").replace("\\", "/").split("/")) for position, told in files]
    most = max((ups for ups, _, _ in split), default=0)
    # names[n]: the folder n steps above the top file's own.
    names: dict[int, str] = {}
    for ups, parts, told in split:
        above = told[: -len(parts)] if told[-len(parts) :][:-1] == parts[:-1] else []
        for step, name in enumerate(reversed(above)):
            if name not in ("", ".", "..") and refusal(name) is None:
                names.setdefault(ups + step, name)
    above_top = [names.get(step, "folder") for step in range(most)]
    return ["/".join([*reversed(above_top[ups:]), *parts]) for ups, parts, _ in split]


def _ups(position: str) -> tuple[int, list[str]]:
    parts = position.split("/")
    ups = sum(1 for part in parts if part == "..")
    return ups, parts[ups:]


def _anchor(tree: Tree, places: Sequence[str], into: Path) -> Path:
    """Where the folder of the places begins: the item may have its file in the user's folder already."""
    top, name = tree.files[0], posixpath.basename(places[0])
    known = into.joinpath(*places[0].split("/"))
    if known.exists() or not into.is_dir():
        return into
    with Library() as library:
        item = top.item.lower()
        found = [one for one in into.rglob(name) if identity_in(library, str(one)).lower() == item]
    if len(found) != 1:
        return into
    base = found[0]
    for _ in places[0].split("/"):
        base = base.parent
    inside = base == into or into in base.parents
    return base if inside and base.joinpath(*places[0].split("/")) == found[0] else into


# --- place -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Rules:
    """What may be done to files that are there.

    overwrite
        also local edits, of which a copy is kept by ``keep``.
    is_open
        FreeCAD has this file open, and its next save would undo what is written.
    learn
        called with each file as it is in Silo: (SHA-256, item, revision).
    """

    overwrite: bool = False
    keep: Callable[[str], Path | None] = lambda _path: None
    is_open: Callable[[str], bool] = lambda _path: False
    learn: Callable[[str, str, int], object] = lambda _sha256, _item, _revision: None


def place(tree: Tree, into: Path | str, rules: Rules = Rules()) -> Pulled:
    """Write the files of a tree below a folder. What has no place there is lost, the others come.

    Raises DocumentError where the disk does not take one, or the top has no place; those before it are whole.
    """
    base = Path(os.path.realpath(into))
    places = lay_out((one.position, one.revision.file_path) for one in tree.files)
    anchor = _anchor(tree, places, base)
    placed: list[Placed] = []
    lost = list(tree.lost)
    # The disk says which names are one file: by their case, their Unicode form, or a link.
    taken: dict[str, Placed] = {}
    for one, where in zip(tree.files, places, strict=True):
        target = anchor.joinpath(*where.split("/"))
        if (before := taken.get(one_path(str(target)))) is not None:
            if (before.part_number, before.revision) != (one.part_number, one.revision.revision_number):
                why = f"{before.part_number}, revision {before.revision}, has the same place on this disk"
                lost.append(Lost(one.position, where, why))
            continue
        if why := _in_the_way(target, base):
            if not placed:
                raise DocumentError(str(target), why)
            lost.append(Lost(one.position, where, why))
            continue
        placed.append(_place(one, target, rules))
        taken[one_path(str(target))] = placed[-1]
    return Pulled(placed[0].path, tuple(placed), tuple(lost))


def _in_the_way(target: Path, base: Path) -> str:
    """Why a file cannot go where it belongs, though the disk takes others; "" where it can."""
    if base not in Path(os.path.realpath(target)).parents:
        return f"its place leads out of {base}; nothing was written there"
    if target.is_dir():
        return "a folder has its place and name"
    return ""


def _place(one: Fetched, target: Path, rules: Rules) -> Placed:
    number = one.revision.revision_number
    rules.learn(one.sha256, one.item, number)

    def done(state: State, kept: Path | None = None) -> Placed:
        return Placed(target, one.part_number, number, state, kept)

    try:
        real = Path(os.path.realpath(target))
        real.parent.mkdir(parents=True, exist_ok=True)
        state, kept = State.NEW, None
        if target.exists():
            there = content_hash(target)
            if there == one.sha256:
                return done(State.SAME)
            if rules.is_open(str(target)):
                return done(State.OPEN)
            state = State.UPDATED
            if there not in one.earlier:
                if not rules.overwrite:
                    return done(State.EDITED)
                state, kept = State.OVERWRITTEN, rules.keep(str(target))
        # Through a link to where the file is: another assembly may use it there.
        with one.content.open("rb") as read, replacing(real, mode=0o644) as write:
            shutil.copyfileobj(read, write, 1 << 20)
    except OSError as error:
        raise DocumentError(str(target), f"cannot be written ({error.strerror or error})") from error
    return done(state, kept)


def pulled_json(pulled: Pulled, base: Path) -> dict[str, Any]:
    """For machines; paths relative to ``base``."""

    def below(path: Path) -> str:
        return os.path.relpath(path, base).replace(os.sep, "/")

    return {
        "top": below(pulled.top),
        "complete": pulled.complete,
        "files": [
            {
                "path": below(one.path),
                "part_number": one.part_number,
                "revision": one.revision,
                "state": one.state.value,
                "kept": str(one.kept) if one.kept else None,
            }
            for one in pulled.files
        ],
        "missing": [
            {"file": lost.position, "link": lost.path, "reason": lost.reason} for lost in pulled.lost
        ],
    }
