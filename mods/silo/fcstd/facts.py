# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a file was found to say of itself, in place of the file: enough for most links to it.

A vault has tens of thousands of these in memory at one time, so each is made of few objects.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

from silo.bom.message import message
from silo.bom.walk.kinds import Kind
from silo.fcstd.container import Directory, FileStat
from silo.fcstd.errors import FcstdError
from silo.fcstd.properties import Properties, Text, table_of
from silo.fcstd.values import ABSENT
from silo.fcstd.xmltext import XmlText

if TYPE_CHECKING:
    from silo.fcstd.contents import Content, FileContents
    from silo.fcstd.document import FcstdDocument

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
    state: FileStat
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
        self.state = FileStat(*file_facts.state)
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
            raise FcstdError(self._path, message("it is being written just now; try again"), state=self.state)
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
