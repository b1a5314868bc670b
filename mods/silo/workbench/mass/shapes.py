# SPDX-License-Identifier: LGPL-2.1-or-later
"""The geometry of an open FreeCAD document: its own shapes and placements, measured by our own integration.

No geometry kernel but FreeCAD's is needed, and none of its numbers is used: ``Shape.Volume`` and
``MatrixOfInertia`` come from an integration without error control, off by up to 7e-3 on real parts. They only
stand witness, as the tessellation does.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np

from silo.bom.document import LinkProblem, own
from silo.bom.errors import DocumentError
from silo.inertia.core import place
from silo.inertia.geometry.exact.quadrature import Moments, integrate
from silo.inertia.geometry.freecad.assembly import assembled, one_by_one
from silo.inertia.geometry.freecad.members import top_object
from silo.inertia.geometry.freecad.stated_materials import (
    NO_MATERIAL,
    NOTHING,
    Material,
    linked_material,
    told_material,
)
from silo.inertia.geometry.freecad.walk import Leaf, Walk
from silo.inertia.geometry.graph import in_metres
from silo.inertia.geometry.measured import (
    INVALID,
    NO_VOLUME,
    STATED,
    Measured,
    Notes,
    cavity_note,
    drift_note,
    integration_notes,
    mesh_notes,
    shell_note,
)
from silo.inertia.geometry.mesh import PICTURE_TRIANGLES, Floats, Mesh, joined, mesh_volume, simplified
from silo.inertia.geometry.options import ReadOptions, Report
from silo.inertia.geometry.together import Body, together
from silo.inertia.model import Assembly, GeometryCode, GeometryProblem, SolidProps
from silo.workbench.freecad import live
from silo.workbench.mass.shape_faces import face_of, faces_of

MM = 1e-3

AGREE = 0.02
"""Where our integration and FreeCAD's differ by more, relative to the volume, the mesh decides."""

CLOSE = 0.01
"""A mesh that agrees as well as this clears a solid: chords cut about that much off a cylinder."""

MANY = 100_000
"""Triangles from where a finer mesh takes seconds."""


def read_live(document: Any, options: ReadOptions, report: Report) -> Assembly:
    """The geometry of an open document as it stands in this session, saved or not.

    ``report`` is called for every product and every face; what it raises (CancelledError) ends the reading.
    Raises DocumentError, as the reader of files does, and InputError for too many or too deeply nested parts.
    """
    source = document.FileName or document.Label
    report("reading", 0, 0)
    if lost := live.lost_assemblies(document):
        raise DocumentError(source, f"this FreeCAD is too old to load its assemblies ({', '.join(lost)})")
    cached = live.cached_document(document)
    walk = Walk(LiveFacts(), os.path.dirname(cached.FileName).replace("\\", "/"), options.hardware)
    top = walk.product(top_object(cached, options.object_name))

    def measured(leaf: Leaf) -> Measured:
        return _Product(options.eps, options.mesh_check, report).measured(leaf)

    return assembled(walk, top, source, options, one_by_one(measured), report)


class LiveFacts:
    """The facts of :class:`silo.inertia.geometry.freecad.facts.Facts` from FreeCAD itself."""

    def __init__(self) -> None:
        self._inspect = live.LinkInspector()

    def placement(self, obj: Any, name: str = "Placement") -> Floats:
        """(4, 4) [mm] of an object's own placement; the identity where it has none."""
        found = own(obj, name)
        return np.eye(4) if found is None else matrix_of(found)

    def places(self, obj: Any) -> list[Floats]:
        """(4, 4) [mm] each, the object's own ``PlacementList``."""
        return [matrix_of(one) for one in own(obj, "PlacementList") or ()]

    def shape(self, obj: Any) -> Any:
        """FreeCAD's shape of the object; None where it has no such property."""
        return obj.Shape if "Shape" in obj.PropertiesList else None

    def material(self, obj: Any) -> Material:
        """The material object linked to it, or its ``ShapeMaterial`` (FreeCAD >= 1.0)."""
        linked = linked_material(obj)
        if linked is not None:
            return linked
        card = _stored(obj, "ShapeMaterial")
        if card is None or not card.UUID or card.UUID == NO_MATERIAL:
            return NOTHING
        return told_material(card.Name, _density(card))

    def problem(self, link: Any) -> LinkProblem | None:
        """Why a link has no target."""
        return self._inspect(link)


def _stored(obj: Any, name: str) -> Any:
    """The value of a property, cut off from its object; None where the object has no such property.

    ``obj.ShapeMaterial.getPhysicalValue(…)`` marks the document as edited and touches all links to the object
    (measured in FreeCAD 1.0 and 1.1): FreeCAD takes every call of a value that it handed out as an attribute
    for a change of it. A value got by name is nobody's.
    """
    # A document without an assembly stands for itself, and has none of these.
    if name not in getattr(obj, "PropertiesList", ()):
        return None
    return getattr(obj, "real", obj).getPropertyByName(name)


def matrix_of(placement: Any) -> Floats:
    """(4, 4) of a FreeCAD placement."""
    return np.array(placement.toMatrix().A, dtype=np.float64).reshape(4, 4)


