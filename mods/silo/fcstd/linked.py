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
from silo.bom.message import message
from silo.bom.walk.links import file_item
from silo.checksums import content_hash
from silo.fcstd.container import ContainerFile, document_xml
from silo.fcstd.expat_reader import Malformed, as_utf8, start_tags
from silo.fcstd.library import Library
from silo.fcstd.limits import Limits
from silo.locator import FoundFile, Locator
from silo.project_folder import Project

TAGS = frozenset({"XLink", "XLinkSub"})
"""The elements of Document.xml that record another file (``src/App/PropertyLinks.cpp``)."""


@dataclass(frozen=True)
class Linked:
    """A linked file: its path as recorded, with ``/``, the identity in it and its SHA-256 (or ""), and the
    UUID of its document, for a file that is no single item's."""

    path: str
    item: str = ""
    sha256: str = ""
    document: str = ""


@dataclass(frozen=True)
class ProjectPlace:
    """Where a file is, relative to its project or to the folder that holds it and all that it links to; and
    those links."""

    path: str
    links: tuple[Linked, ...]

    def as_dicts(self) -> list[dict[str, str]]:
        """Return the links for JSON."""
        return [asdict(link) for link in self.links]


def recorded_paths(path: Path | str) -> tuple[str, ...]:
    """Read the paths of all files that a file links to, as recorded, each once. Raises DocumentError."""
    name = os.fspath(path)
    limits = Limits()
    with ContainerFile(name, limits) as container:
        _, text = document_xml(container, limits)
    try:
        tags = start_tags(as_utf8(text), limits.depth, TAGS)
        paths = {attributes.get("file", "").replace("\\", "/"): None for _, attributes in tags}
    except Malformed as error:
        raise DocumentError(name, message("its Document.xml {error}", error=error)) from error
    return tuple(path for path in paths if path)


def place_of(content: Path | str, path: str) -> ProjectPlace:
    """Find what must be recorded of a file to fetch its tree again. Raises DocumentError.

    content
        the file to read; it may be elsewhere than at its place ``path``.
    """
    folder = os.path.dirname(path)
    locator = Locator()
    places: list[Linked] = []
    project = Project.of(path)
    records = project.records() if project is not None else {}

    def place(of: str) -> str:
        return (project.place(of) if project is not None else None) or ""

    def own_document(of: str, item: str) -> str:
        """Return the document of a linked file that is not the item's, such as that of a copy."""
        record = records.get(place(of))
        return record.document if record is not None and not record.item and not record.is_of(item) else ""

    reached = [os.path.abspath(path)]
    with Library() as library:
        for recorded in recorded_paths(content):
            target = locator.find(recorded, (folder,))
            if not isinstance(target, FoundFile):
                places.append(Linked(recorded))
                continue
            reached.append(os.path.normpath(os.path.join(folder, recorded)))
            item = identity_in(library, target.real)
            document = own_document(target.real, item)
            places.append(Linked(recorded, item, _hash(target.real), document))
    return ProjectPlace(place(path) or _below(reached), tuple(places))


def identity_in(library: Library, path: str) -> str:
    """Read the identity of the item to which a file belongs; "" if it has none or several, or is
    unreadable.
    """
    try:
        return file_item(library.glance(path)) or ""
    except DocumentError:
        return ""


def _hash(path: str) -> str:
    try:
        return content_hash(path)
    except OSError:
        return ""


def _below(paths: list[str]) -> str:
    """Return the first path, relative to the folder that holds all paths."""
    try:
        common = os.path.commonpath([os.path.dirname(path) for path in paths])
    except ValueError:  # on Windows: files on several drives
        common = os.path.dirname(paths[0])
    return os.path.relpath(paths[0], common).replace(os.sep, "/")
