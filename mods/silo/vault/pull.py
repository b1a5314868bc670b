# SPDX-License-Identifier: LGPL-2.1-or-later
"""Put the files of an item, each in its place; nothing of the user's is lost.

::

    fetch      the file, its recorded links, their items, their files, and so on  → Tree (silo.vault.pull)
    lay out    where each file goes: the relative paths of the links              → paths below the folder
    place      new files are written; a file that is an older revision is replaced; edited ones stay

The BOMs of an item's revisions, read from their files: what a colleague changed, and when.

A revision's file is read as if it lay where the user's file lies, so that its links lead to the user's other
files: the lines of two revisions, and those of the file at hand, are then named alike.

Fetch an item's file with all that it links to into a scratch folder.

The files themselves say what they link to. Which item a link means was written down by the commit; where it
was not (an older client, another server), the item's BOM and its file names say it.
"""

from __future__ import annotations

import os
import posixpath
import re
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo.api.files import DocumentId, download_revision
from silo.api.revisions import Standing, checksum_of, has_file
from silo.api.transport import Cancel, stop_if
from silo.api.wire import Item, LinkedFile, Release, Revision
from silo.bom.compare.states import ComparedAssembly
from silo.bom.compare.three_states import ThreeLines, compare_three
from silo.bom.compare.two_states import LineChange, compare_assemblies
from silo.bom.entry import Extraction
from silo.bom.errors import DocumentError, InputError, NotFoundError, RouteMissingError, listed
from silo.bom.items.naming import display_name
from silo.bom.links import extract
from silo.bom.roots import choose_assembly
from silo.checksums import content_hash
from silo.fcstd import Library
from silo.fcstd.contents import FileContents
from silo.fcstd.linked import identity_in, recorded_paths
from silo.locator import refusal
from silo.platform import folded, one_path, remove_patiently, replacing, scratch_folder
from silo.project_folder import Project, ProjectEntry

if TYPE_CHECKING:
    from silo.api.client import SiloClient


def top_of(extraction: Extraction) -> ComparedAssembly:
    """Return the assembly itself with its direct lines."""
    return ComparedAssembly(extraction.assembly, tuple(extraction.entries))


def bom_in(content: Path | str, path: str) -> ComparedAssembly | None:
    """Read the BOM of a file that belongs at ``path``; None for a part, and for a file with several
    assemblies.
    """
    contents = FileContents(instead={os.path.realpath(path): os.fspath(content)})
    with Library(contents=contents) as library:
        try:
            return top_of(extract(choose_assembly(library.open(path))))
        except InputError:
            return None


@dataclass
class RevisionBoms:
    """BOMs of the revisions of one item, each file fetched once. Close it, or use it in a ``with`` block."""

    client: SiloClient
    part_number: str
    path: str
    cancelled: Cancel | None = None
    _known: dict[int, ComparedAssembly | None] = field(default_factory=dict)
    _stack: ExitStack = field(default_factory=ExitStack)

    def __enter__(self) -> RevisionBoms:
        self._folder = Path(self._stack.enter_context(scratch_folder("silo-revisions-")))
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def bom(self, number: int) -> ComparedAssembly | None:
        """Download a revision and read its BOM; None for a part."""
        if number not in self._known:
            target = self._folder / f"{number}.FCStd"
            self.client.download_file(self.part_number, target, number, cancelled=self.cancelled)
            self._known[number] = bom_in(target, self.path)
            remove_patiently(target)
        return self._known[number]

    def change(self, older: int | None, newer: int) -> tuple[LineChange, ...]:
        """Return the lines that differ between two revisions; all lines if there is no older one."""
        before, after = self.bom(older) if older is not None else None, self.bom(newer)
        changes = compare_assemblies([before] if before else [], [after] if after else [])
        return tuple(line for change in changes for line in change.lines)

    def three(self, stands: Standing, mine: ComparedAssembly | None) -> tuple[ThreeLines, ...]:
        """Compare base → theirs → mine, if all three are assemblies."""
        if mine is None or stands.newest is None:
            return ()
        theirs = self.bom(stands.newest.revision_number)
        base = self.bom(stands.base.revision_number) if stands.base is not None else None
        return compare_three(base, theirs, mine) if theirs is not None else ()


