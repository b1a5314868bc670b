# SPDX-License-Identifier: LGPL-2.1-or-later
"""STEP files: products, instances, placements, and every prototype measured once.

Products are kept as the kernel's document (XCAF) has them, with two corrections that real files need. The
kernel splits a product with mixed bodies into an assembly of unnamed leaves; those are given back to the
product around them. And it opens files that a STEP file names, wherever they are: :mod:`text` takes the
names out, and :class:`Siblings` looks for the files by our rules.

SolidWorks, CATIA and Pro/E write one file per part, and an assembly file whose products hold nothing. All
readers tried give such an assembly no solid, and no message. Here a product without geometry is looked for in
the assembly's folder and some levels below it, never outside of it, whatever path the file itself names: as
the file that the text names, as ``<product name>.STEP`` (.step, .stp; case ignored), as
``<product name>_prt.stp``, and as a file that holds the product of this name and no other.

The bodies that the file's text names are compared with the solids that the kernel's reader made of them. The
reader drops what it does not know: replicas, primitives, CSG trees, swept areas, triangles beside an exact
body; and a body whose faces it cannot read is no solid any more. It is silent if the product has another
solid. What is missing is made here from the file's own entities, or named in a warning.
"""

from __future__ import annotations

import math
import os
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakePrism,
    BRepPrimAPI_MakeRevol,
    BRepPrimAPI_MakeSphere,
    BRepPrimAPI_MakeTorus,
    BRepPrimAPI_MakeWedge,
)
from OCP.collections import Sequence_TCollection_AsciiString
from OCP.gp import gp_Ax2, gp_Trsf, gp_Vec
from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.StepData import StepData_Factors
from OCP.StepToGeom import StepToGeom
from OCP.StepToTopoDS import StepToTopoDS_Builder, StepToTopoDS_TranslateCurveBoundedSurface
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDF import TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopLoc import TopLoc_Location
from OCP.XCAFDoc import XCAFDoc_Centroid, XCAFDoc_DocumentTool, XCAFDoc_Volume

from silo.bom.errors import DocumentError, InputError, counted, listed
from silo.bom.message import message
from silo.inertia.assembly import Prototype
from silo.inertia.geometry import kernel as occt
from silo.inertia.geometry.graph import Child, Node, bottom_up, in_metres, unfold
from silo.inertia.geometry.helpers import WORTH_HELP, Helpers
from silo.inertia.geometry.kernel import MM, file_faces, trsf_matrix, xyz
from silo.inertia.geometry.kernel.solids import measure, measure_all
from silo.inertia.geometry.measured import (
    Measured,
    assembled,
    face_differs_note,
    face_rebuilt_note,
    implausible_size,
)
from silo.inertia.geometry.names import clean, is_generic
from silo.inertia.geometry.options import ReadOptions, Report
from silo.inertia.geometry.part21 import ProductFacts, Products
from silo.inertia.geometry.part_files import bare_stem, file_key, kindless, step_files
from silo.inertia.geometry.reading import GeometryReading
from silo.inertia.geometry.step_text import (
    MARK,
    Prepared,
    SphereTurn,
    only_product,
    prepare,
    with_turned_spheres,
)
from silo.inertia.geometry.together import Floats, combined
from silo.inertia.notes import GeometryCode, Note
from silo.platform.whole_files import scratch_folder


def read_step(
    path: Path,
    options: ReadOptions,
    report: Report,
    helpers: Helpers,
    text: Callable[[], Prepared] | None = None,
) -> GeometryReading:
    """Read the assembly of a STEP file, with the files beside it that belong to it. Raises DocumentError.

    text
        returns what was found in the file's text, if that search was begun already.
    """
    report("reading", 0, 0)
    step = load(
        path,
        max_instances=options.max_instances,
        text=text() if text is not None else None,
        encoding=options.step_encoding,
    )
    siblings = Siblings(
        step, options, helpers, lambda name: report(message("reading {name}", name=name), 0, 0)
    )
    siblings.resolve()
    unfolded = unfold(step.nodes, step.roots, options.max_instances)
    unmeasured = [key for key in unfolded.placed if key not in step.measured]
    measured_shapes = measure_all(
        [step.shapes.get(key, []) for key in unmeasured],
        options=options,
        helpers=helpers,
        done=lambda number, total: report("measuring", number, total),
    )
    step.measured.update(zip(unmeasured, measured_shapes, strict=True))
    prototypes = {key: _prototype(step, key, siblings.problems.get(key)) for key in unfolded.placed}
    problems = [*step.said, *split_problems(siblings), *stated_totals(step, prototypes)]
    problems += implausible_size(prototypes, step.unit or "mm")
    problems += unitless(step, prototypes)
    name = step.nodes[step.roots[0].product].name if len(step.roots) == 1 else path.stem
    assembly = assembled(unfolded, prototypes, problems, name=name, source=str(path), unit=step.unit)
    return GeometryReading(assembly, tuple(siblings.used), tuple(siblings.missing), kept=step.kept)


