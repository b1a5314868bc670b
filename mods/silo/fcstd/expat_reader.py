# SPDX-License-Identifier: LGPL-2.1-or-later
"""The slow and right way through Document.xml: expat decides, we only note where things are.

Used where the text has anything that FreeCAD does not write: comments after the head, CDATA, single quotes,
attributes in another order, character references in names, another encoding. Also the judge of what is not
well-formed. A document type (and so any entity) is refused: FreeCAD itself had a hole there.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from xml.parsers import expat

from silo.bom.message import message

Span = tuple[int, int]

_ENCODINGS = {"utf-8", "utf8", "us-ascii", "ascii", "utf-16", "utf-16le", "utf-16be", "iso-8859-1", "latin-1"}
_DECLARED = re.compile(rb"""<\?xml[^>]*?\sencoding\s*=\s*["']([A-Za-z0-9._-]+)["']""")
_DECLARATION = re.compile(r"^\ufeff?\s*<\?xml.*?\?>", re.DOTALL)


class Malformed(ValueError):
    """The XML is not well-formed, or not one that may be read; the text says what, for people."""


class Refused(Malformed):
    """Nothing is wrong with the XML, and FreeCAD reads it: it has what no file of FreeCAD has."""


@dataclass(slots=True)
class Head:
    """What stands before the data of the objects. ``types`` is in document order."""

    attributes: dict[str, str] | bytes  # as bytes until they are asked for
    types: dict[str, str]
    properties: Span | None


@dataclass(slots=True)
class _XmlWalk:
    """One run of expat over a text; ``open_at`` and ``close_at`` get tag, depth and byte offset."""

    text: bytes
    depth_limit: int
    open_at: Callable[[int, str, dict[str, str], int], None]
    close_at: Callable[[int, str, int], None]
    depth: int = 0

    def run(self) -> None:
        parser = expat.ParserCreate("utf-8")
        parser.StartElementHandler = lambda tag, attributes: self._start(parser, tag, attributes)
        parser.EndElementHandler = lambda tag: self._end(parser, tag)
        parser.StartDoctypeDeclHandler = _refuse_doctype
        try:
            parser.Parse(self.text, True)
        except expat.ExpatError as error:
            reason = expat.ErrorString(error.code) or "unknown"
            raise Malformed(
                message("is no well-formed XML: {reason}, line {lineno}", reason=reason, lineno=error.lineno)
            ) from error

    def _start(self, parser: expat.XMLParserType, tag: str, attributes: dict[str, str]) -> None:
        self.depth += 1
        if self.depth > self.depth_limit:
            raise Malformed(
                message("is nested more than {depth_limit} levels deep", depth_limit=self.depth_limit)
            )
        self.open_at(self.depth, tag, attributes, parser.CurrentByteIndex)

    def _end(self, parser: expat.XMLParserType, tag: str) -> None:
        at = parser.CurrentByteIndex
        # At an end tag the index is its begin; at an empty element's it is already behind it.
        end = self.text.index(b">", at) + 1 if self.text.startswith(b"</", at) else at
        self.close_at(self.depth, tag, end)
        self.depth -= 1


def _refuse_doctype(*_: object) -> None:
    raise Refused(message("has a document type (DOCTYPE), which FreeCAD does not write; it is not read"))


def as_utf8(raw: bytes) -> bytes:
    """Convert the text to UTF-8, without the declaration of another encoding."""
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        encoding = "utf-16"
    else:
        declared = _DECLARED.match(raw.removeprefix(b"\xef\xbb\xbf")[:1024].lstrip())
        encoding = declared[1].decode("ascii").lower() if declared else "utf-8"
    if encoding in ("utf-8", "utf8", "us-ascii", "ascii"):
        return raw
    if encoding not in _ENCODINGS:
        raise Malformed(message("is written in {encoding}; FreeCAD writes UTF-8", encoding=encoding))
    try:
        return _DECLARATION.sub("", raw.decode(encoding), count=1).encode()
    except UnicodeError as error:
        raise Malformed(
            message("is not in the encoding that it names, {encoding}", encoding=encoding)
        ) from error


@dataclass(slots=True)
class _DocumentIndex:
    head: Head = field(default_factory=lambda: Head({}, {}, None))
    data: dict[str, Span] = field(default_factory=dict)
    path: list[str] = field(default_factory=list)
    begin: int = 0
    name: str = ""

    def open_at(self, depth: int, tag: str, attributes: dict[str, str], at: int) -> None:
        del self.path[depth - 1 :]
        self.path.append(tag)
        if depth == 1:
            if tag != "Document":
                raise Malformed(message("is not a FreeCAD document: it begins with <{tag}>", tag=tag))
            self.head.attributes = dict(attributes)
        elif depth == 2 and tag == "Properties":
            self.begin = at
        elif depth == 3 and tag == "Object":
            self._object(attributes, at)

    def _object(self, attributes: dict[str, str], at: int) -> None:
        section, name = self.path[1], attributes.get("name", "")
        if section == "Objects":
            if not name or name in self.head.types:
                raise Malformed(
                    message("lists an object {name} twice", name=repr(name))
                    if name
                    else message("lists an object without a name")
                )
            self.head.types[name] = attributes.get("type", "")
        elif section == "ObjectData":
            if name in self.data:
                raise Malformed(message("holds the data of the object {name} twice", name=repr(name)))
            self.name, self.begin = name, at

    def close_at(self, depth: int, tag: str, end: int) -> None:
        if depth == 2 and tag == "Properties":
            if self.head.properties is not None:
                raise Malformed(message("holds the properties of the document twice"))
            self.head.properties = (self.begin, end)
        elif depth == 3 and tag == "Object" and self.path[1] == "ObjectData":
            self.data[self.name] = (self.begin, end)


def index_document(text: bytes, depth_limit: int) -> tuple[Head, dict[str, Span]]:
    """Find the head, and the place of each object's data. Raises Malformed."""
    index = _DocumentIndex()
    _XmlWalk(text, depth_limit, index.open_at, index.close_at).run()
    return index.head, index.data


def index_properties(text: bytes, depth_limit: int) -> dict[str, Span]:
    """Find the place of each property of one ``<Object>`` or ``<Properties>`` element. Raises Malformed."""
    spans: dict[str, Span] = {}
    level = 2 if text.startswith(b"<Properties") else 3
    path: list[str] = []
    name, begin = "", 0

    def open_at(depth: int, tag: str, attributes: dict[str, str], at: int) -> None:
        nonlocal name, begin
        del path[depth - 1 :]
        path.append(tag)
        if depth == level and tag == "Property":
            name, begin = attributes.get("name", ""), at

    def close_at(depth: int, tag: str, end: int) -> None:
        if depth == level and tag == "Property" and path[level - 2] == "Properties":
            if name in spans:
                raise Malformed(message("has the property {name} twice", name=repr(name)))
            spans[name] = (begin, end)

    _XmlWalk(text, depth_limit, open_at, close_at).run()
    return spans


def start_tags(text: bytes, depth_limit: int, tags: Collection[str]) -> list[tuple[int, dict[str, str]]]:
    """Find each element with one of these tags: its position and its attributes, in document order. Raises
    Malformed.
    """
    found: list[tuple[int, dict[str, str]]] = []

    def open_at(depth: int, tag: str, attributes: dict[str, str], at: int) -> None:
        if tag in tags:
            found.append((at, dict(attributes)))

    _XmlWalk(text, depth_limit, open_at, lambda depth, tag, end: None).run()
    return found


@dataclass(slots=True)
class XmlElement:
    """One XML element of a property's value."""

    tag: str
    attributes: dict[str, str]
    children: list[XmlElement] = field(default_factory=list)


def parse_value(snippet: bytes, depth_limit: int) -> XmlElement:
    """Parse one ``<Property>`` element as a tree. Raises Malformed."""
    root = XmlElement("", {})
    stack = [root]

    def open_at(depth: int, tag: str, attributes: dict[str, str], at: int) -> None:
        node = XmlElement(tag, dict(attributes))
        stack[-1].children.append(node)
        stack.append(node)

    def close_at(depth: int, tag: str, end: int) -> None:
        stack.pop()

    _XmlWalk(snippet, depth_limit, open_at, close_at).run()
    return root.children[0]
