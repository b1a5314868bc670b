# SPDX-License-Identifier: LGPL-2.1-or-later
"""The bodies of one product together: copies, cavities and overlaps; what a mesh encloses. For every engine.

Nesting and orientation decide together. A body inside of another one with the opposite orientation is its
cavity, if either is inside out: mirrored housings have both turned. A body inside of another one
with the same orientation adds nothing, for the space is filled already; that, and bodies that overlap, is a
problem. A copy that lies exactly on a body is counted once.

Triangles are from a tessellation or a mesh file. trimesh integrates them, and stands as the independent
witness against the geometry kernel: both look at the same part, by different code and different
mathematics.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from silo.bom.errors import counted
from silo.bom.message import message
from silo.inertia.assembly import SolidProps
from silo.inertia.notes import GeometryCode, Note
from silo.inertia.rigid import combine_arrays

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]
Box = tuple[Floats, Floats]
"""The lowest and the highest corner."""

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
        """Return the sizes (3,) [m] of the axis-aligned box; zeros if there are no triangles."""
        if not len(self.vertices):
            return np.zeros(3)
        size: Floats = np.ptp(self.vertices, axis=0)
        return size

    def moved(self, matrix: Floats) -> Mesh:
        """Move the triangles by a placement ((4, 4) [m]); one that mirrors also turns them over."""
        mirrored = np.linalg.det(matrix[:3, :3]) < 0
        faces = self.faces[:, ::-1] if mirrored else self.faces
        return Mesh(self.vertices @ matrix[:3, :3].T + matrix[:3, 3], faces)


def exact_box(about: Sequence[Any], exact: Callable[[int], Any]) -> Box:
    """Find the exact box around shapes; ``about`` has a box for each that may be too large.

    Only a shape that may reach beyond the others is measured exactly: for a circuit board, that takes a
    second for the faces at its border, but a minute for all faces.
    """
    if not about:
        return np.zeros(3), np.zeros(3)
    reach = np.array([[*np.negative(low), *high] for low, high in about])
    extent, seen = np.full(6, -np.inf), set[int]()
    for axis in range(6):
        for number in np.argsort(-reach[:, axis]):
            if reach[number, axis] <= extent[axis]:
                break
            if number not in seen:
                seen.add(number)
                low, high = exact(number)
                extent = np.maximum(extent, [*np.negative(low), *high])
    return -extent[:3], extent[3:]


def joined(parts: list[Mesh]) -> Mesh:
    """Join several meshes into one, in order."""
    if not parts:
        return Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    starts = np.cumsum([0, *(len(p.vertices) for p in parts)])
    faces = [p.faces + start for p, start in zip(parts, starts, strict=False)]
    return Mesh(np.concatenate([p.vertices for p in parts]), np.concatenate(faces))


def mesh_volume(mesh: Mesh) -> float:
    """Return the signed volume [m^3]; negative if the faces look inwards.

    Needs no trimesh, which FreeCAD lacks.
    """
    if not len(mesh):
        return 0.0
    a, b, c = np.moveaxis(_centred(mesh)[0][mesh.faces], 1, 0)
    return float(np.einsum("ni,ni->", a, np.cross(b, c)) / 6)


def about_enclosed(mesh: Mesh) -> float:
    """Estimate the volume [m^3] that an open surface would have if it closed: cones from its middle.

    A flat surface has none, wherever it is.
    """
    corners = mesh.vertices[mesh.faces]
    a, b, c = np.moveaxis(corners, 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    if not area.any():
        return 0.0
    a, b, c = np.moveaxis(corners - np.average(corners.mean(axis=1), axis=0, weights=area), 1, 0)
    return float(np.abs(np.einsum("ni,ni->n", a, np.cross(b, c))).sum() / 6)


def mesh_solid(mesh: Mesh) -> SolidProps:
    """Integrate the volume, centre and tensor of a closed mesh (exact for its polyhedron). A negative volume
    is made positive.

    A mesh without volume gets its middle as centre, and a zero tensor.
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


def distinct(rows: NDArray[Any]) -> tuple[Indices, Indices]:
    """Return the index of the first row of each kind, with the kinds in order, and the kind of each row.

    ``np.unique`` of rows compares them one by one and takes twenty times as long.
    """
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    is_new = np.ones(len(rows), dtype=bool)
    is_new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    kind = np.empty(len(rows), dtype=np.int64)
    kind[order] = np.cumsum(is_new) - 1
    return order[is_new], kind


