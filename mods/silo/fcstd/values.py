# SPDX-License-Identifier: LGPL-2.1-or-later
"""From the XML of a property to a plain value, as FreeCAD's Python gives it.

Sources: FreeCAD ``src/App/PropertyStandard.cpp``, ``PropertyLinks.cpp``, ``PropertyGeo.cpp`` (``Save``);
forms and Python values checked with FreeCAD 0.20. A link becomes a :class:`Ref`, which the object resolves.
Properties of other kinds (shapes, placements, expressions) have no plain value here. Sequences are tuples.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from enum import Enum, auto
from typing import Any, Final, NamedTuple

from silo.fcstd.expat_reader import XmlElement


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


def _formulas(node: XmlElement) -> tuple[tuple[str, str], ...]:
    formulas = (child.attributes for child in node.children if child.tag == "Expression")
    return tuple((a.get("path", ""), a.get("expression", "")) for a in formulas)


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
    "ExpressionEngine": lambda node, _: _formulas(node),
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