def unitless(step: StepFile, prototypes: Mapping[str, Prototype]) -> Iterator[Note]:
    """Note products whose lengths have no unit: the kernel takes mm, or, in an assembly, reads nothing."""
    for read, what in (
        (True, message("mm are taken")),
        (False, message("their bodies cannot be read; export them with a unit")),
    ):
        names = [
            f"“{step.nodes[key].name}”"
            for key, prototype in prototypes.items()
            if bool(prototype.volume_m3) is read
            and ((read and not step.unit) or (step.facts[key].bodies and not step.facts[key].unit_mm))
        ]
        if names:
            words = message(
                "the file states no unit of length that is understood for {names}; without one, ",
                names=listed(names, 4),
            )
            yield Note(GeometryCode.UNITS, words + what)


def _prototype(step: StepFile, key: str, note: Note | None) -> Prototype:
    node, facts, stated, measured = step.nodes[key], step.facts[key], step.stated[key], step.measured[key]
    problems = list(step.problems.get(key, ()))
    if any(problem.code == GeometryCode.BODY_MISSING for problem in problems):  # the surfaces left are of it
        notes = tuple(p for p in measured.problems if p.code != GeometryCode.BODY_MISSING)
        measured = replace(measured, problems=notes)
    if measured.solids and not node.children:
        whole = combined(measured.solids)
        problems += against_stated(whole.volume_m3, whole.com_m, stated)
    if facts.density_problem:
        problems.append(Note(GeometryCode.UNITS, facts.density_problem))
    if key in step.unnamed:
        words = message("it has no name in the file; called '{name}' after what holds it", name=node.name)
        problems.append(Note(GeometryCode.NAME, words))
    return measured.prototype(
        key,
        node.name,
        *problems,
        empty=note,
        step_density=facts.density,
        step_material=facts.material,
        stated_volume_m3=stated.volume_m3,
        part_number=facts.part_number or None,
    )


STATED_TOLERANCE = 1e-3
"""Files state volumes from their own integrations, 2.6e-5 off in one published by the format's authors."""


def against_stated(volume: float, com: Floats, stated: StatedInStep) -> list[Note]:
    """Compare a part's volume [m^3] and centre (3,) [m] with the validation properties in the file."""
    problems = []
    if stated.volume_m3 is not None and abs(volume - stated.volume_m3) > STATED_TOLERANCE * volume:
        problems.append(
            Note(
                GeometryCode.STATED_VOLUME,
                message(
                    "the file states a volume of {volume_m3} m3, the geometry has {volume} m3 ({volume_m32})",
                    volume_m3=f"{stated.volume_m3:.6g}",
                    volume=f"{volume:.6g}",
                    volume_m32=f"{volume / stated.volume_m3 - 1:+.2%}",
                )
                if stated.volume_m3
                else message(
                    "the file states no volume, the geometry has {volume} m3", volume=f"{volume:.6g}"
                ),
            )
        )
    if stated.centroid_m is not None:
        distance = float(np.linalg.norm(com - np.array(stated.centroid_m)))
        if distance > STATED_TOLERANCE * max(volume, 0.0) ** (1 / 3):
            problems.append(
                Note(
                    GeometryCode.STATED_CENTROID,
                    message(
                        "the file states a centre of volume {distance} mm away from the geometry's",
                        distance=f"{distance * 1000.0:.4g}",
                    ),
                )
            )
    return problems


def split_problems(siblings: Siblings) -> list[Note]:
    """Note from which files a split assembly was completed, and which are missing."""
    problems = []
    if siblings.used:
        names = listed([path.name for path in siblings.used])
        problems.append(
            Note(
                GeometryCode.EXTERNAL_FILE,
                message(
                    "a split assembly: geometry read from {used} beside it ({names})",
                    used=counted(len(siblings.used), "file"),
                    names=names,
                ),
            )
        )
    if siblings.missing:
        names = ", ".join(sorted(set(siblings.missing))[:5])
        problems.append(
            Note(
                GeometryCode.NO_GEOMETRY,
                message(
                    "{missing} without geometry, here or beside the file ({names}); put their files "
                    "into its folder, or export the assembly as one file",
                    missing=counted(len(siblings.missing), "product"),
                    names=names,
                ),
            )
        )
    return problems


