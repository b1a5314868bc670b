# SPDX-License-Identifier: LGPL-2.1-or-later
"""From FreeCAD objects to products and their uses: what :mod:`silo.bom.links` counts, with the placements.

How FreeCAD places things (``src/App/Link.cpp``, tried with 0.20 and 1.0):

* a member of a part or an assembly stands at its own ``Placement`` in it;
* a link stands at its own placement, then its scale, then its element's placement and scale; the target's own
  placement counts only with ``LinkTransform``, and the same holds at every hop of a chain;
* an AssemblyLink is a link without it; a flexible one has the placements of its own copies.

What counts: links as in the BOM, hidden or not; of geometry modelled in place, what no sibling consumes (the
operands of a cut), and of that the visible, where any is. A standard part is one product for each
designation, wherever it lies, and has the shape of its first occurrence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from silo.bom.document import derived, label_of, object_name, own, relative, same_document
from silo.bom.model import BomEntry
from silo.bom.naming import display_name
from silo.bom.roots import loose_hardware, silent_reader
from silo.bom.walk.contents import Reader
from silo.bom.walk.kinds import REPEATERS, Kind, is_container, is_named_assembly, kind_of, sources
from silo.bom.walk.standard import STANDARD_PARTS
from silo.bom.walk.targets import is_assembly_link, is_link
from silo.inertia.geometry.freecad.facts import Facts, element_places, file_of, link_placement, scale
from silo.inertia.geometry.freecad.members import MODELLED, child_named, counted, steps_of
from silo.inertia.geometry.freecad.stated_materials import NOTHING, Material
from silo.inertia.geometry.graph import MAX_DEPTH, Child, Floats, Node, in_metres

MAX_HOPS = 64


@dataclass(frozen=True, eq=False)
class ShapeRef:
    """One shape of a product: its handle, and (4, 4) [mm] from its own axes to the product's."""

    handle: Any
    transform: Floats


@dataclass(frozen=True, eq=False)
class Leaf:
    """What a prototype is made from. ``broken`` says why there is nothing."""

    shapes: tuple[ShapeRef, ...] = ()
    material: Material = NOTHING
    broken: str = ""


