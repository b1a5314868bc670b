# SPDX-License-Identifier: LGPL-2.1-or-later
"""From FreeCAD objects to products and their uses: what :mod:`silo.bom.links` counts, with the placements.

How FreeCAD places things (``src/App/Link.cpp``, tried with 0.20 and 1.0):

* a member of a part or an assembly stands at its own ``Placement`` in it;
* a link stands at its own placement, then its scale, then its element's placement and scale; the target's own
  placement counts only with ``LinkTransform``, and the same holds at every hop of a chain;
* an AssemblyLink is a link without it; a flexible one has the placements of its own copies.

What counts: links as in the BOM, hidden or not; of geometry modelled in place, what no sibling consumes (the
operands of a cut), and of that the visible, where any is.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from silo.bom.document import LinkProblem, derived, label_of, object_name, own, same_document
from silo.bom.errors import DocumentError
from silo.bom.kinds import Kind, is_container, is_named_assembly, kind_of, members
from silo.bom.model import BomEntry
from silo.bom.naming import display_name
from silo.bom.targets import is_assembly_link, is_link
from silo.inertia.geometry.freecad_materials import NOTHING, Material, material_of
from silo.inertia.geometry.freecad_places import (
    Entries,
    element_places,
    link_placement,
    list_places,
    placement,
    scale,
    shape_entry,
)
from silo.inertia.geometry.graph import MAX_DEPTH, Child, Floats, Node

MAX_HOPS = 64

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


@dataclass(frozen=True, eq=False)
class ShapeRef:
    """One shape of a product: where it is kept, and (4, 4) [mm] from its own axes to the product's."""

    path: str
    entry: str
    transform: Floats


@dataclass(frozen=True, eq=False)
class Leaf:
    """What a prototype is made from. ``broken`` says why there is nothing."""

    shapes: tuple[ShapeRef, ...] = ()
    material: Material = NOTHING
    broken: str = ""