def stated_totals(step: StepFile, prototypes: Mapping[str, Prototype]) -> list[Note]:
    """Note assemblies whose stated volume is not the sum of their content."""
    if not any(stated.volume_m3 for stated in step.stated.values()):
        return []
    volumes: dict[str, float] = {}
    problems = []
    for root in step.roots:
        for key in bottom_up(step.nodes, root.product):
            node, stated = step.nodes[key], step.stated[key].volume_m3
            own = prototypes[key].volume_m3 if key in prototypes else 0.0
            volumes[key] = own + sum(
                volumes[c.product] * abs(float(np.linalg.det(c.transform[:3, :3]))) for c in node.children
            )
            if node.children and stated and abs(volumes[key] / stated - 1) > STATED_TOLERANCE:
                problems.append(
                    Note(
                        GeometryCode.STATED_VOLUME,
                        message(
                            "the file states {stated} m3 for the assembly '{name}', its parts add up to "
                            "{key} m3",
                            stated=f"{stated:.6g}",
                            name=node.name,
                            key=f"{volumes[key]:.6g}",
                        ),
                    )
                )
    return problems


@dataclass(frozen=True, eq=False)
class StatedInStep:
    """Validation properties that the file gives for a product: [m^3] and (x, y, z) [m], None if absent."""

    volume_m3: float | None = None
    centroid_m: tuple[float, float, float] | None = None


@dataclass(eq=False)
class StepFile:
    """The content of one file; keys are unique over all files of a split assembly.

    shapes, measured
        of each product with a shape of its own: the kernel's, or what was measured of them already.
    problems, said
        of a product, and of the file: bodies that the text names and the kernel did not give.
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
    stated: dict[str, StatedInStep] = field(default_factory=dict)
    unnamed: set[str] = field(default_factory=set)
    problems: dict[str, tuple[Note, ...]] = field(default_factory=dict)
    said: list[Note] = field(default_factory=list)
    roots: list[Child] = field(default_factory=list)
    kept: tuple[Any, ...] = ()

    def take_in(self, other: StepFile) -> None:
        """Add another file's products; their keys must be new."""
        for mine, theirs in zip(vars(self).values(), vars(other).values(), strict=True):
            if isinstance(mine, dict | set):
                mine.update(theirs)
        self.said += other.said

    def take_shape(self, key: str, other: str) -> None:
        """Give the product ``key`` the shape of ``other``, or none if that has none."""
        for stored in (self.shapes, self.measured, self.problems):
            stored.pop(key, None)
            if other in stored:
                stored[key] = stored[other]  # type: ignore[assignment]


def load(
    path: Path,
    prefix: str = "",
    max_instances: int = 1_000_000,
    text: Prepared | None = None,
    encoding: str | None = None,
) -> StepFile:
    """Read one STEP file. ``prefix`` goes before every key. DocumentError if it cannot be read.

    text
        what :func:`prepare` found, if it was called already.
    encoding
        of names that are no UTF-8.
    """
    with scratch_folder("silo-step-") as folder:
        text = text or prepare(path, Path(folder), max_instances, encoding)
        step, doubts = _walked(path, prefix, text)
        if doubts:
            step = _with_faces_read_again(step, doubts, prefix, text, Path(folder))
        step.said += text.said
        return step


def _walked(path: Path, prefix: str, text: Prepared) -> tuple[StepFile, dict[str, file_faces.Doubt]]:
    document, reader = _transferred(text.source, path)
    walk = _StepWalk(path, prefix, document, reader, text.products)
    step = walk.run()
    step.kept = (document, reader)
    return step, walk.misread()


def _places(step: StepFile, wanted: list[Any]) -> list[int]:
    """Find where entities of the kernel's stand among all of the file, counted from 1."""
    model = step.kept[1].Reader().StepModel()
    places = {id(entity): 0 for entity in wanted}
    for place in range(1, model.NbEntities() + 1):
        entity = model.Entity(place)
        if id(entity) in places:
            places[id(entity)] = place
    return [places[id(entity)] for entity in wanted]


READINGS = 3
"""Of a file with misread faces, at most: each with another axis of their spheres."""


