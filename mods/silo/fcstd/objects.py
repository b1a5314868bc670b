# SPDX-License-Identifier: LGPL-2.1-or-later
"""A document object as FreeCAD's Python shows it, read from the file.

Differences to a live object, on purpose: nothing is forwarded to a link's target, nothing can be written,
lists are tuples, and a link without a target says why (``LinkProblem``).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from functools import cache, cached_property, lru_cache
from typing import TYPE_CHECKING, Any

from silo.bom.document import LinkProblem as Problem
from silo.bom.errors import DocumentError
from silo.fcstd.properties import Properties
from silo.fcstd.values import ABSENT, LocalList, Ref, RefList, ShapeFile, SideEntry, Style, Vector

if TYPE_CHECKING:
    from silo.fcstd.document import FcstdDocument

_STAMP = re.compile(rb'<XLink\b[^<>]*?\sstamp="([0-9TZ:.+-]{1,40})"')

# Equal properties of a document are written in equal bytes (1000 links have one ElementCount), so values are
# remembered by their bytes; long ones seldom repeat.
_REMEMBER_AT_MOST = 1024

# FreeCAD's own properties have one kind; of another kind (a damaged file) FreeCAD ignores them too.
_KINDS: dict[str, type] = {
    "ElementCount": int,
    "ElementList": LocalList,
    "Group": LocalList,
    "LinkCopyOnChangeSource": Ref,
    "LinkedObject": Ref,
    "ScaleList": SideEntry,
    "ScaleVector": Vector,
    "VisibilityList": tuple,
}

_ROOT = "App::DocumentObject"

# Which type is derived from which, as far as a BOM may ask. Taken from FreeCAD 0.20 by asking every type of
# it (``doc.supportedTypes()``, ``isDerivedFrom``), with the types that 1.0 and 1.1 added
# (``src/Mod/Assembly/App``, ``src/App/Datums.h``) by hand. A test asks an installed FreeCAD.
#
# "parent: children"; a name without "::" is in the parent's module. A type may have two parents here where
# FreeCAD 1.1 put another class between.
_TREE = """
App::DocumentObject: Annotation AnnotationLabel DocumentObjectFileIncluded DocumentObjectGroup FeaturePython
App::DocumentObject: FeatureTest GeoFeature Link LinkElement LinkGroup MaterialObject MeasureDistance Origin
App::DocumentObject: TextDocument VarSet Mesh::Curvature Mesh::Export Spreadsheet::Sheet
App::DocumentObjectGroup: DocumentObjectGroupPython Assembly::JointGroup Assembly::BomGroup
App::DocumentObjectGroup: Assembly::ViewGroup Assembly::SnapshotGroup Assembly::SimulationGroup
App::DocumentObjectGroup: Fem::FemAnalysis Inspection::Group
App::FeatureTest: FeatureTestException
App::GeoFeature: GeometryPython InventorObject OriginFeature Part Placement VRMLObject DatumElement
App::GeoFeature: LocalCoordinateSystem ImagePlane Mesh::Feature Part::Feature Points::Feature Path::Feature
App::GeoFeature: Image::ImagePlane Fem::FemMeshObject Fem::FemPostObject Robot::RobotObject
App::GeoFeature: Robot::TrajectoryObject
App::Link: LinkPython Part::LinkArray
App::LinkElement: LinkElementPython
App::LinkGroup: LinkGroupPython
App::LocalCoordinateSystem: Origin Part::LocalCoordinateSystem
App::MaterialObject: MaterialObjectPython
App::OriginFeature: Line Plane
App::DatumElement: Line Plane Point
App::Line: Part::DatumLine
App::Part: Assembly::AssemblyObject Assembly::AssemblyLink
App::Placement: PlacementPython
App::Plane: Part::DatumPlane
App::Point: Part::DatumPoint
Assembly::AssemblyObject: AssemblyObjectPython
Mesh::Feature: Cone Cube Cylinder Ellipsoid FeatureCustom FeaturePython FixDefects Import SegmentByMesh
Mesh::Feature: SetOperations Sphere Torus Transform
Mesh::FixDefects: FillHoles FixDeformations FixDegenerations FixDuplicatedFaces FixDuplicatedPoints
Mesh::FixDefects: FixIndices FixNonManifolds FlipNormals HarmonizeNormals RemoveComponents
Mesh::Transform: TransformDemolding
Part::BodyBase: PartDesign::Body
Part::Boolean: Common Cut Fuse Section
Part::Compound: Compound2
Part::CustomFeature: CustomFeaturePython
Part::Datum: PartDesign::CoordinateSystem PartDesign::Line PartDesign::Plane PartDesign::Point
Part::Feature: BodyBase Boolean Compound CurveNet CustomFeature Datum Extrusion Face FeatureExt
Part::Feature: FeatureGeometrySet FeaturePython FilletBase ImportBrep ImportIges ImportStep Loft Mirroring
Part::Feature: MultiCommon MultiFuse Offset Part2DObject Polygon Primitive ProjectOnSurface Refine Reverse
Part::Feature: Revolution RuledSurface Scale Spline SubShapeBinder Sweep Thickness PartDesign::Feature
Part::Feature: PartDesign::ShapeBinder PartDesign::SubShapeBinder Surface::Cut Surface::Sewing
Part::Feature: Path::FeatureArea Path::FeatureAreaView TechDraw::FeatureProjection
Part::FilletBase: Chamfer Fillet
Part::LinkArray: LinkArrayLinear LinkArrayPolar LinkArrayCircular LinkArrayPath LinkArrayPoint
Part::Offset: Offset2D
Part::Part2DObject: Part2DObjectPython Sketcher::SketchObject Sketcher::SketchObjectSF
Part::Primitive: Box Circle Cone Cylinder Ellipse Ellipsoid Helix Line Plane Prism RegularPolygon Sphere
Part::Primitive: Spiral Torus Vertex Wedge
Part::Spline: Surface::Extend Surface::Filling Surface::GeomFillSurface Surface::Sections
PartDesign::Box: AdditiveBox SubtractiveBox
PartDesign::Cone: AdditiveCone SubtractiveCone
PartDesign::Cylinder: AdditiveCylinder SubtractiveCylinder
PartDesign::DressUp: Chamfer Draft Fillet Thickness
PartDesign::Ellipsoid: AdditiveEllipsoid SubtractiveEllipsoid
PartDesign::Feature: Boolean FeatureAddSub FeatureBase FeaturePython Solid Transformed
PartDesign::FeatureAddSub: DressUp FeatureAddSubPython FeaturePrimitive ProfileBased
PartDesign::FeatureAddSubPython: FeatureAdditivePython FeatureSubtractivePython
PartDesign::FeatureExtrude: Pad Pocket
PartDesign::FeaturePrimitive: Box Cone Cylinder Ellipsoid Prism Sphere Torus Wedge
PartDesign::Helix: AdditiveHelix SubtractiveHelix
PartDesign::Loft: AdditiveLoft SubtractiveLoft
PartDesign::Pipe: AdditivePipe SubtractivePipe
PartDesign::Prism: AdditivePrism SubtractivePrism
PartDesign::ProfileBased: FeatureExtrude Groove Helix Hole Loft Pipe Revolution
PartDesign::Sphere: AdditiveSphere SubtractiveSphere
PartDesign::SubShapeBinder: SubShapeBinderPython
PartDesign::Torus: AdditiveTorus SubtractiveTorus
PartDesign::Transformed: LinearPattern Mirrored MultiTransform PolarPattern Scaled
PartDesign::Wedge: AdditiveWedge SubtractiveWedge
Path::Feature: FeatureCompound FeaturePython FeatureShape
Points::Feature: FeatureCustom FeaturePython Structured
Points::Structured: StructuredCustom
Sketcher::SketchObject: SketchObjectPython
Spreadsheet::Sheet: SheetPython Assembly::BomObject
"""

# What a type that is not listed most likely is: a feature that a later FreeCAD added.
_LATER = {
    "Part": "Part::Feature",
    "PartDesign": "PartDesign::Feature",
    "Surface": "Part::Feature",
    "Mesh": "Mesh::Feature",
    "Points": "Points::Feature",
    "Path": "Path::Feature",
}


def _parents() -> dict[str, list[str]]:
    parents: dict[str, list[str]] = {_ROOT: []}
    for line in _TREE.split("\n"):
        parent, _, children = line.partition(": ")
        module = parent.partition("::")[0]
        for child in children.split():
            name = child if "::" in child else f"{module}::{child}"
            parents.setdefault(name, []).append(parent)
    return parents


PARENTS = _parents()


def is_listed(type_name: str) -> bool:
    """True for a type of the table, and for the Python form of one."""
    return type_name in PARENTS or type_name.removesuffix("Python") in PARENTS


@lru_cache(maxsize=4096)
def ancestors(type_name: str) -> frozenset[str]:
    """The type itself and all that it is derived from; unknown types are plain document objects."""
    found = {type_name, _ROOT}
    parents = PARENTS.get(type_name)
    if parents is None:
        base = type_name.removesuffix("Python")
        later = _LATER.get(type_name.partition("::")[0])
        parents = [base] if base in PARENTS else [later] if later else []
    for parent in parents:
        found |= ancestors(parent)
    return frozenset(found)


@cache
def _answer_of(ancestry: frozenset[str]) -> Callable[[str], bool]:
    """One bound method for all objects of a type: a file may have hundreds of thousands."""
    return ancestry.__contains__


class FcstdObject:
    """One object of a document. Properties are attributes, under FreeCAD's names.

    There is one ``FcstdObject`` per object of a document, so ``is``, ``==`` and ``hash`` distinguish objects.
    Reading a property may raise DocumentError where the file turns out to be damaged.
    """

    # What an object has before it is read; the rest is in its dictionary, which a large document takes back.
    __slots__ = ("Document", "Name", "TypeId", "__dict__", "__weakref__", "ancestry", "isDerivedFrom")

    Name: str
    TypeId: str
    ancestry: frozenset[str]
    """The type and all that it is derived from."""
    isDerivedFrom: Callable[[str], bool]
    """As FreeCAD: the type of the object itself, never of a link's target; False for unknown names."""
    Document: FcstdDocument
    properties: Properties
    """The table of what the file holds, for those that want to see more than values."""
    PropertiesList: tuple[str, ...]
    """The names of the properties that the file holds (FreeCAD lists its transient ones as well)."""

    def __init__(self, document: FcstdDocument, name: str, type_id: str) -> None:
        self.Document = document
        self.Name = name
        self.TypeId = type_id
        self.ancestry = ancestors(type_id)
        if not is_listed(type_id) and self._looks_like_a_link():
            self.ancestry = ancestors("App::Link") | {type_id}
        # A walker asks this most of all; so the set itself answers.
        self.isDerivedFrom = _answer_of(self.ancestry)

    def _looks_like_a_link(self) -> bool:
        """A type that a later FreeCAD added, with the properties of a link array."""
        try:
            self._load()
        except DocumentError:  # whoever asks for a property of it gets the error
            return False
        numbers = self.properties.numbers
        return "LinkedObject" in numbers and "ElementCount" in numbers

    @cached_property
    def Label(self) -> str:
        """What people call the object; its ``Name`` where the file has no label."""
        label = self.properties.value("Label")
        return label if isinstance(label, str) else self.Name

    @property
    def LinkProblem(self) -> Problem | None:
        """Why ``LinkedObject`` is None; where it is not, why the original of a changed copy is.

        None for a link that has what it records, and where there are no such properties.
        """
        return self._problem_of("LinkedObject") or self._problem_of("LinkCopyOnChangeSource")

    def _problem_of(self, name: str) -> Problem | None:
        ref = self.properties.value(name)
        # Most links have no original; only their target may be missed where it was never set.
        if not isinstance(ref, Ref) or (name != "LinkedObject" and not ref.name):
            return None
        return self.Document.problem_of(ref)

    def stamp_of(self, name: str) -> str:
        """The date of its target that a link property recorded (UTC, seconds); "" where it has none."""
        if name not in self.properties.numbers:
            return ""
        found = _STAMP.search(self.properties.piece(name))
        return found[1].decode() if found else ""

    def getPropertyByName(self, name: str) -> Any:
        """The value of a property. AttributeError where there is none, or none that is plain."""
        if name not in self.properties.numbers:  # a plain attribute, such as Name, is no property
            raise AttributeError(f"{self.TypeId} {self.Name} has no property {name!r}")
        return getattr(self, name)

    def __getattr__(self, name: str) -> Any:
        mine = self.__dict__
        if "properties" not in mine:
            self._load()
            if name in mine:
                return mine[name]
        properties: Properties = mine["properties"]
        if name not in properties.numbers:
            raise AttributeError(name)
        # The file does not change while it is open, so the next access need not come here.
        piece = properties.piece(name)
        value = mine[name] = self._value(name, piece)
        if len(piece) > _REMEMBER_AT_MOST and self.Document.is_large:
            properties.kept.pop(name, None)
        return value

    def own_property(self, name: str, default: Any) -> Any:
        """The value of a property, the default where there is none or it is not plain."""
        mine = self.__dict__
        if "properties" not in mine:
            self._load()
        if name not in mine["properties"].numbers:
            return default
        return mine[name] if name in mine else getattr(self, name, default)

    def unload(self) -> None:
        """Give back what was read of the object; it is read again when somebody asks."""
        del self.__dict__

    def shape_key(self) -> str:
        """Something equal for equal shapes, wherever they are placed; "" where the object has no shape."""
        value = self.properties.value("Shape") if "Shape" in self.properties.numbers else None
        return self.Document.shape_key(value.name) if isinstance(value, ShapeFile) else ""

    def _load(self) -> None:
        mine = self.__dict__
        properties = mine["properties"] = self.Document.properties_of(self)
        mine["PropertiesList"] = properties.names
        mine.update(properties.texts)
        known = self.Document.values
        for name, piece in properties.kept.items():
            if piece in known:
                mine[name] = known[piece]
        self.Document.was_read(self, properties.size)

    def __repr__(self) -> str:
        return f"<{self.TypeId} {self.Name} of {self.Document.FileName}>"

    def _value(self, name: str, piece: bytes) -> Any:
        # A plain link has no elements, so no scales of elements; its entry need not be looked up.
        if name == "ScaleList" and getattr(self, "ElementCount", None) == 0:
            return ()
        known = self.Document.values
        if (value := known.get(piece, ABSENT)) is not ABSENT:
            return value
        raw = self.properties.value(name)
        if raw is ABSENT or not isinstance(raw, _KINDS.get(name, object)):
            raise AttributeError(f"{name}: {self.TypeId} {self.Name} has no such property with a plain value")
        value = self._resolved(raw)
        if len(piece) <= _REMEMBER_AT_MOST:
            known[piece] = value
        return value

    def _resolved(self, value: Any) -> Any:
        if isinstance(value, Ref):
            return _with_subs(self.Document.resolve(value), value)
        if isinstance(value, LocalList):
            return self.Document.members(value.names)
        if isinstance(value, RefList):
            return tuple(self._members(value.refs))
        if isinstance(value, SideEntry):
            return self.Document.vectors(value.name)
        return value

    def _members(self, refs: Iterable[Ref]) -> Iterator[Any]:
        for ref in refs:
            if (target := self.Document.resolve(ref)) is not None:
                yield _with_subs(target, ref)


def _with_subs(target: FcstdObject | None, ref: Ref) -> Any:
    if target is None or ref.style is Style.PLAIN:
        return target
    if ref.style is Style.MEMBER:
        return (target, ref.subs)
    if ref.style is Style.PAIR:
        return (target, list(ref.subs))
    if not ref.subs:
        return target
    return (target, ref.subs[0] if len(ref.subs) == 1 else list(ref.subs))
