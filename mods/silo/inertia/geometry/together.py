# SPDX-License-Identifier: LGPL-2.1-or-later
"""The bodies of one product together: copies, cavities and overlaps. The same for every engine.

What a mesh encloses is decided here, too, wherever its triangles are from.

Nesting and orientation decide together. A body inside of another one with the opposite orientation is its
cavity, whichever of the two is inside out: mirrored housings have both turned. A body inside of another one
with the same orientation adds nothing, for the space is filled already; that, and bodies that overlap, is a
problem. A copy that lies exactly on a body is counted once.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from silo.inertia.core import combine_arrays
from silo.inertia.geometry.mesh import (
    Floats,
    Mesh,
    components,
    is_inside,
    mesh_solid,
    open_edges,
    without_doubled,
)
from silo.inertia.model import GeometryCode, GeometryProblem, SolidProps
from silo.inertia.wording import counted

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
        its moments, the volume positive; ``reversed`` where the file has it inside out.
    low, high
        (3,) [m], its box, which may be too large and never too small.
    mesh, exact
        its triangles, None where there are none; whether they are the very body or only near it.
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
"""What two bodies have in common, whatever their orientation: volume 0 for nothing, None where it cannot be
found out."""


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
        """True where some bodies are inside out and some are not."""
        return self.cavities > 0 or 0 < self.turned < len(self.solids)


def together(bodies: Sequence[Body], common: Common, problems: list[GeometryProblem]) -> Together:
    """The solids of one product; what is wrong with them is added to ``problems``."""
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
    crossing = {pair: found for pair, found in relations.partial.items() if swallowed.isdisjoint(pair)}
    for (one, other), found in crossing.items():
        if roles[one] is roles[other] is _Role.BODY:
            rest[other] = _minus(rest[other], found)
    _tell([bodies[n] for n in swallowed], list(crossing.values()), relations.unknown, problems)
    kept = [props for props, role in zip(rest, roles, strict=True) if role is _Role.BODY]
    turned = sum(b.props.reversed for b, role in zip(bodies, roles, strict=True) if role is _Role.BODY)
    return Together(tuple(kept), sum(role is _Role.CAVITY for role in roles), turned)


def _without_copies(bodies: Sequence[Body], problems: list[GeometryProblem]) -> list[Body]:
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
        words = f"{counted(copies, 'solid lies', 'solids lie')} exactly on another one; each is counted once"
        problems.append(GeometryProblem(GeometryCode.COINCIDENT_SOLIDS, words))
    return kept


def _is_copy(one: Body, other: Body) -> bool:
    a, b = one.props, other.props
    size = float(np.linalg.norm(one.high - one.low))
    if abs(a.volume_m3 - b.volume_m3) > 2 * SAME * b.volume_m3:
        return False
    if np.abs(a.com_m - b.com_m).max() > 1e-7 * size:
        return False
    if np.abs(a.inertia_unit - b.inertia_unit).max() > 1e-6 * np.abs(b.inertia_unit).max():
        return False
    if max(np.abs(one.low - other.low).max(), np.abs(one.high - other.high).max()) > 1e-6 * size:
        return False
    # A cube and the same turned by 45 degrees have equal moments, but not equal corners.
    return one.mesh is None or other.mesh is None or _same_corners(one.mesh, other.mesh, 1e-6 * size)


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
        (one, other) → what both have in common, where neither holds the other.
    unknown
        pairs of which that cannot be found out.
    """

    def __init__(self, bodies: Sequence[Body], common: Common) -> None:
        self.holders: list[list[int]] = [[] for _ in bodies]
        self.partial: dict[tuple[int, int], SolidProps] = {}
        self.unknown: list[tuple[int, int]] = []
        for one, other in _near(bodies):
            large, small = bodies[one], bodies[other]
            found = common(large, small)
            least = small.props.volume_m3
            if found is None:
                self._guess(one, other, large, small)
            elif found.volume_m3 >= (1 - WHOLE) * least:
                self.holders[other].append(one)
            elif found.volume_m3 > COMMON * least:
                self.partial[one, other] = found

    def _guess(self, one: int, other: int, large: Body, small: Body) -> None:
        if large.mesh is not None and small.mesh is not None and len(small.mesh):
            inside = is_inside(small.mesh, large.mesh)
            if inside and bool((small.low >= large.low).all() and (small.high <= large.high).all()):
                self.holders[other].append(one)
                return
        self.unknown.append((one, other))


