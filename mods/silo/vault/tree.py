# SPDX-License-Identifier: LGPL-2.1-or-later
"""Fetch an item's file with all that it links to into a scratch folder.

The files themselves say what they link to. The commit wrote down with which content; whose file that is now
is asked of the server at each pull. Where it was not written down (an older client, another server), the item
that the commit named says it, or the item's BOM and its file names.

Only models are fetched as such. A server that knows no kinds may keep a drawing as the newest revision of a
model: then the newest revision before it that is a model counts, and a remark says so.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from silo.api.files import DocumentId, download_revision
from silo.api.revisions import checksum_of
from silo.api.transport import Cancel, stop_if
from silo.api.wire import Item, KnownContent, LinkedFile, Release, Revision
from silo.bom.errors import DocumentError, InputError, NotFoundError, RouteMissingError
from silo.bom.message import message
from silo.fcstd.linked import recorded_paths
from silo.file_kind import is_model
from silo.locator import refusal
from silo.platform.part_file_name import part_file_stem
from silo.platform.whole_files import scratch_folder
from silo.vault.revisions import file_revisions

if TYPE_CHECKING:
    from silo.api.client import SiloClient


MOST_FILES = 20_000

_ABSOLUTE = re.compile(r"/|[A-Za-z]:|[A-Za-z][A-Za-z0-9+.-]+://")

Progress = Callable[[str, int], object]


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
    revisions
        all of its file, the newest first.
    """

    position: str
    part_number: str
    item: str
    revision: Revision
    content: Path
    sha256: str
    revisions: tuple[Revision, ...] = ()

    @property
    def earlier(self) -> frozenset[str]:
        """Return the hashes of its revisions: such a file may be replaced, it is in Silo."""
        return frozenset(filter(None, map(checksum_of, self.revisions)))


@dataclass(frozen=True)
class LostLink:
    """A link whose file could not be fetched: who links, to which path, and why."""

    position: str
    path: str
    reason: str


@dataclass(frozen=True)
class FileTree:
    """All files, the top first, and the links that lead nowhere.

    attachments
        of the items of the files, if they are wanted: ``position`` is that of the model beside which an
        attachment belongs.
    remarks
        what the user should know of the fetched files, in sentences.
    """

    files: tuple[Fetched, ...]
    lost: tuple[LostLink, ...] = ()
    attachments: tuple[Fetched, ...] = ()
    remarks: tuple[str, ...] = ()


