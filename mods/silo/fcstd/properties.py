# SPDX-License-Identifier: LGPL-2.1-or-later
"""The properties of one object, or of the document: the names at once, a value when it is asked for.

The element is cut at every ``<Property name="``; one piece is then a property's name, type and value. FreeCAD
writes the properties of equal objects in equal order, so the list of names seen last for a type is tried
first.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from functools import lru_cache
from types import MappingProxyType
from typing import Any, NamedTuple

from silo.fcstd import expat_reader
from silo.fcstd.expat_reader import Malformed, Span, XmlElement
from silo.fcstd.values import ABSENT, LocalList, value_of
from silo.fcstd.xmltext import XmlText

_CUT = b'<Property name="'
_CLOSING = b"</Property>"
_PROPERTIES = b'<Properties Count="'

# A piece in FreeCAD's own form whose value is one element, empty or with empty elements in it; nearly all
# that a BOM asks for. Nothing that expat would read in another way: no references, no white space to
# normalise.
_ATTRIBUTES = rb'((?: [\w:.-]+="[^"<&\r\n\t]*")*)'
_AFTER = rb"\s*</Property>\s*(?:</Properties>\s*(?:</Object>)?)?\Z"
_CANONICAL = re.compile(
    rb'([^"&]+)" type="([^"&]+)"[^<]*<(\w+)' + _ATTRIBUTES + rb"(?:/>|>\s*"
    rb'((?:<\w+(?: [\w:.-]+="[^"<&\r\n\t]*")*/>\s*)*)</\3>)' + _AFTER
)
# The same for a list of links, which may be long.
_MEMBERS = re.compile(
    rb'[^"&]+" type="App::PropertyLinkList"[^<]*<LinkList count="\d+">'
    rb'((?:\s*<Link value="[^"<&\r\n\t]*"/>)*)\s*</LinkList>' + _AFTER
)
_MEMBER = re.compile(r'"([^"]*)"')
# And what a BOM asks of nearly every object: a text, and a map with nothing in it.
_PLAIN = re.compile(
    rb'[^"&]+" type="App::Property(?:String"[^<]*<String value="([^"<&\r\n\t]*)"/>'
    rb'|Map"[^<]*<Map count="0">\s*</Map>)' + _AFTER
)
_CHILD = re.compile(r"<(\w++)([^<]*)/>")
_ATTRIBUTE = re.compile(r' ([\w:.-]+)="([^"]*)"')

# Kept when an element is cut; any other property is cut out again when somebody asks for it. The pieces of
# all properties would be as much as the text itself.
_KEPT = frozenset(
    {
        *("Base", "Count", "ElementCount", "ElementList", "Group", "Label", "LinkCopyOnChange"),
        *("LinkCopyOnChangeSource", "LinkedObject", "Meta", "Scale", "ScaleList", "ScaleVector"),
        *("Visibility", "SiloBomExclude", "SiloFindNumber", "SiloItemId", "SiloUUID", "Suppressed"),
        "Type",
    }
)


# Thousands of screws have the same few lists of sizes. Equal bytes, equal value.
_OFTEN_ALIKE = 8192
_parsed = lru_cache(maxsize=128)(expat_reader.parse_value)


class Shape(NamedTuple):
    """A list of property names that many objects share. Piece 0 is what stands before the first property."""

    names: tuple[str, ...]
    prefixes: tuple[bytes, ...]
    numbers: dict[str, int]
    kept: tuple[tuple[str, int], ...]
    opening: bytes  # the counted start tag

    @classmethod
    def of(cls, names: Iterable[str], opening: bytes) -> Shape:
        """Make the shape of these names, which must differ."""
        listed = tuple(names)
        numbers = {name: number for number, name in enumerate(listed, start=1)}
        prefixes = (b"", *(f'{name}"'.encode() for name in listed))
        return cls(listed, prefixes, numbers, tuple((n, numbers[n]) for n in listed if n in _KEPT), opening)


_NOTHING = Shape.of((), b"")


Text = str | dict[str, str]
_NO_TEXTS: Mapping[str, Text] = MappingProxyType({})


class Properties:
    """The property table of one element of a document's XML. Reading may raise FcstdError."""

    __slots__ = ("_begin", "_careful", "_decode", "_end", "_xml", "kept", "names", "numbers")

    def __init__(self, xml: XmlText, span: Span | None, kind: str) -> None:
        self._xml, self._decode = xml, xml.decode
        self._begin, self._end = span or (0, 0)
        self._careful = xml.is_careful
        if span is None:  # a foreign document may have no properties of its own
            shape, pieces = _NOTHING, [b""]
        elif self._careful:
            shape, pieces = self._careful_cut()
        else:
            pieces = xml.text[span[0] : span[1]].split(_CUT)
            known_shape = xml.shared.shapes.get((kind, len(pieces)))
            if (
                known_shape is not None
                and pieces[0].endswith(known_shape.opening)
                and all(map(bytes.startswith, pieces, known_shape.prefixes))
            ):
                shape = known_shape
            else:
                shape, pieces = self._other_shape(pieces, kind)
        self.names, self.numbers = shape.names, shape.numbers
        self.kept = {name: pieces[number] for name, number in shape.kept}

    @property
    def size(self) -> int:
        """Return the size of the element in bytes."""
        return self._end - self._begin

    def piece(self, name: str) -> bytes:
        """Return the bytes of the property ``name``, which must be in the table. Equal bytes mean an equal
        value.
        """
        piece = self.kept.get(name)
        if piece is None:
            piece = (self._careful_cut()[1] if self._careful else self._cut())[self.numbers[name]]
        return piece

    def value(self, name: str) -> Any:
        """Return the value of a property; ABSENT if there is no such property or its value is not plain."""
        if name not in self.numbers:
            return ABSENT
        piece = self.piece(name)
        value = self.quick_value(piece)
        return value_of(self._careful_node(piece)) if value is None else value

    def type_of(self, name: str) -> str:
        """Return the type of a property of the table, as FreeCAD names it."""
        return self._careful_node(self.piece(name)).attributes.get("type", "")

    def quick_value(self, piece: bytes) -> Any:
        """Read the value of a piece in FreeCAD's own form; None if it has another form."""
        if (plain := _PLAIN.match(piece)) is not None:
            return {} if plain[1] is None else self._decode(plain[1])
        if (members := _MEMBERS.match(piece)) is not None:
            return LocalList(tuple(_MEMBER.findall(self._decode(members[1]))))
        if (match := _CANONICAL.match(piece)) is None:
            return None
        name, kind, tag, attributes, inner = (self._decode(part or b"") for part in match.groups())
        children = [XmlElement(child, dict(_ATTRIBUTE.findall(own))) for child, own in _CHILD.findall(inner)]
        value = XmlElement(tag, dict(_ATTRIBUTE.findall(attributes)), children)
        return value_of(XmlElement("Property", {"name": name, "type": kind}, [value]))

    @property
    def texts(self) -> Mapping[str, Text]:
        """Return the values that are known without reading a piece."""
        return _NO_TEXTS

    def _cut(self) -> list[bytes]:
        begin, end = self._begin, self._end
        return self._xml.text[begin:end].split(_CUT)

    def _other_shape(self, pieces: list[bytes], kind: str) -> tuple[Shape, list[bytes]]:
        count = len(pieces) - 1
        at = pieces[0].find(_PROPERTIES)
        opening = pieces[0][max(at, 0) :]
        names = [piece.partition(b'"')[0] for piece in pieces[1:]]
        # FreeCAD counts its properties; another number means that some are written in another form.
        counted = opening.startswith(b'%b%d"' % (_PROPERTIES, count))
        if not counted or b"&" in b"".join(names) or len(set(names)) != count:
            self._careful = True
            return self._careful_cut()
        shape = Shape.of((self._xml.decode(name) for name in names), opening)
        self._xml.shared.shapes[kind, len(pieces)] = shape
        return shape, pieces

    def _careful_cut(self) -> tuple[Shape, list[bytes]]:
        begin, end = self._begin, self._end
        element = self._xml.text[begin:end].lstrip()
        try:
            spans = expat_reader.index_properties(element, self._xml.limits.depth)
        except Malformed as error:
            raise self._xml.malformed(error) from error
        return Shape.of(spans, b""), [b"", *(element[first:last] for first, last in spans.values())]

    def _careful_node(self, piece: bytes) -> XmlElement:
        if not self._careful:
            end = piece.find(_CLOSING)
            piece = _CUT + (piece[: end + len(_CLOSING)] if end >= 0 else piece)
        parse = _parsed if len(piece) < _OFTEN_ALIKE else expat_reader.parse_value
        try:
            return parse(piece, self._xml.limits.depth)
        except Malformed as error:
            raise self._xml.malformed(error) from error


def table_of(xml: XmlText, name: str, type_id: str) -> Properties:
    """Make the property table of an object. Raises FcstdError."""
    span = xml.span(name)
    if span is None:
        raise xml.error(f"does not hold the data of the object {name!r}")
    return Properties(xml, span, type_id)
