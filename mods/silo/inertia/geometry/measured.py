# SPDX-License-Identifier: LGPL-2.1-or-later
"""What measuring a product's solids gives, and what is said of them; the same for every engine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from silo.inertia.geometry.labels import lost_characters
from silo.inertia.geometry.mesh import Mesh
from silo.inertia.geometry.together import Together, combined
from silo.inertia.model import GeometryCode, GeometryProblem, Prototype, SolidProps
from silo.inertia.wording import counted

STATED = 5e-5
"""Relative: what the volume may depend on the way that it is taken, and no farther in silence."""

MESH_TOLERANCE = 0.02
"""|V_mesh - V_brep| / V above this is bad geometry: all valid parts of 280 real ones stay below 0.7 %."""

CONVERGED = 1e-6
"""The integration's own error estimate above this says that it did not reach its tolerance."""

FAR_AWAY = 1e4
"""Distance from the origin, in sizes of the solid, from where coordinates themselves lose digits."""


Note = tuple[GeometryCode, str]
Notes = list[Note]

NO_VOLUME: Note = (
    GeometryCode.INVALID_SHAPE,
    "the solid has no volume that can be computed; it is left out",
)
INVALID: Note = (GeometryCode.INVALID_SHAPE, "the geometry kernel's own check finds this shape invalid")


@dataclass(frozen=True, eq=False)
class Measured:
    """What was found in one prototype; ``has_faces``, ``has_wires``: what there is without a solid."""

    solids: tuple[SolidProps, ...]
    problems: tuple[GeometryProblem, ...]
    mesh: Mesh | None
    has_faces: bool
    has_wires: bool = False

    def prototype(
        self, key: str, name: str, *more: GeometryProblem, empty: GeometryProblem | None = None, **stated: Any
    ) -> Prototype:
        """The product with these solids; ``empty`` says why there is none, ``stated`` what the file gives."""
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
) -> Notes:
    """What is to be said of one solid's integration.

    error, eps
        estimated and wanted, relative to the volume (which is signed here).
    distance_m
        of the solid from the origin of its coordinates.
    """
    notes: Notes = []
    if error > CONVERGED:
        message = f"the volume integration stopped at a relative error of {error:.1g}, wanted {eps:.1g}"
        notes.append((GeometryCode.NOT_CONVERGENT, message))
    if distance_m > FAR_AWAY * size_m > 0:
        message = (
            f"the geometry lies {distance_m:.3g} m from its own origin, {distance_m / size_m:.0f} times its "
            "size; its coordinates have lost digits"
        )
        notes.append((GeometryCode.BAKED, message))
    if volume_m3 < 0:
        message = f"the solid is inside out (volume {volume_m3:.6g} m3); its sign was turned"
        notes.append((GeometryCode.NEGATIVE_VOLUME, message))
    return notes


def differing_note(difference: float) -> Note:
    """Two integrations that both converged, and differ."""
    words = (
        f"two exact integrations differ by {difference:.1g}: its edges do not quite meet, by the file's own "
        "tolerances, and no finer integration helps"
    )
    return (GeometryCode.NOT_CONVERGENT, words)


def mesh_notes(deviation: float | None, missing: int) -> Notes:
    """What the mesh says of a solid: its relative deviation in volume (None: not closed), missing faces."""
    if deviation is not None and deviation > MESH_TOLERANCE:
        message = (
            f"its surface mesh encloses a volume that differs by {deviation:.1%}: the geometry is bad, "
            "and so may be its mass"
        )
        return [(GeometryCode.MESH_MISMATCH, message)]
    if deviation is None and missing:
        message = f"{missing} of its faces cannot be meshed, so its volume could not be cross-checked"
        return [(GeometryCode.MESH_MISMATCH, message)]
    return []


def no_solid(measured: Measured) -> GeometryProblem:
    """Why a product has no volume."""
    if measured.has_faces or measured.has_wires:
        what = "surfaces that enclose no solid" if measured.has_faces else "curves only"
        return GeometryProblem(GeometryCode.NO_SOLID, f"it consists of {what}, so it has no volume")
    return GeometryProblem(GeometryCode.NO_GEOMETRY, "the file holds no solid and no surface for it")


def shell_note(shells: int, solids: int) -> GeometryProblem:
    """Surfaces that close were taken for solids."""
    what = counted(shells, "closed surface", "closed surfaces")
    beside = ", beside its solids" if solids else ""
    words = f"{what}, no solid in the file{beside}: the volume inside was taken"
    return GeometryProblem(GeometryCode.SHELL_VOLUME, words)


def open_note(edges: int) -> Note:
    """A solid whose faces do not close, or disagree on what is outside."""
    words = f"its faces do not close ({counted(edges, 'open edge')}), so it has no exact volume"
    return (GeometryCode.OPEN_SHELL, words)


def drift_note(drift: float) -> Note | None:
    """A solid whose edges are shared but whose faces do not meet there; None where they do.

    drift
        how far its volume depends on the way that it is taken, relative.
    """
    if drift <= STATED:
        return None
    words = (
        "its faces do not meet at their edges, by the file's own tolerances: its volume may be off by "
        f"{drift:.1g} of it"
    )
    return (GeometryCode.NOT_CONVERGENT if drift <= TORN else GeometryCode.OPEN_SHELL, words)


TORN = 1e-3
"""Relative: as open as a solid with a missing face, for a mass."""


def cavity_note(found: Together) -> GeometryProblem:
    """Some solids were taken as cavities of others."""
    words = (
        "some solids of this product are inside out and some are not: "
        f"{found.cavities} taken as cavities of the solid around them, {found.turned} as bodies"
    )
    return GeometryProblem(GeometryCode.NEGATIVE_VOLUME, words)