def welded(vertices: Floats, faces: Indices) -> Mesh:
    """Merge equal vertices (an STL repeats each six times), and leave out triangles without area.

    If edges are open then, vertices closer than a millionth of the mesh are merged as well.
    """
    mesh = _merged(vertices, faces)
    if not len(mesh) or not open_edges(mesh):
        return mesh
    step = float(mesh.extents.max()) * WELD
    if step == 0.0:
        return mesh
    first, place = distinct(np.round(mesh.vertices / step))
    return _merged(mesh.vertices[first[place]], mesh.faces)


def _merged(vertices: Floats, faces: Indices) -> Mesh:
    first, place = distinct(vertices)
    faces = place[faces]
    flat = (faces[:, 0] == faces[:, 1]) | (faces[:, 1] == faces[:, 2]) | (faces[:, 2] == faces[:, 0])
    return Mesh(vertices[first], faces[~flat])


def without_doubled(mesh: Mesh) -> tuple[Mesh, int]:
    """Remove repeated triangles from the mesh, and count them.

    If a triangle is there twice, one is a copy; a triangle and the same one turned over enclose nothing, and
    both go.
    """
    order = np.argsort(mesh.faces, axis=1)
    rows = np.take_along_axis(mesh.faces, order, axis=1)
    even = np.isin(order @ np.array([9, 3, 1]), _EVEN)
    kinds, kind = distinct(rows)
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
    """Count the edges that are not used exactly twice, once in each direction."""
    directed = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    ends = np.sort(directed, axis=1)
    number = distinct(ends)[1]
    forward = directed[:, 0] == ends[:, 0]
    ups = np.bincount(number, weights=forward)
    downs = np.bincount(number, weights=~forward)
    return int(((ups != 1) | (downs != 1)).sum())


def components(mesh: Mesh, most: int) -> list[Mesh]:
    """Divide the mesh into pieces that share no edge; if there are more than ``most``, it stays whole.

    Pieces that touch only in a corner are separate: each of them may be inside out.
    """
    edges = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    rows = distinct(edges)[1].reshape(-1, 3)
    face_labels = _labels(rows, int(rows.max()) + 1 if len(rows) else 0)[rows[:, 0]]
    labels = np.unique(face_labels)
    if not 1 < len(labels) <= most:
        return [mesh]
    return [_compact(mesh.vertices, mesh.faces[face_labels == label]) for label in labels]


def _compact(vertices: Floats, faces: Indices) -> Mesh:
    used, place = np.unique(faces, return_inverse=True)
    return Mesh(vertices[used], place.reshape(-1, 3))


def _labels(rows: Indices, count: int) -> Indices:
    """Return (count,): for each thing, the lowest one to which ``rows`` (n, 3) connect it."""
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
    """Return how often the mesh winds around ``point`` ((3,) [m]): 1 inside a closed outward mesh, 0 outside.

    It is the generalised winding number: the sum of the solid angles of all triangles (Van Oosterom and
    Strackee 1983).
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
    """Return True if ``inner`` begins inside ``outer`` (assuming that their surfaces do not cross)."""
    point = inner.vertices[inner.faces[0]].mean(axis=0)
    return abs(winding_number(outer, point)) > 0.5


def simplified(mesh: Mesh, most: int) -> Mesh:
    """Simplify the mesh for a picture to at most about ``most`` triangles: near vertices become one
    (clustering).

    Do not trust the volume of the result. Small meshes stay unchanged.
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


SAME = 1e-9
"""Relative: two bodies with moments closer than this may be one."""

COMMON = 1e-7
"""Common volume above this share of the smaller body is an overlap; touching faces leave less."""

WHOLE = 1e-6
"""A body that shares all but this much of itself with another one lies inside of it."""

MAX_COMPONENTS = 500
"""Meshes in more pieces than this are measured as a whole: scans come in thousands of crumbs."""


