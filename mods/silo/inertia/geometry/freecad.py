# SPDX-License-Identifier: LGPL-2.1-or-later
"""From FreeCAD objects to products and their uses: the chains of :mod:`silo.bom.walk.roles`, with placements.

Nothing here decides what counts. How FreeCAD places things (``src/App/Link.cpp``, tried with 0.20 and 1.0):

* a member of a part or an assembly stands at its own ``Placement`` in it;
* a link stands at its own placement, then its scale, then its element's placement and scale; the target's own
  placement counts only with ``LinkTransform``, and the same holds at every hop of a chain;
* an AssemblyLink is a link without it; a flexible one has the placements of its own copies.

A standard part is one product for each designation, wherever it lies, and has the shape of its first
occurrence. Lengths are mm here, as FreeCAD has them.

A document states a material in two ways: FreeCAD >= 1.0 gives each shape a ``ShapeMaterial``, of which the
file holds the id only, so that the density is in the cards of an installed FreeCAD; and any version may link
a material object (``Material``), which carries name and density itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from silo.bom.entry import BomEntry
from silo.bom.errors import DocumentError, InputError, listed
from silo.bom.findings import FindingCode
from silo.bom.items.naming import display_name
from silo.bom.key import Key
from silo.bom.message import message
from silo.bom.walk.arrays import draft_elements, elements, left_out_by
from silo.bom.walk.contents import Contents, Contribution, Count, Lost
from silo.bom.walk.document import LinkProblem, derived, first_of, label_of, object_name, own, relative
from silo.bom.walk.kinds import REPEATERS, Kind, is_container, kind_of
from silo.bom.walk.roots import choose_assembly, seen_beside, silent_reader
from silo.bom.walk.standard import STANDARD_PARTS
from silo.bom.walk.targets import Step, is_assembly_link, is_link
from silo.budget import Account
from silo.inertia.assembly import Assembly, Prototype
from silo.inertia.geometry import measured as checks
from silo.inertia.geometry.graph import MAX_DEPTH, Child, Floats, Node, in_metres, unfold
from silo.inertia.geometry.limits import MODEL
from silo.inertia.geometry.measured import Measured
from silo.inertia.geometry.options import ReadOptions, Report
from silo.inertia.materials.cards import card_of
from silo.inertia.materials.densities import DENSEST, LIGHTEST, parse_density
from silo.inertia.notes import GeometryCode, Note

NO_MATERIAL = "7f9fd73b-50c9-41d8-b7b2-575a030c1eeb"
"""FreeCAD's "Default": what every untouched part has. Its 1 kg/m^3 is no density that was chosen."""


@dataclass(frozen=True)
class StatedMaterial:
    """Name and density [kg/m^3] as far as they are known; ``problem`` says what is not."""

    name: str | None = None
    density: float | None = None
    problem: str = ""


NOTHING = StatedMaterial()


def linked_material(obj: Any) -> StatedMaterial | None:
    """Return the material object to which an object links, stored or live; None if there is none."""
    linked = own(obj, "Material")
    linked = linked[0] if isinstance(linked, tuple) and linked else linked
    material = own(linked, "Material") if linked is not None and not isinstance(linked, dict) else None
    return _from_map(material) if isinstance(material, dict) and material else None


def told_material(name: str, density: float | None) -> StatedMaterial:
    """Make a material of a name and a density [kg/m^3], which must be plausible."""
    sane = _sane(density)
    if sane is None:
        return StatedMaterial(
            name, problem=message("its material '{name}' has no density that can be used", name=name)
        )
    return StatedMaterial(name, sane)


def _from_map(materials: dict[str, str]) -> StatedMaterial:
    name = next(
        (materials[key].strip() for key in ("Name", "CardName") if materials.get(key, "").strip()), None
    )
    text = materials.get("Density", "").strip()
    if not text:
        return StatedMaterial(name)
    density = _sane(parse_density(text))
    problem = (
        ""
        if density is not None
        else message("the density '{text}' of its material cannot be used", text=text)
    )
    return StatedMaterial(name, density, problem)