@dataclass
class _Fetch:
    client: SiloClient
    folder: Path
    pinned: bool
    cancelled: Cancel | None
    progress: Progress
    most: int
    with_attachments: bool = False
    files: dict[str, Fetched] = field(default_factory=dict)
    lost: list[LostLink] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    release: Release | None = None
    _at: datetime | None = None
    _revisions: dict[str, list[Revision]] = field(default_factory=dict)
    _contents: dict[tuple[str, int], tuple[Path, str]] = field(default_factory=dict)
    _sought: set[str] = field(default_factory=set)
    _known: dict[str, list[KnownContent]] = field(default_factory=dict)
    _contents_unknown: bool = False

    def tree(self, item: Item, number: int | None) -> FileTree:
        holder = self.holder(item)
        revisions = self.revisions(holder)
        wanted = (
            revisions if number is None else [other for other in revisions if other.revision_number == number]
        )
        if self.release is not None:
            wanted = list(filter(None, [self.frozen(holder)]))
        if not wanted:
            which = (
                message("no file yet")
                if number is None
                else message("no file with the revision {number}", number=number)
            )
            if self.release is not None:
                which = message("no file in revision {label}", label=self.release.label)
            raise InputError(
                message("{part_number} has {which} in Silo", part_number=item.part_number, which=which)
            )
        top = self.model(holder, wanted[0], exact=number is not None)
        if top is None:
            raise InputError(
                message("{part_number} has no model in Silo, only other files", part_number=item.part_number)
            )
        self._at = top.created_at
        # The top lies where it lay in its project: a link that steps out of its folder and back leads to one
        # place.
        place = _place_in_project(
            top.file_path or top.file_name or f"{part_file_stem(item.part_number)}.FCStd"
        )
        left = [(place, holder, top)]
        while left:
            position, other_revision, revision = left.pop(0)
            left += self.fetch(position, other_revision, revision)
            if not left:
                left = self.unlinked()
        beside = attachments_beside(self) if self.with_attachments else ()
        return FileTree(tuple(self.files.values()), tuple(self.lost), tuple(beside), tuple(self.remarks))

    def model(self, holder: Holder, revision: Revision, *, exact: bool = False) -> Revision | None:
        """Return the revision if its file is a model, else the newest one before it that is; None for none.

        Its file is fetched to know it, unless the server says kinds. ``exact``: no other revision will do.
        """
        if revision.kind is not None:
            return revision
        number = revision.revision_number
        older = [other for other in self.revisions(holder) if other.revision_number <= number]
        for other in older:
            if is_model(self.content(holder.of, other)[0]):
                if other.revision_number != number:
                    self.remarks.append(
                        message(
                            "{id}: revision {number} is no model, so revision {revision_number} was taken",
                            id=holder.part_number or holder.id,
                            number=number,
                            revision_number=other.revision_number,
                        )
                    )
                return other
            if exact or self.release is not None:
                return None
        return None

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
        """Return the next file of the release to which no link led: it was uploaded by hand."""
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
                    LostLink(place, place, message("it is in the release, and not in Silo at this place"))
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
                path, other = (
                    text or message("another file") for text in (file.part_number, holder.part_number)
                )
                self.lost.append(
                    LostLink(
                        position,
                        position,
                        message("{path} and {other} want the same place", path=path, other=other),
                    )
                )
            return
        if len(self.files) >= self.most:
            raise InputError(message("more than {most} files are not fetched in one go", most=self.most))
        self.progress(posixpath.basename(position), len(self.files))
        taken = self.model(holder, revision)
        if taken is None:
            number = holder.part_number or position
            self.lost.append(
                LostLink(
                    position,
                    position,
                    message("{number} has no model in Silo, only other files", number=number),
                )
            )
            return
        revision = taken
        content, sha256 = self.content(holder.of, revision)
        revisions = tuple(self.revisions(holder))
        self.files[position] = Fetched(
            position, holder.part_number, holder.id, revision, content, sha256, revisions
        )
        try:
            recorded = recorded_paths(content)
        except DocumentError as error:
            self.lost.append(
                LostLink(position, "", message("its links cannot be read: {reason}", reason=error.reason))
            )
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

    def numbers_in(self, file: Fetched) -> list[str]:
        """Return the part numbers of the items in a file: of its own item, or of all that it holds."""
        if file.part_number:
            return [file.part_number]
        try:
            return [
                held.part_number for held in self.client.get_document(file.item).holds if held.part_number
            ]
        except (NotFoundError, RouteMissingError):
            return []

    def attached(self, numbers: Iterable[str]) -> Iterator[tuple[str, str, str, str, Revision]]:
        """Yield each attachment: part number, name, kind, document, revision."""
        if self.release is not None:
            for file in self.release.attachments:
                kept = Revision(revision_number=file.revision, file_checksum=file.sha256)
                yield file.part_number, file.file_name, file.kind, file.document, kept
            return
        for number in numbers:
            try:
                several = self.client.attachments(number)
            except RouteMissingError:
                self.remarks.append(message("this Silo lists no attachments, so none were fetched"))
                return
            for each in several:
                kept = Revision(revision_number=each.revision_number, file_checksum=each.file_checksum)
                yield number, each.file_name, each.kind, each.id, kept

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
        contents = self.contents(link.sha256 for link in links.values())
        others = _Children(self, holder.part_number)
        for path in recorded:
            link = links.get(path)
            target = posixpath.normpath(posixpath.join(posixpath.dirname(position), path))
            child = self.whose(link, target, contents) or self.means(path, link, items, others)
            why = _refused(path)
            if not why and child is None:
                why = message("no item in Silo is known for it: it was never committed")
                if link is not None and not link.sha256:
                    why = message("it was not there either when the file was committed")
            chosen = self.choose(child, link.sha256 if link else "", by_top=by_top) if child else None
            if not why and chosen is None:
                why = message(
                    "{part_number} has no file in Silo",
                    part_number=(child.part_number if child else "") or path,
                )
            if not why and child is not None and not self.proves(link, child, contents):
                name = posixpath.basename(path)
                why = message(
                    "{position} was committed with another {name}, which is not in Silo",
                    position=posixpath.basename(position),
                    name=name,
                )
                self.lost.append(LostLink(position, path, why))
                if chosen is None or (chosen.file_name or name).casefold() != name.casefold():
                    continue
            elif why:
                self.lost.append(LostLink(position, path, why))
                continue
            if child is not None and chosen is not None:
                yield target, child, chosen

    def contents(self, wanted: Iterable[str]) -> dict[str, list[KnownContent]] | None:
        """Find whose revisions have these contents; None if the server does not say, or if a release is
        fetched, whose files were frozen with what they link to.
        """
        asked = set(filter(None, wanted))
        if self.release is not None or self._contents_unknown:
            return None
        if new := asked - self._known.keys():
            try:
                found = self.client.get_contents(new)
            except RouteMissingError:
                self._contents_unknown = True
                return None
            self._known |= {sha256: [] for sha256 in new}
            for content in found:
                self._known[content.sha256].append(content)
        return {sha256: self._known[sha256] for sha256 in asked}

    def whose(
        self, link: LinkedFile | None, target: str, contents: Mapping[str, Sequence[KnownContent]] | None
    ) -> Holder | None:
        """Find whose file a link leads to by the content that it was committed with, which says it best: the
        file may have been registered, split or renamed since. None if that is not known.

        Several documents may have one content: that which the commit named, or which lay at this place, then.
        """
        known = contents.get(link.sha256, ()) if contents is not None and link is not None else ()
        if link is None or not known:
            return None
        named = {name.lower() for name in (link.document, link.item) if name}

        def fits(content: KnownContent) -> tuple[bool, bool]:
            return (content.document.lower() in named, content.file_path == target)

        best = max(known, key=fits)
        document = best.document if self.pinned else best.now
        if best.part_number and document == best.now:
            return Holder(best.part_number, best.now)
        return Holder(DocumentId(document), document)

    def proves(
        self,
        link: LinkedFile | None,
        child: Holder,
        contents: Mapping[str, Sequence[KnownContent]] | None,
    ) -> bool:
        """Return False if the linking file was committed with a content that no revision in Silo has."""
        if link is None or not link.sha256 or self.release is not None:
            return True  # an older revision, or a link to nothing: nothing is proven
        if contents is not None:
            return bool(contents.get(link.sha256))
        checksums = {checksum_of(revision) for revision in self.revisions(child)} - {""}
        return not checksums or link.sha256 in checksums

    def means(
        self, path: str, link: LinkedFile | None, items: Mapping[str, Item], others: _Children
    ) -> Holder | None:
        """Find the item or document to which a link leads, by what the commit named."""
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


