# SPDX-License-Identifier: LGPL-2.1-or-later
"""What measuring a product's solids gives, and what is reported of them; the same for every engine. Pure.

Also what any file may have wrong: its unit, placements that scale or coincide.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from silo.bom.errors import counted, listed
from silo.bom.message import message
from silo.inertia.assembly import Assembly, Instance, Prototype, SolidProps
from silo.inertia.geometry.graph import Unfolded
from silo.inertia.geometry.names import lost_characters
from silo.inertia.geometry.together import Body, Mesh, Together, about_enclosed, combined
from silo.inertia.notes import GeometryCode, Note
from silo.inertia.placements import rigid_mask

STATED = 5e-5
"""Relative: what the volume may depend on the way that it is taken, and no farther in silence."""

MESH_TOLERANCE = 0.02
"""|V_mesh - V_brep| / V above this is bad geometry: all valid parts of 280 real ones stay below 0.7 %."""

CONVERGED = 1e-6
"""The integration's own error estimate above this says that it did not reach its tolerance."""

FAR_AWAY = 1e4
"""Distance from the origin, in sizes of the solid, from where coordinates themselves lose digits."""


NO_VOLUME = Note(
    GeometryCode.INVALID_SHAPE,
    message("the solid has no volume that can be computed; it is left out"),
)
INVALID = Note(
    GeometryCode.INVALID_SHAPE, message("the geometry kernel's own check finds this shape invalid")
)


@dataclass(frozen=True, eq=False)
class Measured:
    """What was found in one prototype; ``has_faces``, ``has_wires``: what there is without a solid."""

    solids: tuple[SolidProps, ...]
    problems: tuple[Note, ...]
    mesh: Mesh | None
    has_faces: bool
    has_wires: bool = False

    def prototype(
        self, key: str, name: str, *more: Note, empty: Note | None = None, **stated: Any
    ) -> Prototype:
        """Make the prototype of a product with these solids.

        ``empty`` says why there is no solid; ``stated``: values from the file.
        """
        whole = combined(self.solids)
        problems = [*self.problems, *more]
        if not self.solids:
            problems.append(empty or no_solid(self))
        return Prototype(
            key=key,
            name=name,
            volume_m3=whole.volume_m3,
            com_m=whole.com_m,
            inertia_unit=whole.inertia_unit,
            has_solid=bool(self.solids),
            problems=(*problems, *lost_characters(name)),
            mesh=self.mesh,
            **stated,
        )


def integration_notes(
    volume_m3: float, error: float, eps: float, *, distance_m: float, size_m: float
) -> list[Note]:
    """Note what is doubtful about the integration of a solid.

    error, eps
        estimated and wanted, relative to the volume (which is signed here).
    distance_m
        of the solid from the origin of its coordinates.
    """
    notes: list[Note] = []
    if error > CONVERGED:
        text = message(
            "the volume integration stopped at a relative error of {error}, wanted {eps}",
            error=f"{error:.1g}",
            eps=f"{eps:.1g}",
        )
        notes.append(Note(GeometryCode.NOT_CONVERGENT, text))
    if distance_m > FAR_AWAY * size_m > 0:
        text = message(
            "the geometry lies {distance_m} m from its own origin, {size_m} times its size; "
            "its coordinates have lost digits",
            distance_m=f"{distance_m:.3g}",
            size_m=f"{distance_m / size_m:.0f}",
        )
        notes.append(Note(GeometryCode.BAKED, text))
    if volume_m3 < 0:
        text = message(
            "the solid is inside out (volume {volume_m3} m3); its sign was turned",
            volume_m3=f"{volume_m3:.6g}",
        )
        notes.append(Note(GeometryCode.NEGATIVE_VOLUME, text))
    return notes


def differing_note(difference: float) -> Note:
    """Note that two integrations both converged, but differ."""
    words = message(
        "two exact integrations differ by {difference}: its edges do not quite meet, by "
        "the file's own tolerances, and no finer integration helps",
        difference=f"{difference:.1g}",
    )
    return Note(GeometryCode.NOT_CONVERGENT, words)


