# SPDX-License-Identifier: LGPL-2.1-or-later
"""Write a Silo identity, or the answer if an object counts, into an FCStd file, and nothing else.

The identity goes into the document's ``Meta`` map, which every FreeCAD keeps, also in partial loads (FreeCAD
0.20 has no document properties of its own).

Where things are in the XML is asked of expat, so comments, other quotes and another order of attributes do no
harm.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from silo.bom.errors import DocumentError
from silo.bom.message import message
from silo.bom.walk.document import own
from silo.bom.walk.identity import META_KEY, meta_key, own_identity
from silo.bom.walk.kinds import has_own
from silo.fcstd import expat_reader
from silo.fcstd.container import ContainerFile, FileStat, ZipEntry
from silo.fcstd.edit import changed, check_writable, edited_xml, in_attribute, replace_file
from silo.fcstd.expat_reader import Malformed, Span, XmlElement
from silo.fcstd.library import Library
from silo.fcstd.limits import Limits
from silo.fcstd.repack import replaced_entry
from silo.platform.spelling import one_path

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
    """Write ``identity`` into the file; returns False if the file had it already.

    object_name
        the object to which the identity belongs, if a file gives several parts: ``Meta["SiloUUID/<Name>"]``;
        None: the whole document, ``Meta["SiloUUID"]``.
    item_object
        the object that is the component: it gets the property ``SiloItemId`` too, by which a Silo finds the
        documents that are its own.
    replace
        write over another identity.

    Raises DocumentError: the file cannot be read or written, is read-only, was changed meanwhile, carries
    another identity, or has no such object. The file is then unchanged.
    """
    real = one_path(str(path))
    _check_identity(real, identity)
    limits = limits or Limits()
    key = meta_key(object_name or "")
    with ContainerFile(real, limits) as container:
        state = container.state
        if _present(real, state, identity, object_name, replace, limits, item_object):
            return False
        check_writable(real)
        xml = _stamped_xml(container, key, identity, limits, item_object, replace)
        content = replaced_entry(container, *xml)
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

    Call it before an item is made on the server: a file that cannot name its item must not get one.
    """
    real = one_path(str(path))
    limits = limits or Limits()
    with ContainerFile(real, limits) as container:
        _present(real, container.state, "", object_name, replace, limits, item_object)
        check_writable(real)
        _stamped_xml(container, meta_key(object_name or ""), "0" * 36, limits, item_object, replace)


def unstamp(
    path: Path | str, object_name: str, *, no_part: bool = False, limits: Limits | None = None
) -> bool:
    """Take the identity of one object out of the file; returns False if there was nothing to do.

    no_part
        the object gets ``SiloBomExclude``: a user decided that it is no part. Otherwise the property is
        removed.

    The document's own identity stays. Raises DocumentError as :func:`stamp` does.
    """
    real = one_path(str(path))
    limits = limits or Limits()
    with ContainerFile(real, limits) as container:
        state = container.state
        with Library(limits=limits) as library:
            obj = library.open(real).getObject(object_name)
            if obj is None:
                raise DocumentError(
                    real, message("it holds no object named {object_name}", object_name=repr(object_name))
                )
            if own_identity(obj) is None and (own(obj, "SiloBomExclude") is True) == no_part:
                return False
        check_writable(real)

        def edit(text: bytes) -> bytes:
            changes: dict[str, bytes | None] = dict.fromkeys(("SiloItemId", "SiloUUID"))
            changes["SiloBomExclude"] = _ANSWER % b"true" if no_part else None
            return _edited(text, {meta_key(object_name): None}, object_name, changes, limits.depth)

        content = replaced_entry(container, *edited_xml(container, edit, limits))

    def check(copy: str) -> None:
        with Library() as library:
            read = library.open(copy).getObject(object_name)
            if read is None or own_identity(read) is not None:
                raise DocumentError(real, message("the copy still holds the identity; the file is unchanged"))
            if (own(read, "SiloBomExclude") is True) != no_part:
                raise DocumentError(
                    real, message("the copy does not have the mark as wanted; the file is unchanged")
                )

    replace_file(real, state, content, check)
    return True