def file_revisions(revisions: Sequence[Revision]) -> list[Revision]:
    """Return the revisions with a file, newest first."""
    return sorted(filter(has_file, revisions), key=lambda revision: revision.revision_number, reverse=True)


def words(lines: Sequence[LineChange], most: int = 6) -> str:
    """Write a difference in one line, such as ``+ Bolt 4, - Plate 1, Nut 4 → 8``."""
    return listed(line_texts(lines), most)


def line_texts(lines: Iterable[LineChange]) -> list[str]:
    """Write each line of a difference in words."""
    texts = []
    for line in lines:
        name = display_name(line.entry) or line.entry.object_name
        if line.old is None:
            texts.append(f"+ {name} {line.entry.quantity:g}")
        elif line.new is None:
            texts.append(f"- {name} {line.entry.quantity:g}")
        elif line.old.quantity != line.new.quantity:
            texts.append(f"{name} {line.old.quantity:g} → {line.new.quantity:g}")
        else:
            texts.append(f"{name} moved")
    return texts


MOST_FILES = 20_000
_ABSOLUTE = re.compile(r"/|[A-Za-z]:|[A-Za-z][A-Za-z0-9+.-]+://")

Progress = Callable[[str, int], object]
"""Called with the name of the file that is fetched now, and how many were."""


@dataclass(frozen=True)
class Holder:
    """Whose revisions are those of a file: an item by its number, or a document. ``id`` is its UUID."""

    of: str
    id: str

    @property
    def part_number(self) -> str:
        """Return the item's part number; "" for a document without one."""
        return "" if isinstance(self.of, DocumentId) else self.of


@dataclass(frozen=True)
class Fetched:
    """A file of the tree, in the scratch folder.

    position
        relative to the folder of the top file, with ``/``; may begin with ``../``.
    part_number, item
        of the file's item; a file of several items or none has no number, and ``item`` is its document.
    earlier
        the hashes of the item's revisions: such a file may be replaced, it is in Silo.
    """

    position: str
    part_number: str
    item: str
    revision: Revision
    content: Path
    sha256: str
    earlier: frozenset[str] = frozenset()


@dataclass(frozen=True)
class LostLink:
    """A link whose file could not be fetched: who links, to which path, and why."""

    position: str
    path: str
    reason: str


@dataclass(frozen=True)
class FileTree:
    """All files, the top first, and the links that lead nowhere."""

    files: tuple[Fetched, ...]
    lost: tuple[LostLink, ...] = ()


