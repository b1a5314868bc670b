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

from silo.fcstd.careful import Node


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
    found = _INTEGER.match(text)
    return int(found[1]) if found else ABSENT


def _float(text: str) -> Any:
    try:
        return float(text)
    except ValueError:
        return ABSENT


def _text(node: Node, _: str) -> Any:
    return node.attributes.get("value", ABSENT)


def _vector(node: Node, _: str) -> Any:
    parts = [_float(node.attributes.get(f"value{axis}", "")) for axis in "XYZ"]
    return ABSENT if ABSENT in parts else Vector(*parts)


def _bools(node: Node, _: str) -> Any:
    # boost::dynamic_bitset writes its last element first.
    bits = node.attributes.get("value", "")
    return tuple(bit == "1" for bit in reversed(bits)) if set(bits) <= {"0", "1"} else ABSENT


def _texts(node: Node) -> tuple[str, ...]:
    return tuple(child.attributes.get("value", "") for child in node.children)


def _integers(node: Node, _: str) -> Any:
    found = tuple(_integer(child.attributes.get("v", "")) for child in node.children)
    return ABSENT if ABSENT in found else found


def _map(node: Node, _: str) -> dict[str, str]:
    items = (child.attributes for child in node.children if child.tag == "Item")
    return {a["key"]: a.get("value", "") for a in items if "key" in a}


def _class(node: Node) -> Any:
    """The class of a Python object, which is not made here: (module, name)."""
    module = node.attributes.get("module", "")
    return (module, node.attributes.get("class", "")) if module else ABSENT


def _subs(node: Node) -> tuple[str, ...]:
    if "sub" in node.attributes:
        return (node.attributes["sub"],)
    return tuple(child.attributes.get("value", "") for child in node.children if child.tag == "Sub")


def _xlink(node: Node, kind: str) -> Ref:
    style = Style.PAIR if kind.startswith("App::PropertyXLinkSub") else Style.LOOSE
    return Ref(node.attributes.get("file", ""), node.attributes.get("name", ""), _subs(node), style)


def _link_sub(node: Node, _: str) -> Ref:
    return Ref("", node.attributes.get("value", ""), _subs(node), Style.PAIR)


def _xlinks(node: Node, kind: str) -> RefList:
    style = Style.PLAIN if kind.startswith("App::PropertyXLinkList") else Style.MEMBER
    found = (_xlink(child, "") for child in node.children if child.tag == "XLink")
    return RefList(tuple(Ref(ref.file, ref.name, ref.subs, style) for ref in found))


def _link_subs(node: Node, _: str) -> RefList:
    return RefList(tuple(_grouped(child.attributes for child in node.children if child.tag == "Link")))


def _grouped(links: Iterable[dict[str, str]]) -> Iterable[Ref]:
    """One reference for a run of links to the same object, as FreeCAD groups them."""
    name, subs = None, list[str]()
    for link in links:
        if name is not None and link.get("obj", "") != name:
            yield Ref("", name, tuple(subs), Style.MEMBER)
            subs.clear()
        name = link.get("obj", "")
        subs.append(link.get("sub", ""))
    if name is not None:
        yield Ref("", name, tuple(subs), Style.MEMBER)


_READERS: dict[str, Callable[[Node, str], Any]] = {
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


def value_of(prop: Node) -> Any:
    """The plain value of a ``<Property>`` element; ABSENT where it has none."""
    if not prop.children:
        return ABSENT
    kind = prop.attributes.get("type", "")
    first = prop.children[0]
    reader = _READERS.get(first.tag)
    value = reader(first, kind) if reader else ABSENT
    if kind == "App::PropertyEnumeration" and isinstance(value, int):
        return _enumeration(prop, value)
    return value


def _enumeration(prop: Node, index: int) -> Any:
    names: tuple[str, ...] = _ENUMERATIONS.get(prop.attributes.get("name", ""), ())
    for child in prop.children[1:]:
        if child.tag == "CustomEnumList":
            names = _texts(child)
    return names[index] if 0 <= index < len(names) else index