@dataclass(eq=False)
class Walk:
    """Products of FreeCAD documents, each once; ``notes`` in plain words by code, each once."""

    entries: Entries
    base: str = ""
    nodes: dict[str, Node] = field(default_factory=dict)
    leaves: dict[str, Leaf] = field(default_factory=dict)
    documents: set[str] = field(default_factory=set)
    absent: set[str] = field(default_factory=set)
    notes: dict[str, list[str]] = field(default_factory=dict)
    _open: list[str] = field(default_factory=list)

    def note(self, code: str, message: str) -> None:
        """Keep one remark."""
        listed = self.notes.setdefault(code, [])
        if message not in listed:
            listed.append(message)

    # --- products ------------------------------------------------------------------------------------------

    def product(self, obj: Any, copies: Any = None) -> str:
        """The key of the product ``obj``, in its own axes; ``copies``: a flexible AssemblyLink of it."""
        self.documents.add(_file(obj))
        key = self._key(obj)
        if copies is not None:
            key += f" as in {object_name(copies)} of {_file(copies)}"
        if key in self.nodes:
            return key
        if key in self._open or len(self._open) > MAX_DEPTH:
            self.note("cycle", f"{label_of(obj)} contains itself; it is left out there")
            return self._nothing(obj, "it contains itself")
        self._open.append(key)
        if is_container(obj) or getattr(obj, "is_document_root", False):
            self._container(key, obj, _flexible_places(copies))
        else:
            self._leaf(key, obj, [(obj, np.eye(4))])
        self._open.pop()
        return key

    def _container(self, key: str, obj: Any, moved: dict[str, Floats]) -> None:
        found = self._counted(obj)
        shapes = [member for member in found if kind_of(member) in (Kind.LOCAL, Kind.FOREIGN)]
        materials = {material_of(member) for member in shapes}
        own_material = material_of(obj)
        one_piece = len(shapes) == len(found) and (own_material != NOTHING or len(materials) <= 1)
        if shapes and one_piece and not is_named_assembly(obj):
            self._leaf(key, obj, [(member, placement(member)) for member in shapes])
            return
        children: list[Child] = []
        for member in found:
            children += self._uses(member, moved.get(object_name(member)))
        self.nodes[key] = Node(key, self._name(obj), tuple(children))

    def _leaf(self, key: str, obj: Any, shapes: Sequence[tuple[Any, Floats]]) -> None:
        refs = [
            ShapeRef(_file(member), entry, transform)
            for member, transform in shapes
            if (entry := shape_entry(member)) is not None
        ]
        material = material_of(obj)
        if material == NOTHING and shapes:
            material = material_of(shapes[0][0])
        self.nodes[key] = Node(key, self._name(obj), has_geometry=True)
        self.leaves[key] = Leaf(tuple(refs), material)

    def _nothing(self, obj: Any, reason: str, name: str = "") -> str:
        key = f"nothing: {name or self._key(obj)} {reason}"
        self.nodes[key] = Node(key, name or self._name(obj), has_geometry=True)
        self.leaves[key] = Leaf(broken=reason)
        return key

    def _key(self, obj: Any) -> str:
        path = _file(obj)
        return f"{_relative(path, self.base)}#{object_name(obj)}"

    def _name(self, obj: Any) -> str:
        document = getattr(obj, "Document", None)
        entry = BomEntry(
            doc_path=_file(obj),
            object_name=object_name(obj),
            label=label_of(obj),
            document_label=getattr(document, "Label", "") or "",
        )
        return display_name(entry)

    # --- members -------------------------------------------------------------------------------------------

    def _counted(self, container: Any) -> list[Any]:
        """The members that have a mass of their own."""
        listed = list(self._flat(container, set()))
        eaten = {name for member in listed for name in _consumed(member)}
        left = [m for m in listed if object_name(m) not in eaten or kind_of(m) is Kind.CONTAINER]
        hidden = [m for m in left if kind_of(m) is Kind.LOCAL and own(m, "Visibility") is False]
        shown = [m for m in left if kind_of(m) is Kind.LOCAL and own(m, "Visibility") is not False]
        if hidden and shown:
            names = ", ".join(label_of(m) for m in hidden[:4])
            self.note("hidden", f"hidden bodies beside visible ones are not counted: {names}")
            left = [m for m in left if m not in hidden]
        return left

    def _flat(self, container: Any, seen: set[str]) -> Iterable[Any]:
        for member in members(container):
            name = object_name(member)
            if name in seen:
                continue
            seen.add(name)
            kind = kind_of(member)
            if own(member, "Suppressed") is True or own(member, "SiloBomExclude") is True:
                self.note("not_counted", f"{label_of(member)} is suppressed or excluded: no mass")
            elif kind is Kind.FOLDER:
                yield from self._flat(member, seen)
            elif kind in (Kind.LOCAL, Kind.FOREIGN):
                if shape_entry(member) is not None:
                    yield member
                elif derived(member, "Mesh::Feature"):
                    self.note("not_counted", f"{label_of(member)} is a mesh, and has no mass here")
            elif kind is not Kind.NOTHING and not name.startswith("CopyOnChangeGroup"):
                yield member

    # --- uses ----------------------------------------------------------------------------------------------

    def _uses(self, member: Any, moved: Floats | None) -> list[Child]:
        name = label_of(member)
        kind = kind_of(member)
        if kind is Kind.DRAFT_ARRAY:
            return self._draft_array(member)
        if kind in (Kind.LINK, Kind.ASSEMBLY_LINK):
            self._remark(member)
        return [
            Child(name, key, _metres(matrix)) for key, matrix in self._resolved(member, True, moved, MAX_HOPS)
        ]

    def _resolved(
        self, obj: Any, with_place: bool, moved: Floats | None, hops: int
    ) -> list[tuple[str, Floats]]:
        """Products that an object stands for, each with (4, 4) [mm] from its axes to those around ``obj``."""
        if hops <= 0:
            return [(self._nothing(obj, "its chain of links does not end"), np.eye(4))]
        own_place = moved if moved is not None else link_placement(obj)
        outer = own_place if with_place else np.eye(4)
        if is_assembly_link(obj):
            flexible = obj if own(obj, "Rigid") is False else None
            return [(key, outer @ inner) for key, inner in self._followed(obj, False, hops, flexible)]
        if is_link(obj) or derived(obj, "App::LinkElement"):
            outer = outer @ scale(obj)
            inside = self._followed(obj, own(obj, "LinkTransform") is True, hops, None)
            places = element_places(obj, self.entries) if is_link(obj) else [np.eye(4)]
            return [(key, outer @ place @ inner) for place in places for key, inner in inside]
        return [(self.product(obj), outer)]

    def _followed(self, link: Any, with_place: bool, hops: int, flexible: Any) -> list[tuple[str, Floats]]:
        target = getattr(link, "LinkedObject", None)
        sub: Any = ""
        if isinstance(target, tuple):
            target, sub = target
        if target is None:
            return [(self._broken(link), np.eye(4))]
        steps = _steps(sub)
        if steps is None:  # a reference to a face or an edge of something is no component
            self.note("not_counted", f"{label_of(link)} refers to {sub} of a part, and has no mass")
            return []
        if flexible is not None and not is_assembly_link(target):
            return [(self.product(target, copies=flexible), np.eye(4))]
        if not steps:
            return self._resolved(target, with_place, None, hops - 1)
        outer = placement(target) if with_place else np.eye(4)
        for step in steps[:-1]:
            target = _child(target, step)
            if target is None:
                return [(self._broken(link, step), np.eye(4))]
            outer = outer @ placement(target)
        last = _child(target, steps[-1])
        if last is None:
            return [(self._broken(link, steps[-1]), np.eye(4))]
        return [(key, outer @ inner) for key, inner in self._resolved(last, True, None, hops - 1)]

    def _broken(self, link: Any, missing: str = "") -> str:
        problem = getattr(link, "LinkProblem", None)
        if missing or not isinstance(problem, LinkProblem):
            return self._nothing(link, f"its target {missing or 'is gone'} cannot be found")
        if problem.file:
            stem = problem.file.replace("\\", "/").rpartition("/")[2].rpartition(".")[0]
            self.absent.add(f"{_file(link).rpartition('/')[0]}/{problem.file}")
            why = problem.detail or problem.code.value.replace("_", " ")
            return self._nothing(link, f"its file {problem.file} cannot be read: {why}", stem)
        return self._nothing(link, "its target is unset or gone")

    def _draft_array(self, array: Any) -> list[Child]:
        base = getattr(array, "Base", None)
        base = base[0] if isinstance(base, tuple) else base
        places = list_places(array, self.entries)
        if base is None or (not places and shape_entry(array) is not None):
            return [Child(label_of(array), self.product(array), _metres(placement(array)))]
        count = own(array, "Count", 0)
        if not places and isinstance(count, int) and count > 1:
            self.note(
                "not_counted", f"the array {label_of(array)} was saved without its placements; counted once"
            )
        inside = self._resolved(base, own(array, "LinkTransform") is True, None, MAX_HOPS)
        outer = placement(array)
        return [
            Child(label_of(array), key, _metres(outer @ place @ inner))
            for place in places or [np.eye(4)]
            for key, inner in inside
        ]

    def _remark(self, link: Any) -> None:
        target = getattr(link, "LinkedObject", None)
        target = target[0] if isinstance(target, tuple) else target
        if target is not None and same_document(target.Document, link.Document):
            if own(link, "LinkCopyOnChangeSource") is not None:
                self.note("variant", f"{label_of(link)} is a variant of its part; measured as the variant is")
            else:
                self.note(
                    "in_document",
                    f"{label_of(link)} links within its own document: it has a mass, but no line in the BOM",
                )


