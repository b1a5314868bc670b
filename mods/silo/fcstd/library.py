# SPDX-License-Identifier: LGPL-2.1-or-later
"""A reading session: documents opened when a link is followed, each file once, whatever it is called."""

from __future__ import annotations

import os
from pathlib import Path

from silo.bom.document import LinkProblem
from silo.bom.findings import FindingCode
from silo.fcstd.container import DOCUMENT_XML, ContainerFile, FileState
from silo.fcstd.document import FcstdDocument
from silo.fcstd.limits import Limits
from silo.fcstd.locate import Found, Locator, NotFound
from silo.fcstd.objects import FcstdObject
from silo.fcstd.problem import FcstdError
from silo.fcstd.values import Ref
from silo.fcstd.xmltext import Shared, XmlText


class Library:
    """Shares opened documents: one file is one document object.

    root
        no file outside this folder is read; links that leave it have the problem OUTSIDE_ROOT. None: no such
        limit, for projects use ``../`` freely.
    notes
        what was taken in another way than recorded (a file name in other case), in plain words.

    No file stays open; closing (or leaving the ``with`` block) only gives memory back.
    """

    def __init__(self, root: Path | str | None = None, limits: Limits | None = None) -> None:
        self.limits = limits or Limits()
        self.notes: list[str] = []
        self._locator = Locator(None if root is None else os.fspath(root))
        self._shared = Shared(self.limits.resident)
        self._documents: dict[str, FcstdDocument | FcstdError] = {}

    def __enter__(self) -> Library:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Forget all documents."""
        self._documents.clear()
        self._shared = Shared(self.limits.resident)

    def open(self, path: Path | str) -> FcstdDocument:
        """The document in a file, read to its end and checked. Raises DocumentError."""
        opened = os.path.abspath(path)
        real = self._locator.real(opened)
        if not self._locator.inside(real):
            raise FcstdError(
                real,
                f"it lies outside {self._locator.root}, the folder that may be read",
                FindingCode.OUTSIDE_ROOT,
            )
        document = self._document(Found(opened, real))
        document.complete()
        return document

    def glance(self, path: Path | str) -> FcstdDocument:
        """The document in a file, of which only as much is read as is asked for. Raises DocumentError."""
        opened = os.path.abspath(path)
        return self._document(Found(opened, self._locator.real(opened)))

    def follow(self, owner: FcstdDocument, ref: Ref) -> FcstdObject | LinkProblem:
        """The object that a link in ``owner`` means, or why there is none. Never raises for a broken link."""
        found = self._locator.find(ref.file, owner.folders)
        if isinstance(found, NotFound):
            return LinkProblem(found.code, ref.file, ref.name, found.detail)
        try:
            document = self._document(found)
            target = document.getObject(ref.name)
            if target is None:
                return LinkProblem(FindingCode.MISSING_OBJECT, ref.file, ref.name)
            document.check(target)
        except FcstdError as error:
            return LinkProblem(error.finding, ref.file, ref.name, error.reason)
        if found.respelt:
            self._note_respelt(owner, ref, found)
        return target

    def _document(self, found: Found) -> FcstdDocument:
        known = self._documents.get(found.real)
        if known is None:
            known = self._documents[found.real] = self._load(found)
        if isinstance(known, FcstdError):
            raise FcstdError(known.path, known.reason, known.finding)
        return known

    def _load(self, found: Found) -> FcstdDocument | FcstdError:
        if len(self._documents) >= self.limits.documents:
            return FcstdError(found.real, f"more than {self.limits.documents} files are not read in one go")
        try:
            try:
                return self._read(found)
            except FcstdError as error:
                # FreeCAD may just be writing it; if nobody is, a second look is the same as the first.
                if error.state is None or error.state == _state(found.real):
                    raise
                return self._read(found)
        except FcstdError as error:
            return error

    def _read(self, found: Found) -> FcstdDocument:
        with ContainerFile(found.real, self.limits) as container:
            entry = container.entry(DOCUMENT_XML)
            if entry is None:
                raise FcstdError(found.real, "it is no FreeCAD document (there is no Document.xml in it)")
            packed = container.packed(entry, self.limits.packed)
            if container.changed():
                raise FcstdError(found.real, "it is being written just now; try again", state=container.state)
            xml = XmlText(found.real, entry, packed, self.limits, self._shared)
            return FcstdDocument(self, found, xml, container.directory, container.state)

    def _note_respelt(self, owner: FcstdDocument, ref: Ref, found: Found) -> None:
        name = os.path.basename(found.real)
        note = f"{owner.FileName} records {ref.file}; taken was {name}, which differs in case only"
        if note not in self.notes:
            self.notes.append(note)


def _state(path: str) -> FileState | None:
    try:
        return FileState.of(os.stat(path))
    except OSError:
        return None


def open_document(
    path: Path | str, *, root: Path | str | None = None, limits: Limits | None = None
) -> FcstdDocument:
    """Open an FCStd file in a session of its own: the document, and on demand what it links to.

    Raises DocumentError where this very file cannot be read; broken links show on the link objects.

    >>> from silo.bom.links import extract  # doctest: +SKIP
    >>> extract(open_document("gearbox.FCStd").getObject("Assembly"))  # doctest: +SKIP
    """
    return Library(root, limits).open(path)
