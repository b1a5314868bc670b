# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which files a FreeCAD file links to: their recorded paths, and what is known of each.

A file that is sent to Silo takes this along, so that the whole tree can be fetched again with every file in
its place. All links count, also those of components that are not in the BOM.
"""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass
from pathlib import Path

from silo.bom.errors import DocumentError
from silo.bom.identity import document_identity, own_identity
from silo.fcstd.careful import Malformed, as_utf8, start_tags
from silo.fcstd.container import ContainerFile
from silo.fcstd.edit import document_xml
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
