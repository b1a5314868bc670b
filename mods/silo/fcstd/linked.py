# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which files a FreeCAD file links to: their recorded paths, and what is known of each.

A file that is sent to Silo takes this along, so that the whole tree can be fetched again with every file in
its place. All links count, also those of components that are not in the BOM.

FreeCAD has no way to mend a link whose target has moved but to make it again, which loses placements and
joints. Here only the recorded path changes: object, sub-names and the rest of the file stay as they are.

Which file was meant, where one is missing: files move, and are renamed.

The rules of this module, the surest first; each names a file only where exactly one fits:

* it carries the Silo identity of the missing component, where the caller knows that (from the last sync);
* it has the same name (but for case and normalisation) in another folder.

In every case it must hold all the objects that the links want.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

from silo.bom.errors import DocumentError, InputError, listed
from silo.bom.findings import Finding, FindingCode
from silo.bom.links import file_item
from silo.bom.model import Extraction, identity_of, walk_entries
from silo.fcstd.container import ContainerFile, Limits
from silo.fcstd.document import FcstdDocument
from silo.fcstd.library import Library
from silo.fcstd.stamp import (
    check_writable,
    document_xml,
    edited_xml,
    in_attribute,
    replace_file,
    replaced_entry,
)
from silo.fcstd.xmltext import Malformed, as_utf8, start_tags
from silo.files import FoundFile, Locator, Project, content_hash
from silo.platform import folded

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
        raise DocumentError(name, f"its Document.xml {error}") from error
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
    files = project.files() if project is not None else {}

    def place(of: str) -> str:
        return (project.place(of) if project is not None else None) or ""

    def kept(of: str) -> str:
        file = files.get(place(of))
        return file.document if file is not None else ""

    reached = [os.path.abspath(path)]
    with Library() as library:
        for recorded in recorded_paths(content):
            target = locator.find(recorded, (folder,))
            if not isinstance(target, FoundFile):
                places.append(Linked(recorded))
                continue
            reached.append(os.path.normpath(os.path.join(folder, recorded)))
            item = identity_in(library, target.real)
            places.append(Linked(recorded, item, _hash(target.real), "" if item else kept(target.real)))
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

    Returns the files that hold such links. Raises InputError if ``new`` does not hold the objects that they
    want, DocumentError if a file cannot be read or written; both before anything is changed.

    check
        raises DocumentError for a file that must not be written now.
    """
    old, target = os.path.abspath(old), os.path.realpath(new)
    limits = Limits()
    relinked = [
        link for path in dict.fromkeys(map(os.path.realpath, paths)) if (link := _look(path, old, limits))
    ]
    _check_target(relinked, old, target, limits)
    for link in relinked:
        check_writable(link.path)
        if not dry_run:
            check(link.path)
    if not dry_run:
        for link in relinked:
            _mend(link, old, target, limits)
    return relinked


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
    """Yield the elements that record a link to ``file``, as seen from the document at ``path``."""
    if as_utf8(text) is not text:
        raise Malformed("is not in UTF-8")
    folder, wanted = os.path.dirname(path), {file, os.path.realpath(file)}
    for at, attributes in start_tags(text, limits.depth, TAGS):
        recorded = attributes.get("file", "")
        if recorded and not wanted.isdisjoint(_spellings(recorded, folder)):
            yield _Record(at, attributes.get("name", ""))


def _spellings(recorded: str, folder: str) -> Iterator[str]:
    for spelling in {recorded, recorded.replace("\\", "/")}:
        yield os.path.normpath(os.path.join(folder, spelling))


def _check_target(relinked_files: list[Relinked], old: str, target: str, limits: Limits) -> None:
    with Library(limits=limits) as library:
        document = library.open(target)
        wanted = sorted({name for file in relinked_files for name in file.objects})
        lacking = [name for name in wanted if document.getObject(name) is None]
    if lacking:
        raise InputError(
            f"{target} does not hold what the links to {old} want: {listed(lacking)}; nothing was changed"
        )
    if any(file.path == target for file in relinked_files):
        raise InputError(f"{target} would link to itself; nothing was changed")


def _mend(relinked: Relinked, old: str, target: str, limits: Limits) -> None:
    recorded = os.path.relpath(target, os.path.dirname(relinked.path)).replace(os.sep, "/")

    def edit(text: bytes) -> bytes:
        parts, begin = [], 0
        for record in _records(text, relinked.path, old, limits):
            attribute = _FILE.search(text, record.at)
            if attribute is None:
                raise Malformed("has a link that cannot be edited")
            parts += [text[begin : attribute.end(1)], b'"%b"' % in_attribute(recorded).encode()]
            begin = attribute.end()
        return b"".join((*parts, text[begin:]))

    with ContainerFile(relinked.path, limits) as container:
        state = container.state
        content = replaced_entry(container, *edited_xml(container, edit, limits))
        _, text = document_xml(container, limits)
    before = sum(1 for _ in _records(text, relinked.path, target, limits))

    replace_file(relinked.path, state, content, lambda copy: read_back(relinked, copy, old, target, before))


def read_back(relinked: Relinked, copy: str, old: str, target: str, before: int) -> None:
    """Raise DocumentError unless the mended copy can be read and its links are as they should be.

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
    if left or now != before + relinked.links:
        raise DocumentError(relinked.path, "the mended copy does not hold the new links; nothing was written")


