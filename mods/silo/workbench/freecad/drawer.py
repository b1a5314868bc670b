# SPDX-License-Identifier: LGPL-2.1-or-later
"""Models of committed files, made in the background by a FreeCAD without a window.

It is the child that :func:`silo.drawing.models.send_models` starts. It meshes with ``MeshPart`` and
simplifies with ``Mesh.decimate``, which takes the triangles first that cost least, but bounds no distance
(0.20 to 1.1: a tolerance of 1e-5 keeps nearly all, 1e-4 removes a tenth of the volume). So fewer and fewer
are taken, until box and volume stay. Imports what it needs late: the window's FreeCAD only names the command.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo.bom.errors import DocumentError
from silo.bom.message import message
from silo.freecads.places import start
from silo.workbench.freecad import host

if TYPE_CHECKING:
    from silo.drawing.models import Stored
    from silo.inertia.geometry.measured import Measured
    from silo.inertia.geometry.together import Box, Floats, Mesh


MM = 1e-3

# Parts of the triangles that may go; and what the box's volume may lose by it.
REDUCTIONS = (0.95, 0.85, 0.7, 0.5)

KEPT_VOLUME = 0.02

# Fewer are not worth it.
MANY = 200


def command() -> list[str]:
    """Return the command that starts the child. Raises ConfigError if this FreeCAD's program cannot be
    found.
    """
    # FreeCAD 1.1 takes a long text for the name of a file, and ends; so the paths come by the environment.
    code = (
        "import os, sys; sys.path[:0] = os.environ['PYTHONPATH'].split(os.pathsep); "
        "from silo.workbench.freecad.drawer import main; main()"
    )
    return [*start(host.program()), "-c", code]


def main() -> None:
    """Run as the child."""
    from silo.drawing.models import work_with

    work_with(FreeCadDrawer)


class FreeCadDrawer:
    """Draws stored shapes with FreeCAD's kernel."""

    def faces(self, path: Path, named: str, place: Floats) -> Sequence[Mesh | None]:
        """Make the triangles of each face."""
        import MeshPart
        import numpy as np

        from silo.drawing.models import ANGULAR, LINEAR
        from silo.inertia.geometry.together import Mesh

        shape = _stored(path, named, place)
        try:
            made = MeshPart.meshFromShape(
                Shape=shape,
                LinearDeflection=max(LINEAR * shape.BoundBox.DiagonalLength, 1e-7),
                AngularDeflection=ANGULAR,
                Relative=False,
                Segments=True,
            )
        except Exception as error:
            raise DocumentError(
                named, message("holds no shape that FreeCAD can draw: {error}", error=error)
            ) from error
        if made.countSegments() != len(shape.Faces):
            raise DocumentError(named, message("FreeCAD drew a different number of faces than the shape has"))
        points, rows = made.Topology
        vertices = MM * np.array([tuple(point) for point in points]).reshape(-1, 3)
        faces = np.array(rows, dtype=np.int64).reshape(-1, 3)
        meshes: list[Mesh | None] = []
        for number in range(made.countSegments()):
            used, index = np.unique(faces[made.getSegment(number)], return_inverse=True)
            meshes.append(Mesh(vertices[used], index) if len(index) else None)
        return meshes

    def simplified(self, mesh: Mesh, error: float, keep_border: bool) -> Mesh:
        """Make a mesh with fewer triangles, if box and volume stay; a border always stays."""
        import Mesh as FreeCadMesh
        import numpy as np

        from silo.inertia.geometry.together import Mesh, about_enclosed

        if len(mesh) < MANY:
            return mesh
        whole = FreeCadMesh.Mesh((mesh.vertices[mesh.faces].reshape(-1, 3) / MM).tolist())
        volume = about_enclosed(mesh)
        for reduction in REDUCTIONS:
            copy: Any = whole.copy()
            copy.decimate(1e9, reduction)
            points, rows = copy.Topology
            few = Mesh(MM * np.array([tuple(point) for point in points]), np.array(rows))
            lost = abs(few.extents - mesh.extents).max() if len(few) else np.inf
            if lost <= error and abs(about_enclosed(few) - volume) <= KEPT_VOLUME * volume:
                return few
        return mesh

    def measured(self, shapes: Sequence[Stored], weigh: bool) -> tuple[Box, Measured | None]:
        """Return the box around the surfaces, and the solids as they are measured for a mass."""
        from silo.drawing.models import EPS
        from silo.inertia.geometry.freecad import Leaf, ShapeRef
        from silo.inertia.geometry.together import exact_box
        from silo.workbench.freecad.shapes import measure

        leaf = Leaf(tuple(ShapeRef(_stored(*shape), shape[2]) for shape in shapes))
        parts = [part for shape in leaf.shapes for part in shape.handle.Faces or [shape.handle]]
        about = [_corners(part.BoundBox) for part in parts]
        # Without triangles. FreeCAD 0.20 crashes on a second argument.
        exact = exact_box(about, lambda n: _corners(parts[n].optimalBoundingBox(False)))
        return exact, measure(leaf, EPS, lambda *_: None) if weigh else None


def _corners(box: Any) -> tuple[list[float], list[float]]:
    return [box.XMin, box.YMin, box.ZMin], [box.XMax, box.YMax, box.ZMax]


def _stored(path: Path, named: str, place: Floats) -> Any:
    """Read a shape, with its placement in its product. Raises DocumentError."""
    import Part

    from silo.inertia.geometry.formats import is_binary_brep
    from silo.inertia.placements import is_rigid

    if not is_rigid(place):
        raise DocumentError(
            named, message("its placement scales it inside of its part, which is not supported")
        )
    shape = Part.Shape()
    read = shape.importBinary if is_binary_brep(path) else shape.importBrep
    try:
        read(str(path))
        placement = type(shape.Placement)
        shape.Placement = placement(type(shape.Placement.toMatrix())(*place.ravel().tolist()))
    except Exception as error:
        raise DocumentError(
            named, message("holds no shape that FreeCAD can draw: {error}", error=error)
        ) from error
    return shape
