# SPDX-License-Identifier: LGPL-2.1-or-later
"""A document as FreeCAD's Python shows it, read from the file.

A document object as FreeCAD's Python shows it, read from the file.

Differences to a live object, on purpose: nothing is forwarded to a link's target, nothing can be written,
lists are tuples, and a link without a target says why (``LinkProblem``).
"""

from __future__ import annotations

import hashlib
import os
import re
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Set
from contextlib import suppress
from functools import cache, cached_property, lru_cache
from struct import Struct
from typing import TYPE_CHECKING, Any, cast

from silo.bom.document import LinkProblem as Problem
from silo.bom.errors import DocumentError
from silo.bom.findings import FindingCode
from silo.bom.objects import Kind, Survey, kind_by_type, kind_of
from silo.fcstd.container import ContainerFile, FcstdError, Inflater, ZipEntry
from silo.fcstd.properties import (
    ABSENT,
    LocalList,
    Properties,
    Ref,
    RefList,
    ShapeFile,
    SideEntry,
    Style,
    Vector,
    table_of,
)
from silo.fcstd.xmltext import XmlText
from silo.files import FoundFile

if TYPE_CHECKING:
    from silo.fcstd.library import Content, Library, Remembered


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

_ALIKE = frozenset({"ElementCount", "LinkCopyOnChange", "Scale", "ScaleVector"})

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
    """Return True if the table has the type, or the type of which it is the Python form."""
    return type_name in PARENTS or type_name.removesuffix("Python") in PARENTS


@lru_cache(maxsize=4096)
def ancestors(type_name: str) -> frozenset[str]:
    """Return the type and all types from which it is derived; an unknown type is a plain document object."""
    types = {type_name, _ROOT}
    parents = PARENTS.get(type_name)
    if parents is None:
        base = type_name.removesuffix("Python")
        later = _LATER.get(type_name.partition("::")[0])
        parents = [base] if base in PARENTS else [later] if later else []
    for parent in parents:
        types |= ancestors(parent)
    return frozenset(types)


@cache
def _answer_of(ancestry: frozenset[str]) -> Callable[[str], bool]:
    """Return one bound method for all objects of a type, of which a file may have hundreds of thousands."""
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
        # A walker asks this most often, so the set itself answers.
        self.isDerivedFrom = _answer_of(self.ancestry)

    def _looks_like_a_link(self) -> bool:
        """Return True if the object has the properties of a link array, as a type that a later FreeCAD added
        may have.
        """
        try:
            self._load()
        except DocumentError:  # a caller that asks for a property of it gets the error
            return False
        numbers = self.properties.numbers
        return "LinkedObject" in numbers and "ElementCount" in numbers

    @cached_property
    def Label(self) -> str:
        """Return what people call the object; its ``Name`` if the file has no label."""
        label = self.properties.value("Label")
        return label if isinstance(label, str) else self.Name

    @property
    def LinkProblem(self) -> Problem | None:
        """Return why ``LinkedObject`` is None; if it is not None, why the original of a changed copy is.

        None for a link that has its target, and for an object without these properties.
        """
        return self._problem_of("LinkedObject") or self._problem_of("LinkCopyOnChangeSource")

    def _problem_of(self, name: str) -> Problem | None:
        ref = self.properties.value(name)
        # Most links have no original; only their target is reported as missing if it was never set.
        if not isinstance(ref, Ref) or (name != "LinkedObject" and not ref.name):
            return None
        return self.Document.problem_of(ref)

    def getPropertyByName(self, name: str) -> Any:
        """Return the value of a property. AttributeError if there is none, or none that is plain."""
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
        # The file does not change while it is open, so the next access need not call this.
        piece = properties.piece(name)
        value = mine[name] = self._value(name, piece)
        if len(piece) > _REMEMBER_AT_MOST and self.Document.is_large:
            properties.kept.pop(name, None)
        return value

    def own_property(self, name: str, default: Any) -> Any:
        """Return the value of a property; the default if there is none or it is not plain."""
        mine = self.__dict__
        if "properties" not in mine:
            self._load()
        if name in mine:
            return mine[name]
        return getattr(self, name, default) if name in mine["properties"].numbers else default

    def unload(self) -> None:
        """Forget what was read of the object; it is read again when it is needed."""
        del self.__dict__

    def shape_key(self) -> str:
        """Return a text that is equal for equal shapes, wherever they are placed; "" if the object has no
        shape.
        """
        value = self.properties.value("Shape") if "Shape" in self.properties.numbers else None
        return self.Document.shape_key(value.name) if isinstance(value, ShapeFile) else ""

    def _load(self) -> None:
        mine = self.__dict__
        properties = mine["properties"] = self.Document.properties_of(self)
        mine["PropertiesList"] = properties.names
        mine.update(properties.texts)
        values = self.Document.values
        for name, piece in properties.kept.items():
            if piece in values:
                mine[name] = values[piece]
            elif name in _ALIKE:  # most links have the same, and find it here
                with suppress(DocumentError):
                    getattr(self, name, None)
        self.Document.was_read(self, properties.size)

    def __repr__(self) -> str:
        return f"<{self.TypeId} {self.Name} of {self.Document.FileName}>"

    def _value(self, name: str, piece: bytes) -> Any:
        values = self.Document.values
        if (value := values.get(piece, ABSENT)) is not ABSENT:
            return value
        raw = self.properties.value(name)
        if raw is ABSENT or not isinstance(raw, _KINDS.get(name, object)):
            raise AttributeError(f"{name}: {self.TypeId} {self.Name} has no such property with a plain value")
        value = self._resolved(raw)
        if len(piece) <= _REMEMBER_AT_MOST:
            values[piece] = value
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


