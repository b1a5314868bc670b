# SPDX-License-Identifier: LGPL-2.1-or-later
"""The properties of one object, or of the document: the names at once, a value when it is asked for.

The element is cut at every ``<Property name="``; one piece is then a property's name, type and value. FreeCAD
writes the properties of equal objects in equal order, so the list of names seen last for a type is tried
first.

From the XML of a property to a plain value, as FreeCAD's Python gives it.

Sources: FreeCAD ``src/App/PropertyStandard.cpp``, ``PropertyLinks.cpp``, ``PropertyGeo.cpp`` (``Save``);
forms and Python values checked with FreeCAD 0.20. A link becomes a :class:`Ref`, which the object resolves.
Properties of other kinds (shapes, placements, expressions) have no plain value here. Sequences are tuples.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from enum import Enum, auto
from functools import lru_cache
from types import MappingProxyType
from typing import Any, Final, NamedTuple

from silo.fcstd import xmltext
from silo.fcstd.xmltext import Malformed, Span, XmlElement, XmlText


class _Absent:
    def __repr__(self) -> str:
        return "ABSENT"

    def __bool__(self) -> bool:
        return False


# An unreadable or unsupported value is absent, never a guess.
ABSENT: Final = _Absent()

# A static enumeration keeps its names in FreeCAD, not in the file (src/App/Link.cpp); of those that are not
# known here, the value is the number.
_ENUMERATIONS = {
    "LinkCopyOnChange": ("Disabled", "Enabled", "Owned", "Tracking"),
    "LinkMode": ("None", "Auto Delete", "Auto Link", "Auto Unlink"),
}

_INTEGER = re.compile(r"\s*([+-]?\d{1,18})\s*\Z")


class Vector(NamedTuple):
    """A point or a scale, as FreeCAD's ``Vector`` reads."""

    x: float
    y: float
    z: float


class Style(Enum):
    """What FreeCAD's Python makes of the sub-names of a link."""

    PLAIN = auto()  # object
    LOOSE = auto()  # object, (object, "sub") or (object, ["sub", …])
    PAIR = auto()  # (object, ["sub", …]), also where there are none
    MEMBER = auto()  # (object, ("sub", …)), in a list


class Ref(NamedTuple):
    """A link as recorded. ``file`` "" is the same document."""

    file: str
    name: str
    subs: tuple[str, ...] = ()
    style: Style = Style.PLAIN


class LocalList(NamedTuple):
    """Objects of the same document, by name; FreeCAD drops those that are not there."""

    names: tuple[str, ...]


class RefList(NamedTuple):
    """Several links; FreeCAD drops those that lost their target."""

    refs: tuple[Ref, ...]


class ShapeFile(NamedTuple):
    """A shape, in an entry of its own."""

    name: str


class SideEntry(NamedTuple):
    """A list of vectors, kept in another entry of the container ("" for none)."""

    name: str


def _integer(text: str) -> Any:
    match = _INTEGER.match(text)
    return int(match[1]) if match else ABSENT


def _float(text: str) -> Any:
    try:
        return float(text)
    except ValueError:
        return ABSENT


def _text(node: XmlElement, _: str) -> Any:
    return node.attributes.get("value", ABSENT)


def _vector(node: XmlElement, _: str) -> Any:
    parts = [_float(node.attributes.get(f"value{axis}", "")) for axis in "XYZ"]
    return ABSENT if ABSENT in parts else Vector(*parts)


def _bools(node: XmlElement, _: str) -> Any:
    # boost::dynamic_bitset writes its last element first.
    bits = node.attributes.get("value", "")
    return tuple(bit == "1" for bit in reversed(bits)) if set(bits) <= {"0", "1"} else ABSENT


def _texts(node: XmlElement) -> tuple[str, ...]:
    return tuple(child.attributes.get("value", "") for child in node.children)


def _integers(node: XmlElement, _: str) -> Any:
    numbers = tuple(_integer(child.attributes.get("v", "")) for child in node.children)
    return ABSENT if ABSENT in numbers else numbers


def _map(node: XmlElement, _: str) -> dict[str, str]:
    items = (child.attributes for child in node.children if child.tag == "Item")
    return {a["key"]: a.get("value", "") for a in items if "key" in a}


def _class(node: XmlElement) -> Any:
    """Return the class of a Python object as (module, name); the object itself is never made."""
    module = node.attributes.get("module", "")
    return (module, node.attributes.get("class", "")) if module else ABSENT


def _subs(node: XmlElement) -> tuple[str, ...]:
    if "sub" in node.attributes:
        return (node.attributes["sub"],)
    return tuple(child.attributes.get("value", "") for child in node.children if child.tag == "Sub")