def attachments_beside(fetch: _Fetch) -> Iterator[Fetched]:
    """Fetch the attachments of the items whose models were fetched, or those that a release holds."""
    places: dict[str, str] = {}
    for position, file in fetch.files.items():
        for number in fetch.numbers_in(file):
            places.setdefault(number, position)
    top = next(iter(fetch.files))
    for number, name, kind, document, revision in fetch.attached(places):
        stop_if(fetch.cancelled)
        fetch.progress(name, len(fetch.files))
        position = places.get(number, top)
        try:
            content, sha256 = fetch.content(DocumentId(document), revision)
            earlier = fetch.client.revisions(DocumentId(document))
        except (NotFoundError, RouteMissingError) as error:
            fetch.lost.append(
                LostLink(
                    position,
                    name,
                    message(
                        "the {kind} of {number} cannot be fetched: {error}",
                        kind=kind,
                        number=number,
                        error=error,
                    ),
                )
            )
            continue
        kept = revision.model_copy(update={"file_name": name, "kind": kind})
        yield Fetched(position, number, document, kept, content, sha256, tuple(earlier))


def _place_in_project(path: str) -> str:
    """Return the path with a safe name; without its folder if that is not inside a project."""
    folder, name = posixpath.split(path.replace("\\", "/"))
    outside = any(":" in part or part in ("", ".", "..") or refusal(part) for part in folder.split("/"))
    return _safe_name(name) if outside else posixpath.join(folder, _safe_name(name))


def _refused(path: str) -> str:
    """Say why a recorded path is not followed; "" if it is."""
    if _ABSOLUTE.match(path):
        return message("it is an absolute path, which has no place in another folder")
    if (refused := refusal(path)) is not None:
        return refused.detail or message("its path cannot be one")
    if posixpath.splitext(path)[1].lower() != ".fcstd":
        return message("it is not a FreeCAD file")
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
    attachments: bool = False,
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
        how = (number is not None, cancelled, progress, most, attachments)
        fetch = _Fetch(client, Path(scratch), *how, release=release)
        yield fetch.tree(item, number)
