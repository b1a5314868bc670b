# SPDX-License-Identifier: LGPL-2.1-or-later
"""Fetch an item's file with all that it links to into a scratch folder.

The files themselves say what they link to. Which item a link means was written down by the commit; where it
was not (an older client, another server), the item's BOM and its file names say it.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Protocol

from silo.api.revisions import checksum_of, download_revision
from silo.api.transport import Cancel, stop_if
from silo.api.wire import BomLine, Item, Revision
from silo.bom.errors import DocumentError, InputError, NotFoundError, RouteMissingError
from silo.fcstd.linked import recorded_paths
from silo.fcstd.locate import refusal
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


@dataclass(frozen=True)
class Fetched:
    """A file of the tree, in the scratch folder.

    position
        relative to the folder of the top file, with ``/``; may begin with ``../``.
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


@dataclass
class _Fetch:
    client: PullApi
    folder: Path
    pinned: bool
    cancelled: Cancel | None
    progress: Progress
    most: int
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
            raise InputError(f"{item.part_number} has {which} in Silo")
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
        if len(self.files) >= self.most:
            raise InputError(f"more than {self.most} files are not fetched in one go")
        self.progress(posixpath.basename(position), len(self.files))
        content, sha256 = self.content(item.part_number, revision)
        earlier = frozenset(filter(None, map(checksum_of, self.revisions(item.part_number))))
        self.files[position] = Fetched(
            position, item.part_number, item.id, revision, content, sha256, earlier
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
    most: int = MOST_FILES,
) -> Iterator[Tree]:
    """The tree of an item, in a scratch folder that goes with the block.

    revision
        of the top; its linked files are then those of its time. None: the newest of all.

    Raises InputError where the item has no such file, and for more than ``most`` files.
    """
    item = client.get_item(part_number)
    with scratch_folder("silo-pull-") as scratch:
        yield _Fetch(client, Path(scratch), revision is not None, cancelled, progress, most).tree(
            item, revision
        )
