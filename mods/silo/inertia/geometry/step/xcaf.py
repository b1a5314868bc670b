# SPDX-License-Identifier: LGPL-2.1-or-later
"""One STEP file as the geometry kernel reads it: products, their uses, and their shapes.

Products are kept as the kernel's document (XCAF) has them, with two corrections that real files need. The
kernel splits a product with mixed bodies into an assembly of unnamed leaves; those are given back to the
product around them. And it opens files that a STEP file names, wherever they are; a copy without those names
is read instead, and :mod:`siblings` looks for the files by our rules.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from OCP.collections import Sequence_TCollection_AsciiString
from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDF import TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.XCAFDoc import XCAFDoc_Centroid, XCAFDoc_DocumentTool, XCAFDoc_Volume

from silo.bom.errors import DocumentError
from silo.folders import scratch_folder
from silo.inertia.geometry.graph import Child, Node, in_metres
from silo.inertia.geometry.kernel import occt
from silo.inertia.geometry.kernel.tessellate import MM, trsf_matrix
from silo.inertia.geometry.labels import clean, is_generic
from silo.inertia.geometry.measured import Measured
from silo.inertia.geometry.step.prepare import Prepared, prepare
from silo.inertia.geometry.step.product_text import ProductFacts, Products
from silo.inertia.geometry.step.regroup import MARK


@dataclass(frozen=True, eq=False)
class Stated:
    """Validation properties that the file gives for a product: [m^3] and (x, y, z) [m], None where absent."""

    volume_m3: float | None = None
    centroid_m: tuple[float, float, float] | None = None


@dataclass(eq=False)
class StepFile:
    """The content of one file; keys are unique over all files of a split assembly.

    shapes, measured
        of each product with a shape of its own: the kernel's, or what was measured of them already.
    empty
        products without children and without any edge or face: their geometry is somewhere else.
    kept
        the kernel's document. Taking a large one down takes longer than reading on.
    """

    path: Path
    unit: str = ""
    nodes: dict[str, Node] = field(default_factory=dict)
    shapes: dict[str, list[Any]] = field(default_factory=dict)
    measured: dict[str, Measured] = field(default_factory=dict)
    empty: list[str] = field(default_factory=list)
    facts: dict[str, ProductFacts] = field(default_factory=dict)
    stated: dict[str, Stated] = field(default_factory=dict)
    unnamed: set[str] = field(default_factory=set)
    roots: list[Child] = field(default_factory=list)
    kept: tuple[Any, ...] = ()

    def take_in(self, other: StepFile) -> None:
        """Add another file's products; its keys must be its own."""
        self.nodes.update(other.nodes)
        self.shapes.update(other.shapes)
        self.measured.update(other.measured)
        self.facts.update(other.facts)
        self.stated.update(other.stated)
        self.unnamed.update(other.unnamed)

    def take_shape(self, key: str, other: str) -> None:
        """Give the product ``key`` the shape of ``other``, or none if that has none."""
        for known in (self.shapes, self.measured):
            known.pop(key, None)
            if other in known:
                known[key] = known[other]  # type: ignore[assignment]


def load(
    path: Path, prefix: str = "", max_instances: int = 1_000_000, text: Prepared | None = None
) -> StepFile:
    """Read one STEP file. ``prefix`` goes before every key. DocumentError where it cannot be read.

    text
        what :func:`prepare` found, where somebody asked it already.
    """
    with scratch_folder("silo-step-") as folder:
        text = text or prepare(path, Path(folder), max_instances)
        document, reader = _transferred(text.source, path)
    step = _Walk(path, prefix, document, reader, text.products).run()
    step.kept = (document, reader)
    return step


def _transferred(source: Path, named: Path) -> tuple[Any, Any]:
    document = TDocStd_Document(TCollection_ExtendedString("XmlXCAF"))
    reader = STEPCAFControl_Reader()
    reader.SetNameMode(True)
    reader.SetColorMode(False)
    reader.SetLayerMode(False)
    reader.SetPropsMode(True)
    if reader.ReadFile(str(source)) != IFSelect_RetDone:
        raise DocumentError(str(named), "the geometry kernel cannot read it as STEP; export it again")
    if not reader.Transfer(document):
        raise DocumentError(str(named), "holds no geometry that the kernel can transfer")
    return document, reader


@dataclass(frozen=True, eq=False, slots=True)
class _Used:
    """A product that others use. ``made_up``: the kernel made this leaf of a product's mixed bodies, and it
    is no product itself."""

    label: Any
    key: str
    name: str
    facts: ProductFacts | None
    made_up: bool


