# SPDX-License-Identifier: LGPL-2.1-or-later
"""A reading session: documents opened when a link is followed, each file once, whatever it is called.

What a file was found to say of itself, in place of the file: enough for most links to it.

A vault has tens of thousands of these in memory at one time, so each is made of few objects.
"""

from __future__ import annotations

import json
import os
import time
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

from silo.bom.document import LinkProblem
from silo.bom.errors import InputError
from silo.bom.findings import FindingCode
from silo.bom.objects import Kind
from silo.fcstd.container import DOCUMENT_XML, ContainerFile, Directory, FcstdError, FileState, Limits
from silo.fcstd.document import FcstdDocument, FcstdObject
from silo.fcstd.properties import ABSENT, Properties, Ref, Text, table_of
from silo.fcstd.xmltext import SharedTexts, XmlText
from silo.files import FoundFile, Locator, NotFound

# Which objects of a file its facts describe: what may be a component, but no features of a body.
_TARGETS = frozenset(Kind) - {Kind.NOTHING, Kind.FOLDER, Kind.LINK, Kind.ASSEMBLY_LINK, Kind.ELEMENT}
_TARGETS_AT_MOST = 24
# What is mostly text. The values are kept, as they are asked for by each assembly that uses the file.
_TEXTS = frozenset({"Label", "Meta", "SiloItemId", "SiloUUID"})
# The content of a target is only needed if a link names an object inside it.
_NOT_OF_TARGETS = frozenset({"ElementList", "Group"})
_ENCODER = json.JSONEncoder(separators=(",", ":"))


class FileFacts(NamedTuple):
    """The facts of a file. Goes through JSON.

    document
        of the document's own properties: all names, what is text, and the kept pieces of others.
    objects
        name → (type, and the same three), of those that links most likely mean.
    """

    digest: str
    state: FileState
    changed_ns: int
    read_ns: int
    document: tuple[Sequence[str], Mapping[str, Text], Mapping[str, str]]
    objects: Mapping[str, tuple[str, Sequence[str], Mapping[str, Text], Mapping[str, str]]]


def facts_of(document: FcstdDocument) -> str:
    """Write the facts of a document that was read to its end as JSON; "" if that is not possible."""
    content = document.content
    if isinstance(content, Remembered) or content.xml.is_careful:
        return ""
    try:
        survey = document.survey
        targets = survey.of(_TARGETS, survey.grouped({Kind.LOCAL}))[:_TARGETS_AT_MOST]
        objects = {obj.Name: (obj.TypeId, *_to_keep(obj.properties)) for obj, _ in targets}
        own = _to_keep(document.properties)
        facts = FileFacts(content.digest, content.state, content.changed_ns, content.read_ns, own, objects)
    except (FcstdError, UnicodeDecodeError):  # who asks for it gets the error
        return ""
    return _ENCODER.encode(facts)


def _to_keep(table: Properties) -> tuple[tuple[str, ...], dict[str, Text], dict[str, str]]:
    texts, pieces = dict[str, Text](), dict[str, str]()
    for name, piece in table.kept.items():
        if name in _NOT_OF_TARGETS:
            continue
        value = table.quick_value(piece) if name in _TEXTS else None
        if isinstance(value, (str, dict)):
            texts[name] = value
        else:
            pieces[name] = piece.decode()
    return table.names, texts, pieces


class Remembered:
    """The content of a file of which facts are known. It is read where they say too little.

    Several sessions may share it. Raises FcstdError where the file that is read is another one by now.

    document
        the table of the document's own properties.
    sound
        names of the objects of which all that a walker asks can be read.
    """

    __slots__ = (
        *("_contents", "_objects", "_path", "_tables", "changed_ns", "digest", "document", "read_ns"),
        *("sound", "state"),
    )

    def __init__(self, path: str, facts: str, contents: FileContents) -> None:
        self._path, self._contents = path, contents
        file_facts = FileFacts(*json.loads(facts))
        self.digest, self.changed_ns, self.read_ns = (
            file_facts.digest,
            file_facts.changed_ns,
            file_facts.read_ns,
        )
        self.state = FileState(*file_facts.state)
        self._objects = dict(file_facts.objects)
        self._tables: dict[str, _DigestTable] = {}
        self.document: Properties = _DigestTable(self, "", "", *file_facts.document)
        self.sound: set[str] = set()

    @property
    def known(self) -> Remembered:
        """Return the facts that spare reading the file."""
        return self

    def type_of(self, name: str) -> str | None:
        """Return the type of an object; None if nothing is known of it."""
        table = self.table(name)
        return None if table is None else table.kind

    def table(self, name: str) -> _DigestTable | None:
        """Return the table of an object, made once; None if nothing is known of it."""
        table = self._tables.get(name)
        if table is None and (rows_of_object := self._objects.pop(name, None)) is not None:
            table = self._tables[name] = _DigestTable(self, name, *rows_of_object)
        return table

    def _content(self) -> Content:
        content = self._contents.read(self._path)
        if content.digest != self.digest:
            raise FcstdError(self._path, "it is being written just now; try again", state=self.state)
        return content

    @property
    def xml(self) -> XmlText:
        return self._content().xml

    @property
    def directory(self) -> Directory:
        return self._content().directory