@dataclass(frozen=True, eq=False)
class Body:
    """One closed body where it stands, as if it were alone.

    props
        its moments, the volume positive; ``reversed`` if the file has it inside out.
    low, high
        (3,) [m], its box, which may be too large and never too small.
    mesh, exact
        its triangles, None if there are none; whether they are the very body or only near it.
    shape
        what its engine needs to compare it with another one.
    """

    props: SolidProps
    low: Floats
    high: Floats
    mesh: Mesh | None = None
    shape: Any = None
    exact: bool = False


Common = Callable[[Body, Body], SolidProps | None]
"""What two bodies have in common, whatever their orientation: volume 0 for nothing, None if it cannot be
known."""


class _Role(Enum):
    BODY = "body"
    CAVITY = "cavity"
    SWALLOWED = "swallowed"  # inside of a body, and no cavity


@dataclass(frozen=True, eq=False)
class Together:
    """The solids that remain, how many bodies were taken as cavities, and how many were turned inside out."""

    solids: tuple[SolidProps, ...]
    cavities: int = 0
    turned: int = 0

    @property
    def mixed(self) -> bool:
        """Return True if some bodies are inside out and some are not."""
        return self.cavities > 0 or 0 < self.turned < len(self.solids)


def together(bodies: Sequence[Body], common: Common, problems: list[Note]) -> Together:
    """Combine the bodies of one product into its solids, and add what is wrong with them to ``problems``."""
    bodies = _without_copies(bodies, problems)
    if len(bodies) < 2:
        return Together(tuple(b.props for b in bodies), 0, sum(b.props.reversed for b in bodies))
    # Larger ones first, so that what holds a body comes before it.
    bodies = sorted(bodies, key=lambda body: -body.props.volume_m3)
    relations = _Relations(bodies, common)
    roles, hosts = _roles(bodies, relations.holders)
    rest = [body.props for body in bodies]
    for number, role in enumerate(roles):
        if role is _Role.CAVITY:
            rest[hosts[number]] = _minus(rest[hosts[number]], bodies[number].props)
    swallowed = {n for n, role in enumerate(roles) if role is _Role.SWALLOWED}
    crossing = {
        pair: solid_props for pair, solid_props in relations.partial.items() if swallowed.isdisjoint(pair)
    }
    for (one, other), shared in crossing.items():
        if roles[one] is roles[other] is _Role.BODY:
            rest[other] = _minus(rest[other], shared)
    _tell([bodies[n] for n in swallowed], list(crossing.values()), relations.unknown, problems)
    kept = [props for props, role in zip(rest, roles, strict=True) if role is _Role.BODY]
    turned = sum(b.props.reversed for b, role in zip(bodies, roles, strict=True) if role is _Role.BODY)
    return Together(tuple(kept), sum(role is _Role.CAVITY for role in roles), turned)


def _without_copies(bodies: Sequence[Body], problems: list[Note]) -> list[Body]:
    kept: list[Body] = []
    by_volume: dict[float, list[Body]] = {}
    copies = 0
    for body in bodies:
        volume = body.props.volume_m3
        near = [float(f"{volume * (1 + shift):.9e}") for shift in (-SAME, 0, SAME)]
        if any(_is_copy(body, other) for key in dict.fromkeys(near) for other in by_volume.get(key, ())):
            copies += 1
            continue
        kept.append(body)
        by_volume.setdefault(near[1], []).append(body)
    if copies:
        words = message(
            "{copies} exactly on another one; each is counted once",
            copies=counted(copies, "solid lies", "solids lie"),
        )
        problems.append(Note(GeometryCode.COINCIDENT_SOLIDS, words))
    return kept


def _is_copy(body: Body, other: Body) -> bool:
    a, b = body.props, other.props
    size = float(np.linalg.norm(body.high - body.low))
    if abs(a.volume_m3 - b.volume_m3) > 2 * SAME * b.volume_m3:
        return False
    if np.abs(a.com_m - b.com_m).max() > 1e-7 * size:
        return False
    if np.abs(a.inertia_unit - b.inertia_unit).max() > 1e-6 * np.abs(b.inertia_unit).max():
        return False
    if max(np.abs(body.low - other.low).max(), np.abs(body.high - other.high).max()) > 1e-6 * size:
        return False
    # A cube and the same turned by 45 degrees have equal moments, but not equal corners.
    return body.mesh is None or other.mesh is None or _same_corners(body.mesh, other.mesh, 1e-6 * size)


