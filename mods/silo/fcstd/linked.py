# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which files a FreeCAD file links to: their recorded paths, and what is known of each.

A file that is sent to Silo takes this along, so that the whole tree can be fetched again with every file in
its place. All links count, also those of components that are not in the BOM.

FreeCAD has no way to mend a link whose target has moved but to make it anew, which loses placements and
joints. Here only the recorded path changes: object, sub-names and the rest of the file stay as they are.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import NamedTuple

from silo.bom.errors import DocumentError, InputError
from silo.bom.identity import document_identity, own_identity
from silo.fcstd.careful import Malformed, as_utf8, start_tags
from silo.fcstd.container import ContainerFile
from silo.fcstd.edit import (
    check_writable,
    document_xml,
    edited_xml,
    in_attribute,
    replace_file,
    replaced_entry,
)
from silo.fcstd.library import Library
from silo.fcstd.limits import Limits
from silo.fcstd.locate import Found, Locator
from silo.files import content_hash

TAGS = frozenset({"XLink", "XLinkSub"})
"""The elements of Document.xml that record another file (``src/App/PropertyLinks.cpp``)."""


@dataclass(frozen=True)
class Linked:
    """A linked file: its path as recorded, with ``/``, the identity in it and its SHA-256 (or "")."""

    path: str
    item: str = ""
    sha256: str = ""


@dataclass(frozen=True)
class Place:
    """Where a file is, relative to the folder that holds it and all that it links to; and those links."""

    path: str
    links: tuple[Linked, ...]

    def as_dicts(self) -> list[dict[str, str]]:
        """The links for JSON."""
        return [asdict(link) for link in self.links]


def recorded_paths(path: Path | str) -> tuple[str, ...]:
    """The paths of all files that a file links to, as recorded, each once. Raises DocumentError."""
    name = os.fspath(path)
    limits = Limits()
    with ContainerFile(name, limits) as container:
        _, text = document_xml(container, limits)
    try:
        tags = start_tags(as_utf8(text), limits.depth, TAGS)
        found = {attributes.get("file", "").replace("\\", "/"): None for _, attributes in tags}
    except Malformed as error:
        raise DocumentError(name, f"its Document.xml {error}") from error
    return tuple(path for path in found if path)


def place_of(content: Path | str, path: str) -> Place:
    """What is to be known of a file for fetching its tree again. Raises DocumentError.

    content
        the file to read; it may lie elsewhere than ``path``, where it belongs.
    """
    folder = os.path.dirname(path)
    locator = Locator()
    found: list[Linked] = []
    reached = [os.path.abspath(path)]
    with Library() as library:
        for recorded in recorded_paths(content):
            target = locator.find(recorded, (folder,))
            if not isinstance(target, Found):
                found.append(Linked(recorded))
                continue
            reached.append(os.path.normpath(os.path.join(folder, recorded)))
            found.append(Linked(recorded, identity_in(library, target.real), _hash(target.real)))
    return Place(_below(reached), tuple(found))


def identity_in(library: Library, path: str) -> str:
    """The identity of the item that a file belongs to; "" where it has none or several, or is unreadable."""
    try:
        document = library.glance(path)
        if found := document_identity(document):
            return found
        own = {identity for obj in document.Objects if (identity := own_identity(obj))}
    except DocumentError:
        return ""
    return own.pop() if len(own) == 1 else ""


def _hash(path: str) -> str:
    try:
        return content_hash(path)
    except OSError:
        return ""


def _below(paths: list[str]) -> str:
    """The first path, relative to the folder that holds all of them."""
    try:
        common = os.path.commonpath([os.path.dirname(path) for path in paths])
    except ValueError:  # on Windows: files on several drives
        common = os.path.dirname(paths[0])
    return os.path.relpath(paths[0], common).replace(os.sep, "/")


_FILE = re.compile(rb"""(\sfile\s*=\s*)("[^"]*"|'[^']*')""")


@dataclass(frozen=True)
class Relinked:
    """A file whose links were mended, or would be: its path, how many links, and to which objects."""

    path: str
    links: int
    objects: tuple[str, ...]


class _Record(NamedTuple):
    at: int
    name: str