def card_material(uuid: str) -> StatedMaterial:
    """Find the material of a card in an installed FreeCAD, or say what is wrong with it."""
    if uuid == NO_MATERIAL:
        return NOTHING
    card = card_of(uuid)
    if card is None:
        return StatedMaterial(
            problem=message(
                "its material (id {uuid}) is in no material library found on this machine; "
                "install FreeCAD, or name the folder of its cards in FREECAD_MATERIALS",
                uuid=uuid,
            )
        )
    if card.density is None:
        return StatedMaterial(
            card.name,
            problem=message("the card of its material '{name}' has no usable density", name=card.name),
        )
    return StatedMaterial(card.name, card.density)


def _sane(density: float | None) -> float | None:
    return density if density is not None and LIGHTEST <= density <= DENSEST else None


MAX_ELEMENTS = 1_000_000
# What a finding of the count means for the mass.
_TOLD = {
    FindingCode.CYCLE: "cycle",
    FindingCode.NO_HARDWARE: "no_hardware",
    FindingCode.VARIANT: "variant",
    **dict.fromkeys(
        (
            *(FindingCode.SUPPRESSED, FindingCode.EXCLUDED, FindingCode.SUB_ELEMENT_LINK),
            *(FindingCode.UNSET_LINK, FindingCode.BROKEN_LINK, FindingCode.TOO_DEEP),
        ),
        "not_counted",
    ),
}


class ShapeSource(Protocol):
    """What a mass needs of objects and a BOM does not, from files (``places.StoredFacts``) or from FreeCAD
    (``silo.workbench.freecad.shapes``)."""

    def placement(self, obj: Any, name: str = "Placement") -> Floats:
        """Return (4, 4) of an object's own placement; the identity if it has none."""
        ...

    def places(self, obj: Any) -> list[Floats]:
        """Return (4, 4) for each placement in the object's own ``PlacementList``."""
        ...

    def shape(self, obj: Any) -> Any:
        """Return a handle by which the object's shape can be measured; None if it has none, or an empty
        one.
        """
        ...

    def material(self, obj: Any) -> StatedMaterial:
        """Return the material that the object itself states."""
        ...

    def problem(self, link: Any) -> LinkProblem | None:
        """Return why a link has no target, if that is known."""
        ...


@dataclass(frozen=True, eq=False)
class ShapeRef:
    """One shape of a product: its handle, and (4, 4) [mm] from its own axes to the product's."""

    handle: Any
    transform: Floats


@dataclass(frozen=True, eq=False)
class Leaf:
    """What a prototype is made from. ``broken`` says why there is nothing, ``lost`` which bodies have no
    shape."""

    shapes: tuple[ShapeRef, ...] = ()
    material: StatedMaterial = NOTHING
    broken: str = ""
    lost: tuple[str, ...] = ()


# An object, the flexible AssemblyLink that it is shown by, and (4, 4) from its axes to those around.
_Placed = tuple[Any, Any, Floats]