def _with_faces_read_again(
    step: StepFile, doubts: dict[str, file_faces.Doubt], prefix: str, text: Prepared, folder: Path
) -> StepFile:
    """Read a file again with other axes for its misread spheres, and note what became of them."""
    data = text.source.read_bytes()
    best, left = step, doubts
    turns: dict[int, SphereTurn] = {}
    for attempt in range(READINGS if any(doubt.spheres for doubt in doubts.values()) else 0):
        spheres = [sphere for doubt in left.values() for sphere in doubt.spheres]
        places = _places(best, [e for sphere in spheres for e in (sphere.entity, sphere.centre_entity)])
        for sphere, face, centre in zip(spheres, places[::2], places[1::2], strict=True):
            if attempt < len(axes := sphere.axes()):
                axis, across = (direction.tolist() for direction in axes[attempt])
                turns[face] = SphereTurn(centre, sphere.in_file, axis, across)
        changed, added = with_turned_spheres(data, turns)
        source = folder / "turned.step"
        source.write_bytes(changed)
        products = replace(text.products, count=text.products.count + added)
        again, remaining = _walked(step.path, prefix, replace(text, source=source, products=products))
        if sum(d.doubt for d in remaining.values()) < sum(d.doubt for d in left.values()):
            best, left = again, remaining
        if not any(doubt.spheres for doubt in left.values()):
            break
    for key, doubt in doubts.items():
        notes = []
        if best is not step and doubt.spheres:
            before, after = (_volume_m3(read.shapes.get(key, ())) for read in (step, best))
            notes.append(face_rebuilt_note(len(doubt.spheres), before, after))
        if (rest := left.get(key)) is not None and rest.counts:
            notes.append(face_differs_note(rest.faces, rest.doubt * MM**3, rest.volume * MM**3))
        best.problems[key] = (*best.problems.get(key, ()), *notes)
    return best


def _volume_m3(shapes: Iterable[Any]) -> float:
    solids = (solid for shape in shapes for solid in occt.solids_of(shape))
    return sum(abs(file_faces.volume_of(solid)) for solid in solids) * MM**3


def _transferred(source: Path, named: Path) -> tuple[Any, Any]:
    document = TDocStd_Document(TCollection_ExtendedString("XmlXCAF"))
    reader = STEPCAFControl_Reader()
    reader.SetNameMode(True)
    reader.SetColorMode(False)
    reader.SetLayerMode(False)
    reader.SetPropsMode(True)
    if reader.ReadFile(str(source)) != IFSelect_RetDone:
        raise DocumentError(
            str(named), message("the geometry kernel cannot read it as STEP; export it again")
        )
    if not reader.Transfer(document):
        raise DocumentError(str(named), message("holds no geometry that the kernel can transfer"))
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


