# SPDX-License-Identifier: LGPL-2.1-or-later
"""Triangles: what a tessellation or a mesh file holds, and what it says of volume and inertia.

trimesh does the integrals here and stands as the independent witness against the geometry kernel: both look
at the same part, by different code and different mathematics.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from silo.inertia.model import SolidProps

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

PICTURE_TRIANGLES = 120_000
"""The most triangles that are kept of one prototype; a populated circuit board has millions."""


WELD = 1e-6
"""Share of a mesh's size; vertices that are closer may be made one."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """The triangles of one prototype, in the prototype's axes.

    vertices : (n, 3) float [m]
    faces : (m, 3) int, rows of vertex indices, counter-clockwise seen from outside
    """

    vertices: Floats
    faces: Indices

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", np.asarray(self.vertices, dtype=np.float64).reshape(-1, 3))
        object.__setattr__(self, "faces", np.asarray(self.faces, dtype=np.int64).reshape(-1, 3))

    def __len__(self) -> int:
        return len(self.faces)

    @property
    def extents(self) -> Floats:
        """(3,) [m], sizes of the axis-aligned box; zeros for no triangles."""
        if not len(self.vertices):
            return np.zeros(3)
        size: Floats = np.ptp(self.vertices, axis=0)
        return size

    def moved(self, matrix: Floats) -> Mesh:
        """The same triangles after a placement ((4, 4) [m]); one that mirrors turns them over."""
        mirrored = np.linalg.det(matrix[:3, :3]) < 0
        faces = self.faces[:, ::-1] if mirrored else self.faces
        return Mesh(self.vertices @ matrix[:3, :3].T + matrix[:3, 3], faces)


def joined(parts: list[Mesh]) -> Mesh:
    """Several meshes as one, in order."""
    if not parts:
        return Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    starts = np.cumsum([0, *(len(p.vertices) for p in parts)])
    faces = [p.faces + start for p, start in zip(parts, starts, strict=False)]
    return Mesh(np.concatenate([p.vertices for p in parts]), np.concatenate(faces))


def mesh_volume(mesh: Mesh) -> float:
    """Signed volume [m^3]; negative where the faces look inwards. Without trimesh, which FreeCAD lacks."""
    if not len(mesh):
        return 0.0
    a, b, c = np.moveaxis(_centred(mesh)[0][mesh.faces], 1, 0)
    return float(np.einsum("ni,ni->", a, np.cross(b, c)) / 6)


def mesh_solid(mesh: Mesh) -> SolidProps:
    """Volume, centre and tensor of a closed mesh (exact for its polyhedron), the sign turned if need be.

    A mesh without volume has its middle as centre, and no tensor.
    """
    from trimesh.triangles import mass_properties

    vertices, centre = _centred(mesh)
    with np.errstate(all="ignore"):
        moments = mass_properties(vertices[mesh.faces], density=1.0)
    volume = float(moments.volume)
    if volume == 0.0 or not np.isfinite(moments.center_mass).all():
        return SolidProps(0.0, centre, np.zeros((3, 3)))
    sign = -1.0 if volume < 0 else 1.0
    com = np.asarray(moments.center_mass, dtype=np.float64) + centre
    inertia = sign * np.asarray(moments.inertia, dtype=np.float64)
    return SolidProps(sign * volume, com, inertia, reversed=volume < 0)


def _centred(mesh: Mesh) -> tuple[Floats, Floats]:
    # The integrals are sums of differences; taken about the mesh's own middle they keep their digits for a
    # small part that lies far from its origin.
    centre = (mesh.vertices.max(axis=0) + mesh.vertices.min(axis=0)) / 2
    return mesh.vertices - centre, centre


def welded(vertices: Floats, faces: Indices) -> Mesh:
    """Equal vertices made one (an STL repeats each six times), triangles without area taken out.

    Where edges are open then, vertices closer than a millionth of the mesh are made one as well.
    """
    mesh = _merged(vertices, faces)
    if not len(mesh) or not open_edges(mesh):
        return mesh
    step = float(mesh.extents.max()) * WELD
    if step == 0.0:
        return mesh
    grid = np.round(mesh.vertices / step)
    _, first, place = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    return _merged(mesh.vertices[first[place.reshape(-1)]], mesh.faces)


def _merged(vertices: Floats, faces: Indices) -> Mesh:
    unique, place = np.unique(vertices, axis=0, return_inverse=True)
    faces = place.reshape(-1)[faces]
    flat = (faces[:, 0] == faces[:, 1]) | (faces[:, 1] == faces[:, 2]) | (faces[:, 2] == faces[:, 0])
    return Mesh(unique, faces[~flat])


def without_doubled(mesh: Mesh) -> tuple[Mesh, int]:
    """The mesh with each triangle once, and how many were repeated.

    Triangles that stand there twice are a copy; a triangle and the same turned over enclose nothing.
    """
    order = np.argsort(mesh.faces, axis=1)
    rows = np.take_along_axis(mesh.faces, order, axis=1)
    even = np.isin(order @ np.array([9, 3, 1]), _EVEN)
    kinds, kind = np.unique(rows, axis=0, return_inverse=True)
    kind = kind.reshape(-1)
    if len(kinds) == len(mesh.faces):
        return mesh, 0
    forward = np.bincount(kind, weights=even, minlength=len(kinds))
    backward = np.bincount(kind, weights=~even, minlength=len(kinds))
    kept = np.zeros(len(mesh.faces), dtype=bool)
    # The first triangle that looks to the side of which there are more.
    for number in np.nonzero(forward != backward)[0]:
        side = even if forward[number] > backward[number] else ~even
        kept[np.nonzero((kind == number) & side)[0][0]] = True
    met = 2 * int(np.minimum(forward, backward).sum())
    return Mesh(mesh.vertices, mesh.faces[kept]), int(len(mesh.faces) - kept.sum()) - met


_EVEN = [0 * 9 + 1 * 3 + 2, 1 * 9 + 2 * 3 + 0, 2 * 9 + 0 * 3 + 1]


def open_edges(mesh: Mesh) -> int:
    """How many edges are not used exactly twice, once in each direction."""
    directed = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    ends = np.sort(directed, axis=1)
    _, number = np.unique(ends, axis=0, return_inverse=True)
    forward = directed[:, 0] == ends[:, 0]
    ups = np.bincount(number.reshape(-1), weights=forward)
    downs = np.bincount(number.reshape(-1), weights=~forward)
    return int(((ups != 1) | (downs != 1)).sum())


def components(mesh: Mesh, most: int) -> list[Mesh]:
    """The mesh cut into pieces that share no edge; whole if there are more than ``most``.

    Pieces that touch in a corner only are two: each may be inside out by itself.
    """
    edges = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, number = np.unique(edges, axis=0, return_inverse=True)
    rows = number.reshape(-1, 3)
    face_labels = _labels(rows, int(rows.max()) + 1 if len(rows) else 0)[rows[:, 0]]
    labels = np.unique(face_labels)
    if not 1 < len(labels) <= most:
        return [mesh]
    return [_compact(mesh.vertices, mesh.faces[face_labels == label]) for label in labels]


def _compact(vertices: Floats, faces: Indices) -> Mesh:
    used, place = np.unique(faces, return_inverse=True)
    return Mesh(vertices[used], place.reshape(-1, 3))


def _labels(rows: Indices, count: int) -> Indices:
    """(count,) for each thing the lowest one that it is connected to by ``rows`` (n, 3)."""
    labels = np.arange(count)
    while True:
        lowest = labels[rows].min(axis=1)
        before = labels.copy()
        for column in range(3):
            np.minimum.at(labels, rows[:, column], lowest)
        # Following labels to their own label halves the number of rounds that long strips would need.
        labels = labels[labels]
        if np.array_equal(labels, before):
            return labels


def winding_number(mesh: Mesh, point: Floats) -> float:
    """How often the mesh goes round ``point`` ((3,) [m]): 1 inside a closed outward mesh, 0 outside.

    The generalised winding number: the solid angles of all triangles, added (Van Oosterom and Strackee 1983).
    """
    a, b, c = (mesh.vertices[mesh.faces[:, i]] - point for i in range(3))
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    numerator = np.einsum("ij,ij->i", a, np.cross(b, c))
    denominator = (
        la * lb * lc
        + np.einsum("ij,ij->i", a, b) * lc
        + np.einsum("ij,ij->i", b, c) * la
        + np.einsum("ij,ij->i", c, a) * lb
    )
    return float(np.arctan2(numerator, denominator).sum() / (2 * np.pi))


def is_inside(inner: Mesh, outer: Mesh) -> bool:
    """True where ``inner`` begins inside ``outer`` (their surfaces are taken not to cross)."""
    point = inner.vertices[inner.faces[0]].mean(axis=0)
    return abs(winding_number(outer, point)) > 0.5


def simplified(mesh: Mesh, most: int) -> Mesh:
    """The mesh for a picture, with about ``most`` triangles at most: near vertices made one (clustering).

    Its volume is not to be trusted any more; small meshes are left as they are.
    """
    cells = 512
    while len(mesh) > most and cells >= 8:
        low = mesh.vertices.min(axis=0)
        grid = np.floor((mesh.vertices - low) / max(float(mesh.extents.max()) / cells, 1e-12)).astype(
            np.int64
        )
        code = (grid[:, 0] * (cells + 1) + grid[:, 1]) * (cells + 1) + grid[:, 2]
        _, first, place = np.unique(code, return_index=True, return_inverse=True)
        faces = place.reshape(-1)[mesh.faces]
        flat = (faces[:, 0] == faces[:, 1]) | (faces[:, 1] == faces[:, 2]) | (faces[:, 2] == faces[:, 0])
        mesh = Mesh(mesh.vertices[first], np.unique(faces[~flat], axis=0))
        cells //= 2
    return mesh