def _density(card: Any) -> float | None:
    try:
        return float(card.getPhysicalValue("Density").getValueAs("kg/m^3").Value)
    except (AttributeError, KeyError, LookupError, TypeError, ValueError, RuntimeError):
        return None


@dataclass(frozen=True, eq=False)
class _Solid:
    """One measured solid where FreeCAD has it; ``props`` None where it has no volume."""

    shape: Any
    props: SolidProps | None
    mesh: Mesh | None


@dataclass(eq=False)
class _Product:
    """Measures the shapes of one product."""

    eps: float
    mesh_check: bool
    report: Report
    known: list[_Solid] = field(default_factory=list)
    problems: list[GeometryProblem] = field(default_factory=list)

    def measured(self, leaf: Leaf) -> Measured:
        """All solids of a leaf, in its axes."""
        shapes = [(ref.handle, ref.transform) for ref in leaf.shapes if not ref.handle.isNull()]
        # FreeCAD keeps an object's placement as the location of its shape; the walk's own takes its place.
        placed = [(shape, t @ np.linalg.inv(matrix_of(shape.Placement))) for shape, t in shapes]
        solids = [(solid, matrix) for shape, matrix in placed for solid in shape.Solids]
        shells = [(solid, matrix) for shape, matrix in placed for solid in _closed_shells(shape)]
        if shells:
            self.problems.append(shell_note(len(shells), len(solids)))
        solids += shells
        bodies: list[Body] = []
        for number, (solid, matrix) in enumerate(solids, start=1):
            where = f"solid {number} of {len(solids)}: " if len(solids) > 1 else ""
            found, moved = self._find(solid, where)
            if found.props is not None:
                bodies.append(_placed(found, matrix @ moved, solid, matrix))
        faces = any(shape.Faces for shape, _ in shapes)
        meshes = [body.mesh for body in bodies if body.mesh is not None]
        if self.mesh_check and not solids and faces:
            meshes = [
                _mesh(shape, _fineness(shape)).moved(in_metres(t)) for shape, t in placed if shape.Faces
            ]
        picture = simplified(joined(meshes), PICTURE_TRIANGLES) if meshes else None
        settled = together(bodies, _common, self.problems)
        if settled.mixed:
            self.problems.append(cavity_note(settled))
        wires = any(shape.Edges for shape, _ in shapes)
        return Measured(settled.solids, tuple(self.problems), picture, faces, wires)

    def _find(self, solid: Any, where: str) -> tuple[_Solid, Floats]:
        """The solid or an equal one that was measured before, and (4, 4) [mm] from there to here."""
        here = matrix_of(solid.Placement)
        for one in self.known:
            if solid.isPartner(one.shape) and solid.Orientation == one.shape.Orientation:
                return one, here @ np.linalg.inv(matrix_of(one.shape.Placement))
        notes: Notes = []
        found = self._measure(solid, notes)
        self.problems += [GeometryProblem(code, where + message) for code, message in notes]
        self.known.append(found)
        return found, np.eye(4)

    def _measure(self, solid: Any, notes: Notes) -> _Solid:
        box = solid.BoundBox
        centre, size = np.array(tuple(box.Center)), max(box.DiagonalLength, 1e-9)
        mesh = _mesh(solid, _fineness(solid)) if self.mesh_check else None
        body = self._integrated(solid, centre, size / 2)
        body = _weighed(solid, body, mesh, notes)
        if not np.isfinite(body.volume) or body.volume == 0.0:
            notes.append(NO_VOLUME)
            return _Solid(solid, None, mesh)
        # The centre's distance is that from the origin of the shape's own coordinates.
        away = float(np.linalg.norm(np.linalg.inv(matrix_of(solid.Placement)) @ np.r_[centre, 1.0])) * MM
        notes += integration_notes(
            body.volume * MM**3, body.error, self.eps, distance_m=away, size_m=size * MM
        )
        if (note := drift_note(body.drift)) is not None:
            notes.append(note)
        if not solid.isValid():
            notes.append(INVALID)
        if mesh is not None:
            mesh, deviation = _cross_checked(solid, mesh, abs(body.volume))
            notes += mesh_notes(deviation, 0)
        sign = -1.0 if body.volume < 0 else 1.0
        props = SolidProps(
            sign * body.volume * MM**3, body.com * MM, sign * body.inertia * MM**5, reversed=body.volume < 0
        )
        return _Solid(solid, props, mesh)

    def _integrated(self, solid: Any, centre: Floats, radius: float) -> Moments:
        """By our integration; not finite where FreeCAD does not give the geometry in full."""
        faces = list(faces_of(solid))

        def told() -> Any:
            for number, face in enumerate(faces, start=1):
                self.report("measuring faces", number, len(faces))
                yield face_of(face)

        rough = abs(solid.Volume) or radius**3
        try:
            return integrate(told(), centre=centre, size=radius, volume=rough, eps=self.eps)
        except (ValueError, RuntimeError, AttributeError, np.linalg.LinAlgError):
            return Moments(np.nan, centre, np.zeros((3, 3)), np.inf)