def _metres(matrix: Floats) -> Floats:
    result = matrix.copy()
    result[:3, 3] *= 1e-3
    return result


def _relative(path: str, base: str) -> str:
    try:
        return os.path.relpath(path, base).replace("\\", "/")
    except ValueError:  # another drive
        return path


def _file(obj: Any) -> str:
    name = getattr(getattr(obj, "Document", None), "FileName", "") or ""
    return name.replace("\\", "/")


def _consumed(feature: Any) -> Iterable[str]:
    """Names of the objects that a feature takes its shape from."""
    if kind_of(feature) not in (Kind.LOCAL, Kind.DRAFT_ARRAY):
        return
    for name in getattr(feature, "PropertiesList", ()):
        if name in _CONSUMING or (name == "Group" and derived(feature, "PartDesign::Boolean")):
            value = getattr(feature, name, None)
            for item in value if isinstance(value, tuple | list) else (value,):
                target = item[0] if isinstance(item, tuple) and item else item
                if hasattr(target, "TypeId"):
                    yield object_name(target)


def _flexible_places(link: Any) -> dict[str, Floats]:
    """Member name in the real assembly → where a flexible AssemblyLink's copy of it stands."""
    places: dict[str, Floats] = {}
    for copy in (getattr(link, "Group", None) or ()) if link is not None else ():
        original = getattr(copy, "LinkedObject", None)
        original = original[0] if isinstance(original, tuple) else original
        if original is not None:
            places[object_name(original)] = link_placement(copy)
    return places


def _steps(sub: Any) -> list[str] | None:
    """The object names in a sub-name such as ``Inner.Bolt.``; None where it ends in a face or an edge."""
    text = sub if isinstance(sub, str) else next((str(part) for part in sub or ()), "")
    *steps, last = text.split(".")
    return None if last else [step for step in steps if step and not step.isdigit()]


def _child(container: Any, name: str) -> Any:
    for member in members(container):
        if object_name(member) == name:
            return member
    look_up = getattr(getattr(container, "Document", None), "getObject", None)
    return look_up(name) if callable(look_up) else None


def top_object(document: Any, name: str | None) -> Any:
    """The object to measure: the named one, the assembly, or all that stands free in the document."""
    from silo.bom.errors import InputError
    from silo.bom.roots import DocumentRoot, choose_assembly

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
