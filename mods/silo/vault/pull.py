# SPDX-License-Identifier: LGPL-2.1-or-later
"""Fetch an item's file with all that it links to, each file in its place; nothing of the user's is lost.

::

    fetch      the file, its recorded links, their items, their files, and so on  → Tree (in a scratch folder)
    lay out    where each file goes: the relative paths of the links              → paths below the folder
    place      new files are written; a file that is an older revision is replaced; edited ones stay

The files themselves say what they link to. Which item a link means was written down by the commit; where it
was not (an older client, another server), the item's BOM and its file names say it.
"""

from __future__ import annotations

import os
import posixpath
import re
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import Any, Protocol

from silo.api.revisions import checksum_of, download_revision
from silo.api.transport import Cancel, stop_if
from silo.api.wire import BomLine, Item, Revision
from silo.bom.errors import DocumentError, InputError, NotFoundError, RouteMissingError
from silo.durable import replacing
from silo.fcstd import Library
from silo.fcstd.linked import identity_in, recorded_paths
from silo.fcstd.locate import refusal
from silo.files import content_hash
from silo.folders import scratch_folder
from silo.vault.revisions import RevisionsApi, file_revisions

MOST_FILES = 20_000
_ABSOLUTE = re.compile(r"/|[A-Za-z]:|[A-Za-z][A-Za-z0-9+.-]+://")

Progress = Callable[[str, int], object]
"""Called with the name of the file that is fetched now, and how many were."""


class PullApi(RevisionsApi, Protocol):
    """What is needed of a Silo; :class:`silo.api.client.SiloClient` has it."""

    @property
    def base_url(self) -> str: ...

    def get_item(self, part_number: str, /) -> Item: ...

    def get_items_by_uuid(
        self, uuids: Iterable[str], /, *, cancelled: Cancel | None = None
    ) -> dict[str, Item]: ...

    def get_bom(self, part_number: str, /) -> Sequence[BomLine]: ...

    def get_revision(self, part_number: str, number: int, /) -> Revision: ...


class State(StrEnum):
    """What became of a file."""

    NEW = "new"  # was not there
    SAME = "same"  # was there already
    UPDATED = "updated"  # replaced an older revision
    EDITED = "edited"  # local edits that are not in Silo: not touched
    OVERWRITTEN = "overwritten"  # local edits, replaced at the user's word; a copy is kept
    OPEN = "open"  # FreeCAD has it open: not touched


@dataclass(frozen=True)
class Fetched:
    """A file of the tree, in the scratch folder.

    position
        relative to the folder of the top file, with ``/``; may begin with ``../``.
    earlier
        the hashes of the item's other revisions: such a file may be replaced, it is in Silo.
    """

    position: str
    part_number: str
    item: str
    revision: Revision
    content: Path
    sha256: str
    earlier: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Lost:
    """A link whose file could not be fetched: who links, to which path, and why."""

    position: str
    path: str
    reason: str


@dataclass(frozen=True)
class Tree:
    """All files, the top first, and the links that lead nowhere."""

    files: tuple[Fetched, ...]
    lost: tuple[Lost, ...] = ()


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


# --- fetch -----------------------------------------------------------------------------------------------