def _same_corners(one: Mesh, other: Mesh, step: float) -> bool:
    if len(one.vertices) != len(other.vertices):
        return False
    a, b = (np.unique(np.round(mesh.vertices / step), axis=0) for mesh in (one, other))
    return a.shape == b.shape and bool((a == b).all())


class _Relations:
    """Which bodies hold which, and which overlap, by number.

    holders
        for each body those that it lies inside of.
    partial
        (one, other) → what both have in common, if neither holds the other.
    unknown
        pairs of which that is not known.
    """

    def __init__(self, bodies: Sequence[Body], common: Common) -> None:
        self.holders: list[list[int]] = [[] for _ in bodies]
        self.partial: dict[tuple[int, int], SolidProps] = {}
        self.unknown: list[tuple[int, int]] = []
        for body, other in _close_pairs(bodies):
            large, small = bodies[body], bodies[other]
            props = common(large, small)
            least = small.props.volume_m3
            if props is None:
                self._guess(body, other, large, small)
            elif props.volume_m3 >= (1 - WHOLE) * least:
                self.holders[other].append(body)
            elif props.volume_m3 > COMMON * least:
                self.partial[body, other] = props

    def _guess(self, index: int, other: int, large: Body, small: Body) -> None:
        if large.mesh is not None and small.mesh is not None and len(small.mesh):
            inside = is_inside(small.mesh, large.mesh)
            if inside and bool((small.low >= large.low).all() and (small.high <= large.high).all()):
                self.holders[other].append(index)
                return
        self.unknown.append((index, other))


def _close_pairs(bodies: Sequence[Body]) -> Iterator[tuple[int, int]]:
    """Yield the pairs of bodies whose boxes share more than a face."""
    low = np.array([body.low for body in bodies])
    high = np.array([body.high for body in bodies])
    for index in range(len(bodies) - 1):
        depth = np.minimum(high[index], high[index + 1 :]) - np.maximum(low[index], low[index + 1 :])
        least = np.minimum(np.ptp([low[index], high[index]], axis=0), high[index + 1 :] - low[index + 1 :])
        for other in np.nonzero((depth > 1e-7 * least).all(axis=1))[0].tolist():
            yield index, index + 1 + other


def _roles(bodies: Sequence[Body], holders: list[list[int]]) -> tuple[list[_Role], list[int]]:
    """Find the role of each body, and the number of the body around it; its own number if nothing holds
    it.
    """
    roles: list[_Role] = []
    hosts: list[int] = []
    for number, body in enumerate(bodies):
        # The innermost holder is the smallest one, the last in the order of volumes.
        around = max(holders[number], default=None)
        if around is None:
            roles.append(_Role.BODY)
            hosts.append(number)
            continue
        opposite = body.props.reversed != bodies[around].props.reversed
        hosts.append(around if roles[around] is _Role.BODY else hosts[around])
        if roles[around] is _Role.CAVITY:
            roles.append(_Role.BODY)
        elif roles[around] is _Role.BODY and opposite:
            roles.append(_Role.CAVITY)
        else:
            roles.append(_Role.SWALLOWED)
    return roles, hosts


def _tell(
    swallowed: list[Body],
    crossing: list[SolidProps],
    unknown: list[tuple[int, int]],
    problems: list[Note],
) -> None:
    reasons = []
    if swallowed:
        volume = sum(body.props.volume_m3 for body in swallowed)
        what = counted(len(swallowed), "solid lies", "solids lie")
        reasons.append(
            message(
                "{what} inside of another one ({volume} cm³, not counted)",
                what=what,
                volume=f"{volume * 1000000.0:.6g}",
            )
        )
    if crossing:
        volume = sum(props.volume_m3 for props in crossing)
        what = counted(len(crossing), "pair of solids overlaps", "pairs of solids overlap")
        reasons.append(
            message("{what} ({volume} cm³, counted once)", what=what, volume=f"{volume * 1000000.0:.6g}")
        )
    if unknown:
        what = counted(len(unknown), "pair of solids", "pairs of solids")
        reasons.append(message("{what} may overlap; this could not be checked", what=what))
    if reasons:
        words = "; ".join(reasons) + message(". Is it one part? Its volume is in doubt")
        problems.append(Note(GeometryCode.OVERLAPPING_SOLIDS, words))