def _weighed(solid: Any, ours: Moments, mesh: Mesh | None, notes: Notes) -> Moments:
    """Our moments; FreeCAD's where ours cannot be had, or where the mesh sides with them."""
    volume = float(solid.Volume)
    if abs(ours.volume - volume) <= AGREE * abs(volume):
        return ours
    enclosed = abs(mesh_volume(mesh)) * MM**-3 if mesh is not None else abs(volume)
    trusted = np.isfinite(ours.volume) and abs(abs(ours.volume) - enclosed) < abs(abs(volume) - enclosed)
    if not trusted:
        notes.append(
            (
                GeometryCode.NOT_CONVERGENT,
                "measured by FreeCAD's own integration, which has no error control: on real parts it was off "
                "by up to 0.7 %",
            )
        )
        tensor = np.array(solid.MatrixOfInertia.A, dtype=np.float64).reshape(4, 4)[:3, :3]
        return Moments(volume, np.array(tuple(solid.CenterOfMass)), tensor, 0.0)
    if ours.drift > STATED:  # where faces close, it is FreeCAD that is wrong
        apart = abs(volume / ours.volume - 1)
        message = f"FreeCAD's own volume differs by {apart:.1%}; the geometry may be bad"
        notes.append((GeometryCode.NOT_CONVERGENT, message))
    return ours


def _cross_checked(solid: Any, mesh: Mesh, volume: float) -> tuple[Mesh, float]:
    """A mesh for the picture, and by how much the best mesh differs from ``volume`` [mm^3]."""
    deviation = abs(abs(mesh_volume(mesh)) * MM**-3 / volume - 1)
    if deviation < CLOSE or len(mesh) > MANY:
        return mesh, deviation
    # Thin curved wires lose several per cent to chords: fine against their thickness, not their length.
    wanted = min(_fineness(solid) / 5, 0.02 * volume / max(solid.Area, 1e-12))
    finer = _mesh(solid, max(wanted, _fineness(solid) / 50))
    return mesh, min(deviation, abs(abs(mesh_volume(finer)) * MM**-3 / volume - 1))


def _fineness(shape: Any) -> float:
    return max(0.005 * float(shape.BoundBox.DiagonalLength), 1e-6)


def _mesh(shape: Any, deflection: float) -> Mesh:
    points, facets = shape.tessellate(deflection)
    vertices = np.array([(p.x, p.y, p.z) for p in points]).reshape(-1, 3) * MM
    return Mesh(vertices, np.array(facets, dtype=np.int64).reshape(-1, 3))


def _placed(found: _Solid, moved: Floats, solid: Any, matrix: Floats) -> Body:
    """A measured solid after ``moved``; ``solid`` after ``matrix`` ((4, 4) [mm]) is the same."""
    assert found.props is not None
    props, metres = found.props, in_metres(moved)
    volumes, coms, units = place([props.volume_m3], [props.com_m], [props.inertia_unit], [metres])
    there = SolidProps(float(volumes[0]), coms[0], units[0], props.reversed)
    box = solid.BoundBox
    ends = ((box.XMin, box.XMax), (box.YMin, box.YMax), (box.ZMin, box.ZMax))
    corners = np.array([(*corner, 1.0) for corner in product(*ends)]) @ matrix.T
    corners = corners[:, :3] * MM
    mesh = found.mesh.moved(metres) if found.mesh is not None else None
    return Body(there, corners.min(axis=0), corners.max(axis=0), mesh, (solid, matrix))


def _closed_shells(shape: Any) -> list[Any]:
    """The shells of a shape that stand in no solid and close, as solids."""
    if len(shape.Shells) == sum(len(solid.Shells) for solid in shape.Solids):
        return []
    import Part

    inside = [shell for solid in shape.Solids for shell in solid.Shells]
    loose = [shell for shell in shape.Shells if not any(shell.isSame(other) for other in inside)]
    return [Part.Solid(shell) for shell in loose if shell.isClosed()]


def _common(one: Body, other: Body) -> SolidProps | None:
    """What two solids have in common, by FreeCAD's boolean operation; None where that fails."""
    try:
        both = _shape(one).common(_shape(other))
        least = min(one.props.volume_m3, other.props.volume_m3)
        volume = float(both.Volume) * MM**3 if both.Solids else 0.0
        if not 0 <= volume <= (1 + 1e-5) * least:
            return None
        if volume == 0.0:
            return SolidProps(0.0, np.zeros(3), np.zeros((3, 3)))
        tensor = np.array(both.MatrixOfInertia.A, dtype=np.float64).reshape(4, 4)[:3, :3]
        return SolidProps(volume, np.array(tuple(both.CenterOfMass)) * MM, tensor * MM**5)
    except (ValueError, RuntimeError, AttributeError):
        return None


def _shape(body: Body) -> Any:
    solid, matrix = body.shape
    moved = solid.copy()
    # FreeCAD's own classes, without importing FreeCAD here.
    placement, matrix_class = type(solid.Placement), type(solid.Placement.toMatrix())
    moved.Placement = placement(matrix_class(*matrix.ravel().tolist())).multiply(solid.Placement)
    if body.props.reversed:
        moved.reverse()
    return moved