class _Walk:
    """From the kernel's document to nodes; lives for one file."""

    def __init__(self, path: Path, prefix: str, document: Any, reader: Any, products: Products) -> None:
        self._tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
        self._transfer = reader.Reader().WS().TransferReader()
        self._prefix = prefix
        self._products = products
        self._owners = _owners(reader, products)
        self._known: dict[str, _Used] = {}
        self._file = StepFile(path, unit=_unit(reader))
        self._fallback = clean(path.stem) or "part"

    def run(self) -> StepFile:
        for label in occt.labels(self._tool.GetFreeShapes):
            key = self._prefix + occt.entry(label)
            self._visit_all(key, label)
            self._file.roots.append(Child(self._file.nodes[key].name, key))
        if not self._file.roots:
            raise DocumentError(str(self._file.path), "holds no product and no shape")
        self._file.empty = [
            key
            for key, shapes in self._file.shapes.items()
            if not self._file.nodes[key].children
            and not any(occt.has_edges(shape) or occt.faces_of(shape) for shape in shapes)
        ]
        return self._file

    def _visit_all(self, top: str, label: Any) -> None:
        waiting = [(top, label, self._fallback)]
        while waiting:
            key, label, around = waiting.pop()
            if key not in self._file.nodes:
                node, inside = self._node(label, key, around)
                self._file.nodes[key] = node
                waiting.extend((used.key, used.label, node.name) for used in inside)

    def _node(self, label: Any, key: str, around: str) -> tuple[Node, list[_Used]]:
        children, inside, own, facts = self._inside(label)
        if not self._tool.IsAssembly_s(label):
            own, facts = [self._tool.GetShape_s(label)], self._used(label).facts
        name = clean(occt.name_of(label))
        if not name or (is_generic(name) and (facts is None or facts.name != name)):
            name = around
            self._file.unnamed.add(key)
        if own:
            self._file.shapes[key] = own
        self._file.facts[key] = facts or self._products.named(name) or ProductFacts()
        self._file.stated[key] = _stated(label)
        return Node(key, name, tuple(children), has_geometry=bool(own)), inside

    def _inside(self, label: Any) -> tuple[list[Child], list[_Used], list[Any], ProductFacts | None]:
        """Uses of products, the products, the shapes that are the label's own, and their facts."""
        children: list[Child] = []
        inside: dict[str, _Used] = {}
        own: list[Any] = []
        known: ProductFacts | None = None
        for component, used in self._components(label):
            if used.made_up:
                own.append(self._tool.GetShape_s(component))
                known = known or used.facts
            else:
                children.append(self._child(component, used))
                inside[used.key] = used
        return children, list(inside.values()), own, known

    def _components(self, label: Any) -> Iterator[tuple[Any, _Used]]:
        """Uses and what they use; groups of our own making are seen through."""
        if not self._tool.IsAssembly_s(label):
            return
        for component in occt.labels(lambda found: self._tool.GetComponents_s(label, found)):
            target = TDF_Label()
            self._tool.GetReferredShape_s(component, target)
            used = self._used(target)
            if used.name.startswith(MARK):
                yield from self._components(target)
            else:
                yield component, used

    def _used(self, target: Any) -> _Used:
        # Asked once for every use of a product, and slow to answer.
        entry = occt.entry(target)
        if entry not in self._known:
            name = clean(occt.name_of(target))
            facts = self._facts(target) if not name.startswith(MARK) else None
            leaf = is_generic(name) and not self._tool.IsAssembly_s(target)
            made_up = leaf and (facts is None or facts.name != name)
            self._known[entry] = _Used(target, self._prefix + entry, name, facts, made_up)
        return self._known[entry]

    def _child(self, component: Any, used: _Used) -> Child:
        name = clean(occt.name_of(component))
        if is_generic(name):
            name = self._fallback if is_generic(used.name) else used.name
        matrix = in_metres(trsf_matrix(self._tool.GetLocation_s(component).Transformation()))
        return Child(name, used.key, matrix)

    def _facts(self, label: Any) -> ProductFacts | None:
        shape = self._tool.GetShape_s(label)
        if shape is None or shape.IsNull():
            return None
        entity = self._transfer.EntityFromShapeResult(shape, 1)
        if entity is None:
            return None
        found = self._owners.get(id(entity))
        return self._products.facts.get(found[1]) if found is not None else None


def _owners(reader: Any, products: Products) -> dict[int, tuple[Any, int]]:
    """id of the kernel's entity object → that object (kept alive, so that the id stays its own), product."""
    model = reader.Reader().StepModel()
    if model.NbEntities() != products.count:
        # The kernel left an entity out; from there on its numbers are not ours. Names must do.
        return {}
    entities = ((model.Entity(ordinal), pd) for ordinal, pd in products.by_ordinal.items())
    return {id(entity): (entity, pd) for entity, pd in entities}


def _stated(label: Any) -> Stated:
    volume = occt.attribute_of(label, XCAFDoc_Volume)
    centroid = occt.attribute_of(label, XCAFDoc_Centroid)
    point = centroid.Get() if centroid is not None else None
    return Stated(
        volume.Get() * MM**3 if volume is not None else None,
        (point.X() * MM, point.Y() * MM, point.Z() * MM) if point is not None else None,
    )


_UNITS = {
    "millimetre": "mm",
    "millimeter": "mm",
    "metre": "m",
    "meter": "m",
    "centimetre": "cm",
    "centimeter": "cm",
    "micrometre": "um",
    "inch": "inch",
    "foot": "foot",
}


def _unit(reader: Any) -> str:
    lengths, angles, solid_angles = (Sequence_TCollection_AsciiString() for _ in range(3))
    reader.Reader().FileUnits(lengths, angles, solid_angles)
    names = {str(lengths.Value(i).ToCString()).strip().lower() for i in range(1, lengths.Length() + 1)}
    return " and ".join(sorted(_UNITS.get(name, name) for name in names))