class _StepWalk:
    """From the kernel's document to nodes; lives for one file."""

    def __init__(self, path: Path, prefix: str, document: Any, reader: Any, products: Products) -> None:
        self._tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
        self._reader = reader
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
            raise DocumentError(str(self._file.path), message("holds no product and no shape"))
        self._complete()
        self._file.empty = [
            key
            for key, shapes in self._file.shapes.items()
            if not self._file.nodes[key].children
            and not any(occt.has_edges(shape) or occt.faces_of(shape) for shape in shapes)
        ]
        return self._file

    def misread(self) -> dict[str, file_faces.Doubt]:
        """Find the products with faces that differ from their edges as the file has them."""
        facts = self._file.facts
        found = {
            key: file_faces.misread(shapes, self._transfer, facts[key].unit_mm)
            for key, shapes in self._file.shapes.items()
        }
        return {key: doubt for key, doubt in found.items() if doubt is not None}

    def _complete(self) -> None:
        """Add the bodies that the kernel's reader dropped, or say that they are missing."""
        file, bodies = self._file, Bodies(self._reader, self._products)
        groups: dict[int, list[str]] = {}
        for key, facts in file.facts.items():
            groups.setdefault(id(facts), []).append(key)
        if not self._owners:
            named = len(self._products.stray)
            named += sum(len(facts.bodies) for facts in self._products.facts.values())
            solids = sum(len(occt.solids_of(shape)) for own in file.shapes.values() for shape in own)
            if solids < named:
                words = message(
                    "the file has {named}, {solids} were read: volume is missing",
                    named=counted(named, "body", "bodies"),
                    solids=solids,
                )
                file.said.append(Note(GeometryCode.BODY_MISSING, words))
            return
        file.said += map(bodies.problem, self._products.stray)
        for keys in groups.values():
            # A product of mixed bodies may stand in several leaves: together they have what the text names.
            key, facts = keys[0], file.facts[keys[0]]
            notes = []
            for number in bodies.dropped(facts.bodies, [s for k in keys for s in file.shapes.get(k, ())]):
                if (shape := bodies.made(number, facts)) is None:
                    notes.append(bodies.problem(number))
                else:
                    file.shapes.setdefault(key, []).append(shape)
                    file.nodes[key] = replace(file.nodes[key], has_geometry=True)
            if facts.hidden:
                what = counted(facts.hidden, "of its bodies is", "of its bodies are")
                words = message(
                    "{what} hidden in the file (INVISIBILITY), and counted like all others", what=what
                )
                notes.append(Note(GeometryCode.HIDDEN, words))
            file.problems[key] = tuple(notes)

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
        """Return the uses of products, the products, the shapes that are the label's own, and their facts."""
        children: list[Child] = []
        inside: dict[str, _Used] = {}
        own: list[Any] = []
        facts: ProductFacts | None = None
        for component, used in self._components(label):
            if used.made_up:
                own.append(self._tool.GetShape_s(component))
                facts = facts or used.facts
            else:
                children.append(self._child(component, used))
                inside[used.key] = used
        return children, list(inside.values()), own, facts

    def _components(self, label: Any) -> Iterator[tuple[Any, _Used]]:
        """Yield each use and the product that it uses; looks through groups that we made ourselves."""
        if not self._tool.IsAssembly_s(label):
            return
        for component in occt.labels(lambda labels: self._tool.GetComponents_s(label, labels)):
            target = TDF_Label()
            self._tool.GetReferredShape_s(component, target)
            used = self._used(target)
            if used.name.startswith(MARK):
                yield from self._components(target)
            else:
                yield component, used

    def _used(self, target: Any) -> _Used:
        # Called for every use of a product, and slow.
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
        owner = self._owners.get(id(entity))
        return self._products.facts.get(owner[1]) if owner is not None else None


def _owners(reader: Any, products: Products) -> dict[int, tuple[Any, int]]:
    """Map the id of the kernel's entity objects to the object (kept alive, so that its id stays its own) and
    its product.
    """
    model = reader.Reader().StepModel()
    if model.NbEntities() != products.count:
        # The kernel left an entity out, so its numbers are not ours from there on. Names must be enough.
        return {}
    entities = ((model.Entity(ordinal), pd) for ordinal, pd in products.by_ordinal.items())
    return {id(entity): (entity, pd) for entity, pd in entities}


def _stated(label: Any) -> StatedInStep:
    volume = occt.attribute_of(label, XCAFDoc_Volume)
    centroid = occt.attribute_of(label, XCAFDoc_Centroid)
    point = centroid.Get() if centroid is not None else None
    return StatedInStep(
        volume.Get() * MM**3 if volume is not None else None,
        (point.X() * MM, point.Y() * MM, point.Z() * MM) if point is not None else None,
    )


_UNITS = {"millimetre": "mm", "metre": "m", "centimetre": "cm", "micrometre": "um"}


def _unit(reader: Any) -> str:
    lengths, angles, solid_angles = (Sequence_TCollection_AsciiString() for _ in range(3))
    reader.Reader().FileUnits(lengths, angles, solid_angles)
    names = {str(lengths.Value(i).ToCString()).strip().lower() for i in range(1, lengths.Length() + 1)}
    return " and ".join(sorted(_UNITS.get(name.replace("meter", "metre"), name) for name in names))