def mesh_notes(deviation: float | None, missing: int) -> list[Note]:
    """Note what the mesh shows about a solid.

    ``deviation``: of its volume, relative (None: the mesh is not closed); ``missing``: how many faces have no
    triangles.
    """
    if deviation is not None and deviation > MESH_TOLERANCE:
        text = message(
            "its surface mesh encloses a volume that differs by {deviation}: the geometry is "
            "bad, and so may be its mass",
            deviation=f"{deviation:.1%}",
        )
        return [Note(GeometryCode.MESH_MISMATCH, text)]
    if deviation is None and missing:
        text = message(
            "{missing} of its faces cannot be meshed, so its volume could not be cross-checked",
            missing=missing,
        )
        return [Note(GeometryCode.MESH_MISMATCH, text)]
    return []


def no_solid(measured: Measured) -> Note:
    """Note why a product has no volume."""
    if measured.has_faces or measured.has_wires:
        what = message("surfaces that enclose no solid") if measured.has_faces else message("curves only")
        return Note(GeometryCode.NO_SOLID, message("it consists of {what}, so it has no volume", what=what))
    return Note(GeometryCode.NO_GEOMETRY, message("the file holds no solid and no surface for it"))


def shell_note(shells: int, solids: int) -> Note:
    """Note surfaces that close and were taken for solids."""
    what = counted(shells, "closed surface", "closed surfaces")
    beside = message(", beside its solids") if solids else ""
    words = message(
        "{what}, no solid in the file{beside}: the volume inside was taken", what=what, beside=beside
    )
    return Note(GeometryCode.SHELL_VOLUME, words)


COSMETIC = 0.01
"""Of a product's volume, up to which open surfaces beside its solids say nothing: they would enclose less."""

SLACK = 0.02
"""Of an open surface's size, by which it may reach out of a solid that it decorates."""


def loose_notes(surfaces: Sequence[Mesh], bodies: Sequence[Body], solids: Sequence[SolidProps]) -> list[Note]:
    """Note open surfaces beside solids that may be a body.

    Surfaces in the box of a body are a thread, a label, or a symbol.
    """

    def is_beside(mesh: Mesh, body: Body) -> bool:
        slack = SLACK * float(mesh.extents.max())
        low, high = mesh.vertices.min(axis=0) + slack, mesh.vertices.max(axis=0) - slack
        return bool((low >= body.low).all() and (high <= body.high).all())

    left = [
        surface
        for surface in surfaces
        if len(surface) and not any(is_beside(surface, body) for body in bodies)
    ]
    lost = sum(map(about_enclosed, left))
    if not solids or lost <= COSMETIC * sum(solid.volume_m3 for solid in solids):
        return []
    what = counted(len(left), "surface that does not close", "surfaces that do not close")
    words = message(
        "beside its solids there are {what}: if they are a body, some {lost} cm³ are missing",
        what=what,
        lost=f"{lost * 1000000.0:.3g}",
    )
    return [Note(GeometryCode.BODY_MISSING, words)]


def lost_note(names: Sequence[str]) -> Note:
    """Note bodies of a FreeCAD part that have no shape."""
    what = message("has no shape: its") if len(names) == 1 else message("have no shape: their")
    words = message(
        "{names} {what} volume is missing; recompute the file, or make a solid of a mesh",
        names=listed(names, 4),
        what=what,
    )
    return Note(GeometryCode.BODY_MISSING, words)


def open_note(edges: int) -> Note:
    """Note a solid whose faces do not close, or disagree on what is outside."""
    words = message(
        "its faces do not close ({edges}), so it has no exact volume", edges=counted(edges, "open edge")
    )
    return Note(GeometryCode.OPEN_SHELL, words)


def drift_note(drift: float) -> Note | None:
    """Note a solid whose edges are shared but whose faces do not meet there; None if they do.

    drift
        how much its volume depends on the way in which it is integrated, relative.
    """
    if drift <= STATED:
        return None
    words = message(
        "its faces do not meet at their edges, by the file's own tolerances: its volume "
        "may be off by {drift} of it",
        drift=f"{drift:.1g}",
    )
    return Note(GeometryCode.NOT_CONVERGENT if drift <= TORN else GeometryCode.OPEN_SHELL, words)


TORN = 1e-3
"""Relative: as open as a solid with a missing face, for a mass."""


