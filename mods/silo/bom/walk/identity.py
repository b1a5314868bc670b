# SPDX-License-Identifier: LGPL-2.1-or-later
"""The Silo identity of a component.

It is read in this order (the real Silo writes ``SiloItemId`` on objects, the spec ``SiloUUID`` on documents):

1. the object's own ``SiloItemId``, then its own ``SiloUUID``;
2. ``Meta["SiloUUID/<object Name>"]`` of its document: one file may give several parts, and FreeCAD 0.20 has
   no document properties but keeps ``Meta``;
3. the document's ``SiloUUID`` property;
4. ``Meta["SiloUUID"]`` of its document.

Part numbers are never parsed, and never taken from labels.
"""

from __future__ import annotations

from collections.abc import Mapping
from uuid import UUID

from silo.bom.walk.document import document_property, object_name, own

META_KEY = "SiloUUID"


def meta_key(obj_name: str = "") -> str:
    """Return the key in ``Meta`` for the identity of the whole document, or of one of its objects."""
    return f"{META_KEY}/{obj_name}" if obj_name else META_KEY


def _text(value: object) -> str | None:
    return value.strip() or None if isinstance(value, str) else None


def identity_of(obj: object) -> str | None:
    """Return the Silo UUID of a component (the real part or assembly, not a link to it); None while
    unregistered.
    """
    return own_identity(obj) or document_identity(getattr(obj, "Document", None))


def as_uuid(text: str) -> str:
    """Return a UUID in its one written form; "" if the text is none. Files have it in capitals, or in
    braces.
    """
    try:
        return str(UUID(text))
    except ValueError:
        return ""


def own_identity(obj: object) -> str | None:
    """Return the identity that is written for this very object, not that of its document."""
    for name in ("SiloItemId", "SiloUUID"):
        if identity := _text(own(obj, name)):
            return identity
    name = object_name(obj)
    return _text(_meta(getattr(obj, "Document", None)).get(meta_key(name))) if name else None


def document_identity(doc: object) -> str | None:
    """Return the identity that is written for the whole document."""
    if doc is None:
        return None
    return _text(document_property(doc, "SiloUUID")) or _text(_meta(doc).get(META_KEY))


def held_items(doc: object) -> tuple[tuple[str, str], ...]:
    """Return the items that a document says it holds: (identity, object), in document order.

    The object is "" for the identity of the file as a whole, which comes first.
    """
    whole = document_identity(doc)
    own = [(own_identity(obj), object_name(obj)) for obj in getattr(doc, "Objects", None) or ()]
    return (*([(whole, "")] if whole else ()), *((identity, name) for identity, name in own if identity))


def sole_identity(doc: object) -> str | None:
    """Return the item to which a file without an assembly belongs; None if it has several or none."""
    if whole := document_identity(doc):
        return whole
    items = {identity for identity, _ in held_items(doc)}
    return items.pop() if len(items) == 1 else None


def _meta(doc: object) -> Mapping[str, str]:
    meta = getattr(doc, "Meta", None)
    return meta if isinstance(meta, Mapping) else {}
