# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a STEP file says of itself against what was measured."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from silo.inertia.core import rigid_mask
from silo.inertia.geometry.graph import bottom_up
from silo.inertia.geometry.mesh import Floats
from silo.inertia.geometry.step.siblings import Siblings
from silo.inertia.geometry.step.xcaf import Stated, StepFile
from silo.inertia.model import GeometryCode, GeometryProblem, Prototype
from silo.inertia.wording import counted

STATED_TOLERANCE = 1e-3
"""Files state volumes from their own integrations, 2.6e-5 off in one published by the format's authors."""


def against_stated(volume: float, com: Floats, stated: Stated) -> list[GeometryProblem]:
    """A part's volume [m^3] and centre (3,) [m] against the validation properties that the file gives."""
    problems = []
    if stated.volume_m3 is not None and abs(volume - stated.volume_m3) > STATED_TOLERANCE * volume:
        problems.append(
            GeometryProblem(
                GeometryCode.STATED_VOLUME,
                f"the file states a volume of {stated.volume_m3:.6g} m3, the geometry has {volume:.6g} m3 "
                f"({volume / stated.volume_m3 - 1:+.2%})"
                if stated.volume_m3
                else f"the file states no volume, the geometry has {volume:.6g} m3",
            )
        )
    if stated.centroid_m is not None:
        distance = float(np.linalg.norm(com - np.array(stated.centroid_m)))
        if distance > STATED_TOLERANCE * max(volume, 0.0) ** (1 / 3):
            problems.append(
                GeometryProblem(
                    GeometryCode.STATED_CENTROID,
                    f"the file states a centre of volume {distance * 1e3:.4g} mm away from the geometry's",
                )
            )
    return problems


def split_problems(siblings: Siblings) -> list[GeometryProblem]:
    """Which files a split assembly was completed from, and which it lacks."""
    problems = []
    if siblings.used:
        names = ", ".join(path.name for path in siblings.used[:5])
        more = f" and {len(siblings.used) - 5} more" if len(siblings.used) > 5 else ""
        problems.append(
            GeometryProblem(
                GeometryCode.EXTERNAL_FILE,
                f"a split assembly: geometry read from {counted(len(siblings.used), 'file')} beside it "
                f"({names}{more})",
            )
        )
    if siblings.missing:
        names = ", ".join(sorted(set(siblings.missing))[:5])
        problems.append(
            GeometryProblem(
                GeometryCode.NO_GEOMETRY,
                f"{counted(len(siblings.missing), 'product')} without geometry, here or beside the file "
                f"({names}); put their files into its folder, or export the assembly as one file",
            )
        )
    return problems


def stated_totals(step: StepFile, prototypes: Mapping[str, Prototype]) -> list[GeometryProblem]:
    """Assemblies whose stated volume is not what their content adds up to."""
    if not any(stated.volume_m3 for stated in step.stated.values()):
        return []
    volumes: dict[str, float] = {}
    problems = []
    for root in step.roots:
        for key in bottom_up(step.nodes, root.product):
            node, stated = step.nodes[key], step.stated[key].volume_m3
            own = prototypes[key].volume_m3 if key in prototypes else 0.0
            volumes[key] = own + sum(
                volumes[c.product] * abs(float(np.linalg.det(c.transform[:3, :3]))) for c in node.children
            )
            if node.children and stated and abs(volumes[key] / stated - 1) > STATED_TOLERANCE:
                problems.append(
                    GeometryProblem(
                        GeometryCode.STATED_VOLUME,
                        f"the file states {stated:.6g} m3 for the assembly '{node.name}', "
                        f"its parts add up to {volumes[key]:.6g} m3",
                    )
                )
    return problems


def lost_stretches(step: StepFile) -> list[GeometryProblem]:
    """Transformations that scale or mirror, of which the kernel made plain ones (versions before 8 do)."""
    placements = [child.transform for node in step.nodes.values() for child in node.children]
    if not step.stretched or any(_stretches(np.array(placements).reshape(-1, 4, 4))):
        return []
    from silo.inertia.geometry.kernel.occt import VERSION

    return [
        GeometryProblem(
            GeometryCode.SCALED,
            f"the file scales or mirrors parts in {step.stretched} places, which the installed geometry "
            f"kernel ({VERSION}) does not do; masses and centres are wrong there. Install "
            "cadquery-ocp-novtk 8 or newer",
        )
    ]


def _stretches(placements: Floats) -> list[bool]:
    return [*(~rigid_mask(placements)), *(np.linalg.det(placements[:, :3, :3]) < 0)]