def answer(path: Path | str, object_name: str, *, counts: bool, limits: Limits | None = None) -> bool:
    """Keep in the file if an object counts, whatever the view shows (``SiloBomExclude``); returns False if
    the file says so already. Raises DocumentError as :func:`stamp` does.
    """
    real = one_path(str(path))
    limits = limits or Limits()

    def answered(file: str) -> bool:
        with Library(limits=limits) as library:
            obj = library.open(file).getObject(object_name)
            if obj is None:
                raise DocumentError(real, f"it holds no object named {object_name!r}")
            return own(obj, "SiloBomExclude") is (not counts) and has_own(obj, "SiloBomExclude")

    with ContainerFile(real, limits) as container:
        state = container.state
        if answered(real):
            return False
        check_writable(real)
        changes = {"SiloBomExclude": _ANSWER % (b"false" if counts else b"true")}
        content = replaced_entry(
            container,
            *edited_xml(
                container, lambda text: _edited(text, {}, object_name, changes, limits.depth), limits
            ),
        )

    def check(copy: str) -> None:
        if not answered(copy):
            raise DocumentError(real, "the copy does not have the answer; the file is unchanged")

    replace_file(real, state, content, check)
    return True


def _check_identity(path: str, identity: str) -> None:
    odd = any(unicodedata.category(c) in ("Cc", "Cs", "Cn") or c in "\ufffe\uffff" for c in identity)
    if not identity.strip() or identity != identity.strip() or len(identity) > _LONGEST or odd:
        raise DocumentError(
            path,
            message(
                "{identity} is not an identity: wanted one line of 1 to {longest} characters",
                identity=repr(identity),
                longest=_LONGEST,
            ),
        )


def _present(
    path: str,
    state: FileStat,
    identity: str,
    object_name: str | None,
    replace: bool,
    limits: Limits,
    item_object: str | None,
) -> bool:
    """Return True if the identity is in each of its places. Raises DocumentError if another identity is."""
    with Library(limits=limits) as library:
        document = library.open(path)
        if document.state != state:
            raise changed(path)
        places: list[tuple[object, str]] = [] if object_name is not None else [(document, "SiloUUID")]
        for wanted in dict.fromkeys(filter(None, (object_name, item_object))):
            obj = document.getObject(wanted)
            if obj is None:
                raise DocumentError(path, message("it holds no object named {wanted}", wanted=repr(wanted)))
            places += [(obj, "SiloItemId"), (obj, "SiloUUID")]
        # A property of its own goes before Meta, so Meta would have no effect beside another one.
        others = {name: own for owner, name in places if (own := _text_of(owner, name))}
        others = {name: own for name, own in others.items() if own.lower() != identity.lower()}
        for name, own in others.items() if not replace else ():
            raise DocumentError(
                path,
                message("its own property {name} is another identity already: {own}", name=name, own=own),
            )
        item = document.getObject(item_object) if item_object else None
        named = item is None or bool(_text_of(item, "SiloItemId"))
        present = document.Meta.get(meta_key(object_name or ""), "").strip()
    same = present.lower() == identity.lower()
    if present and not same and not replace:
        what = META_KEY if object_name is None else f"{META_KEY} of {object_name}"
        raise DocumentError(
            path,
            message("it carries another identity already ({what}): {present}", what=what, present=present),
        )
    return same and named and not others


def _text_of(owner: object, name: str) -> str:
    value = getattr(owner, name, None)
    return value.strip() if isinstance(value, str) else ""


def _stamped_xml(
    container: ContainerFile, key: str, identity: str, limits: Limits, item_object: str | None, replace: bool
) -> tuple[ZipEntry, bytes]:
    """Return the entry Document.xml and its text with the identity."""

    def edit(text: bytes) -> bytes:
        gone = ("SiloUUID",) if replace else ()
        own = {**dict.fromkeys(gone), "SiloItemId": _ITEM_ID % in_attribute(identity).encode()}
        whole = gone if key == META_KEY else ()
        return _edited(text, {key: identity}, item_object, own, limits.depth, whole)

    return edited_xml(container, edit, limits)


def _read_back(path: str, temporary: str, key: str, identity: str) -> None:
    try:
        with Library() as library:
            read = library.open(temporary).Meta.get(key)
    except DocumentError as error:
        reason = message(
            "the stamped copy cannot be read ({reason}); the file is unchanged", reason=error.reason
        )
        raise DocumentError(path, reason) from error
    if read != identity:
        raise DocumentError(
            path, message("the stamped copy does not hold the identity; the file is unchanged")
        )


# As FreeCAD writes what the add-on adds: asks for no recompute (8), and cannot be edited by accident.
_ITEM_ID = (
    b'<Property name="SiloItemId" type="App::PropertyString" group="Silo" doc="Identity of the item in Silo"'
    b' attr="8" ro="1" hide="0">\n                    <String value="%s"/>\n                </Property>'
)
_ANSWER = (
    b'<Property name="SiloBomExclude" type="App::PropertyBool" group="Silo" doc="True: no part of any BOM"'
    b' attr="0" ro="0" hide="0">\n                    <Bool value="%s"/>\n                </Property>'
)
_META = b'<Property name="Meta" type="App::PropertyMap">'
_COUNT = re.compile(rb"""(<Properties\b[^<>]*?\sCount\s*=\s*["'])(\d+)(["'])""")