@dataclass(eq=False)
class Walk:
    """Products of FreeCAD documents, each once.

    hardware
        False leaves standard parts out.
    account
        of the placements that are made.
    """

    facts: ShapeSource
    base: str = ""
    hardware: bool = True
    nodes: dict[str, Node] = field(default_factory=dict)
    leaves: dict[str, Leaf] = field(default_factory=dict)
    documents: set[str] = field(default_factory=set)
    absent: set[str] = field(default_factory=set)
    _noted: dict[str, list[str]] = field(default_factory=dict)
    _open: list[str] = field(default_factory=list)
    account: Account = field(default_factory=lambda: MODEL.account(message("the model")))

    def __post_init__(self) -> None:
        self._reader = silent_reader(
            hardware=self.hardware, counts_beside=True, inspect=lambda link: self.facts.problem(link)
        )

    def problems(self) -> list[Note]:
        """Return notes about what was left out, or counted with a doubt."""
        for finding in self._reader.notes.findings():
            if finding.code in _TOLD:
                self._note(_TOLD[finding.code], finding.message)
        return [Note(code, message) for code, labels in self._noted.items() for message in labels]

    def _note(self, code: str, message: str) -> None:
        labels = self._noted.setdefault(code, [])
        if message not in labels:
            labels.append(message)

    # --- products ------------------------------------------------------------------------------------------

    def top(self, document: Any, name: str | None) -> str:
        """Choose what is measured (the named object, the assembly, or the document's own part), and return
        its key.
        """
        obj = document.getObject(name) if name is not None else None
        try:
            top = obj if obj is not None else choose_assembly(document, name)
        except InputError as error:
            raise DocumentError(document.FileName, str(error)) from error
        if getattr(top, "is_document_root", False) and (contents := self._reader.contents(top)).is_part:
            top = contents.own[0].target
        if obj is None and not getattr(top, "is_document_root", False):
            counted = {object_name(count.shown.obj) for count in self._reader.contents(top).counts}
            names = [
                f"“{label_of(member)}”"
                for member in seen_beside(top, self._reader)
                if object_name(member) not in counted
                and (self.hardware or kind_of(member) is not Kind.STANDARD)
            ]
            if names:
                words = message(
                    "{names}: beside “{top}” in the document, and in no mass",
                    names=listed(names, 4),
                    top=label_of(top),
                )
                self._note("not_counted", words)
        return self.product(top)

    def product(self, obj: Any, copies: Any = None) -> str:
        """Walk the product ``obj`` in its own axes, and return its key.

        copies
            a flexible AssemblyLink of it; or the object itself, if it has only its own shape.
        """
        self.documents.add(file_of(obj))
        key = self._key(obj, copies)
        if self._is_known(key):
            return key
        if key in self._open or len(self._open) > MAX_DEPTH:
            self._note(
                "cycle",
                message("“{obj}” contains itself; it is left out where the ring closes", obj=label_of(obj)),
            )
            return self._nothing(obj, message("it contains itself"))
        self._open.append(key)
        is_root = bool(getattr(obj, "is_document_root", False))
        holds = is_root or (is_container(obj) and copies is not obj and not self._is_one_shape(obj))
        contents = self._reader.contents(obj) if holds else Contents()
        if contents.counts or contents.own or (holds and kind_of(obj) not in REPEATERS):
            self._container(key, obj, contents, self._moved(copies))
        else:
            self._leaf(key, obj, [(obj, np.eye(4))])
        self._open.pop()
        return key

    def _container(self, key: str, obj: Any, contents: Contents, moved: dict[str, Floats]) -> None:
        if contents.hidden:
            names = listed([f"“{label_of(member)}”" for member in contents.hidden], 4)
            self._note(
                "hidden", message("bodies hidden beside visible ones are not counted: {names}", names=names)
            )
        shapes = [use for count in contents.own for use in self._uses(obj, count, contents, moved)]
        bodies = [(end, place) for end, _, place in shapes if not is_container(end)]
        materials = {self.facts.material(end) for end, _ in bodies}
        mine = self.facts.material(obj)
        one_piece = not contents.counts and len(bodies) == len(shapes)
        is_part = one_piece and not contents.is_assembly(obj)
        if bodies and is_part and (mine != NOTHING or len(materials) <= 1):
            self._leaf(key, obj, bodies)
            return
        children: list[Child] = []
        replaced = {key for modified in contents.modified for key in modified.operands}
        for modified in contents.modified:
            product = self._shape_of(modified.feature)
            place = in_metres(self._holders_of(modified.feature, contents, moved))
            children.append(Child(label_of(modified.feature), product, place))
        for count in (*contents.own, *contents.counts):
            if replaced and self._is_inside(count, contents, replaced):
                continue
            for end, copies, place in self._uses(obj, count, contents, moved):
                if not isinstance(end, Lost) and derived(end, "Mesh::Feature"):
                    self._note(
                        "not_counted",
                        message(
                            "“{label_of}” is a mesh and no solid; its mass is not counted",
                            label_of=label_of(end),
                        ),
                    )
                    continue
                product = self._lost(end) if isinstance(end, Lost) else self.product(end, copies)
                children.append(Child(label_of(count.shown.obj), product, in_metres(place)))
        self.nodes[key] = Node(key, self._name(obj), tuple(children))

    def _shape_of(self, feature: Any) -> str:
        """Return the key of the product that is a feature's own shape."""
        key = self._key(feature)
        if not self._is_known(key):
            self.documents.add(file_of(feature))
            self._leaf(key, feature, [(feature, np.eye(4))])
        return key

    def _holders_of(self, feature: Any, contents: Contents, moved: dict[str, Floats]) -> Floats:
        """Return (4, 4) from a feature's axes to those of the assembly."""
        around = np.eye(4)
        path = next(contents.tree.paths(self._reader.key(feature)), ()) if contents.tree is not None else ()
        for holder in path:
            around = around @ moved.get(object_name(holder), self.facts.placement(holder))
        return around @ self.facts.placement(feature)

    def _is_inside(self, count: Count, contents: Contents, operands: set[Key]) -> bool:
        """Return True for a component whose solid lives on in a feature of the assembly."""
        tree = contents.tree
        if tree is None or count.beside:
            return count.shown.key in operands
        return not operands.isdisjoint((count.shown.key, *tree.above(count.shown.key)))

    def _moved(self, link: Any) -> dict[str, Floats]:
        """Map each member of the real assembly to the placement of its copy in a flexible AssemblyLink."""
        places: dict[str, Floats] = {}
        for copy in (getattr(link, "Group", None) or ()) if link is not None else ():
            if (original := first_of(getattr(copy, "LinkedObject", None))) is not None:
                places[object_name(original)] = self._link_placement(copy)
        return places

    def _leaf(self, key: str, obj: Any, shapes: Sequence[tuple[Any, Floats]]) -> None:
        leaves = [(self.facts.shape(member), transform) for member, transform in shapes]
        refs = [ShapeRef(handle, transform) for handle, transform in leaves if handle is not None]
        lost = [
            f"“{label_of(leaf[0])}”"
            for leaf, (handle, _) in zip(shapes, leaves, strict=True)
            if handle is None
        ]
        material = self.facts.material(obj)
        if material == NOTHING and shapes:
            material = self.facts.material(shapes[0][0])
        self.nodes[key] = Node(key, self._name(obj), has_geometry=True)
        self.leaves[key] = Leaf(tuple(refs), material, lost=tuple(lost if refs else ()))

    def _nothing(self, obj: Any, reason: str, name: str = "") -> str:
        key = message("nothing: {obj} {reason}", obj=name or self._key(obj), reason=reason)
        self.nodes[key] = Node(key, name or self._name(obj), has_geometry=True)
        self.leaves[key] = Leaf(broken=reason)
        return key

    def _lost(self, lost: Lost) -> str:
        file = lost.file.replace("\\", "/")
        self.absent.add(file)
        stem = file.rpartition("/")[2].rpartition(".")[0]
        if file in self.documents:  # it is there, and a changed copy in it was deleted
            self.absent.discard(file)
            return self._nothing(lost, message("its changed copy was deleted"), lost.label)
        return self._nothing(
            lost, message("its file {base} cannot be read", base=relative(file, self.base)), stem
        )

    def _is_known(self, key: str) -> bool:
        return key in self.nodes

    def _key(self, obj: Any, copies: Any = None) -> str:
        designation, registered = self._reader.standard(obj)
        key = product_key(file_of(obj), object_name(obj), "" if registered else designation, self.base)
        if copies is None or copies is obj:
            return key
        return message("{key} as in {obj} of {file}", key=key, obj=object_name(copies), file=file_of(copies))

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

    # --- where its instances stand ---

    def _uses(
        self, container: Any, count: Count, contents: Contents, moved: dict[str, Floats]
    ) -> Iterator[_Placed]:
        """Yield every instance of a component, in the axes of the container."""
        shown = count.shown
        if count.quantity > MAX_ELEMENTS:
            words = message(
                "{obj} claims {quantity} elements", obj=label_of(shown.obj), quantity=count.quantity
            )
            raise DocumentError(file_of(container), words)
        if contents.tree is None:
            yield from self._placed(shown, count.key, False)
            return
        paths = [()] if count.beside else contents.tree.paths(shown.key)
        for path in paths:
            around = np.linalg.inv(self.facts.placement(container)) if count.beside else np.eye(4)
            self.account.take_objects()
            first = moved.get(object_name((*path, shown.obj)[0]))
            for number, holder in enumerate(path):
                own_place = self.facts.placement(holder)
                around = around @ (own_place if number or first is None else first)
            here = first if not path else None
            for end, copies, place in self._placed(shown, count.key, True, here):
                yield end, copies, around @ place

    def _placed(
        self, node: Contribution, key: Key, with_place: bool, moved: Floats | None = None
    ) -> Iterator[_Placed]:
        """Yield each instance of a component that an object shows, in the axes around the object.

        with_place
            True: with the object's own placement, or with ``moved`` in its place.
        """
        obj, kind = node.obj, node.kind
        if kind in (Kind.LINK, Kind.ELEMENT, Kind.ASSEMBLY_LINK):
            yield from self._linked(node, key, with_place, moved)
            return
        outer = self.facts.placement(obj) if with_place else np.eye(4)
        outer = outer if moved is None else moved
        below = [inner for inner, _ in node.shown_objects if key in inner.brings]
        if not below:
            yield node.brings[key][0], None, outer
        elif kind is Kind.LOCAL:  # made of linked parts: its shape is what is there, once
            if key == next(iter(node.brings)):
                yield obj, obj, outer
        elif node.tree is not None:
            for inner in below:
                for path in node.tree.paths(inner.key):
                    around = outer
                    for holder in path:
                        around = around @ self.facts.placement(holder)
                    yield from _moved_by(around, self._placed(inner, key, True))
        elif kind is Kind.DRAFT_ARRAY:
            yield from self._draft_array(node, key, outer, below)
        else:
            is_copy = kind is Kind.COPY
            if derived(obj, "Part::Mirroring"):
                outer, is_copy = _mirror(obj), False
            for inner in below:
                yield from _moved_by(outer, self._placed(inner, key, not is_copy))

    def _is_one_shape(self, obj: Any) -> bool:
        """Return True for an array without links, which older FreeCADs save as one shape."""
        if kind_of(obj) is not Kind.DRAFT_ARRAY or self._array_places(obj):
            return False
        return self.facts.shape(obj) is not None

    def _array_places(self, array: Any) -> list[Floats]:
        """Return (4, 4) for each instance of a Draft array; an expanded array keeps them in its elements."""
        return self.facts.places(array) or [
            self._link_placement(element) @ scale(element) for element in draft_elements(array)
        ]

    def _draft_array(
        self, node: Contribution, key: Key, outer: Floats, below: list[Contribution]
    ) -> Iterator[_Placed]:
        obj = node.obj
        if self._is_one_shape(obj):
            if key == next(iter(node.brings)):  # it holds all that the array shows
                yield obj, obj, outer
            return
        places = self._array_places(obj)
        for inner in below:
            seen = list(self._placed(inner, key, own(obj, "LinkTransform") is True))
            if not places:
                words = message(
                    "the array “{obj}” was saved without its placements; counted once", obj=label_of(obj)
                )
                self._note("not_counted", words)
            self.account.take_objects(len(seen) * max(len(places), 1))
            left_out = [bool(left_out_by(element)) for element in draft_elements(obj)]
            for number, place in enumerate(places or [np.eye(4)]):
                if number >= len(left_out) or not left_out[number]:
                    yield from _moved_by(outer @ place, seen)

    def _linked(
        self, node: Contribution, key: Key, with_place: bool, moved: Floats | None
    ) -> Iterator[_Placed]:
        target = self._reader.resolve(node.obj)
        steps = target.way or (Step(node.obj),)
        around = self._along(steps, with_place, moved)
        below = [inner for inner, _ in node.shown_objects if key in inner.brings]
        last = steps[-1].obj
        is_placed = own(last, "LinkTransform") is True if target.by_link else bool(target.way)
        if target.variant is not None or not below:
            end = target.obj if target.variant is None else target.variant
            if end is None:
                end = node.brings[key][0]
            elif is_placed:
                around = [place @ self.facts.placement(end) for place in around]
            flexible = is_assembly_link(last) and own(last, "Rigid") is False
            for place in around:
                yield end, last if flexible else None, place
            return
        # What somebody put into a flexible AssemblyLink himself stands in the link's own axes.
        own_parts = is_assembly_link(node.obj)
        for inner in below:
            seen = list(self._placed(inner, key, own_parts or is_placed))
            self.account.take_objects(len(seen) * len(around))
            for place in around:
                yield from _moved_by(place, seen)

    def _along(self, steps: Sequence[Step], with_place: bool, moved: Floats | None) -> list[Floats]:
        """Return (4, 4) for each instance that a chain of links shows."""
        around = [np.eye(4)]
        for number, step in enumerate(steps):
            obj = step.obj
            is_placed = own(steps[number - 1].obj, "LinkTransform") is True if step.by_link else True
            here = np.eye(4)
            if number == 0 and moved is not None:
                here = moved
            elif is_placed and (number or with_place):
                here = self._link_placement(obj)
            places = [here]
            if is_link(obj) or derived(obj, "App::LinkElement"):
                here = here @ scale(obj)
                places = [here @ place for place in self._element_places(obj, step.index)]
            if len(places) > 1:
                self.account.take_objects(len(around) * len(places))
            around = [outer @ place for outer in around for place in places]
        return around

    def _link_placement(self, link: Any) -> Floats:
        """Return a link's own placement; ``Placement`` and ``LinkPlacement`` are equal if both exist."""
        names = getattr(link, "PropertiesList", ())
        has_both = "Placement" in names or "LinkPlacement" not in names
        return self.facts.placement(link, "Placement" if has_both else "LinkPlacement")

    def _element_places(self, link: Any, index: int | None) -> list[Floats]:
        """Return (4, 4) [mm] for each element of a link array that is not left out; one identity for a plain
        link.
        """
        count = own(link, "ElementCount", 0)
        if not is_link(link) or not isinstance(count, int) or count <= 0:
            return [np.eye(4)]
        if count > MAX_ELEMENTS:
            raise DocumentError(
                file_of(link), message("the link {name} claims {count} elements", name=link.Name, count=count)
            )
        if index is None and count > self.account.budget.objects:  # before a list of them is made
            self.account.take_objects(count)
        if len(listed_ones := elements(link)) == count:
            wanted = listed_ones if index is None else listed_ones[index : index + 1]
            return [
                self._link_placement(step) @ scale(step)
                for step in wanted
                if index is not None or not left_out_by(step)
            ]
        places = self.facts.places(link)
        scales = [_diagonal(list(vector)) for vector in own(link, "ScaleList") or ()]
        matrix = np.eye(4)
        return [
            (places[n] if n < len(places) else matrix) @ (scales[n] if n < len(scales) else matrix)
            for n in (range(count) if index is None else [index])
        ]


