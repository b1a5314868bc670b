# SPDX-License-Identifier: LGPL-2.1-or-later
"""A Silo identity in a live document: written to every place that survives in all versions, or removed.

FreeCAD's main thread only; the caller saves.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from silo.bom.message import message
from silo.workbench.freecad.modified import others_unmarked


def write_identity(doc: Any, name: str, identity: str, *, whole_document: bool) -> None:
    """Write a Silo identity in every place that survives in all versions; the caller saves.

    name
        ``Name`` of the component's object; "" for the document itself.
    whole_document
        the document is this one component, so it carries the identity as well. Otherwise only the object has
        the identity (:mod:`silo.bom.walk.identity` says where it is looked for).
    """
    from silo.bom.errors import DocumentError
    from silo.bom.walk.identity import meta_key

    obj = doc.getObject(name) if name else None
    if name and obj is None:
        raise DocumentError(doc.FileName, message("it has no object {name} any more", name=name))
    with others_unmarked(doc):
        if obj is not None:
            _set(obj, "SiloItemId", identity)
            if "SiloUUID" in obj.PropertiesList:
                _set(obj, "SiloUUID", identity)
        # Meta gives a copy: only assigning a whole dictionary changes it.
        doc.Meta = {**doc.Meta, meta_key("" if whole_document else name): identity}
        if whole_document and hasattr(doc, "addProperty"):
            _set(doc, "SiloUUID", identity)


def remove_identity(doc: Any, name: str, *, no_part: bool = False, whole_document: bool = False) -> None:
    """Remove the identity of one object from every place. The caller saves.

    no_part
        the object gets ``SiloBomExclude``, since a user decided that it is no part. Otherwise the property
        is removed.
    whole_document
        the document's own identity is removed too; otherwise it stays.
    """
    from silo.bom.walk.identity import meta_key

    obj = doc.getObject(name)
    with others_unmarked(doc):
        for place in ("SiloItemId", "SiloUUID", "SiloBomExclude") if obj is not None else ():
            if place in obj.PropertiesList and not obj.removeProperty(place):
                _set(obj, place, type(obj.getPropertyByName(place))())
        if obj is not None and no_part:
            _set(obj, "SiloBomExclude", True, "App::PropertyBool", "True: no part of any BOM", locked=False)
        gone = {meta_key(name), *([meta_key()] if whole_document else [])}
        doc.Meta = {key: value for key, value in doc.Meta.items() if key not in gone}
        if whole_document and "SiloUUID" in getattr(doc, "PropertiesList", ()):
            _set(doc, "SiloUUID", "")


def write_answer(doc: Any, names: Iterable[str], *, counts: bool) -> list[str]:
    """Keep in the objects if they count, whatever the view shows, in one step of undo; returns their labels.
    The caller saves.
    """
    objects = [obj for obj in map(doc.getObject, names) if obj is not None]
    doc.openTransaction("Silo: count" if counts else "Silo: reference")
    with others_unmarked(doc):
        for obj in objects:
            tip = "True: no part of any BOM"
            _set(obj, "SiloBomExclude", not counts, "App::PropertyBool", tip, locked=False)
    doc.commitTransaction()
    return [str(obj.Label) for obj in objects]


# FreeCAD's number for "a change of it asks for no recompute" (Prop_Output of App::PropertyType).
_OUTPUT = 8


def _set(
    owner: Any,
    name: str,
    value: Any,
    kind: str = "App::PropertyString",
    tip: str = "Identity of the item in Silo",
    *,
    locked: bool = True,
) -> None:
    """Set a property without touching its object.

    A touched object touches all links to it, and the next recompute marks their documents as edited.
    """
    if name not in owner.PropertiesList:
        owner.addProperty(kind, name, "Silo", tip, _OUTPUT, locked)
    if hasattr(owner, "State") and "Output" not in owner.getPropertyStatus(name):
        owner.setPropertyStatus(name, "Output")
    setattr(owner, name, value)