@dataclass(eq=False)
class Walk:
    """Products of FreeCAD documents, each once; ``notes`` in plain words by code, each once.

    hardware
        False leaves standard parts out.
    """

    facts: Facts
    base: str = ""
    hardware: bool = True
    nodes: dict[str, Node] = field(default_factory=dict)
    leaves: dict[str, Leaf] = field(default_factory=dict)
    documents: set[str] = field(default_factory=set)
    absent: set[str] = field(default_factory=set)
    notes: dict[str, list[str]] = field(default_factory=dict)
    _open: list[str] = field(default_factory=list)
    _reader: Reader = field(default_factory=silent_reader)

    def note(self, code: str, message: str) -> None:
        """Keep one remark."""
        listed = self.notes.setdefault(code, [])
        if message not in listed:
            listed.append(message)

    # --- products ------------------------------------------------------------------------------------------

    def product(self, obj: Any, copies: Any = None) -> str:
        """The key of the product ``obj``, in its own axes; ``copies``: a flexible AssemblyLink of it."""
        self.documents.add(file_of(obj))
        key = self._key(obj)
        if copies is not None:
            key += f" as in {object_name(copies)} of {file_of(copies)}"
        if key in self.nodes:
            return key
        if key in self._open or len(self._open) > MAX_DEPTH:
            self.note("cycle", f"“{label_of(obj)}” contains itself; it is left out where the ring closes")
            return self._nothing(obj, "it contains itself")
        self._open.append(key)
        holds = is_container(obj) and kind_of(obj) not in REPEATERS
        if holds or getattr(obj, "is_document_root", False):
            self._container(key, obj, self._moved(copies))
        else:
            self._leaf(key, obj, [(obj, np.eye(4))])
        self._open.pop()
        return key

    def _container(self, key: str, obj: Any, moved: dict[str, Floats]) -> None:
        found = counted(obj, self.facts, self.note)
        shapes = [member for member in found if kind_of(member) in (*MODELLED, Kind.FOREIGN)]
        materials = {self.facts.material(member) for member in shapes}
        own_material = self.facts.material(obj)
        one_piece = len(shapes) == len(found) and (own_material != NOTHING or len(materials) <= 1)
        if shapes and one_piece and not is_named_assembly(obj):
            self._leaf(key, obj, [(member, self.facts.placement(member)) for member in shapes])
            return
        children: list[Child] = []
        for member in found:
            children += self._uses(member, moved.get(object_name(member)))
        if beside := loose_hardware(obj, self._reader):
            inwards = np.linalg.inv(in_metres(self.facts.placement(obj)))
            for member in beside:
                children += [
                    replace(use, transform=inwards @ use.transform) for use in self._uses(member, None)
                ]
        self.nodes[key] = Node(key, self._name(obj), tuple(children))

    def _moved(self, link: Any) -> dict[str, Floats]:
        """Member name in the real assembly → where a flexible AssemblyLink's copy of it stands."""
        places: dict[str, Floats] = {}
        for copy in (getattr(link, "Group", None) or ()) if link is not None else ():
            original = getattr(copy, "LinkedObject", None)
            original = original[0] if isinstance(original, tuple) else original
            if original is not None:
                places[object_name(original)] = link_placement(copy, self.facts)
        return places

    def _leaf(self, key: str, obj: Any, shapes: Sequence[tuple[Any, Floats]]) -> None:
        refs = [
            ShapeRef(handle, transform)
            for member, transform in shapes
            if (handle := self.facts.shape(member)) is not None
        ]
        material = self.facts.material(obj)
        if material == NOTHING and shapes:
            material = self.facts.material(shapes[0][0])
        self.nodes[key] = Node(key, self._name(obj), has_geometry=True)
        self.leaves[key] = Leaf(tuple(refs), material)

    def _nothing(self, obj: Any, reason: str, name: str = "") -> str:
        key = f"nothing: {name or self._key(obj)} {reason}"
        self.nodes[key] = Node(key, name or self._name(obj), has_geometry=True)
        self.leaves[key] = Leaf(broken=reason)
        return key

    def _key(self, obj: Any) -> str:
        designation, registered = self._reader.standard(obj)
        return product_key(file_of(obj), object_name(obj), "" if registered else designation, self.base)

    def _name(self, obj: Any) -> str:
        document = getattr(obj, "Document", None)
        entry = BomEntry(
            doc_path=file_of(obj),
            object_name=object_name(obj),
            label=label_of(obj),
            document_label=getattr(document, "Label", "") or "",
            standard=self._reader.standard(obj)[0] or None,
        )
        return display_name(entry)

    def _left_out(self, obj: Any) -> bool:
        """True for standard parts where they are left out; says so."""
        if self.hardware or not self._is_hardware(obj):
            return False
        self.note("no_hardware", "standard parts are left out, as asked: the masses are those of the others")
        return True

    def _is_hardware(self, obj: Any) -> bool:
        """True for a standard part, and for arrays, compounds and copies of nothing else."""
        if kind_of(obj) is Kind.STANDARD:
            return True
        shown = sources(obj) if kind_of(obj) in REPEATERS else []
        return bool(shown) and all(map(self._is_hardware, shown))

    # --- uses ----------------------------------------------------------------------------------------------

    def _uses(self, member: Any, moved: Floats | None) -> list[Child]:
        name = label_of(member)
        kind = kind_of(member)
        if self._left_out(member):
            return []
        if kind is Kind.DRAFT_ARRAY:
            return self._draft_array(member)
        if kind is Kind.COMPOUND and self._is_hardware(member):
            outer = self.facts.placement(member)
            uses = (use for source in sources(member) for use in self._resolved(source, True, None, MAX_HOPS))
            return [Child(name, key, in_metres(outer @ inner)) for key, inner in uses]
        if kind in (Kind.LINK, Kind.ASSEMBLY_LINK):
            self._remark(member)
        found = self._resolved(member, True, moved, MAX_HOPS)
        return [Child(name, key, in_metres(matrix)) for key, matrix in found]

    def _resolved(
        self, obj: Any, with_place: bool, moved: Floats | None, hops: int
    ) -> list[tuple[str, Floats]]:
        """Products that an object stands for, each with (4, 4) [mm] from its axes to those around ``obj``."""
        if hops <= 0:
            return [(self._nothing(obj, "its chain of links does not end"), np.eye(4))]
        own_place = moved if moved is not None else link_placement(obj, self.facts)
        outer = own_place if with_place else np.eye(4)
        if is_assembly_link(obj):
            flexible = obj if own(obj, "Rigid") is False else None
            return [(key, outer @ inner) for key, inner in self._followed(obj, False, hops, flexible)]
        if is_link(obj) or derived(obj, "App::LinkElement"):
            outer = outer @ scale(obj)
            inside = self._followed(obj, own(obj, "LinkTransform") is True, hops, None)
            places = element_places(obj, self.facts) if is_link(obj) else [np.eye(4)]
            return [(key, outer @ place @ inner) for place in places for key, inner in inside]
        if self._left_out(obj):
            return []
        return [(self.product(obj), outer)]

    def _followed(self, link: Any, with_place: bool, hops: int, flexible: Any) -> list[tuple[str, Floats]]:
        target = getattr(link, "LinkedObject", None)
        sub: Any = ""
        if isinstance(target, tuple):
            target, sub = target
        if target is None:
            return [(self._broken(link), np.eye(4))]
        steps = steps_of(sub)
        if steps is None:  # a reference to a face or an edge of something is no component
            words = f"“{label_of(link)}” leads to {sub} of a part and not to a part; it has no mass"
            self.note("not_counted", words)
            return []
        if flexible is not None and not is_assembly_link(target):
            return [(self.product(target, copies=flexible), np.eye(4))]
        if not steps:
            return self._resolved(target, with_place, None, hops - 1)
        outer = self.facts.placement(target) if with_place else np.eye(4)
        for step in steps[:-1]:
            target = child_named(target, step)
            if target is None:
                return [(self._broken(link, step), np.eye(4))]
            outer = outer @ self.facts.placement(target)
        last = child_named(target, steps[-1])
        if last is None:
            return [(self._broken(link, steps[-1]), np.eye(4))]
        return [(key, outer @ inner) for key, inner in self._resolved(last, True, None, hops - 1)]

    def _broken(self, link: Any, missing: str = "") -> str:
        problem = self.facts.problem(link)
        if missing or problem is None:
            return self._nothing(link, f"its target {missing or 'is gone'} cannot be found")
        if problem.file:
            stem = problem.file.replace("\\", "/").rpartition("/")[2].rpartition(".")[0]
            self.absent.add(f"{file_of(link).rpartition('/')[0]}/{problem.file}")
            why = problem.detail or problem.code.value.replace("_", " ")
            return self._nothing(link, f"its file {problem.file} cannot be read: {why}", stem)
        return self._nothing(link, "its target is unset or gone")

    def _draft_array(self, array: Any) -> list[Child]:
        base = getattr(array, "Base", None)
        base = base[0] if isinstance(base, tuple) else base
        places = self.facts.places(array)
        if base is None or (not places and self.facts.shape(array) is not None):
            return [Child(label_of(array), self.product(array), in_metres(self.facts.placement(array)))]
        count = own(array, "Count", 0)
        if not places and isinstance(count, int) and count > 1:
            words = f"the array “{label_of(array)}” was saved without its {count} placements; counted once"
            self.note("not_counted", words)
        inside = self._resolved(base, own(array, "LinkTransform") is True, None, MAX_HOPS)
        outer = self.facts.placement(array)
        return [
            Child(label_of(array), key, in_metres(outer @ place @ inner))
            for place in places or [np.eye(4)]
            for key, inner in inside
        ]

    def _remark(self, link: Any) -> None:
        target = getattr(link, "LinkedObject", None)
        target = target[0] if isinstance(target, tuple) else target
        if target is not None and same_document(target.Document, link.Document):
            if own(link, "LinkCopyOnChangeSource") is not None:
                words = f"“{label_of(link)}” is a variant of its part; its mass is that of the variant"
                self.note("variant", words)
            elif not self._is_hardware(target):
                self.note(
                    "in_document",
                    f"“{label_of(link)}” is a link within its own document: its mass counts, "
                    "though it is no line of the BOM",
                )


def product_key(path: str, name: str, designation: str, base: str) -> str:
    """What identifies a product: a standard part by its designation, any other by its file and its object."""
    return f"{STANDARD_PARTS}{designation}" if designation else f"{relative(path, base)}#{name}"
