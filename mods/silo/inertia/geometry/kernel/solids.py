# SPDX-License-Identifier: LGPL-2.1-or-later
"""Volume, centre and tensor of a shape of the geometry kernel, with every doubt about them named.

Rules of this module, each found on real files:

* The integration is chosen by :mod:`moments`; the kernel's usual one is off in silence.
* Integrated with the solid moved to the origin: from afar the tensor is the difference of huge numbers.
* A negative volume is a reversed shell. Its sign is turned, and said.
* The tessellation is integrated as well, by other code. Where both disagree the geometry is bad.
* A solid that stands in a product fifty times (the pins of a connector) is measured once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.gp import gp_Trsf, gp_Vec
from OCP.TopLoc import TopLoc_Location

from silo.inertia.core import place
from silo.inertia.geometry.graph import in_metres
from silo.inertia.geometry.kernel import occt
from silo.inertia.geometry.kernel.closure import beside_edges, closed_shells, open_edges_of
from silo.inertia.geometry.kernel.common import KernelCommon
from silo.inertia.geometry.kernel.moments import solid_moments
from silo.inertia.geometry.kernel.tessellate import (
    MM,
    bounds,
    box,
    cross_check,
    tessellated,
    triangles,
    trsf_matrix,
)
from silo.inertia.geometry.measured import (
    INVALID,
    NO_VOLUME,
    Measured,
    Notes,
    cavity_note,
    drift_note,
    integration_notes,
    mesh_notes,
    open_note,
    shell_note,
)
from silo.inertia.geometry.mesh import (
    PICTURE_TRIANGLES,
    Floats,
    Mesh,
    joined,
    simplified,
    welded,
)
from silo.inertia.geometry.together import Body, enclosed, together
from silo.inertia.model import GeometryCode, GeometryProblem, SolidProps

SMALL = 0.1
"""Size of a solid in sizes of its product, below which its picture may be coarse."""

MANY_FACES = 60
"""A solid with more is full of small faces, whose picture may be coarse; meshing it is the most work."""

NEAR = 50.0
"""Distance from the origin, in sizes of the solid, up to where integrating from there costs no digits."""


def measure(shapes: list[Any], *, eps: float, mesh_check: bool) -> Measured:
    """All solids of ``shapes``, in their common axes; shells that close count as solids, with a word."""
    problems: list[GeometryProblem] = []
    bodies: list[Body] = []
    known: dict[tuple[int, Any], _Bare] = {}
    solids = [solid for shape in shapes for solid in occt.solids_of(shape)]
    shells = closed_shells(shapes)
    if shells:
        problems.append(shell_note(len(shells), len(solids)))
    found = [*solids, *shells]
    picture = _Picture.of(shapes, len(found)) if mesh_check else None
    for number, solid in enumerate(found, start=1):
        # The kernel's shared body of equal solids; kept in _Bare, so that its id stays its own.
        body = solid.TShape()
        key = (id(body), solid.Orientation())
        if key not in known:
            known[key] = _measured(solid.Located(TopLoc_Location()), body, eps, picture)
            where = f"solid {number} of {len(found)}: " if len(found) > 1 else ""
            problems += [GeometryProblem(code, where + message) for code, message in known[key].notes]
        bodies += _placed(known[key], solid)
    settled = together(bodies, KernelCommon(), problems)
    if settled.mixed:
        problems.append(cavity_note(settled))
    meshes = [body.mesh for body in bodies if body.mesh is not None]
    bare = [] if found else [shape for shape in shapes if occt.faces_of(shape)]
    if mesh_check and bare:
        meshes = [tessellated(shape)[0] for shape in bare]
    whole = simplified(joined(meshes), PICTURE_TRIANGLES) if meshes else None
    wires = any(occt.has_edges(shape) for shape in shapes)
    return Measured(settled.solids, tuple(problems), whole, bool(found or bare), wires)


@dataclass(frozen=True, slots=True)
class _Picture:
    """What a product's picture asks of one solid's mesh: the product's size [mm], and triangles at most."""

    size: float
    triangles: int

    @classmethod
    def of(cls, shapes: list[Any], solids: int) -> _Picture:
        """Each solid may have four times its share, for most need less."""
        share = 4 * PICTURE_TRIANGLES // max(solids, 1)
        return cls(max((box(shape)[1] for shape in shapes), default=0.0), max(share, 500))