def _edited(
    text: bytes,
    meta: Mapping[str, str | None],
    object_name: str | None,
    properties: Mapping[str, bytes | None],
    depth_limit: int,
    whole: Iterable[str] = (),
) -> bytes:
    """Set these keys in ``Meta`` and these properties of the object, and remove those named in ``whole`` from
    the document. None removes a key or a property. Raises ValueError, with the reason, if the text cannot be
    edited.
    """
    if expat_reader.as_utf8(text) is not text:
        raise Malformed(message("is not in UTF-8"))
    head, data = expat_reader.index_document(text, depth_limit)
    if head.properties is None:
        raise Malformed(message("has no document properties"))
    edits: list[tuple[Span, Callable[[bytes], bytes]]]
    edits = [
        (
            head.properties,
            lambda e: _with_all(_with_meta(e, meta, depth_limit), dict.fromkeys(whole), depth_limit),
        )
    ]
    if object_name is not None:
        if object_name not in data:
            raise Malformed(message("has no data of the object {object_name}", object_name=repr(object_name)))
        edits.append((data[object_name], lambda element: _with_all(element, properties, depth_limit)))
    for (begin, end), edit in sorted(edits, key=lambda change: change[0], reverse=True):
        text = text[:begin] + edit(text[begin:end]) + text[end:]
    return text


def _with_meta(element: bytes, changes: Mapping[str, str | None], depth_limit: int) -> bytes:
    span = expat_reader.index_properties(element, depth_limit).get("Meta")
    old = element[slice(*span)] if span else b""
    meta = _items(expat_reader.parse_value(old, depth_limit)) if span else {}
    items = {key: value for key, value in {**meta, **changes}.items() if value is not None}
    if items == meta:
        return element
    start = _start_tag(old).rstrip(b"/> \t\r\n") + b">" if span else _META
    prop = start + _map(items) + b"\n        </Property>"
    return _with_property(element, "Meta", prop, b"\n        ", depth_limit)


def _with_all(element: bytes, properties: Mapping[str, bytes | None], depth_limit: int) -> bytes:
    for name, prop in properties.items():
        element = _with_property(element, name, prop, b"\n                ", depth_limit)
    return element


def _with_property(element: bytes, name: str, prop: bytes | None, indent: bytes, depth_limit: int) -> bytes:
    """Set a property in a ``<Properties>`` element, or in the ``<Object>`` around it; None removes it."""
    spans = expat_reader.index_properties(element, depth_limit)
    here = spans.get(name)
    if here is not None and prop is not None:
        return element[: here[0]] + prop + element[here[1] :]
    if here is None and prop is None:
        return element
    # The start of the list is directly before the first property.
    start = element.rfind(b"<Properties", 0, min((span[0] for span in spans.values()), default=len(element)))
    if start < 0:
        raise Malformed(message("has an object without properties"))
    tag = _start_tag(element[start:])
    step = 1 if here is None else -1
    counted = _COUNT.sub(lambda match: match[1] + b"%d" % (int(match[2]) + step) + match[3], tag, count=1)
    begin = start + len(tag)
    if here is not None:
        rest = element[begin : here[0]].rstrip() + element[here[1] :]
    elif tag.endswith(b"/>"):
        counted = counted[:-2].rstrip() + b">"
        rest = indent + (prop or b"") + indent[:-4] + b"</Properties>" + element[begin:]
    else:
        at = max((span[1] for span in spans.values()), default=begin)
        rest = element[begin:at] + indent + (prop or b"") + element[at:]
    return element[:start] + counted + rest


def _items(prop: XmlElement) -> dict[str, str]:
    maps = [child for child in prop.children if child.tag == "Map"]
    items = (child.attributes for child in (maps[0].children if maps else ()) if child.tag == "Item")
    return {item["key"]: item.get("value", "") for item in items if "key" in item}


def _start_tag(element: bytes) -> bytes:
    """Return the first tag; its quotes may hold a ``>``."""
    match = re.match(rb"""<(?:[^<>"']|"[^"]*"|'[^']*')*>""", element)
    if match is None:
        raise Malformed(message("has a property that cannot be edited"))
    return match[0]


def _map(items: dict[str, str]) -> bytes:
    # As FreeCAD lays it out (PropertyMap::Save); a std::map is written in the order of its keys' bytes.
    lines = [f'\n            <Map count="{len(items)}">']
    for key in sorted(items, key=str.encode):
        lines.append(
            f'\n                <Item key="{in_attribute(key)}" value="{in_attribute(items[key])}"/>'
        )
    return "".join((*lines, "\n            </Map>")).encode()
