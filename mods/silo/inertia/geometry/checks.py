# SPDX-License-Identifier: LGPL-2.1-or-later
"""What any file may have wrong: its unit, placements that scale or coincide. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from silo.inertia.core import rigid_mask
from silo.inertia.geometry.graph import Unfolded
from silo.inertia.geometry.mesh import Mesh
from silo.inertia.model import Assembly, GeometryCode, GeometryProblem, Instance, Prototype

LARGE_M, SMALL_M = 20.0, 5e-4
"""A part whose largest extent [m] is outside of this was probably meant in another unit."""


def implausible_size(prototypes: Mapping[str, Prototype], unit: str) -> list[GeometryProblem]:
    """Parts of 30 km or of a grain of dust: the file's unit is not the one that its numbers are in."""
    extents = [float(p.mesh.extents.max()) for p in prototypes.values() if isinstance(p.mesh, Mesh)]
    extents = extents or [p.volume_m3 ** (1 / 3) for p in prototypes.values() if p.volume_m3 > 0]
    if not extents or SMALL_M <= max(extents) <= LARGE_M:
        return []
    return [
        GeometryProblem(
            GeometryCode.UNITS,
            f"read in {unit}, the largest part measures {max(extents):.3g} m: was another unit meant?",
        )
    ]


def placement_problems(instances: Sequence[Instance]) -> list[GeometryProblem]:
    """Placements that scale (mirrored ones are rigid), and parts that are placed twice at one place."""
    if not instances:
        return []
    placements = np.array([instance.transform for instance in instances])
    scaled = [i.name for i, rigid in zip(instances, rigid_mask(placements), strict=True) if not rigid]
    seen: set[tuple[str, bytes]] = set()
    twice = []
    # 0.1 µm and 1e-7 of a turn; adding 0 makes -0 the 0 that it is.
    for instance, place in zip(instances, np.round(placements, 7) + 0.0, strict=True):
        here = (instance.prototype, place.tobytes())
        if here in seen:
            twice.append(instance.name)
        seen.add(here)
    problems = []
    if scaled:
        words = (
            f"placements that scale their part: {_some(scaled)}; "
            "volume and inertia are scaled with it, a mass from the BOM is not"
        )
        problems.append(GeometryProblem(GeometryCode.SCALED, words))
    if twice:
        words = (
            f"parts that stand exactly where the same part stands already: {_some(twice)}; "
            "all of them are counted"
        )
        problems.append(GeometryProblem(GeometryCode.COINCIDENT_PARTS, words))
    return problems


def _some(names: Sequence[str]) -> str:
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return f"{len(names)} ({', '.join(names[:3])}{more})"


def assembled(
    unfolded: Unfolded,
    prototypes: Mapping[str, Prototype],
    problems: Sequence[GeometryProblem],
    *,
    name: str,
    source: str,
    unit: str,
) -> Assembly:
    """What a reader found, as an assembly; the problems of its placements are added."""
    return Assembly(
        name=name,
        prototypes=prototypes,
        instances=tuple(unfolded.instances),
        problems=(*problems, *placement_problems(unfolded.instances)),
        source=source,
        unit=unit,
        frames=unfolded.frames,
    )