class _DigestTable(Properties):
    """The table of an object, "" for the document itself: what a walker asks of a target."""

    __slots__ = ("_file", "_name", "_texts", "_values", "kind")

    def __init__(
        self,
        file: Remembered,
        name: str,
        kind: str,
        names: Sequence[str],
        texts: Mapping[str, Text],
        pieces: Mapping[str, str],
    ) -> None:
        self._file, self._name, self.kind = file, name, kind
        self._careful, self._decode = False, _utf8
        self._begin = self._end = 0
        self._values: dict[str, Any] | None = None
        self.names, self.numbers = _shared(tuple(names))
        self._texts = texts
        self.kept = {name: piece.encode() for name, piece in pieces.items()}

    def _whole(self) -> Properties:
        xml = self._file.xml
        return (
            table_of(xml, self._name, self.kind) if self._name else Properties(xml, xml.head.properties, "")
        )

    def piece(self, name: str) -> bytes:
        piece = self.kept.get(name)
        return self._whole().piece(name) if piece is None else piece

    def value(self, name: str) -> Any:
        if name not in self.numbers:
            return ABSENT
        if name in self._texts:
            return self._texts[name]
        if self._values is None:
            self._values = {}
        if name not in self._values:
            value = self.quick_value(self.kept.get(name, b""))
            if value is None:
                return self._whole().value(name)
            self._values[name] = value
        return self._values[name]

    @property
    def texts(self) -> Mapping[str, Text]:
        return self._texts


@lru_cache(maxsize=4096)
def _shared(names: tuple[str, ...]) -> tuple[tuple[str, ...], dict[str, int]]:
    """Return one shared value for the property names of a type, which most of its objects have."""
    return names, dict.fromkeys(names, 0)


def _utf8(raw: bytes) -> str:
    return raw.decode()


# How many files' facts are kept as values: as many as a large vault needs at one time.
_REMEMBERED_AT_MOST = 20_000


@dataclass(frozen=True, slots=True)
class Content:
    """What was read of one file: its text, as far as it is unpacked, and the directory of its container.

    changed_ns
        when the file system last changed anything of the file (``st_ctime_ns``).
    read_ns
        a moment before it was opened, by this machine's clock.
    """

    xml: XmlText
    directory: Directory
    state: FileState
    changed_ns: int
    read_ns: int

    @property
    def digest(self) -> str:
        """Return a text that distinguishes this content from any other."""
        return self.xml.digest(self.directory.raw)

    known: ClassVar[None] = None  # nothing that could spare reading it

    @property
    def size(self) -> int:
        """Return roughly how many bytes stay in memory; unpacked text is counted elsewhere."""
        return self.xml.packed_size + 2 * len(self.directory.raw) + 300 * self.directory.entry_count


