# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which members of a FreeCAD container have a mass of their own, and which object is measured."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from silo.bom.document import derived, label_of, object_name, own
from silo.bom.errors import DocumentError, InputError
from silo.bom.roots import DocumentRoot, choose_assembly
from silo.bom.walk.kinds import Kind, kind_of, members
from silo.inertia.geometry.freecad.facts import Facts
from silo.inertia.wording import listed

Note = Callable[[str, str], None]
"""Takes a remark: its code, and a plain sentence."""

MODELLED = (Kind.LOCAL, Kind.COMPOUND, Kind.COPY)
"""Geometry that is modelled in the container's own file."""

_CONSUMING = frozenset(
    [
        "Base",
        "Tool",
        "Shapes",
        "Source",
        "Sources",
        "Object",
        "Objects",
        "BaseFeature",
        "Profile",
        "Sections",
        "Spine",
        "Links",
        "Bodies",
        "Refine",
        "Subtractions",
        "Shape1",
        "Shape2",
        "Parts",
    ]
)
"""Properties by which a feature makes its shape of others, which then are no bodies of their own."""


def counted(container: Any, facts: Facts, note: Note) -> list[Any]:
    """The members that have a mass of their own."""
    found = list(_flat(container, facts, note, set()))
    eaten = {name for member in found for name in _consumed(member)}
    left = [m for m in found if object_name(m) not in eaten or kind_of(m) is Kind.CONTAINER]
    bodies = [m for m in left if kind_of(m) in MODELLED]
    hidden = [m for m in bodies if own(m, "Visibility") is False]
    shown = [m for m in bodies if own(m, "Visibility") is not False]
    if hidden and shown:
        names = listed([label_of(m) for m in hidden])
        note("hidden", f"bodies hidden beside visible ones are not counted: {names}")
        left = [m for m in left if m not in hidden]
    return left


def _flat(container: Any, facts: Facts, note: Note, seen: set[str]) -> Iterable[Any]:
    for member in members(container):
        name = object_name(member)
        if name in seen:
            continue
        seen.add(name)
        kind = kind_of(member)
        if own(member, "Suppressed") is True or own(member, "SiloBomExclude") is True:
            note(
                "not_counted",
                f"“{label_of(member)}” is suppressed, or excluded from the BOM; its mass is not counted",
            )
        elif kind is Kind.FOLDER:
            yield from _flat(member, facts, note, seen)
        elif kind in (*MODELLED, Kind.FOREIGN, Kind.STANDARD):
            if facts.shape(member) is not None:
                yield member
            elif derived(member, "Mesh::Feature"):
                note("not_counted", f"“{label_of(member)}” is a mesh and no solid; its mass is not counted")
        elif kind is not Kind.NOTHING and not name.startswith("CopyOnChangeGroup"):
            yield member


def _consumed(feature: Any) -> Iterable[str]:
    """Names of the objects that a feature takes its shape from."""
    if kind_of(feature) not in (*MODELLED, Kind.DRAFT_ARRAY):
        return
    for name in getattr(feature, "PropertiesList", ()):
        if name in _CONSUMING or (name == "Group" and derived(feature, "PartDesign::Boolean")):
            value = getattr(feature, name, None)
            for item in value if isinstance(value, tuple | list) else (value,):
                target = item[0] if isinstance(item, tuple) and item else item
                if hasattr(target, "TypeId"):
                    yield object_name(target)


def steps_of(sub: Any) -> list[str] | None:
    """The object names in a sub-name such as ``Inner.Bolt.``; None where it ends in a face or an edge."""
    text = sub if isinstance(sub, str) else next((str(part) for part in sub or ()), "")
    *steps, last = text.split(".")
    return None if last else [step for step in steps if step and not step.isdigit()]


def child_named(container: Any, name: str) -> Any:
    for member in members(container):
        if object_name(member) == name:
            return member
    look_up = getattr(getattr(container, "Document", None), "getObject", None)
    return look_up(name) if callable(look_up) else None


def top_object(document: Any, name: str | None) -> Any:
    """The object to measure: the named one, the assembly, or all that stands free in the document."""
    if name is not None and (found := document.getObject(name)) is not None:
        return found
    try:
        top = choose_assembly(document, name)
    except InputError as error:
        raise DocumentError(document.FileName, str(error)) from error
    if not getattr(top, "is_document_root", False):
        return top
    objects = document.Objects
    claimed = {
        object_name(member)
        for obj in objects
        if kind_of(obj) is not Kind.FOLDER
        for attribute in ("Group", "ElementList")
        for member in own(obj, attribute) or ()
    }
    wanted = [
        o for o in objects if object_name(o) not in claimed and kind_of(o) not in (Kind.NOTHING, Kind.FOLDER)
    ]
    return wanted[0] if len(wanted) == 1 else DocumentRoot(document, wanted)