def _moved_by(outer: Floats, placed: Any) -> Iterator[_Placed]:
    for end, copies, place in placed:
        yield end, copies, outer @ place


def _mirror(obj: Any) -> Floats:
    """Return (4, 4) [mm] of the reflection in the plane of a mirror image."""
    normal, base = (np.array(tuple(own(obj, name) or (0.0, 0.0, 0.0)), float) for name in ("Normal", "Base"))
    length = float(np.linalg.norm(normal))
    matrix = np.eye(4)
    if np.isfinite(length) and length > 1e-12:
        normal = normal / length
        matrix[:3, :3] -= 2 * np.outer(normal, normal)
        matrix[:3, 3] = 2 * normal * float(normal @ base)
    return matrix


def file_of(obj: Any) -> str:
    """Return the path of the object's file, with "/"; "" while it is unsaved."""
    name = getattr(getattr(obj, "Document", None), "FileName", "") or ""
    return name.replace("\\", "/")


def scale(link: Any) -> Floats:
    """Return the diagonal matrix (4, 4) of a link's scale. A zero would flatten the part; FreeCAD takes it as
    1.
    """
    vector = own(link, "ScaleVector")
    parts = list(vector) if vector is not None else []
    factor = own(link, "Scale")
    if not parts and isinstance(factor, int | float):
        parts = [float(factor)] * 3
    return _diagonal(parts)