@dataclass(frozen=True, eq=False)
class _Bare:
    """One solid in the axes of its bare geometry; ``props`` None where it has no volume.

    flat
        its mesh is the very solid.
    """

    body: Any
    props: SolidProps | None
    mesh: Mesh | None
    notes: Notes
    flat: bool = False


def _measured(solid: Any, body: Any, eps: float, picture: _Picture | None) -> _Bare:
    notes: Notes = []
    if not all(occt.has_surface(face) for face in occt.faces_of(solid)):
        return _Bare(body, *_triangulated_solid(solid, notes), notes)
    props = _integrated(solid, eps, notes)
    if not BRepCheck_Analyzer(solid).IsValid():
        notes.append(INVALID)
    mesh = _checked_mesh(solid, props, picture, notes) if picture is not None else None
    if props is not None and (edges := open_edges_of(solid)) is not None:
        notes.append(open_note(edges))
    elif props is not None and not any(code is GeometryCode.NOT_CONVERGENT for code, _ in notes):
        note = drift_note(beside_edges(solid, props.volume_m3 / MM**3))
        notes += [note] if note is not None else []
    flat = mesh is not None and props is not None and occt.is_flat(solid)
    return _Bare(body, props, mesh, notes, flat)


def _placed(bare: _Bare, solid: Any) -> list[Body]:
    """The solid where it stands, with our own algebra; empty where it has no volume."""
    if bare.props is None:
        return []
    props, mesh = bare.props, bare.mesh
    location = trsf_matrix(solid.Location().Transformation())
    if not np.array_equal(location, np.eye(4)):
        matrix = in_metres(location)
        volumes, coms, units = place([props.volume_m3], [props.com_m], [props.inertia_unit], [matrix])
        mesh = mesh.moved(matrix) if mesh is not None else None
        props = SolidProps(float(volumes[0]), coms[0], units[0], props.reversed)
    low, high = bounds(solid)
    shape = solid.Reversed() if props.reversed else solid
    return [Body(props, low * MM, high * MM, mesh, shape, bare.flat)]


def _integrated(solid: Any, eps: float, notes: Notes) -> SolidProps | None:
    centre, size = box(solid)
    distance = float(np.linalg.norm(centre))
    if distance > NEAR * size > 0:
        solid = _rebuilt(solid, -centre)
    else:
        centre = np.zeros(3)
    found = solid_moments(solid, eps, notes)
    if not np.isfinite(found.volume) or found.volume == 0.0:
        notes.append(NO_VOLUME)
        return None
    size_m, distance_m = size * MM, distance * MM
    volume_m3 = found.volume * MM**3
    notes += integration_notes(volume_m3, found.error, eps, distance_m=distance_m, size_m=size_m)
    sign = -1.0 if found.volume < 0 else 1.0
    com = (found.com + centre) * MM
    return SolidProps(sign * volume_m3, com, sign * found.inertia * MM**5, reversed=sign < 0)


def _rebuilt(shape: Any, offset: Floats) -> Any:
    step = gp_Trsf()
    step.SetTranslation(gp_Vec(*offset))
    return BRepBuilderAPI_Transform(shape, step, True).Shape()


def _triangulated_solid(solid: Any, notes: Notes) -> tuple[SolidProps | None, Mesh | None]:
    """A solid whose faces are triangles without surfaces (AP242 tessellated), judged as a mesh file is."""
    mesh, missing = triangles(solid)
    if missing or not len(mesh):
        message = "the solid mixes triangles and surfaces, or has neither; it is left out"
        notes.append((GeometryCode.INVALID_SHAPE, message))
        return None, mesh if len(mesh) else None
    problems: list[GeometryProblem] = []
    props = enclosed(mesh := welded(mesh.vertices, mesh.faces), problems)
    notes += [(GeometryCode(problem.code), problem.message) for problem in problems]
    if props.volume_m3 == 0.0:
        notes.append(NO_VOLUME)
        return None, mesh
    notes.append((GeometryCode.READER, "the solid is given as triangles, and measured as such"))
    return props, mesh


def _checked_mesh(solid: Any, props: SolidProps | None, picture: _Picture, notes: Notes) -> Mesh:
    small = box(solid)[1] < SMALL * picture.size
    coarse = small or len(occt.faces_of(solid)) > MANY_FACES
    volume = props.volume_m3 if props is not None else None
    mesh, deviation, missing = cross_check(solid, volume, small=coarse)
    notes += mesh_notes(deviation, missing)
    return simplified(mesh, picture.triangles)