# A project has some hundreds of files; a home folder taken for one would have many more.
_MOST_FILES = 2000
_MOST_FOLDERS = 5000
_DID_YOU_MEAN = " Did you mean"
_CODES = (FindingCode.MISSING_FILE, FindingCode.MISSING_OBJECT)

# (file, object) → the Silo UUID that it had in the last sync.
Identities = Mapping[tuple[str, str], str]


@dataclass
class _Lost:
    file: str
    objects: set[str] = field(default_factory=set)


def with_suggestions(
    extraction: Extraction, identities: Identities | None = None, files: Iterable[str] | None = None
) -> Extraction:
    """Add to the findings of missing files the file that was probably meant.

    Reads the project's files, or those of ``files``; costs nothing if no file is missing.
    """
    lost = _lost(extraction)
    if not lost or (files is not None and not (files := list(files))):
        return extraction
    with Library() as library:
        files = _project_files(extraction) if files is None else files
        project = _Project(library, list(files), identities or {})
        meant = {file: path for file, lost_link in lost.items() if (path := project.meant(lost_link))}
    findings = tuple(_with_suggestion(finding, meant, extraction) for finding in extraction.findings)
    return replace(extraction, findings=findings)


def _with_suggestion(
    finding: Finding, meant: Mapping[str, tuple[str, str]], extraction: Extraction
) -> Finding:
    if finding.code not in _CODES or finding.file not in meant:
        return finding
    file, why = meant[finding.file]
    holder = finding.where[0].doc_path if finding.where else extraction.assembly.doc_path
    top = os.path.basename(holder)
    message = (
        f"{finding.message.partition(_DID_YOU_MEAN)[0]}{_DID_YOU_MEAN} {file} ({why})? "
        f"`silo-mod relink {top} --from {finding.file} --to {file}` mends the links."
    )
    return replace(finding, message=message, did_you_mean=file)


def _lost(extraction: Extraction) -> dict[str, _Lost]:
    files = {finding.file for finding in extraction.findings if finding.code in _CODES and finding.file}
    lost: dict[str, _Lost] = {}
    for entry in walk_entries(extraction.entries):
        if entry.missing and entry.doc_path in files:
            lost.setdefault(entry.doc_path, _Lost(entry.doc_path)).objects.add(entry.object_name)
    return lost


def _project_files(extraction: Extraction) -> Iterator[str]:
    """Yield the FreeCAD files in the folder that holds all files of the tree."""
    paths = [entry.doc_path for entry in walk_entries((extraction.assembly, *extraction.entries))]
    folders = [os.path.dirname(path) for path in paths if path]
    top = os.path.dirname(extraction.assembly.doc_path)
    try:
        root = os.path.commonpath(folders)
    except ValueError:  # another Windows drive
        root = top
    # The root of the disk, or the home folder, is no project.
    if root in (os.path.abspath(os.sep), os.path.expanduser("~")) or len(Path(root).parts) < 3:
        root = top
    left, folders_left = _MOST_FILES, _MOST_FOLDERS
    for folder, inner, names in os.walk(root):
        inner[:] = sorted(name for name in inner if not name.startswith("."))
        folders_left -= 1
        for name in sorted(names):
            if name.lower().endswith(".fcstd") and not name.startswith(".") and left > 0:
                left -= 1
                yield os.path.join(folder, name)
        if left <= 0 or folders_left <= 0:
            return


class _Project:
    """The files that may have been meant."""

    def __init__(self, library: Library, files: Sequence[str], identities: Identities) -> None:
        self._library, self._files, self._identities = library, files, identities
        self._opened: dict[str, FcstdDocument | None] = {}

    def meant(self, lost: _Lost) -> tuple[str, str] | None:
        """Find the file that was meant, and why; None unless exactly one file fits."""
        holding = [path for path in self._files if path != lost.file and self._holds(path, lost.objects)]
        rules: list[tuple[str, list[str]]] = [
            ("it carries the Silo identity", [path for path in holding if self._identified(path, lost)]),
            ("a file of this name", [path for path in holding if _same_name(path, lost.file)]),
        ]
        for why, fitting in rules:
            # Copies of one file share its identity; their names may still distinguish them.
            exact = [path for path in fitting if _same_name(path, lost.file)] or fitting
            if len(exact) == 1:
                return exact[0], why
        return None

    def _document(self, path: str) -> FcstdDocument | None:
        if path not in self._opened:
            try:
                self._opened[path] = self._library.open(path)
            except DocumentError:
                self._opened[path] = None
        return self._opened[path]

    def _holds(self, path: str, objects: Iterable[str]) -> bool:
        document = self._document(path)
        return document is not None and all(document.getObject(name) is not None for name in objects if name)

    def _identified(self, path: str, lost: _Lost) -> bool:
        document = self._document(path)
        wanted = {name: self._identities.get((lost.file, name)) for name in lost.objects}
        if document is None or not all(wanted.values()):
            return False
        return all(
            (identity_of(document.getObject(name)) or "").lower() == (uuid or "").lower()
            for name, uuid in wanted.items()
        )


def _same_name(name: str, other: str) -> bool:
    return folded(os.path.basename(name)) == folded(os.path.basename(other.replace("\\", "/")))