def _minus(body: SolidProps, cavity: SolidProps) -> SolidProps:
    nothing = replace(cavity, volume_m3=-cavity.volume_m3, inertia_unit=-cavity.inertia_unit)
    return combined([body, nothing])


def combined(solids: Sequence[SolidProps]) -> SolidProps:
    """Combine all solids into one; without any, the result has no volume, at the origin."""
    if not solids:
        return NOTHING
    whole = combine_arrays(
        [s.volume_m3 for s in solids],
        np.array([s.com_m for s in solids]),
        np.array([s.inertia_unit for s in solids]),
    )
    return SolidProps(whole.mass, whole.com, whole.inertia)


NOTHING = SolidProps(0.0, np.zeros(3), np.zeros((3, 3)))


class MeshCommon:
    """Compares the meshes of bodies; each is prepared once."""

    def __init__(self) -> None:
        self._manifold = cache(_closed)

    def __call__(self, body: Body, other: Body) -> SolidProps | None:
        """Return the moments of what both have in common; None if a mesh is not closed."""
        a, b = self._manifold(body), self._manifold(other)
        if a is None or b is None:
            return None
        both = a ^ b
        if both.is_empty():
            return NOTHING
        mesh = both.to_mesh64()
        return mesh_solid(Mesh(mesh.vert_properties[:, :3], mesh.tri_verts.astype(np.int64)))


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
    manifold = manifold3d.Manifold(mesh)
    sound = manifold.status() == manifold3d.Error.NoError and manifold.volume() > 0
    return manifold if sound else None


def without(mesh: Mesh, cut: Mesh) -> Mesh | None:
    """Cut another mesh away from a mesh; None if one of them is not closed."""
    body, other = _closed(_body(mesh)), _closed(_body(cut))
    if body is None or other is None:
        return None
    remaining = (body - other).to_mesh64()
    return Mesh(remaining.vert_properties[:, :3], remaining.tri_verts.astype(np.int64))


def enclosed(mesh: Mesh, problems: list[Note]) -> SolidProps:
    """Measure a part's triangles, and add every doubt to ``problems``."""
    mesh, repeated = without_doubled(mesh)
    if repeated:
        what = counted(repeated, "of its triangles is", "of its triangles are")
        words = message("{what} there more than once; each is counted once", what=what)
        problems.append(Note(GeometryCode.COINCIDENT_SOLIDS, words))
    if not len(mesh):
        return NOTHING
    edges = open_edges(mesh)
    if edges:
        problems.append(_not_closed(mesh, edges))
        return mesh_solid(mesh)
    pieces = components(mesh, MAX_COMPONENTS)
    if len(pieces) == 1 and len(components(mesh, sys.maxsize)) > 1:
        words = message(
            "its triangles are in more than {max_components} pieces, which may overlap; they were added up",
            max_components=MAX_COMPONENTS,
        )
        problems.append(Note(GeometryCode.OVERLAPPING_SOLIDS, words))
    relations = together([_body(piece) for piece in pieces], MeshCommon(), problems)
    if relations.turned:
        which = (
            message("the mesh is")
            if len(pieces) == 1
            else message("{turned} of its {count} pieces are", turned=relations.turned, count=len(pieces))
        )
        words = message("{which} inside out; the sign was turned", which=which)
        problems.append(Note(GeometryCode.NEGATIVE_VOLUME, words))
    return replace(combined(relations.solids), reversed=relations.turned > 0)


def _body(piece: Mesh) -> Body:
    return Body(mesh_solid(piece), piece.vertices.min(axis=0), piece.vertices.max(axis=0), piece)


def _not_closed(mesh: Mesh, edges: int) -> Note:
    """Note holes, or triangles that disagree.

    In both cases the volume depends on the point from which it is taken.
    """
    undirected = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    if (np.unique(undirected, axis=0, return_counts=True)[1] == 2).all():
        words = message("its triangles do not agree on what is outside; its volume cannot be trusted")
        return Note(GeometryCode.WINDING, words)
    words = message("the mesh is open ({edges} free or shared edges), so it has no exact volume", edges=edges)
    return Note(GeometryCode.NOT_WATERTIGHT, words)