# Objects of these types are read together with the rest of their file, for a walker looks at what they hold.
_CONTAINERS = frozenset({"App::Part", "App::LinkGroup", "App::DocumentObjectGroup"})
_GEOMETRY = frozenset({Kind.LOCAL, Kind.NOTHING, Kind.FOLDER})
# What a target is and which item it is: without these a link to it would only be guessed at.
_SAID_OF_ITSELF = ("SiloItemId", "SiloUUID", "Type")
_BREP_TEXT = (b"CASCADE Topology", b"DBRep_DrawableShape")
_MANY_OBJECTS = 20_000
# Of so many objects a large document keeps what it has read. One with a long list, such as the assembly,
# costs too much to be read twice.
_READ_AT_MOST, _SHORT = 4096, 1 << 14
_SIZE = Struct("<I")
_DOUBLES, _FLOATS = Struct("<3d"), Struct("<3f")


class FileSurvey(Survey):
    """Objects by kind, most of them known by their type alone."""

    def __init__(self, document: FcstdDocument, xml: XmlText) -> None:
        self._document, self._xml = document, xml
        types = xml.head.types
        self._types = set(types.values())
        kinds = {kind: kind_by_type(ancestors(kind)) if is_listed(kind) else None for kind in self._types}
        self._kinds = {
            name: kind or kind_of(document.object_of(name, types[name]))
            for name, kind in zip(types, map(kinds.__getitem__, types.values()), strict=True)
        }
        self._there = set(self._kinds.values())
        self._groups: list[tuple[Kind, tuple[str, ...]]] | None = None

    def of(self, kinds: Set[Kind], but: Set[str] = frozenset()) -> list[tuple[Any, Kind]]:
        if self._there.isdisjoint(kinds):
            return []
        types, make = self._xml.head.types, self._document.object_of
        return [
            (make(name, types[name]), kind)
            for name, kind in self._kinds.items()
            if kind in kinds and name not in but
        ]

    def grouped(self, kinds: Set[Kind]) -> set[str]:
        if self._groups is None:
            types, make = self._xml.head.types, self._document.object_of
            groups = [
                (kind, make(name, types[name]).properties.value("Group"))
                for name in self._xml.mentioning("Group")
                if (kind := self._kinds.get(name)) is not None
            ]
            self._groups = [(kind, group.names) for kind, group in groups if isinstance(group, LocalList)]
        return {name for kind, names in self._groups if kind in kinds for name in names}

    def only(self, kinds: Set[Kind]) -> bool:
        """Return True if all objects are of these kinds."""
        return self._there <= kinds

    def has_python(self) -> bool:
        return any(type_id.endswith("FeaturePython") for type_id in self._types)