@dataclass
class _Fetch:
    client: PullApi
    folder: Path
    pinned: bool
    cancelled: Cancel | None
    progress: Progress
    files: dict[str, Fetched] = field(default_factory=dict)
    lost: list[Lost] = field(default_factory=list)
    _at: datetime | None = None
    _revisions: dict[str, list[Revision]] = field(default_factory=dict)
    _contents: dict[tuple[str, int], tuple[Path, str]] = field(default_factory=dict)

    def tree(self, item: Item, number: int | None) -> Tree:
        known = self.revisions(item.part_number)
        wanted = known if number is None else [one for one in known if one.revision_number == number]
        if not wanted:
            which = "no file yet" if number is None else f"no file with the revision {number}"
            raise NotFoundError(f"{item.part_number} has {which} in Silo")
        top = wanted[0]
        self._at = top.created_at
        name = posixpath.basename((top.file_path or top.file_name or "").replace("\\", "/"))
        left = [(_safe_name(name or f"{item.part_number}.FCStd"), item, top)]
        while left:
            position, one, revision = left.pop(0)
            left += self.fetch(position, one, revision)
        return Tree(tuple(self.files.values()), tuple(self.lost))

    def fetch(self, position: str, item: Item, revision: Revision) -> Iterator[tuple[str, Item, Revision]]:
        """Fetch one file; gives what it links to and was not seen before."""
        stop_if(self.cancelled)
        if (known := self.files.get(position)) is not None:
            if known.item != item.id:
                why = f"{known.part_number} and {item.part_number} want the same place"
                self.lost.append(Lost(position, position, why))
            return
        if len(self.files) >= MOST_FILES:
            raise InputError(f"more than {MOST_FILES} files are not fetched in one go")
        self.progress(posixpath.basename(position), len(self.files))
        content, sha256 = self.content(item.part_number, revision)
        earlier = frozenset(filter(None, map(checksum_of, self.revisions(item.part_number))))
        self.files[position] = Fetched(
            position, item.part_number, item.id, revision, content, sha256, earlier - {sha256}
        )
        try:
            recorded = recorded_paths(content)
        except DocumentError as error:
            self.lost.append(Lost(position, "", f"its links cannot be read: {error.reason}"))
            return
        if recorded:
            yield from self.linked(position, item, revision, recorded)

    def content(self, part_number: str, revision: Revision) -> tuple[Path, str]:
        number, checksum = revision.revision_number, checksum_of(revision)
        key = (part_number, number)
        if key not in self._contents:
            target = self.folder / f"{len(self._contents)}.FCStd"
            sha256 = download_revision(
                self.client, part_number, target, number, checksum, cancelled=self.cancelled
            )
            self._contents[key] = (target, sha256)
        return self._contents[key]

    def revisions(self, part_number: str) -> list[Revision]:
        if part_number not in self._revisions:
            self._revisions[part_number] = file_revisions(self.client.revisions(part_number))
        return self._revisions[part_number]

    def linked(
        self, position: str, item: Item, revision: Revision, recorded: Sequence[str]
    ) -> Iterator[tuple[str, Item, Revision]]:
        by_top = len(self.files) == 1
        told = self.client.get_revision(item.part_number, revision.revision_number)
        links = {link.path.replace("\\", "/"): link for link in told.links}
        ids = [link.item for link in links.values() if link.item]
        items = self.client.get_items_by_uuid(ids, cancelled=self.cancelled) if ids else {}
        others = _Children(self, item.part_number)
        for path in recorded:
            link = links.get(path)
            child = items.get(link.item) if link is not None and link.item else others.find(path)
            target = posixpath.normpath(posixpath.join(posixpath.dirname(position), path))
            why = _refused(path)
            if not why and child is None:
                why = "no item in Silo is known for it: it was never committed"
            chosen = self.choose(child, link.sha256 if link else "", by_top=by_top) if child else None
            if not why and chosen is None:
                why = f"{child.part_number if child else path} has no file in Silo"
            if why or child is None or chosen is None:
                self.lost.append(Lost(position, path, why))
            else:
                yield target, child, chosen

    def choose(self, child: Item, sha256: str, *, by_top: bool) -> Revision | None:
        """The newest revision of a linked file; for a chosen revision of the top, that of its time.

        What the top itself links to was written down with it (``sha256``). A file further below
        may have been committed again between the file that links to it and the top.
        """
        known = self.revisions(child.part_number)
        if not self.pinned or not known:
            return known[0] if known else None
        at = self._at
        same = [one for one in known if sha256 and checksum_of(one) == sha256]
        before = [one for one in known if at and one.created_at and one.created_at <= at]
        if same and by_top:
            return same[0]
        return max([*same[:1], *before[:1]] or known[-1:], key=lambda one: one.revision_number)


