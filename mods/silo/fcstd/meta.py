# SPDX-License-Identifier: LGPL-2.1-or-later
"""Document.xml with an identity in the document's ``Meta`` map, and on an object; all other bytes stay.

Where things are is asked of expat, so comments, other quotes and another order of attributes do no harm.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from xml.sax.saxutils import escape

from silo.fcstd import careful
from silo.fcstd.careful import Malformed, Node

_MORE = {'"': "&quot;", "'": "&apos;", "\n": "&#10;", "\r": "&#13;", "\t": "&#9;"}
_ITEM_ID = (
    b'<Property name="SiloItemId" type="App::PropertyString" group="Silo" doc="Identity of the item in Silo"'
    b' attr="0" ro="0" hide="0">\n                    <String value="%s"/>\n                </Property>'
)
_COUNT = re.compile(rb"""(<Properties\b[^<>]*?\sCount\s*=\s*["'])(\d+)(["'])""")


def with_meta(text: bytes, key: str, value: str, depth_limit: int) -> bytes:
    """The text with ``Meta[key] = value``. Raises ValueError where it cannot be edited (says why)."""
    if careful.as_utf8(text) is not text:
        raise Malformed("is not in UTF-8")
    head, _ = careful.index_document(text, depth_limit)
    if head.properties is None:
        raise Malformed("has no document properties")
    begin, end = head.properties
    element = text[begin:end]
    spans = careful.index_properties(element, depth_limit)
    if "Meta" in spans:
        first, last = spans["Meta"]
        items = _items(careful.parse_value(element[first:last], depth_limit))
        items[key] = value
        element = element[:first] + _property(element[first:last], items) + element[last:]
    else:
        element = _with_property(element, {key: value})
    return text[:begin] + element + text[end:]


def with_item_id(text: bytes, object_name: str, value: str, depth_limit: int) -> bytes:
    """The text with the property ``SiloItemId`` on an object, as the add-on writes it there.

    Raises ValueError where it cannot be edited (says why).
    """
    _, data = careful.index_document(text, depth_limit)
    if object_name not in data:
        raise Malformed(f"has no data of the object {object_name!r}")
    begin, end = data[object_name]
    element = text[begin:end]
    spans = careful.index_properties(element, depth_limit)
    if not spans:
        raise Malformed(f"has no properties of the object {object_name!r}")
    prop = _ITEM_ID % escape(value, _MORE).encode()
    if "SiloItemId" in spans:
        first, last = spans["SiloItemId"]
        element = element[:first] + prop + element[last:]
    else:
        # Before the first property stands the start of their list, whatever stood before that.
        start = element.rindex(b"<Properties", 0, min(span[0] for span in spans.values()))
        close = max(span[1] for span in spans.values())
        head = _COUNT.sub(lambda m: m[1] + b"%d" % (int(m[2]) + 1) + m[3], element[start:close], count=1)
        element = element[:start] + head + b"\n                " + prop + element[close:]
    return text[:begin] + element + text[end:]


def without_identity(text: bytes, object_name: str, keys: Iterable[str], depth_limit: int) -> bytes:
    """The text without these keys in ``Meta``, and without an identity on the object."""
    head, data = careful.index_document(text, depth_limit)
    if head.properties is None or object_name not in data:
        raise Malformed(f"has no data of the object {object_name!r}")
    begin, end = data[object_name]
    text = text[:begin] + _without_properties(text[begin:end], depth_limit) + text[end:]
    begin, end = head.properties  # stands before all objects
    element = text[begin:end]
    spans = careful.index_properties(element, depth_limit)
    if "Meta" in spans:
        first, last = spans["Meta"]
        items = _items(careful.parse_value(element[first:last], depth_limit))
        kept = {key: value for key, value in items.items() if key not in set(keys)}
        if kept != items:
            element = element[:first] + _property(element[first:last], kept) + element[last:]
    return text[:begin] + element + text[end:]


def _without_properties(element: bytes, depth_limit: int) -> bytes:
    spans = careful.index_properties(element, depth_limit)
    for name in ("SiloItemId", "SiloUUID"):
        if name not in spans:
            continue
        start = element.rindex(b"<Properties", 0, min(span[0] for span in spans.values()))
        first, last = spans[name]
        head = _COUNT.sub(lambda m: m[1] + b"%d" % (int(m[2]) - 1) + m[3], element[start:first], count=1)
        element = element[:start] + head.rstrip() + element[last:]
        spans = careful.index_properties(element, depth_limit)
    return element


def _items(prop: Node) -> dict[str, str]:
    maps = [child for child in prop.children if child.tag == "Map"]
    items = (child.attributes for child in (maps[0].children if maps else ()) if child.tag == "Item")
    return {item["key"]: item.get("value", "") for item in items if "key" in item}


def _property(old: bytes, items: dict[str, str]) -> bytes:
    """The property with other items; its own start tag is kept."""
    start = _start_tag(old)
    return start.rstrip(b"/> \t\r\n") + b">" + _map(items) + b"\n        </Property>"


def _start_tag(element: bytes) -> bytes:
    """The first tag; a ``>`` may stand inside its quotes."""
    found = re.match(rb"""<(?:[^<>"']|"[^"]*"|'[^']*')*>""", element)
    if found is None:
        raise Malformed("has a property that cannot be edited")
    return found[0]


def _map(items: dict[str, str]) -> bytes:
    # As FreeCAD lays it out (PropertyMap::Save); a std::map is written in the order of its keys' bytes.
    lines = [f'\n            <Map count="{len(items)}">']
    for key in sorted(items, key=str.encode):
        lines.append(
            f'\n                <Item key="{escape(key, _MORE)}" value="{escape(items[key], _MORE)}"/>'
        )
    return "".join((*lines, "\n            </Map>")).encode()


def _with_property(element: bytes, items: dict[str, str]) -> bytes:
    """The ``<Properties>`` element with a ``Meta`` at its end, and counted."""
    start = _start_tag(element)
    counted = _COUNT.sub(lambda m: m[1] + b"%d" % (int(m[2]) + 1) + m[3], start, count=1)
    prop = (
        b'    <Property name="Meta" type="App::PropertyMap">' + _map(items) + b"\n        </Property>\n    "
    )
    if start.endswith(b"/>"):
        return counted[:-2].rstrip() + b">\n    " + prop + b"</Properties>"
    close = element.rindex(b"</")
    return counted + element[len(start) : close] + prop + element[close:]
