# SPDX-License-Identifier: LGPL-2.1-or-later
"""Put the files of an item, each in its place; nothing of the user's is lost.

::

    fetch      the file, its recorded links, their items, their files, and so on  → FileTree (silo.vault.tree)
    lay out    where each file goes: the relative paths of the links              → paths below the folder
    place      new files are written; a file that is an older revision is replaced; edited ones stay
"""

from __future__ import annotations

import os
import posixpath
import shutil
from collections.abc import Callable, Container, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo.api.address import canonical
from silo.bom.errors import DocumentError
from silo.bom.message import message
from silo.bom.system_refusals import why_refused
from silo.checksums import content_hash
from silo.fcstd import Library
from silo.fcstd.linked import identity_in
from silo.file_kind import MODEL, kind_by_name
from silo.file_state import FileState, file_state
from silo.locator import refusal
from silo.outbox.recorded import arrived, uid_of
from silo.platform.part_file_name import part_file_stem
from silo.platform.spelling import folded, one_path
from silo.platform.whole_files import replacing
from silo.project_folder import FileRecord, Project, record_of
from silo.vault.former import documents_now, record_for
from silo.vault.tree import Fetched, FileTree, LostLink

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.outbox.store import Store


class PullState(StrEnum):
    """What became of a file."""

    NEW = "new"  # was not there
    SAME = "same"  # was there already
    UPDATED = "updated"  # replaced an older revision
    EDITED = "edited"  # local edits that are not in Silo: not touched
    WAITING = "waiting"  # its commit is in the queue, and not in Silo yet: not touched
    SET_BACK = "server set back"  # it is of a revision that the server has lost: not touched
    OVERWRITTEN = "overwritten"  # local edits, replaced at the user's word; a copy is kept
    OPEN = "open"  # FreeCAD has it open: not touched


LEFT_ALONE = frozenset({PullState.EDITED, PullState.WAITING, PullState.SET_BACK, PullState.OPEN})
"""The states of files that were not touched, though Silo has another one."""


@dataclass(frozen=True)
class PulledFile:
    """A file in the user's folder. ``kept``: where the copy of an overwritten one is."""

    path: Path
    part_number: str
    revision: int
    state: PullState
    kept: Path | None = None


@dataclass(frozen=True)
class Pulled:
    """What became of a pull: the top file, all files, and the links that lead nowhere."""

    top: Path
    files: tuple[PulledFile, ...]
    lost: tuple[LostLink, ...]
    remarks: tuple[str, ...] = ()

    @property
    def complete(self) -> bool:
        """Return True if every file is there in the wanted revision."""
        return not self.lost and not any(file.state in LEFT_ALONE for file in self.files)


# --- lay out ---------------------------------------------------------------------------------------------


def lay_out(files: Iterable[tuple[str, str | None]]) -> list[str]:
    """Find the place of each file below one folder: its position, with names for the folders above the top's.

    files
        (position, ``file_path`` of the revision); the paths have the names of folders for which the positions
        only have ``..``.
    """
    split = [(*_ups(position), (spot or "").replace("\\", "/").split("/")) for position, spot in files]
    most = max((ups for ups, _, _ in split), default=0)
    # names[n]: the folder n steps above the top file's own.
    names: dict[int, str] = {}
    for ups, parts, place_text in split:
        above = place_text[: -len(parts)] if place_text[-len(parts) :][:-1] == parts[:-1] else []
        for step, name in enumerate(reversed(above)):
            if name not in ("", ".", "..") and refusal(name) is None:
                names.setdefault(ups + step, name)
    above_top = [names.get(step, "folder") for step in range(most)]
    places = ["/".join([*reversed(above_top[ups:]), *parts]) for ups, parts, _ in split]
    # A link may spell a name in another way than its file does.
    spelt = [("/".join(spot), place) for (_, _, spot), place in zip(split, places, strict=True)]
    return [spot if folded(spot) == folded(place) else place for spot, place in spelt]


def _ups(position: str) -> tuple[int, list[str]]:
    parts = position.split("/")
    ups = sum(1 for part in parts if part == "..")
    return ups, parts[ups:]