def relink(
    paths: Iterable[Path | str],
    old: Path | str,
    new: Path | str,
    *,
    dry_run: bool = False,
    check: Callable[[str], None] = lambda _path: None,
) -> list[Relinked]:
    """Mend the links of these files that record ``old``, to lead to ``new``.

    Returns the files that hold such links. Raises InputError where ``new`` does not hold the objects that
    they want, DocumentError where a file cannot be read or written; both before anything is changed.

    check
        raises DocumentError for a file that must not be written now.
    """
    old, target = os.path.abspath(old), os.path.realpath(new)
    limits = Limits()
    found = [one for path in dict.fromkeys(map(os.path.realpath, paths)) if (one := _look(path, old, limits))]
    _check_target(found, old, target, limits)
    for one in found:
        check_writable(one.path)
        if not dry_run:
            check(one.path)
    if not dry_run:
        for one in found:
            _mend(one, old, target, limits)
    return found


def _look(path: str, old: str, limits: Limits) -> Relinked | None:
    with ContainerFile(path, limits) as container:
        _, text = document_xml(container, limits)
    try:
        records = list(_records(text, path, old, limits))
    except Malformed as error:
        raise DocumentError(path, f"its Document.xml {error}") from error
    if not records:
        return None
    return Relinked(path, len(records), tuple(sorted({record.name for record in records if record.name})))


def _records(text: bytes, path: str, file: str, limits: Limits) -> Iterator[_Record]:
    """The elements that record ``file``, as seen from the document at ``path``."""
    if as_utf8(text) is not text:
        raise Malformed("is not in UTF-8")
    folder, wanted = os.path.dirname(path), {file, os.path.realpath(file)}
    for at, attributes in start_tags(text, limits.depth, TAGS):
        recorded = attributes.get("file", "")
        if recorded and not wanted.isdisjoint(_meant(recorded, folder)):
            yield _Record(at, attributes.get("name", ""))


def _meant(recorded: str, folder: str) -> Iterator[str]:
    for spelling in {recorded, recorded.replace("\\", "/")}:
        yield os.path.normpath(os.path.join(folder, spelling))


def _check_target(found: list[Relinked], old: str, target: str, limits: Limits) -> None:
    with Library(limits=limits) as library:
        document = library.open(target)
        wanted = sorted({name for one in found for name in one.objects})
        lacking = [name for name in wanted if document.getObject(name) is None]
    if lacking:
        raise InputError(
            f"{target} does not hold what the links to {old} want: {', '.join(lacking[:8])}"
            + (f" and {len(lacking) - 8} more" if len(lacking) > 8 else "")
            + "; nothing was changed"
        )
    if any(one.path == target for one in found):
        raise InputError(f"{target} would link to itself; nothing was changed")


def _mend(one: Relinked, old: str, target: str, limits: Limits) -> None:
    recorded = os.path.relpath(target, os.path.dirname(one.path)).replace(os.sep, "/")

    def edit(text: bytes) -> bytes:
        parts, begin = [], 0
        for record in _records(text, one.path, old, limits):
            attribute = _FILE.search(text, record.at)
            if attribute is None:
                raise Malformed("has a link that cannot be edited")
            parts += [text[begin : attribute.end(1)], b'"%b"' % in_attribute(recorded).encode()]
            begin = attribute.end()
        return b"".join((*parts, text[begin:]))

    with ContainerFile(one.path, limits) as container:
        state = container.state
        content = replaced_entry(container, *edited_xml(container, edit, limits))
        _, text = document_xml(container, limits)
    before = sum(1 for _ in _records(text, one.path, target, limits))

    replace_file(one.path, state, content, lambda copy: read_back(one, copy, old, target, before))


def read_back(one: Relinked, copy: str, old: str, target: str, before: int) -> None:
    """Raise DocumentError unless the mended copy can be read and holds the links as they are to be.

    before
        how many links led to the target already.
    """
    limits = Limits()
    with Library(limits=limits) as library:
        library.open(copy)
    with ContainerFile(copy, limits) as container:
        _, text = document_xml(container, limits)
    left = sum(1 for _ in _records(text, copy, old, limits))
    now = sum(1 for _ in _records(text, copy, target, limits))
    if left or now != before + one.links:
        raise DocumentError(one.path, "the mended copy does not hold the new links; nothing was written")