@dataclass
class _Fetch:
    client: SiloClient
    folder: Path
    pinned: bool
    cancelled: Cancel | None
    progress: Progress
    most: int
    files: dict[str, Fetched] = field(default_factory=dict)
    lost: list[LostLink] = field(default_factory=list)
    release: Release | None = None
    _at: datetime | None = None
    _revisions: dict[str, list[Revision]] = field(default_factory=dict)
    _contents: dict[tuple[str, int], tuple[Path, str]] = field(default_factory=dict)
    _sought: set[str] = field(default_factory=set)

    def tree(self, item: Item, number: int | None) -> FileTree:
        holder = self.holder(item)
        revisions = self.revisions(holder)
        wanted = (
            revisions if number is None else [other for other in revisions if other.revision_number == number]
        )
        if self.release is not None:
            wanted = list(filter(None, [self.frozen(holder)]))
        if not wanted:
            which = "no file yet" if number is None else f"no file with the revision {number}"
            if self.release is not None:
                which = f"no file in revision {self.release.label}"
            raise InputError(f"{item.part_number} has {which} in Silo")
        top = wanted[0]
        self._at = top.created_at
        # The top lies where it lay in its project: a link that steps out of its folder and back leads to one
        # place.
        place = _place_in_project(top.file_path or top.file_name or f"{item.part_number}.FCStd")
        left = [(place, holder, top)]
        while left:
            position, other_revision, revision = left.pop(0)
            left += self.fetch(position, other_revision, revision)
            if not left:
                left = self.unlinked()
        return FileTree(tuple(self.files.values()), tuple(self.lost))

    def frozen(self, holder: Holder) -> Revision | None:
        """Return the revision of a file in the release that is being fetched; None if the file is not
        in it.
        """
        files = self.release.files if self.release is not None else ()
        numbers = {file.document: file.revision for file in files}
        revisions = self.revisions(holder) if holder.id in numbers else []
        return next(
            (revision for revision in revisions if revision.revision_number == numbers[holder.id]), None
        )

    def unlinked(self) -> list[tuple[str, Holder, Revision]]:
        """Return the next file of the release to which no link led: a person uploaded it."""
        there = {file.item for file in self.files.values()} | self._sought
        for file in self.release.files if self.release is not None else ():
            if file.document not in there:
                self._sought.add(file.document)
                holder = Holder(DocumentId(file.document), file.document)
                revision = self.frozen(holder)
                place = _place_in_project(file.file_path or file.file_name)
                if revision is not None and place not in self.files:
                    return [(place, holder, revision)]
                self.lost.append(
                    LostLink(place, place, "it is in the release, and not in Silo at this place")
                )
        return []

    def holder(self, item: Item) -> Holder:
        """Return the item; or, if it has no revisions, the file of several items that holds it."""
        own = Holder(item.part_number, item.id)
        if self.revisions(own):
            return own
        try:
            several = self.client.documents_of(item.part_number)
        except (NotFoundError, RouteMissingError):
            return own
        return Holder(DocumentId(several[0].id), several[0].id) if several else own

    def fetch(
        self, position: str, holder: Holder, revision: Revision
    ) -> Iterator[tuple[str, Holder, Revision]]:
        """Fetch one file, and yield the files to which it links and that were not seen before."""
        stop_if(self.cancelled)
        if (file := self.files.get(position)) is not None:
            if file.item != holder.id:
                path, other = (text or "another file" for text in (file.part_number, holder.part_number))
                self.lost.append(LostLink(position, position, f"{path} and {other} want the same place"))
            return
        if len(self.files) >= self.most:
            raise InputError(f"more than {self.most} files are not fetched in one go")
        self.progress(posixpath.basename(position), len(self.files))
        content, sha256 = self.content(holder.of, revision)
        earlier = frozenset(filter(None, map(checksum_of, self.revisions(holder))))
        self.files[position] = Fetched(
            position, holder.part_number, holder.id, revision, content, sha256, earlier
        )
        try:
            recorded = recorded_paths(content)
        except DocumentError as error:
            self.lost.append(LostLink(position, "", f"its links cannot be read: {error.reason}"))
            return
        if recorded:
            yield from self.linked(position, holder, revision, recorded)

    def content(self, of: str, revision: Revision) -> tuple[Path, str]:
        number, checksum = revision.revision_number, checksum_of(revision)
        key = (of, number)
        if key not in self._contents:
            target = self.folder / f"{len(self._contents)}.FCStd"
            sha256 = download_revision(self.client, of, target, number, checksum, cancelled=self.cancelled)
            self._contents[key] = (target, sha256)
        return self._contents[key]

    def revisions(self, holder: Holder) -> list[Revision]:
        if holder.of not in self._revisions:
            try:
                self._revisions[holder.of] = file_revisions(self.client.revisions(holder.of))
            except NotFoundError:
                if holder.part_number:
                    raise
                self._revisions[holder.of] = []  # a document that never arrived, or a Silo without any
        return self._revisions[holder.of]

    def linked(
        self, position: str, holder: Holder, revision: Revision, recorded: Sequence[str]
    ) -> Iterator[tuple[str, Holder, Revision]]:
        by_top = len(self.files) == 1
        linked_revision = self.client.get_revision(holder.of, revision.revision_number)
        links = {link.path.replace("\\", "/"): link for link in linked_revision.links}
        ids = [link.item for link in links.values() if link.item]
        items = self.client.get_items_by_uuid(ids, cancelled=self.cancelled) if ids else {}
        others = _Children(self, holder.part_number)
        for path in recorded:
            link = links.get(path)
            child = self.means(path, link, items, others)
            target = posixpath.normpath(posixpath.join(posixpath.dirname(position), path))
            why = _refused(path)
            if not why and child is None:
                why = "no item in Silo is known for it: it was never committed"
                if link is not None and not link.sha256:
                    why = "it was not there either when the file was committed"
            chosen = self.choose(child, link.sha256 if link else "", by_top=by_top) if child else None
            if not why and chosen is None:
                why = f"{(child.part_number if child else '') or path} has no file in Silo"
            if why or child is None or chosen is None:
                self.lost.append(LostLink(position, path, why))
            else:
                yield target, child, chosen

    def means(
        self, path: str, link: LinkedFile | None, items: Mapping[str, Item], others: _Children
    ) -> Holder | None:
        """Find the item or document to which a link leads."""
        if link is not None and link.document:
            own = Holder(DocumentId(link.document), link.document)
            if self.revisions(own):
                return own
        child = items.get(link.item) if link is not None and link.item else others.find(path)
        return self.holder(child) if child is not None else None

    def choose(self, child: Holder, sha256: str, *, by_top: bool) -> Revision | None:
        """Choose the newest revision of a linked file; if a revision of the top was chosen, that of its time.

        The top's own links were recorded with their hash (``sha256``). A file further below may have been
        committed again after the file that links to it, but before the top.
        """
        if self.release is not None:
            return self.frozen(child)
        revisions = self.revisions(child)
        if not self.pinned or not revisions:
            return revisions[0] if revisions else None
        at = self._at
        same = [revision for revision in revisions if sha256 and checksum_of(revision) == sha256]
        before = [
            revision for revision in revisions if at and revision.created_at and revision.created_at <= at
        ]
        if same and by_top:
            return same[0]
        return max([*same[:1], *before[:1]] or revisions[-1:], key=lambda revision: revision.revision_number)


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
        if not self.part_number:
            return {}, {}
        try:
            lines = self.fetch.client.get_bom(self.part_number)
        except (NotFoundError, RouteMissingError):
            return {}, {}
        for line in lines:
            number = line.child_part_number
            by_path |= {
                str(component.get("file", "")).replace("\\", "/"): number for component in line.components
            }
            for revision in self.fetch.revisions(Holder(number, ""))[:1]:
                by_name[(revision.file_name or "").casefold()] = number
        return by_path, by_name