def _near(bodies: Sequence[Body]) -> Iterator[tuple[int, int]]:
    """Pairs whose boxes share more than a face."""
    low = np.array([body.low for body in bodies])
    high = np.array([body.high for body in bodies])
    for one in range(len(bodies) - 1):
        depth = np.minimum(high[one], high[one + 1 :]) - np.maximum(low[one], low[one + 1 :])
        least = np.minimum(np.ptp([low[one], high[one]], axis=0), high[one + 1 :] - low[one + 1 :])
        for other in np.nonzero((depth > 1e-7 * least).all(axis=1))[0].tolist():
            yield one, one + 1 + other


def _roles(bodies: Sequence[Body], holders: list[list[int]]) -> tuple[list[_Role], list[int]]:
    """What each body is, and the number of the body around it, its own for those that nothing holds."""
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
    problems: list[GeometryProblem],
) -> None:
    reasons = []
    if swallowed:
        volume = sum(body.props.volume_m3 for body in swallowed)
        what = counted(len(swallowed), "solid lies", "solids lie")
        reasons.append(f"{what} inside of another one ({volume * 1e6:.6g} cm³, not counted)")
    if crossing:
        volume = sum(found.volume_m3 for found in crossing)
        what = counted(len(crossing), "pair of solids overlaps", "pairs of solids overlap")
        reasons.append(f"{what} ({volume * 1e6:.6g} cm³, counted once)")
    if unknown:
        what = counted(len(unknown), "pair of solids", "pairs of solids")
        reasons.append(f"{what} may overlap, which could not be found out")
    if reasons:
        words = "; ".join(reasons) + ". Is it one part? Its volume is in doubt"
        problems.append(GeometryProblem(GeometryCode.OVERLAPPING_SOLIDS, words))


def _minus(body: SolidProps, cavity: SolidProps) -> SolidProps:
    nothing = replace(cavity, volume_m3=-cavity.volume_m3, inertia_unit=-cavity.inertia_unit)
    return combined([body, nothing])


def combined(solids: Sequence[SolidProps]) -> SolidProps:
    """All solids as one; no volume at the origin where there is none."""
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


def enclosed(mesh: Mesh, problems: list[GeometryProblem]) -> SolidProps:
    """The moments of a part's triangles; every doubt is added to ``problems``."""
    mesh, repeated = without_doubled(mesh)
    if repeated:
        what = counted(repeated, "of its triangles is", "of its triangles are")
        words = f"{what} there more than once; each is counted once"
        problems.append(GeometryProblem(GeometryCode.COINCIDENT_SOLIDS, words))
    if not len(mesh):
        return NOTHING
    edges = open_edges(mesh)
    if edges:
        problems.append(_not_closed(mesh, edges))
        return mesh_solid(mesh)
    pieces = components(mesh, MAX_COMPONENTS)
    if len(pieces) == 1 and len(components(mesh, sys.maxsize)) > 1:
        words = (
            f"its triangles are in more than {MAX_COMPONENTS} pieces, which may overlap; they were added up"
        )
        problems.append(GeometryProblem(GeometryCode.OVERLAPPING_SOLIDS, words))
    found = together([_body(piece) for piece in pieces], MeshCommon(), problems)
    if found.turned:
        which = "the mesh is" if len(pieces) == 1 else f"{found.turned} of its {len(pieces)} pieces are"
        words = f"{which} inside out; the sign was turned"
        problems.append(GeometryProblem(GeometryCode.NEGATIVE_VOLUME, words))
    return replace(combined(found.solids), reversed=found.turned > 0)


def _body(piece: Mesh) -> Body:
    return Body(mesh_solid(piece), piece.vertices.min(axis=0), piece.vertices.max(axis=0), piece)


def _not_closed(mesh: Mesh, edges: int) -> GeometryProblem:
    """Holes, or triangles that disagree; either way the volume depends on the point that it is taken from."""
    undirected = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    if (np.unique(undirected, axis=0, return_counts=True)[1] == 2).all():
        words = "its triangles do not agree on what is outside; its volume cannot be trusted"
        return GeometryProblem(GeometryCode.WINDING, words)
    words = f"the mesh is open ({edges} free or shared edges), so it has no exact volume"
    return GeometryProblem(GeometryCode.NOT_WATERTIGHT, words)
