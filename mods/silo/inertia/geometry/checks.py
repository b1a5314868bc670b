# SPDX-License-Identifier: LGPL-2.1-or-later
"""What any file may have wrong: its unit, its names, placements that scale. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from silo.inertia.core import rigid_mask
from silo.inertia.geometry.labels import has_lost_characters
from silo.inertia.geometry.mesh import Mesh
from silo.inertia.model import GeometryCode, GeometryProblem, Instance, Prototype

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


def name_problems(name: str, unnamed: bool) -> list[GeometryProblem]:
    """What may keep a name from being found in a BOM."""
    problems = []
    if has_lost_characters(name):
        problems.append(
            GeometryProblem(GeometryCode.NAME, f"characters of its name were lost in the export: '{name}'")
        )
    if unnamed:
        problems.append(
            GeometryProblem(
                GeometryCode.NAME, f"it has no name in the file; called '{name}' after what holds it"
            )
        )
    return problems


def scaled_problems(instances: Sequence[Instance]) -> list[GeometryProblem]:
    """One problem for all placements that scale; mirrored ones are rigid and need none."""
    if not instances:
        return []
    placements = np.array([instance.transform for instance in instances])
    scaled = [i.name for i, rigid in zip(instances, rigid_mask(placements), strict=True) if not rigid]
    if not scaled:
        return []
    more = f" and {len(scaled) - 3} more" if len(scaled) > 3 else ""
    return [
        GeometryProblem(
            GeometryCode.SCALED,
            f"placements that scale their part: {len(scaled)} ({', '.join(scaled[:3])}{more}); "
            "volume and inertia are scaled with it, a mass from the BOM is not",
        )
    ]


def coincident_problems(instances: Sequence[Instance]) -> list[GeometryProblem]:
    """One problem for all parts that stand exactly where the same part stands already."""
    seen: dict[tuple[str, bytes], Instance] = {}
    twice = []
    # 0.1 µm and 1e-7 of a turn; adding 0 makes -0 the 0 that it is.
    places = np.round([instance.transform for instance in instances], 7) + 0.0
    for instance, place in zip(instances, places, strict=True):
        if seen.setdefault((instance.prototype, place.tobytes()), instance) is not instance:
            twice.append(instance.name)
    if not twice:
        return []
    more = f" and {len(twice) - 3} more" if len(twice) > 3 else ""
    words = (
        f"parts that stand exactly where the same part stands already: {len(twice)} "
        f"({', '.join(twice[:3])}{more}); all of them are counted"
    )
    return [GeometryProblem(GeometryCode.COINCIDENT_PARTS, words)]