def cavity_note(together: Together) -> Note:
    """Note that solids were taken as cavities of others."""
    words = message(
        "some solids of this product are inside out and some are not: {cavities} taken "
        "as cavities of the solid around them, {turned} as bodies",
        cavities=together.cavities,
        turned=together.turned,
    )
    return Note(GeometryCode.NEGATIVE_VOLUME, words)


LARGE_M, SMALL_M = 20.0, 5e-4
"""A part whose largest extent [m] is outside of this was probably meant in another unit."""


def implausible_size(prototypes: Mapping[str, Prototype], unit: str) -> list[Note]:
    """Note parts of 30 km, or of the size of a grain of dust: the file's unit must be wrong."""
    extents = [float(p.mesh.extents.max()) for p in prototypes.values() if isinstance(p.mesh, Mesh)]
    extents = extents or [p.volume_m3 ** (1 / 3) for p in prototypes.values() if p.volume_m3 > 0]
    if not extents or SMALL_M <= max(extents) <= LARGE_M:
        return []
    return [
        Note(
            GeometryCode.UNITS,
            message(
                "read in {unit}, the largest part measures {extents} m: was another unit meant?",
                unit=unit,
                extents=f"{max(extents):.3g}",
            ),
        )
    ]


def placement_problems(instances: Sequence[Instance]) -> list[Note]:
    """Note placements that scale (mirrored ones are rigid), and parts that are placed twice at the same
    place.
    """
    if not instances:
        return []
    placements = np.array([instance.transform for instance in instances])
    scaled = [i.name for i, rigid in zip(instances, rigid_mask(placements), strict=True) if not rigid]
    seen: set[tuple[str, bytes]] = set()
    twice = []
    # 0.1 µm and 1e-7 of a turn; adding 0 turns -0 into 0.
    for instance, place in zip(instances, np.round(placements, 7) + 0.0, strict=True):
        here = (instance.prototype, place.tobytes())
        if here in seen:
            twice.append(instance.name)
        seen.add(here)
    problems = []
    if scaled:
        words = message(
            "placements that scale their part: {scaled}; volume and inertia are scaled with "
            "it, a mass from the BOM is not",
            scaled=_some(scaled),
        )
        problems.append(Note(GeometryCode.SCALED, words))
    if twice:
        words = message(
            "parts that stand exactly where the same part stands already: {twice}; all of them are counted",
            twice=_some(twice),
        )
        problems.append(Note(GeometryCode.COINCIDENT_PARTS, words))
    return problems


def _some(names: Sequence[str]) -> str:
    return f"{len(names)} ({listed(names, 3)})"


def assembled(
    unfolded: Unfolded,
    prototypes: Mapping[str, Prototype],
    problems: Sequence[Note],
    *,
    name: str,
    source: str,
    unit: str,
) -> Assembly:
    """Make the assembly of what a reader found, and add the problems of its placements."""
    return Assembly(
        name=name,
        prototypes=prototypes,
        instances=tuple(unfolded.instances),
        problems=(*problems, *placement_problems(unfolded.instances)),
        source=source,
        unit=unit,
        frames=unfolded.frames,
    )


def face_rebuilt_note(faces: int, before_m3: float, after_m3: float) -> Note:
    """Note spherical faces that the kernel misread, and that another reading of the file gave right."""
    words = message(
        "the geometry kernel misread {faces} ({before_m3} cm³); read with another axis, "
        "as the edges in the file say, the volume is {after_m3} cm³",
        faces=counted(faces, "spherical face"),
        before_m3=f"{before_m3 * 1000000.0:.4g}",
        after_m3=f"{after_m3 * 1000000.0:.4g}",
    )
    return Note(GeometryCode.FACE_REBUILT, words)


def face_differs_note(faces: int, doubt_m3: float, volume_m3: float) -> Note:
    """Note curved faces that do not lie between their edges."""
    words = message(
        "{faces} not lie between the edges that the file has: some {doubt_m3} of "
        "{volume_m3} cm³ are in doubt",
        faces=counted(faces, "curved face does", "curved faces do"),
        doubt_m3=f"{doubt_m3 * 1000000.0:.3g}",
        volume_m3=f"{volume_m3 * 1000000.0:.4g}",
    )
    return Note(GeometryCode.FACE_DIFFERS, words)
