# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which of FreeCAD's types is derived from which, as far as a BOM may ask."""

from __future__ import annotations

from functools import lru_cache

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