def _anchor(tree: FileTree, places: Sequence[str], into: Path) -> Path:
    """Find the folder at which the places begin: the user's folder may have the item's file already."""
    top, name = tree.files[0], posixpath.basename(places[0])
    path = into.joinpath(*places[0].split("/"))
    if path.exists() or not into.is_dir():
        return into
    with Library() as library:
        item = top.item.lower()
        paths = [source for source in into.rglob(name) if identity_in(library, str(source)).lower() == item]
    if len(paths) != 1:
        return into
    base = paths[0]
    for _ in places[0].split("/"):
        base = base.parent
    inside = base == into or into in base.parents
    return base if inside and base.joinpath(*places[0].split("/")) == paths[0] else into


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
    state
        returns how the file at a path stands, with this content, to the one that was fetched.
    server
        from which the files come, for their records.
    """

    overwrite: bool = False
    keep: Callable[[str], Path | None] = lambda _path: None
    is_open: Callable[[str], bool] = lambda _path: False
    learn: Callable[[str, str, int], object] = lambda _sha256, _item, _revision: None
    state: Callable[[str, str, Fetched], FileState] = lambda _path, _sha256, _one: FileState.BOTH
    server: str = ""


def rules_of(
    store: Store, client: SiloClient, *, overwrite: bool = False, is_open: Callable[[str], bool]
) -> Rules:
    """Make the rules of a pull for this computer: its queue, its records, and what its FreeCAD saved."""
    server = canonical(client.base_url)

    def state(path: str, sha256: str, one: Fetched) -> FileState:
        record = record_of(path)
        former = record.document if record is not None and not record.item else ""
        now = documents_now([record], client) if record is not None and former else {}
        own = record_for(record, one.item, former if now.get(former, "").lower() == one.item.lower() else "")
        revisions = one.revisions
        origins = store.origins(sha256, path, one.item, record=record)
        found = file_state(
            sha256,
            origins,
            own,
            revisions[0] if revisions else None,
            server,
            lambda: revisions,
            lambda content: store.known_revision(server, content, one.item),
        )
        waits = any(
            entry.file_left and entry.sha256 == sha256 and entry.identity.lower() == one.item.lower()
            for entry in store.entries()
        )
        return FileState.WAITING if waits and found is not FileState.SAME else found

    def learn(sha256: str, item: str, number: int) -> None:
        store.learn(server, sha256, item, number)

    return Rules(overwrite, store.keep_aside, is_open, learn, state, server)


def place(tree: FileTree, into: Path | str, rules: Rules = Rules()) -> Pulled:
    """Write the files of a tree below a folder. A file without a place there is lost; the others are written.

    Raises DocumentError if a file cannot be written, or if the top has no place; the files before it are
    complete.
    """
    base = Path(os.path.realpath(into))
    places = lay_out((file.position, file.revision.file_path) for file in tree.files)
    anchor = _anchor(tree, places, base)
    placed: list[PulledFile] = []
    noted: dict[str, FileRecord | None] = {}
    lost = list(tree.lost)
    # The disk says which names are one file: by their case, their Unicode form, or a link.
    taken: dict[str, PulledFile] = {}
    folders: dict[str, Path] = {}
    for one, where in zip(tree.files, places, strict=True):
        target = anchor.joinpath(*where.split("/"))
        if (before := taken.get(one_path(str(target)))) is not None:
            if (before.part_number, before.revision) != (one.part_number, one.revision.revision_number):
                why: str = message(
                    "{part_number}, revision {revision}, has the same place on this disk",
                    part_number=before.part_number,
                    revision=before.revision,
                )
                lost.append(LostLink(one.position, where, why))
            continue
        if why := _in_the_way(target, base):
            if not placed:
                raise DocumentError(str(target), why)
            lost.append(LostLink(one.position, where, why))
            continue
        placed.append(_place(one, target, rules))
        folders.setdefault(one.position, target.parent)
        taken[one_path(str(target))] = placed[-1]
        if placed[-1].state not in LEFT_ALONE:
            item = bool(one.part_number)
            uid, server = uid_of(str(target)), rules.server
            noted[str(target)] = arrived(one.item, one.sha256, one.revision, server, uid, item=item)
    project = Project.of(anchor) or Project(one_path(str(anchor)))
    project.note({at: kept for path, kept in noted.items() if (at := project.place(path)) is not None})
    top = placed[0].path
    for one in tree.attachments:
        beside = _place_beside(one, folders.get(one.position, top.parent), taken)
        reason = message("its name is taken there") if beside is None else _in_the_way(beside, base)
        if beside is None or reason:
            lost.append(LostLink(one.position, one.revision.file_name or "", reason))
            continue
        placed.append(_place(one, beside, rules))
        taken[one_path(str(beside))] = placed[-1]
    return Pulled(top, tuple(placed), tuple(lost), tree.remarks)


def _place_beside(one: Fetched, folder: Path, taken: Container[str]) -> Path | None:
    """Find a free name for an attachment in the folder of its model; None if none is free.

    A name that a model or another attachment has gets the part number in front, and so does each name that
    FreeCAD would take for a model.
    """
    name = (one.revision.file_name or "file").replace("/", "_").replace("\\", "_").strip(". ") or "file"
    if refusal(name) is not None:
        name = f"_{name}"
    stem = part_file_stem(one.part_number or "file")
    for free in (name, f"{stem}-{name}"):
        target = folder / free
        if one_path(str(target)) not in taken and kind_by_name(free) != MODEL:
            return target
    target = folder / f"{stem}-{name}.{one.revision.kind}"
    return None if one_path(str(target)) in taken else target


def _in_the_way(target: Path, base: Path) -> str:
    """Say why a file cannot be written to its place, although the disk accepts others; "" if it can."""
    if base not in Path(os.path.realpath(target)).parents:
        return message("its place leads out of {base}; nothing was written there", base=base)
    if target.is_dir():
        return message("a folder has its place and name")
    return ""


def _place(one: Fetched, target: Path, rules: Rules) -> PulledFile:
    number = one.revision.revision_number
    rules.learn(one.sha256, one.item, number)

    def done(state: PullState, kept: Path | None = None) -> PulledFile:
        return PulledFile(target, one.part_number, number, state, kept)

    try:
        real = Path(os.path.realpath(target))
        real.parent.mkdir(parents=True, exist_ok=True)
        state, kept = PullState.NEW, None
        if target.exists():
            there = content_hash(target)
            if there == one.sha256:
                return done(PullState.SAME)
            if rules.is_open(str(target)):
                return done(PullState.OPEN)
            state = PullState.UPDATED
            if there not in one.earlier:
                stands = rules.state(str(target), there, one)
                if stands is FileState.SET_BACK:
                    return done(PullState.SET_BACK)
                # What is newer only was not edited: it was another document when it came here.
                if stands is not FileState.NEWER:
                    if not rules.overwrite:
                        return done(PullState.WAITING if stands is FileState.WAITING else PullState.EDITED)
                    state, kept = PullState.OVERWRITTEN, rules.keep(str(target))
        # Through a link to where the file is: another assembly may use it there.
        with one.content.open("rb") as read, replacing(real, mode=0o644) as write:
            shutil.copyfileobj(read, write, 1 << 20)
    except OSError as error:
        raise DocumentError(
            str(target), message("cannot be written ({error})", error=why_refused(error))
        ) from error
    return done(state, kept)


def pulled_json(pulled: Pulled, base: Path) -> dict[str, Any]:
    """Return the result as JSON values; paths are relative to ``base``."""

    def below(path: Path) -> str:
        return os.path.relpath(path, base).replace(os.sep, "/")

    return {
        "top": below(pulled.top),
        "complete": pulled.complete,
        "files": [
            {
                "path": below(file.path),
                "part_number": file.part_number,
                "revision": file.revision,
                "state": file.state.value,
                "kept": str(file.kept) if file.kept else None,
            }
            for file in pulled.files
        ],
        "remarks": list(pulled.remarks),
        "missing": [
            {"file": lost.position, "link": lost.path, "reason": lost.reason} for lost in pulled.lost
        ],
    }