class FileContents:
    """The contents of files for several sessions, one after the other: a file that many assemblies use is
    read once. Those that were not asked for longest are forgotten first.

    instead
        real path → a file that is read in its place, such as another revision of it.
    clock
        nanoseconds.
    """

    def __init__(
        self,
        limits: Limits | None = None,
        *,
        instead: Mapping[str, str] | None = None,
        clock: Callable[[], int] = time.time_ns,
    ) -> None:
        self.limits = limits or Limits()
        self._instead = dict(instead or {})
        self._clock = clock
        self.shared = SharedTexts(self.limits.resident)
        self.reads = 0
        self._known: OrderedDict[str, Content] = OrderedDict()
        self._remembered: OrderedDict[tuple[str, str], Remembered] = OrderedDict()
        self._size = 0

    def read(self, path: str) -> Content:
        """Return the content of a file; reads it if it is not in memory. Raises FcstdError."""
        if (known := self._known.get(path)) is not None:
            self._known.move_to_end(path)
            return known
        content = self._read(path)
        self.reads += 1
        self._keep(path, content)
        return content

    def _keep(self, path: str, content: Content) -> None:
        if (before := self._known.pop(path, None)) is not None:
            self._size -= before.size
        self._known[path] = content
        self._size += content.size
        while self._size > self.limits.resident and len(self._known) > 1:
            _, oldest = self._known.popitem(last=False)
            self._size -= oldest.size

    def remembered(self, path: str, facts: str) -> Remembered:
        """Return the content of a file whose facts are known."""
        content = self._remembered.get((path, facts))
        if content is None:
            content = self._remembered[path, facts] = Remembered(path, facts, self)
            if len(self._remembered) > _REMEMBERED_AT_MOST:
                self._remembered.popitem(last=False)
        return content

    def add(self, path: str, content: Content) -> None:
        """Take over what another process has read."""
        content.xml.shared = self.shared
        self._keep(path, content)

    def _read(self, path: str) -> Content:
        read_ns = self._clock()
        with ContainerFile(self._instead.get(path, path), self.limits) as container:
            entry = container.entry(DOCUMENT_XML)
            if entry is None:
                reason = "it is not a FreeCAD document (there is no Document.xml in it)"
                raise FcstdError(path, reason, state=container.state)
            packed = container.packed(entry, self.limits.packed)
            if container.changed():
                raise FcstdError(path, "it is being written just now; try again", state=container.state)
            xml = XmlText(path, entry, packed, self.limits, self.shared)
            return Content(xml, container.directory, container.state, container.changed_ns, read_ns)


class Library:
    """Shares opened documents: one file is one document object.

    root
        no file outside this folder is read; links that leave it have the problem OUTSIDE_ROOT. None: no such
        limit, for projects use ``../`` freely.
    contents
        what was read before, by other sessions.
    facts
        path → what :func:`~silo.fcstd.library.facts_of` gave for a file as it is now; "" where none is known.
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
                f"it lies outside {self._locator.root}, the folder that may be read",
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

    def imported(self, owner: FcstdDocument, file: str) -> object:
        """Find the part or assembly in a file that A2plus imported into ``owner``; a LinkProblem if there is
        none.

        Like A2plus, it also looks for the file in the folder of the owner, if the file is no longer in its
        place.
        """
        from silo.bom.roots import choose_assembly

        for recorded in dict.fromkeys((file, os.path.basename(file))):
            location = self.lookups[owner.folders, recorded] = self._locator.find(recorded, owner.folders)
            if isinstance(location, FoundFile):
                break
        if isinstance(location, NotFound):
            return LinkProblem(location.code, file, "", location.detail)
        try:
            document = self._document(location)
            document.complete()
            return choose_assembly(document)
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
                location.real, f"more than {self.limits.documents} files are not read in one go"
            )
        if facts := self._facts(location.real):
            return FcstdDocument(self, location, self._contents.remembered(location.real, facts))
        try:
            try:
                return FcstdDocument(self, location, self._contents.read(location.real))
            except FcstdError as error:
                # FreeCAD may just be writing it; if not, the second reading gives the same as the first.
                if error.state is None or error.state == FileState.now(location.real):
                    raise
                return FcstdDocument(self, location, self._contents.read(location.real))
        except FcstdError as error:
            return error

    def _note_respelt(self, owner: FcstdDocument, ref: Ref, location: FoundFile) -> None:
        name = os.path.basename(location.real)
        differs = "which differs in case or Unicode form only"
        note = f"{owner.FileName} records {ref.file}; taken was {name}, {differs}"
        if note not in self.notes:
            self.notes.append(note)


def open_document(
    path: Path | str, *, root: Path | str | None = None, limits: Limits | None = None
) -> FcstdDocument:
    """Open an FCStd file in a session of its own: the document, and on demand what it links to.

    Raises DocumentError if this very file cannot be read; a broken link is noted on its object.

    >>> from silo.bom.links import extract  # doctest: +SKIP
    >>> extract(open_document("gearbox.FCStd").getObject("Assembly"))  # doctest: +SKIP
    """
    return Library(root, limits).open(path)