@dataclass
class _Children:
    """Which item a recorded path means, where the commit did not say: by the BOM."""

    fetch: _Fetch
    part_number: str
    _known: tuple[dict[str, str], dict[str, str]] | None = None

    def find(self, path: str) -> Item | None:
        by_path, by_name = self._known = self._known or self._read()
        number = by_path.get(path) or by_name.get(posixpath.basename(path).casefold())
        return self.fetch.client.get_item(number) if number else None

    def _read(self) -> tuple[dict[str, str], dict[str, str]]:
        by_path: dict[str, str] = {}
        by_name: dict[str, str] = {}
        try:
            lines = self.fetch.client.get_bom(self.part_number)
        except (NotFoundError, RouteMissingError):
            return {}, {}
        for line in lines:
            number = line.child_part_number
            by_path |= {str(one.get("file", "")).replace("\\", "/"): number for one in line.components}
            for revision in self.fetch.revisions(number)[:1]:
                by_name[(revision.file_name or "").casefold()] = number
        return by_path, by_name


def _refused(path: str) -> str:
    """Why a recorded path is not followed; "" where it is."""
    if _ABSOLUTE.match(path):
        return "it is an absolute path, which has no place in another folder"
    if (found := refusal(path)) is not None:
        return found.detail or "its path cannot be one"
    if posixpath.splitext(path)[1].lower() != ".fcstd":
        return "it is no FreeCAD file"
    return ""


def _safe_name(name: str) -> str:
    name = name.replace("/", "_").strip(". ") or "file"
    if posixpath.splitext(name)[1].lower() != ".fcstd":
        name += ".FCStd"
    return f"_{name}" if refusal(name) is not None else name


@contextmanager
def fetched(
    client: PullApi,
    part_number: str,
    revision: int | None = None,
    *,
    cancelled: Cancel | None = None,
    progress: Progress = lambda _name, _count: None,
) -> Iterator[Tree]:
    """The tree of an item, in a scratch folder that goes with the block.

    revision
        of the top; its linked files are then those of its time. None: the newest of all.

    Raises NotFoundError where the item has no such file.
    """
    item = client.get_item(part_number)
    with scratch_folder("silo-pull-") as scratch:
        yield _Fetch(client, Path(scratch), revision is not None, cancelled, progress).tree(item, revision)


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
        called with each file that is as in Silo: (SHA-256, item, revision).
    """

    overwrite: bool = False
    keep: Callable[[str], Path | None] = lambda _path: None
    is_open: Callable[[str], bool] = lambda _path: False
    learn: Callable[[str, str, int], object] = lambda _sha256, _item, _revision: None


def place(tree: Tree, into: Path | str, rules: Rules = Rules()) -> Pulled:
    """Write the files of a tree below a folder. Raises DocumentError where the disk does not take one; those
    before it are whole."""
    base = Path(os.path.realpath(into))
    places = lay_out((one.position, one.revision.file_path) for one in tree.files)
    anchor = _anchor(tree, places, base)
    placed: list[Placed] = []
    lost = list(tree.lost)
    # The disk says which names are one file: by their case, their Unicode form, or a link.
    taken: dict[tuple[int, int], Placed] = {}
    for one, where in zip(tree.files, places, strict=True):
        target = anchor.joinpath(*where.split("/"))
        if (before := taken.get(_on_disk(target))) is not None:
            if (before.part_number, before.revision) != (one.part_number, one.revision.revision_number):
                why = f"{before.part_number}, revision {before.revision}, has the same place on this disk"
                lost.append(Lost(one.position, where, why))
            continue
        placed.append(_place(one, target, base, rules))
        taken[_on_disk(target)] = placed[-1]
    return Pulled(placed[0].path, tuple(placed), tuple(lost))


def _on_disk(path: Path) -> tuple[int, int]:
    try:
        status = path.stat()
    except OSError:
        return (0, 0)
    return (status.st_dev, status.st_ino)


def _place(one: Fetched, target: Path, base: Path, rules: Rules) -> Placed:
    number = one.revision.revision_number

    def done(state: State, kept: Path | None = None) -> Placed:
        if state not in (State.EDITED, State.OPEN):
            rules.learn(one.sha256, one.item, number)
        return Placed(target, one.part_number, number, state, kept)

    try:
        real = Path(os.path.realpath(target))
        if base not in real.parents:
            raise DocumentError(str(target), f"it leads out of {base}; nothing was written there")
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


def counts(pulled: Pulled) -> Mapping[State, int]:
    """How many files of each state."""
    found: dict[State, int] = {}
    for one in pulled.files:
        found[one.state] = found.get(one.state, 0) + 1
    return found