class FcstdDocument:
    """One FCStd file. ``FileName`` is absolute and without symlinks.

    Document properties (``Company``, ``Id``, ``Comment``, own ones of FreeCAD >= 0.21) are
    attributes.
    """

    FileName: str

    def __init__(self, library: Library, found: FoundFile, content: Content | Remembered) -> None:
        self.FileName = found.real
        self._library, self._found = library, found
        self.content, self.state = content, content.state
        if content.known is None:
            self.__dict__["_xml"] = content.xml  # a cached property takes a lock
        self._table: Properties | None = None
        self._objects: dict[str, FcstdObject] = {}
        self._read: deque[FcstdObject] = deque()
        self._targets: dict[tuple[str, str], FcstdObject | Problem] = {}
        self.values: dict[bytes, Any] = {}

    @cached_property
    def _xml(self) -> XmlText:
        return self.content.xml

    @cached_property
    def Label(self) -> str:
        """Return the file's name without its ending; FreeCAD ignores the saved label
        (``Document::Restore``).
        """
        return os.path.splitext(os.path.basename(self.FileName))[0]

    @cached_property
    def Name(self) -> str:
        """Return the internal name that FreeCAD would give: the file's, in ASCII letters, digits and
        ``_``.
        """
        name = re.sub(r"[^A-Za-z0-9_]", "_", self.Label)
        return f"_{name}" if name[:1].isdigit() else name or "Unnamed"

    @cached_property
    def ProgramVersion(self) -> str:
        """Return the FreeCAD that wrote the file, such as ``1.0R39319 (Git)``."""
        return self._xml.attribute("ProgramVersion")

    @cached_property
    def Uid(self) -> str:
        """Return FreeCAD's id of the document; copies of the file have the same one."""
        return self._text("Uid")

    @property
    def Meta(self) -> Mapping[str, str]:
        """Return the document's free texts by key; {} if the file has none."""
        value = self.__dict__.get("_meta")
        if value is None:
            value = self._value("Meta")
            value = self.__dict__["_meta"] = value if isinstance(value, dict) else {}
        return cast("Mapping[str, str]", value)

    @cached_property
    def Objects(self) -> tuple[FcstdObject, ...]:
        """Return all objects, in document order."""
        self.complete()
        return self.members(self._xml.head.types)

    @cached_property
    def survey(self) -> FileSurvey:
        """Return the objects by their kinds; an object is made only if it is asked for."""
        self.complete()
        return FileSurvey(self, self._xml)

    @property
    def PropertiesList(self) -> tuple[str, ...]:
        """Return the names of the document's own properties that the file holds."""
        return self.properties.names

    def getObject(self, name: str) -> FcstdObject | None:
        """Return the object of this ``Name`` (never a label); None if there is none."""
        fcstd_object = self._objects.get(name)
        if fcstd_object is None and (kind := self._type_of(name)) is not None:
            fcstd_object = self.object_of(name, kind)
        return fcstd_object

    def _type_of(self, name: str) -> str | None:
        remembered = self.content.known
        kind = remembered.type_of(name) if remembered is not None else None
        return kind or self._xml.head.types.get(name)

    def getPropertyByName(self, name: str) -> Any:
        """Return a document property. AttributeError if there is none, or none with a plain value."""
        value = self.Label if name == "Label" else self._value(name)
        if value is ABSENT:
            raise AttributeError(f"the document {self.FileName} has no readable property {name!r}")
        return value

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        value = self.__dict__[name] = self.getPropertyByName(name)
        return value

    def __repr__(self) -> str:
        return f"<document {self.FileName}>"

    def linked(self) -> set[str]:
        """Return roughly the recorded paths of linked files; none if the file holds only geometry."""
        return set() if self.survey.only(_GEOMETRY) else self._xml.linked()

    def mentioning(self, name: str) -> Iterable[str]:
        """Return the names of objects that may mention a name."""
        return self._xml.mentioning(name)

    # For the objects of this document and the session; a walker has no use for what follows.

    @cached_property
    def is_large(self) -> bool:
        """Return True if the file is so large that memory counts more than time."""
        return self.content.known is None and len(self._xml.head.types) > _MANY_OBJECTS

    def was_read(self, obj: FcstdObject, size: int) -> None:
        """Note that an object was read. A large document unloads the one that was read longest ago."""
        if self.is_large and size <= _SHORT:
            self._read.append(obj)
            if len(self._read) > _READ_AT_MOST:
                self._read.popleft().unload()

    def complete(self) -> None:
        """Read the file to its end and check it. Raises DocumentError."""
        self._xml.complete()

    @cached_property
    def folders(self) -> tuple[str, ...]:
        """Return the folders at which the paths of links begin: that of the path as opened, and that without
        symlinks.
        """
        location = self._found
        return tuple(dict.fromkeys((os.path.dirname(location.opened), os.path.dirname(location.real))))

    def check(self, target: FcstdObject) -> None:
        """Make sure that everything that a walker asks of a link's target can be read. Raises
        DocumentError.
        """
        remembered = self.content.known
        if remembered is not None and target.Name in remembered.sound:
            return
        # Facts are those of a file that was read to its end.
        if remembered is None and not _CONTAINERS.isdisjoint(ancestors(target.TypeId)):
            self._xml.complete()
        numbers = target.properties.numbers
        for name in _SAID_OF_ITSELF:
            if name in numbers:
                getattr(target, name, None)
        _ = target.Label, self.Meta, self._value("SiloUUID")
        if remembered is not None:
            remembered.sound.add(target.Name)

    @property
    def properties(self) -> Properties:
        """Return the property table of the document itself."""
        if self._table is None:
            remembered = self.content.known
            if remembered is None:
                self._table = Properties(self._xml, self._xml.head.properties, "")
            else:
                self._table = remembered.document
        return self._table

    def properties_of(self, obj: FcstdObject) -> Properties:
        """Return the property table of an object of this document."""
        remembered = self.content.known
        table = remembered.table(obj.Name) if remembered is not None else None
        return table or table_of(self._xml, obj.Name, obj.TypeId)

    def members(self, names: Collection[str]) -> tuple[FcstdObject, ...]:
        """Return the objects of these names; names without an object are skipped."""
        types = self._xml.head.types
        if len(names) > _MANY_OBJECTS:  # no second copy of each name
            listed = {name: name for name in types}
            names = [listed[name] for name in names if name in listed]
        return tuple(self.object_of(name, types[name]) for name in names if name in types)

    def resolve(self, ref: Ref) -> FcstdObject | None:
        """Return the object to which a link leads; None if the link is unset or broken."""
        if not ref.file and (local := self._objects.get(ref.name)) is not None:
            return local
        target = self._target(ref)
        return target if isinstance(target, FcstdObject) else None

    def problem_of(self, ref: Ref) -> Problem | None:
        """Return why ``resolve`` gives None; None if it does not."""
        problem = self._target(ref)
        return problem if isinstance(problem, Problem) else None

    def imported(self, file: str) -> Any:
        """Return the part that A2plus imported from a file, or a LinkProblem that says why there is none."""
        return self._library.imported(self, file)

    def vectors(self, entry_name: str) -> tuple[Vector, ...]:
        """Read a list of vectors from its side entry (``PropertyVectorList::RestoreDocFile``)."""
        if not entry_name:
            return ()
        entry = self._entries.get(entry_name.encode())
        if entry is None:
            raise FcstdError(self.FileName, f"its {entry_name} is missing")
        if entry.size <= _SIZE.size:  # an empty list; there is one for every link
            return ()
        data = self._side_entry(entry)
        # Files of FileVersion 0 have single precision (src/App/PropertyGeo.cpp).
        form = _DOUBLES if self._xml.attribute("FileVersion", "0") != "0" else _FLOATS
        (count,) = _SIZE.unpack_from(data)
        if len(data) != _SIZE.size + count * form.size:
            raise FcstdError(self.FileName, f"its {entry_name} is damaged (its length is wrong)")
        return tuple(Vector(*numbers) for numbers in form.iter_unpack(data[_SIZE.size :]))

    def shape_key(self, entry_name: str) -> str:
        """Hash a shape from its side entry, so that its placement does not matter; "" if there is no shape.

        The text form has all placements in a separate list (``BRepTools_ShapeSet``).
        """
        entry = self._entries.get(entry_name.encode()) if entry_name else None
        if entry is None or entry.size > self._xml.limits.side_entry:
            return ""
        data = self._side_entry(entry)
        begin = data.find(b"Curve2ds") if data.lstrip().startswith(_BREP_TEXT) else 0
        # The last line says where the shape is placed.
        body = data[begin:].rstrip().rpartition(b"\n")[0] if begin > 0 else data
        return hashlib.sha256(body).hexdigest()

    @cached_property
    def _entries(self) -> dict[bytes, ZipEntry]:
        try:
            return {entry.name: entry for entry in self.content.directory.entries()}
        except ValueError as error:
            raise FcstdError(self.FileName, str(error)) from error

    def _value(self, name: str) -> Any:
        value = self.properties.value(name)
        return value if isinstance(value, str | int | float | dict | tuple) else ABSENT

    def _text(self, name: str) -> str:
        value = self._value(name)
        return value if isinstance(value, str) else ""

    def object_of(self, name: str, kind: str) -> FcstdObject:
        """Return the object of this name and type; makes it if it is not there yet."""
        found = self._objects.get(name)
        if found is None:
            found = self._objects[name] = FcstdObject(self, name, kind)
        return found

    def _target(self, ref: Ref) -> FcstdObject | Problem:
        key = (ref.file, ref.name)
        target = self._targets.get(key)
        if target is None:
            target = self._targets[key] = self._find_target(ref)
        return target

    def _find_target(self, ref: Ref) -> FcstdObject | Problem:
        if not ref.name:
            code = FindingCode.MISSING_OBJECT if ref.file else FindingCode.UNSET_LINK
            return Problem(code, ref.file)
        if ref.file:
            return self._library.follow(self, ref)
        fcstd_object = self.getObject(ref.name)
        return fcstd_object or Problem(FindingCode.MISSING_OBJECT, "", ref.name)

    def _side_entry(self, entry: ZipEntry) -> bytes:
        limits = self._xml.limits
        with ContainerFile(self.FileName, limits) as container:
            if container.state != self.state:
                raise FcstdError(self.FileName, "it was changed while it was being read; read it again")
            packed = container.packed(entry, limits.packed)
            return Inflater(self.FileName, entry, packed, limits.side_entry, limits).rest()
