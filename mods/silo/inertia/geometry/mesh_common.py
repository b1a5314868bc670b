# SPDX-License-Identifier: LGPL-2.1-or-later
"""What two closed meshes have in common, by the library manifold3d."""

from __future__ import annotations

from typing import Any

import numpy as np

from silo.inertia.geometry.mesh import Mesh, mesh_solid
from silo.inertia.geometry.together import Body
from silo.inertia.model import SolidProps

NOTHING = SolidProps(0.0, np.zeros(3), np.zeros((3, 3)))


class MeshCommon:
    """Compares the meshes of bodies; each is prepared once."""

    def __init__(self) -> None:
        self._known: dict[int, Any] = {}

    def __call__(self, one: Body, other: Body) -> SolidProps | None:
        """The moments of what both have in common; None where a mesh is not closed."""
        a, b = self._manifold(one), self._manifold(other)
        if a is None or b is None:
            return None
        both = a ^ b
        if both.is_empty():
            return NOTHING
        found = both.to_mesh64()
        return mesh_solid(Mesh(found.vert_properties[:, :3], found.tri_verts.astype(np.int64)))

    def _manifold(self, body: Body) -> Any:
        key = id(body)
        if key not in self._known:
            self._known[key] = _closed(body)
        return self._known[key]


def _closed(body: Body) -> Any:
    try:
        import manifold3d
    except ImportError:  # pragma: no cover - inside FreeCAD, which compares shapes itself
        return None
    if body.mesh is None or not len(body.mesh):
        return None
    faces = body.mesh.faces[:, ::-1] if body.props.reversed else body.mesh.faces
    mesh = manifold3d.Mesh64(
        vert_properties=np.ascontiguousarray(body.mesh.vertices),
        tri_verts=np.ascontiguousarray(faces, np.uint64),
    )
    found = manifold3d.Manifold(mesh)
    sound = found.status() == manifold3d.Error.NoError and found.volume() > 0
    return found if sound else None