class Siblings:
    """The files that may hold missing products; ``problems`` by product key, ``used`` paths in order."""

    def __init__(
        self, top: StepFile, options: ReadOptions, helpers: Helpers, reading: Callable[[str], None]
    ) -> None:
        self._top = top
        self._options = options
        self._helpers = helpers
        self._reading = reading
        self._root = Path(os.path.realpath(top.path)).parent
        self._loaded: dict[Path, StepFile | str] = {}
        self._open = {Path(os.path.realpath(top.path))}
        self.problems: dict[str, Note] = {}
        self.used: list[Path] = []
        self.missing: list[str] = []

    def resolve(self) -> None:
        """Fill every product without geometry that has a file; notes for the others why they stay empty."""
        waiting = self._top.empty
        while waiting:
            by_key = {key: self._find(key) for key in waiting}
            self._load([path for path, _ in by_key.values() if path is not None])
            waiting = []
            for key, (path, reason) in by_key.items():
                if path is None:
                    self.missing.append(self._top.nodes[key].name)
                    self.problems[key] = Note(GeometryCode.NO_GEOMETRY, reason)
                    continue
                try:
                    waiting += self._fill(key, path)
                except DocumentError as error:
                    self.problems[key] = Note(
                        GeometryCode.NOT_READ,
                        message(
                            "its file {name} cannot be read: {reason}", name=path.name, reason=error.reason
                        ),
                    )

    def _load(self, wanted: list[Path]) -> None:
        """Read the files that are not read yet, large ones first, with as many processes as are useful."""
        paths = [path for path in dict.fromkeys(wanted) if path not in self._loaded]
        paths = paths[: max(self._options.max_siblings - len(self._loaded), 0)]
        sizes = {path: path.stat().st_size for path in paths if path.is_file()}
        paths.sort(key=lambda path: -sizes.get(path, 0))
        if len(paths) > 1 and sum(sizes.values()) >= WORTH_HELP and self._helpers.start():
            self._helpers.load_kernel()
        options = self._options
        rows = [
            (
                path,
                f"{path.relative_to(self._root).as_posix()}#",
                options.eps,
                options.mesh_check,
                options.step_encoding,
            )
            for path in paths
        ]
        read = self._helpers.all(
            rows,
            lambda row: (part_file, row),
            lambda number, _: self._reading(paths[number - 1].name),
        )
        self._loaded.update(zip(paths, read, strict=True))

    def _find(self, key: str) -> tuple[Path | None, str]:
        node, facts = self._top.nodes[key], self._top.facts[key]
        names = [file_key(name) for name in (node.name, facts.part_number) if name]
        documents = [file_key(bare_stem(document)) for document in facts.documents]
        answers = (
            found
            for index, keys in (
                (self._files, [*documents, *names]),
                (self._kindless, [kindless(key) for key in names]),
                (self._by_product, names),
            )
            for key in keys
            if (found := [p for p in index.get(key, ()) if p not in self._open])
        )
        paths = next(answers, [])
        if not paths:
            return None, (
                message(
                    "the file holds no geometry for it, and no file '{name}.STEP' lies in the folder",
                    name=node.name,
                )
                if self._options.siblings
                else message("the file holds no geometry for it, and files beside it are not to be used")
            )
        nearest = min(len(p.parts) for p in paths)
        best = [p for p in paths if len(p.parts) == nearest]
        if len(best) > 1:
            several = ", ".join(str(p.relative_to(self._root)) for p in best)
            return None, message(
                "the file holds no geometry for it, and several files are named after it: {names}",
                names=several,
            )
        return best[0], ""

    @cached_property
    def _files(self) -> Mapping[str, list[Path]]:
        """Map the key of a file's name → files in the folder and below it."""
        index: dict[str, list[Path]] = defaultdict(list)
        for path in step_files(self._root, self._options.sibling_depth) if self._options.siblings else ():
            index[file_key(path.stem)].append(path)
        return index

    @cached_property
    def _kindless(self) -> Mapping[str, list[Path]]:
        """Map the same without the kind in the file's name ("head_back_prt")."""
        index: dict[str, list[Path]] = defaultdict(list)
        for key, paths in self._files.items():
            index[kindless(key)] += paths
        return index

    @cached_property
    def _by_product(self) -> Mapping[str, list[Path]]:
        """Map the key of a product → files that hold this product alone, whatever they are called."""
        index: dict[str, list[Path]] = defaultdict(list)
        for path in islice((p for paths in self._files.values() for p in paths), self._options.max_siblings):
            for name in only_product(path):
                index[file_key(name)].append(path)
        return index

    def _fill(self, key: str, path: Path) -> list[str]:
        """Put the file's content in the product's place; returns the products in it that are empty
        themselves.
        """
        part = self._loaded.get(path)
        if part is None:
            raise DocumentError(
                str(path),
                message(
                    "more than {max_siblings} files belong to this assembly",
                    max_siblings=self._options.max_siblings,
                ),
            )
        if isinstance(part, str):
            raise DocumentError(str(path), part)
        empty: list[str] = []
        if path not in self.used:
            empty = part.empty
            self._top.take_in(part)
            self.used.append(path)
        self._hang(key, part.roots, path)
        return empty

    def _hang(self, key: str, roots: list[Child], path: Path) -> None:
        node = self._top.nodes[key]
        content = self._top.nodes[roots[0].product] if len(roots) == 1 else None
        children = content.children if content is not None else tuple(roots)
        filled = replace(node, children=children, has_geometry=bool(content and content.has_geometry))
        self._top.nodes[key] = filled
        try:
            bottom_up(self._top.nodes, key)
        except InputError as error:
            self._top.nodes[key] = node
            raise DocumentError(str(path), message("it contains the assembly that needs it")) from error
        self._top.take_shape(key, roots[0].product if content is not None else "")
        if content is not None:
            here, there = self._top.facts[key], self._top.facts[roots[0].product]
            self._top.facts[key] = replace(
                here,
                part_number=here.part_number or there.part_number,
                material=here.material or there.material,
                density=here.density if here.density is not None else there.density,
            )
            if self._top.stated[key] == StatedInStep():
                self._top.stated[key] = self._top.stated[roots[0].product]


