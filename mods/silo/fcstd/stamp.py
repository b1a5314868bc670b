# SPDX-License-Identifier: LGPL-2.1-or-later
"""Write a Silo identity into an FCStd file, and nothing else.

The identity goes into the document's ``Meta`` map, which every FreeCAD keeps, also in partial loads (FreeCAD
0.20 has no document properties of its own). Only ``Document.xml`` is packed anew; all other entries keep
their bytes, order and times. The file is replaced in one step, so a reader sees the old one or the new one.

Where things are in the XML is asked of expat, so comments, other quotes and another order of attributes do no
harm.
"""

from __future__ import annotations

import os
import re
import unicodedata
from collections.abc import Iterable
from pathlib import Path
from xml.sax.saxutils import escape

from silo.bom.errors import DocumentError
from silo.bom.identity import META_KEY, meta_key, own_identity
from silo.fcstd import careful
from silo.fcstd.careful import Malformed, Node
from silo.fcstd.container import ContainerFile, Entry, FileState
from silo.fcstd.edit import changed, check_writable, edited_xml, replace_file, replaced_entry
from silo.fcstd.library import Library
from silo.fcstd.limits import Limits

_LONGEST = 200


def stamp(
    path: Path | str,
    identity: str,
    *,
    object_name: str | None = None,
    item_object: str | None = None,
    replace: bool = False,
    limits: Limits | None = None,
) -> bool:
    """Write ``identity`` into the file; True where it was written, False where the file had it already.

    object_name
        the object that the identity is for, where one file gives several parts: ``Meta["SiloUUID/<Name>"]``;
        None: the whole document, ``Meta["SiloUUID"]``.
    item_object
        the object that is the component: it gets the property ``SiloItemId`` too, by which a Silo finds the
        documents that are its own.
    replace
        write over another identity of the same key.

    Raises DocumentError: the file cannot be read or written, is read-only, was changed meanwhile, carries
    another identity, or has no such object. The file is then as it was.
    """
    real = os.path.realpath(path)
    _check_identity(real, identity)
    limits = limits or Limits()
    key = meta_key(object_name or "")
    with ContainerFile(real, limits) as container:
        state = container.state
        if _present(real, state, identity, object_name, replace, limits, item_object):
            return False
        check_writable(real)
        content = replaced_entry(container, *_stamped_xml(container, key, identity, limits, item_object))
    replace_file(real, state, content, lambda copy: _read_back(real, copy, key, identity))
    return True


def check_stampable(
    path: Path | str,
    *,
    object_name: str | None = None,
    item_object: str | None = None,
    replace: bool = False,
    limits: Limits | None = None,
) -> None:
    """Raise the DocumentError that :func:`stamp` would raise for a new identity; changes nothing.

    Asked before an item is made on the server: a file that cannot name its item shall get none.
    """
    real = os.path.realpath(path)
    limits = limits or Limits()
    with ContainerFile(real, limits) as container:
        _present(real, container.state, "", object_name, replace, limits, item_object)
        check_writable(real)
        _stamped_xml(container, meta_key(object_name or ""), "0" * 36, limits, item_object)


def unstamp(path: Path | str, object_name: str, *, limits: Limits | None = None) -> bool:
    """Take the identity of one object out of the file; False where it had none.

    The document's own identity stays. Raises DocumentError as :func:`stamp` does.
    """
    real = os.path.realpath(path)
    limits = limits or Limits()
    with ContainerFile(real, limits) as container:
        state = container.state
        with Library(limits=limits) as library:
            obj = library.open(real).getObject(object_name)
            if obj is None:
                raise DocumentError(real, f"it holds no object named {object_name!r}")
            if own_identity(obj) is None:
                return False
        check_writable(real)

        def edit(text: bytes) -> bytes:
            return without_identity(text, object_name, [meta_key(object_name)], limits.depth)

        content = replaced_entry(container, *edited_xml(container, edit, limits))

    def check(copy: str) -> None:
        with Library() as library:
            read = library.open(copy).getObject(object_name)
            if read is None or own_identity(read) is not None:
                raise DocumentError(real, "the copy still holds the identity; the file is unchanged")

    replace_file(real, state, content, check)
    return True


def _check_identity(path: str, identity: str) -> None:
    odd = any(unicodedata.category(c) in ("Cc", "Cs", "Cn") or c in "\ufffe\uffff" for c in identity)
    if not identity.strip() or identity != identity.strip() or len(identity) > _LONGEST or odd:
        raise DocumentError(
            path, f"{identity!r} is no identity: wanted is one line of 1 to {_LONGEST} characters"
        )


def _present(
    path: str,
    state: FileState,
    identity: str,
    object_name: str | None,
    replace: bool,
    limits: Limits,
    item_object: str | None,
) -> bool:
    """True where the file carries the identity already. Raises DocumentError where it carries another."""
    with Library(limits=limits) as library:
        document = library.open(path)
        if document.state != state:
            raise changed(path)
        places: list[tuple[object, str]] = [] if object_name is not None else [(document, "SiloUUID")]
        for wanted in dict.fromkeys(filter(None, (object_name, item_object))):
            obj = document.getObject(wanted)
            if obj is None:
                raise DocumentError(path, f"it holds no object named {wanted!r}")
            places += [(obj, "SiloItemId"), (obj, "SiloUUID")]
        for owner, name in places:
            # A property of its own goes before Meta, so Meta would have no effect beside another one.
            own = _text_of(owner, name)
            if own and own.lower() != identity.lower():
                raise DocumentError(path, f"its own property {name} is another identity already: {own}")
        present = document.Meta.get(meta_key(object_name or ""), "").strip()
    same = present.lower() == identity.lower()
    if present and not same and not replace:
        what = META_KEY if object_name is None else f"{META_KEY} of {object_name}"
        raise DocumentError(path, f"it carries another identity already ({what}): {present}")
    return same


def _text_of(owner: object, name: str) -> str:
    value = getattr(owner, name, None)
    return value.strip() if isinstance(value, str) else ""


def _stamped_xml(
    container: ContainerFile, key: str, identity: str, limits: Limits, item_object: str | None
) -> tuple[Entry, bytes]:
    """The entry Document.xml, and its content as it is to become."""

    def edit(text: bytes) -> bytes:
        stamped = with_meta(text, key, identity, limits.depth)
        return with_item_id(stamped, item_object, identity, limits.depth) if item_object else stamped

    return edited_xml(container, edit, limits)


def _read_back(path: str, temporary: str, key: str, identity: str) -> None:
    try:
        with Library() as library:
            read = library.open(temporary).Meta.get(key)
    except DocumentError as error:
        reason = f"the stamped copy cannot be read ({error.reason}); the file is unchanged"
        raise DocumentError(path, reason) from error
    if read != identity:
        raise DocumentError(path, "the stamped copy does not hold the identity; the file is unchanged")


_MORE = {'"': "&quot;", "'": "&apos;", "\n": "&#10;", "\r": "&#13;", "\t": "&#9;"}
# As FreeCAD writes what the add-on adds: asks for no recompute (8), and cannot be edited by accident.
_ITEM_ID = (
    b'<Property name="SiloItemId" type="App::PropertyString" group="Silo" doc="Identity of the item in Silo"'
    b' attr="8" ro="1" hide="0">\n                    <String value="%s"/>\n                </Property>'
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
