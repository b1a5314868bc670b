# SPDX-License-Identifier: LGPL-2.1-or-later
"""A reading session: documents opened when a link is followed, each file once, whatever it is called."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from silo.bom.errors import InputError
from silo.bom.findings import FindingCode
from silo.bom.message import message
from silo.bom.walk.document import LinkProblem
from silo.fcstd.container import FileStat
from silo.fcstd.contents import FileContents
from silo.fcstd.document import FcstdDocument
from silo.fcstd.errors import FcstdError
from silo.fcstd.limits import Limits
from silo.fcstd.objects import FcstdObject
from silo.fcstd.values import Ref
from silo.locator import FoundFile, Locator, NotFound


class Library:
    """Shares opened documents: one file is one document object.

    root
        no file outside this folder is read; links that leave it have the problem OUTSIDE_ROOT. None: no such
        limit, for projects use ``../`` freely.
    contents
        what was read before, by other sessions.
    facts
        path → what :func:`~silo.fcstd.facts.facts_of` gave for a file as it is now; "" where none is known.
    notes
        what was taken in another way than recorded (a file name in other case), in plain words.
    documents, lookups
        all that this session has read, and each path of a link that it followed with where that led: what was
        known from it depends on these and on nothing else.

    No file stays open; closing (or leaving the ``with`` block) only gives memory back.
    """

    def __init__(
        self,
        root: Path | str | None = None,
        limits: Limits | None = None,
        contents: FileContents | None = None,
        locator: Locator | None = None,
        facts: Callable[[str], str] = lambda _path: "",
    ) -> None:
        self.limits = limits or Limits()
        self.notes: list[str] = []
        self.documents: dict[str, FcstdDocument | FcstdError] = {}
        self.lookups: dict[tuple[tuple[str, ...], str], FoundFile | NotFound] = {}
        self._locator = locator or Locator(None if root is None else os.fspath(root))
        self._contents = contents or FileContents(self.limits)
        self._facts = facts

    def __enter__(self) -> Library:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Forget all documents."""
        self.documents.clear()
        self._contents = FileContents(self.limits)

    def dissolve(self) -> None:
        """Forget all documents and take them apart; their objects must not be used any more.

        Documents and their objects refer to each other. A program with thousands of sessions need not wait
        until Python finds such rings.
        """
        for document in self.documents.values():
            if isinstance(document, FcstdDocument):
                document.__dict__.clear()
        self.documents.clear()

    def open(self, path: Path | str) -> FcstdDocument:
        """Open the document in a file, read it to its end and check it. Raises DocumentError."""
        opened = os.path.abspath(path)
        real = self._locator.real(opened)
        if opened != real:  # a symlink may lead elsewhere tomorrow
            self.lookups[(os.path.dirname(opened),), os.path.basename(opened)] = FoundFile(opened, real)
        if not self._locator.inside(real):
            raise FcstdError(
                real,
                message("it lies outside {root}, the folder that may be read", root=self._locator.root),
                FindingCode.OUTSIDE_ROOT,
            )
        document = self._document(FoundFile(opened, real))
        document.complete()
        return document

    def glance(self, path: Path | str) -> FcstdDocument:
        """Open the document in a file, and read only what is asked for. Raises DocumentError."""
        opened = os.path.abspath(path)
        return self._document(FoundFile(opened, self._locator.real(opened)))

    def follow(self, owner: FcstdDocument, ref: Ref) -> FcstdObject | LinkProblem:
        """Return the object to which a link in ``owner`` leads, or a LinkProblem. Never raises for a broken
        link.
        """
        location = self._locator.find(ref.file, owner.folders)
        self.lookups[owner.folders, ref.file] = location
        if isinstance(location, NotFound):
            return LinkProblem(location.code, ref.file, ref.name, location.detail)
        try:
            document = self._document(location)
            target = document.getObject(ref.name)
            if target is None:
                return LinkProblem(FindingCode.MISSING_OBJECT, ref.file, ref.name)
            document.check(target)
        except FcstdError as error:
            return LinkProblem(error.finding, ref.file, ref.name, error.reason)
        if location.respelt:
            self._note_respelt(owner, ref, location)
        return target

    def imported(self, owner: FcstdDocument, file: str, part: str = "") -> object:
        """Find the part or assembly in a file that A2plus imported into ``owner``; a LinkProblem if there is
        none.

        part
            the label of the part, if the import names one of several.

        Like A2plus, it also looks for the file in the folder of the owner, if the file is no longer in its
        place.
        """
        from silo.bom.walk.imported import named_part
        from silo.bom.walk.roots import choose_assembly

        for recorded in dict.fromkeys((file, os.path.basename(file))):
            location = self.lookups[owner.folders, recorded] = self._locator.find(recorded, owner.folders)
            if isinstance(location, FoundFile):
                break
        if isinstance(location, NotFound):
            return LinkProblem(location.code, file, "", location.detail)
        try:
            document = self._document(location)
            document.complete()
            named = named_part(document, part)
            return choose_assembly(document) if named is None else named
        except FcstdError as error:
            return LinkProblem(error.finding, file, "", error.reason)
        except InputError as error:
            return LinkProblem(FindingCode.BROKEN_LINK, file, "", str(error))

    def _document(self, location: FoundFile) -> FcstdDocument:
        document = self.documents.get(location.real)
        if document is None:
            document = self.documents[location.real] = self._load(location)
        if isinstance(document, FcstdError):
            raise FcstdError(document.path, document.reason, document.finding, document.state)
        return document

    def _load(self, location: FoundFile) -> FcstdDocument | FcstdError:
        if len(self.documents) >= self.limits.documents:
            return FcstdError(
                location.real,
                message(
                    "more than {documents} files are not read in one go", documents=self.limits.documents
                ),
            )
        if facts := self._facts(location.real):
            return FcstdDocument(self, location, self._contents.remembered(location.real, facts))
        try:
            try:
                return FcstdDocument(self, location, self._contents.read(location.real))
            except FcstdError as error:
                # FreeCAD may just be writing it; if not, the second reading gives the same as the first.
                if error.state is None or error.state == FileStat.now(location.real):
                    raise
                return FcstdDocument(self, location, self._contents.read(location.real))
        except FcstdError as error:
            return error

    def _note_respelt(self, owner: FcstdDocument, ref: Ref, location: FoundFile) -> None:
        name = os.path.basename(location.real)
        differs = message("which differs in case or Unicode form only")
        note = message(
            "{filename} records {file}; taken was {name}, {differs}",
            filename=owner.FileName,
            file=ref.file,
            name=name,
            differs=differs,
        )
        if note not in self.notes:
            self.notes.append(note)


def open_document(
    path: Path | str, *, root: Path | str | None = None, limits: Limits | None = None
) -> FcstdDocument:
    """Open an FCStd file in a session of its own: the document, and on demand what it links to.

    Raises DocumentError if this very file cannot be read; a broken link is noted on its object.

    >>> from silo.bom.walk.links import extract  # doctest: +SKIP
    >>> extract(open_document("gearbox.FCStd").getObject("Assembly"))  # doctest: +SKIP
    """
    return Library(root, limits).open(path)