def _place_in_project(path: str) -> str:
    """Return the path with a safe name; without its folder if that is not inside a project."""
    folder, name = posixpath.split(path.replace("\\", "/"))
    outside = any(":" in part or part in ("", ".", "..") or refusal(part) for part in folder.split("/"))
    return _safe_name(name) if outside else posixpath.join(folder, _safe_name(name))


def _refused(path: str) -> str:
    """Say why a recorded path is not followed; "" if it is."""
    if _ABSOLUTE.match(path):
        return "it is an absolute path, which has no place in another folder"
    if (refused := refusal(path)) is not None:
        return refused.detail or "its path cannot be one"
    if posixpath.splitext(path)[1].lower() != ".fcstd":
        return "it is not a FreeCAD file"
    return ""


def _safe_name(name: str) -> str:
    name = name.replace("/", "_").strip(". ") or "file"
    if posixpath.splitext(name)[1].lower() != ".fcstd":
        name += ".FCStd"
    return f"_{name}" if refusal(name) is not None else name


@contextmanager
def fetched(
    client: SiloClient,
    part_number: str,
    revision: int | str | None = None,
    *,
    cancelled: Cancel | None = None,
    progress: Progress = lambda _name, _count: None,
    most: int = MOST_FILES,
) -> Iterator[FileTree]:
    """Fetch the files of an item, and yield their tree in a scratch folder that ends with the block.

    revision
        the number of a file's revision: its linked files are then those of its time. The label of a released
        revision: all files as they were frozen. None: the newest of all.

    Raises InputError if the item has no such file, and for more than ``most`` files.
    """
    item = client.get_item(part_number)
    number = revision if isinstance(revision, int) else None
    release = client.get_release(item.part_number, revision) if isinstance(revision, str) else None
    with scratch_folder("silo-pull-") as scratch:
        fetch = _Fetch(client, Path(scratch), number is not None, cancelled, progress, most, release=release)
        yield fetch.tree(item, number)