def _diagonal(parts: list[float]) -> Floats:
    matrix = np.eye(4)
    for axis, part in enumerate(parts[:3]):
        if np.isfinite(part) and abs(part) > 1e-9:
            matrix[axis, axis] = part
    return matrix


def product_key(path: str, name: str, designation: str, base: str) -> str:
    """Return the key of a product: a standard part's designation, or file and object of any other."""
    return f"{STANDARD_PARTS}{designation}" if designation else f"{relative(path, base)}#{name}"


# --- the assembly, for each way to measure the shapes ---

Measure = Callable[[Sequence[Leaf], Callable[[int, int], Any]], Sequence[Measured | str]]
"""Measures products, or says why the shapes of one cannot be had; calls back with (number, of how many)."""


def assembled(
    walk: Walk, top: str, source: str, options: ReadOptions, measure: Measure, report: Report
) -> Assembly:
    """Measure the products that the walk found below ``top``, and make the assembly. InputError if the
    nesting has no end.
    """
    name = walk.nodes[top].name
    unfolded = unfold(walk.nodes, [Child(name, top)], options.max_instances)
    keys = unfolded.placed
    measured = measure(
        [walk.leaves[key] for key in keys], lambda number, total: report("measuring", number, total)
    )
    prototypes = {
        key: _prototype(walk, key, measured_body) for key, measured_body in zip(keys, measured, strict=True)
    }
    problems = walk.problems()
    return checks.assembled(unfolded, prototypes, problems, name=name, source=source, unit="mm")


def one_by_one(measure: Callable[[Leaf], Measured]) -> Measure:
    """Make a function that measures one product after the other; ``measure`` raises DocumentError if it
    cannot get the shapes.
    """

    def measured(leaves: Sequence[Leaf], done: Callable[[int, int], Any]) -> list[Measured | str]:
        results: list[Measured | str] = []
        for number, leaf in enumerate(leaves, start=1):
            done(number, len(leaves))
            try:
                results.append(measure(leaf))
            except DocumentError as error:
                results.append(error.reason)
        return results

    return measured


def _prototype(walk: Walk, key: str, measured_part: Measured | str) -> Prototype:
    leaf = walk.leaves[key]
    measured = Measured((), (), None, False) if isinstance(measured_part, str) else measured_part
    broken = leaf.broken or (measured_part if isinstance(measured_part, str) else "")
    stated = leaf.material
    return measured.prototype(
        key,
        walk.nodes[key].name,
        *([Note(GeometryCode.MATERIAL, stated.problem)] if stated.problem else []),
        *([checks.lost_note(leaf.lost)] if leaf.lost else []),
        empty=Note(GeometryCode.NOT_READ, broken) if broken else None,
        step_density=stated.density,
        step_material=stated.name,
    )