def _xlink(node: XmlElement, kind: str) -> Ref:
    style = Style.PAIR if kind.startswith("App::PropertyXLinkSub") else Style.LOOSE
    return Ref(node.attributes.get("file", ""), node.attributes.get("name", ""), _subs(node), style)


def _link_sub(node: XmlElement, _: str) -> Ref:
    return Ref("", node.attributes.get("value", ""), _subs(node), Style.PAIR)


def _xlinks(node: XmlElement, kind: str) -> RefList:
    style = Style.PLAIN if kind.startswith("App::PropertyXLinkList") else Style.MEMBER
    refs = (_xlink(child, "") for child in node.children if child.tag == "XLink")
    return RefList(tuple(Ref(ref.file, ref.name, ref.subs, style) for ref in refs))


def _link_subs(node: XmlElement, _: str) -> RefList:
    return RefList(tuple(_grouped(child.attributes for child in node.children if child.tag == "Link")))


def _grouped(links: Iterable[dict[str, str]]) -> Iterable[Ref]:
    """Yield one reference for each run of links to the same object, as FreeCAD groups them."""
    name, subs = None, list[str]()
    for link in links:
        if name is not None and link.get("obj", "") != name:
            yield Ref("", name, tuple(subs), Style.MEMBER)
            subs.clear()
        name = link.get("obj", "")
        subs.append(link.get("sub", ""))
    if name is not None:
        yield Ref("", name, tuple(subs), Style.MEMBER)


_READERS: dict[str, Callable[[XmlElement, str], Any]] = {
    "String": _text,
    "Uuid": _text,
    "Path": _text,
    "Integer": lambda node, _: _integer(node.attributes.get("value", "")),
    "Bool": lambda node, _: {"true": True, "false": False}.get(node.attributes.get("value", ""), ABSENT),
    "Float": lambda node, _: _float(node.attributes.get("value", "")),
    "PropertyVector": _vector,
    "BoolList": _bools,
    "IntegerList": _integers,
    "StringList": lambda node, _: _texts(node),
    "Map": _map,
    "Link": lambda node, _: Ref("", node.attributes.get("value", "")),
    "LinkSub": _link_sub,
    "XLink": _xlink,
    "LinkList": lambda node, _: LocalList(_texts(node)),
    "LinkSubList": _link_subs,
    "XLinkSubList": _xlinks,
    "Python": lambda node, _: _class(node),
    "Part": lambda node, _: ShapeFile(node.attributes.get("file", "")),
    "VectorList": lambda node, _: SideEntry(node.attributes.get("file", "")),
}


def value_of(prop: XmlElement) -> Any:
    """Return the plain value of a ``<Property>`` element; ABSENT if it has none."""
    if not prop.children:
        return ABSENT
    kind = prop.attributes.get("type", "")
    first = prop.children[0]
    reader = _READERS.get(first.tag)
    value = reader(first, kind) if reader else ABSENT
    if kind == "App::PropertyEnumeration" and isinstance(value, int):
        return _enumeration(prop, value)
    return value


def _enumeration(prop: XmlElement, index: int) -> Any:
    names: tuple[str, ...] = _ENUMERATIONS.get(prop.attributes.get("name", ""), ())
    for child in prop.children[1:]:
        if child.tag == "CustomEnumList":
            names = _texts(child)
    return names[index] if 0 <= index < len(names) else index


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
_CHILD = re.compile(r"<(\w+)([^<]*)/>")
_ATTRIBUTE = re.compile(r' ([\w:.-]+)="([^"]*)"')

# Kept when an element is cut; any other property is cut out again when somebody asks for it. The pieces of
# all properties would be as much as the text itself.
_KEPT = frozenset(
    {
        *("Base", "Count", "ElementCount", "ElementList", "Group", "Label", "LinkCopyOnChange"),
        *("LinkCopyOnChangeSource", "LinkedObject", "Meta", "Scale", "ScaleList", "ScaleVector"),
        *("SiloBomExclude", "SiloItemId", "SiloUUID", "Suppressed", "Type"),
    }
)


# Thousands of screws have the same few lists of sizes. Equal bytes, equal value.
_OFTEN_ALIKE = 8192
_parsed = lru_cache(maxsize=128)(xmltext.parse_value)


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
            spans = xmltext.index_properties(element, self._xml.limits.depth)
        except Malformed as error:
            raise self._xml.malformed(error) from error
        return Shape.of(spans, b""), [b"", *(element[first:last] for first, last in spans.values())]

    def _careful_node(self, piece: bytes) -> XmlElement:
        if not self._careful:
            end = piece.find(_CLOSING)
            piece = _CUT + (piece[: end + len(_CLOSING)] if end >= 0 else piece)
        parse = _parsed if len(piece) < _OFTEN_ALIKE else xmltext.parse_value
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