class PullState(StrEnum):
    """What became of a file."""

    NEW = "new"  # was not there
    SAME = "same"  # was there already
    UPDATED = "updated"  # replaced an older revision
    EDITED = "edited"  # local edits that are not in Silo: not touched
    OVERWRITTEN = "overwritten"  # local edits, replaced at the user's word; a copy is kept
    OPEN = "open"  # FreeCAD has it open: not touched


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

    @property
    def complete(self) -> bool:
        """Return True if every file is there in the wanted revision."""
        return not self.lost and not any(
            file.state in (PullState.EDITED, PullState.OPEN) for file in self.files
        )


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
    """

    overwrite: bool = False
    keep: Callable[[str], Path | None] = lambda _path: None
    is_open: Callable[[str], bool] = lambda _path: False
    learn: Callable[[str, str, int], object] = lambda _sha256, _item, _revision: None


def place(tree: FileTree, into: Path | str, rules: Rules = Rules()) -> Pulled:
    """Write the files of a tree below a folder. A file without a place there is lost; the others are written.

    Raises DocumentError if a file cannot be written, or if the top has no place; the files before it are
    complete.
    """
    base = Path(os.path.realpath(into))
    places = lay_out((file.position, file.revision.file_path) for file in tree.files)
    anchor = _anchor(tree, places, base)
    placed: list[PulledFile] = []
    noted: dict[str, ProjectEntry | None] = {}
    lost = list(tree.lost)
    # The disk says which names are one file: by their case, their Unicode form, or a link.
    taken: dict[str, PulledFile] = {}
    for one, where in zip(tree.files, places, strict=True):
        target = anchor.joinpath(*where.split("/"))
        if (before := taken.get(one_path(str(target)))) is not None:
            if (before.part_number, before.revision) != (one.part_number, one.revision.revision_number):
                why = f"{before.part_number}, revision {before.revision}, has the same place on this disk"
                lost.append(LostLink(one.position, where, why))
            continue
        if why := _in_the_way(target, base):
            if not placed:
                raise DocumentError(str(target), why)
            lost.append(LostLink(one.position, where, why))
            continue
        placed.append(_place(one, target, rules))
        taken[one_path(str(target))] = placed[-1]
        if placed[-1].state not in (PullState.EDITED, PullState.OPEN):
            noted[str(target)] = ProjectEntry(one.item, one.sha256, _uid_of(target))
    project = Project.of(anchor) or Project(one_path(str(anchor)))
    project.note({at: kept for path, kept in noted.items() if (at := project.place(path)) is not None})
    return Pulled(placed[0].path, tuple(placed), tuple(lost))


def _uid_of(path: Path) -> str:
    try:
        with Library() as library:
            return str(library.glance(path).Uid)
    except DocumentError:
        return ""


def _in_the_way(target: Path, base: Path) -> str:
    """Say why a file cannot be written to its place, although the disk accepts others; "" if it can."""
    if base not in Path(os.path.realpath(target)).parents:
        return f"its place leads out of {base}; nothing was written there"
    if target.is_dir():
        return "a folder has its place and name"
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
                if not rules.overwrite:
                    return done(PullState.EDITED)
                state, kept = PullState.OVERWRITTEN, rules.keep(str(target))
        # Through a link to where the file is: another assembly may use it there.
        with one.content.open("rb") as read, replacing(real, mode=0o644) as write:
            shutil.copyfileobj(read, write, 1 << 20)
    except OSError as error:
        raise DocumentError(str(target), f"cannot be written ({error.strerror or error})") from error
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
        "missing": [
            {"file": lost.position, "link": lost.path, "reason": lost.reason} for lost in pulled.lost
        ],
    }