def part_file(path: Path, prefix: str, eps: float, mesh_check: bool, encoding: str | None) -> StepFile | str:
    """Read and measure a part's own file, and drop the kernel's shapes. Returns a text if something is
    wrong.
    """
    try:
        part = load(path, prefix, encoding=encoding)
    except DocumentError as error:
        return error.reason
    part.measured = {
        key: measure(shapes, eps=eps, mesh_check=mesh_check) for key, shapes in part.shapes.items()
    }
    part.shapes.clear()
    part.kept = ()
    return part


MOST_ASKED = 200
"""Solids of one product whose entity the kernel is asked for, which is slow; of more, the number decides."""

MOST_PARTS = 500
"""Of one CSG tree; a hostile one of a kilobyte may unfold to 2**40."""

_OPERATIONS = {
    ".UNION.": BRepAlgoAPI_Fuse,
    ".DIFFERENCE.": BRepAlgoAPI_Cut,
    ".INTERSECTION.": BRepAlgoAPI_Common,
}


def _given(value: Any) -> Any:
    # The kernel ends the process if it gets nothing.
    if value is None:
        raise ValueError(message("the entity is not complete"))
    return value


class Bodies:
    """The bodies of one file, which its reader still holds."""

    def __init__(self, reader: Any, products: Products) -> None:
        session = reader.Reader()
        self._model = session.StepModel()
        self._transfer = session.WS().TransferReader()
        self._products = products
        self._left = 0

    def dropped(self, bodies: tuple[int, ...], shapes: list[Any]) -> list[int]:
        """Return the ``bodies`` that are missing in the solids of ``shapes``."""
        solids = [solid for shape in shapes for solid in occt.solids_of(shape) if occt.faces_of(solid)]
        if len(solids) == len(bodies) and not 1 < len(solids) <= MOST_ASKED:
            return []
        read = [self._transfer.EntityFromShapeResult(s.Located(TopLoc_Location()), 1) for s in solids]
        entity_ids = {id(entity) for entity in read if entity is not None}
        return [number for number in bodies if id(self._entity(number)) not in entity_ids]

    def made(self, number: int, facts: ProductFacts) -> Any:
        """Make the shape of a body that was dropped; None if that is not possible."""
        factors = StepData_Factors()
        factors.InitializeFactors(facts.unit_mm or 1.0, facts.unit_rad, 1.0)
        self._left = MOST_PARTS
        # If the reader could not close the faces of a body, this cannot either.
        if number in facts.mapped or self._products.solids[number][0].endswith(("BREP", "VOIDS")):
            return None
        with occt.Attempt(), suppress(AttributeError, LookupError, TypeError):
            shape = self._made(number, factors)
            if any(map(occt.faces_of, occt.solids_of(shape))):
                return shape
        return None

    def problem(self, number: int) -> Note:
        """Note that a body is missing."""
        entity, keyword = self._entity(number), self._products.solids[number][0]
        name = entity.Name() if hasattr(entity, "Name") else None
        what = f"{keyword} #{number}" + (f" “{name.ToCString()}”" if name and name.Length() else "")
        words = message(
            "the file has a body that could not be read as a solid, {what}: its volume is missing", what=what
        )
        return Note(GeometryCode.BODY_MISSING, words)

    def _entity(self, number: int) -> Any:
        return self._model.Entity(self._products.solids[number][1])

    def _made(self, number: int, factors: Any) -> Any:
        self._left -= 1
        keyword = self._products.solids[number][0]
        word, parts = self._products.trees.get(number, ("", ()))
        if self._left < 0:
            raise ValueError(message("its parts nest without end"))
        if keyword == "CSG_SOLID":
            return self._made(parts[0], factors)
        if keyword == "BOOLEAN_RESULT":
            body, other = (self._made(part, factors) for part in parts)
            return _OPERATIONS[word](body, other).Shape()
        entity = self._entity(number)
        if keyword == "SOLID_REPLICA":
            place = TopLoc_Location(_operator(_given(entity.Transformation()), factors))
            return self._made(parts[0], factors).Moved(place, False)
        return self._primitive(keyword, entity, factors)

    def _primitive(self, keyword: str, entity: Any, factors: Any) -> Any:
        unit = factors.LengthFactor()

        def place() -> gp_Ax2:
            position = _given(entity.Position())
            if keyword in ("BLOCK", "RIGHT_ANGULAR_WEDGE"):
                return StepToGeom.MakeAxis2Placement_s(position, factors).Ax2()
            axis = StepToGeom.MakeAxis1Placement_s(position, factors).Ax1()
            return gp_Ax2(axis.Location(), axis.Direction())

        def size(*names: str) -> list[float]:
            return [getattr(entity, name)() * unit for name in names]

        if keyword == "BLOCK":
            return BRepPrimAPI_MakeBox(place(), *size("X", "Y", "Z")).Shape()
        if keyword == "RIGHT_ANGULAR_WEDGE":
            return BRepPrimAPI_MakeWedge(place(), *size("X", "Y", "Z", "Ltx")).Shape()
        if keyword == "RIGHT_CIRCULAR_CYLINDER":
            return BRepPrimAPI_MakeCylinder(place(), *size("Radius", "Height")).Shape()
        if keyword == "RIGHT_CIRCULAR_CONE":
            radius, height = size("Radius", "Height")
            wider = radius + height * math.tan(entity.SemiAngle() * factors.PlaneAngleFactor())
            return BRepPrimAPI_MakeCone(place(), radius, wider, height).Shape()
        if keyword == "TORUS":
            return BRepPrimAPI_MakeTorus(place(), *size("MajorRadius", "MinorRadius")).Shape()
        if keyword == "SPHERE":
            centre = StepToGeom.MakeCartesianPoint_s(_given(entity.Centre()), factors).Pnt()
            return BRepPrimAPI_MakeSphere(centre, *size("Radius")).Shape()
        process = self._transfer.TransientProcess()
        if keyword in ("EXTRUDED_AREA_SOLID", "REVOLVED_AREA_SOLID"):
            area = StepToTopoDS_TranslateCurveBoundedSurface(
                _given(entity.SweptArea()), process, factors
            ).Value()
            if keyword == "REVOLVED_AREA_SOLID":
                axis = StepToGeom.MakeAxis1Placement_s(_given(entity.Axis()), factors).Ax1()
                return BRepPrimAPI_MakeRevol(area, axis, entity.Angle() * factors.PlaneAngleFactor()).Shape()
            along = StepToGeom.MakeDirection_s(_given(entity.ExtrudedDirection())).Dir()
            return BRepPrimAPI_MakePrism(area, gp_Vec(along).Multiplied(*size("Depth"))).Shape()
        builder = StepToTopoDS_Builder()
        builder.Init(entity, process, *([False] if keyword == "TESSELLATED_SOLID" else []), factors)
        return builder.Value()


def _operator(operator: Any, factors: Any) -> gp_Trsf:
    """Make the transformation of a replica, which may scale and mirror; the kernel's own does neither."""

    def axis(given: Any, default: int, *across: Floats) -> Floats:
        for axes in ([xyz(StepToGeom.MakeDirection_s(given).Dir())] if given is not None else []) + [
            *np.roll(np.eye(3), -default, axis=0)
        ]:
            free = np.array(axes) - sum(np.dot(axes, direction) * direction for direction in across)
            if np.linalg.norm(free) > 1e-6:
                break
        unit: Floats = free / np.linalg.norm(free)
        return unit

    z = axis(operator.Axis3(), 2)
    x = axis(operator.Axis1(), 0, z)
    y = axis(operator.Axis2(), 1, z, x)
    scale = operator.Scale() if operator.HasScale() else 1.0
    origin = xyz(StepToGeom.MakeCartesianPoint_s(_given(operator.LocalOrigin()), factors).Pnt())
    step = gp_Trsf()
    step.SetValues(*np.column_stack([scale * x, scale * y, scale * z, origin]).ravel().tolist())
    return step
