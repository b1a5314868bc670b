# SPDX-License-Identifier: LGPL-2.1-or-later
"""The geometry of an assembly as a reader hands it over: prototypes measured once, instances that place them.

SI throughout (m, m^3, m^5, kg/m^3). Arrays are numpy float64; the readers may pass lists. Volumes are
positive: a reader that met an inside-out solid turns its sign, marks it ``reversed`` and adds a problem.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from silo.inertia.arrays import Floats, freeze
from silo.inertia.notes import Note


@dataclass(frozen=True, eq=False)
class SolidProps:
    """One solid of a prototype, in the prototype's axes.

    volume_m3 : float [m^3], positive
    com_m : (3,) [m]
    inertia_unit : (3, 3) [m^5], tensor per unit density about ``com_m``
    reversed : the file had it inside out
    """

    volume_m3: float
    com_m: Floats
    inertia_unit: Floats
    reversed: bool = False

    def __post_init__(self) -> None:
        freeze(self, com_m=(3,), inertia_unit=(3, 3))


@dataclass(frozen=True, eq=False)
class Prototype:
    """One product's geometry, computed once, however often it is placed.

    key
        unique in its assembly (names are not: exports hold "Part 1" five times).
    name
        the product's name, for matching with the BOM.
    volume_m3, com_m, inertia_unit
        of all solids together: [m^3], (3,) [m], (3, 3) [m^5] per unit density about ``com_m``.
    has_solid
        False: surfaces, wires, or nothing; then the volume is 0.
    step_density, step_material, stated_volume_m3
        what the file says itself; [kg/m^3], name, [m^3]; None if it says nothing.
    part_number
        if the file has one besides the name.
    mesh
        a handle for preview and cross-check; nothing here looks into it.
    """

    key: str
    name: str
    volume_m3: float = 0.0
    com_m: Floats = field(default_factory=lambda: np.zeros(3))
    inertia_unit: Floats = field(default_factory=lambda: np.zeros((3, 3)))
    has_solid: bool = True
    problems: tuple[Note, ...] = ()
    step_density: float | None = None
    step_material: str | None = None
    stated_volume_m3: float | None = None
    part_number: str | None = None
    mesh: Any = field(default=None, repr=False)

    def __post_init__(self) -> None:
        freeze(self, com_m=(3,), inertia_unit=(3, 3))


@dataclass(frozen=True, eq=False)
class Instance:
    """One placed prototype.

    path
        instance names from the top assembly (not included) down to this one. Unique in the assembly: a
        reader that meets a name again among siblings appends ``#2``, ``#3``, … (Onshape names instances by
        their product, so that two legs are both "leg"; without this they would become one link).
    product_path
        product names of the same levels.
    prototype
        key into ``Assembly.prototypes``.
    transform
        (4, 4) float, lengths in m: prototype axes → top assembly axes.
    """

    path: tuple[str, ...]
    product_path: tuple[str, ...]
    prototype: str
    transform: Floats = field(default_factory=lambda: np.eye(4))

    def __post_init__(self) -> None:
        freeze(self, transform=(4, 4))

    @property
    def name(self) -> str:
        """Return the path as people write it: ``arm/forearm/bolt``."""
        return "/".join(self.path)


@dataclass(frozen=True, eq=False)
class Assembly:
    """All geometry of one file (or one FreeCAD assembly).

    problems
        of the file as a whole; those of one product are on its prototype.
    source, unit
        the file's path as given, and the length unit it states ("mm", "inch", …; "" if none).
    frames
        placements ((4, 4), m) of sub-assemblies by instance path, if the reader knows them.
    """

    name: str
    prototypes: Mapping[str, Prototype]
    instances: tuple[Instance, ...]
    problems: tuple[Note, ...] = ()
    source: str = ""
    unit: str = ""
    frames: Mapping[tuple[str, ...], Floats] = field(default_factory=dict)


def placed_below(assembly: Assembly) -> dict[tuple[str, ...], list[int]]:
    """Map the path of each placed sub-assembly to the indices of its instances, in order of appearance."""
    below: dict[tuple[str, ...], list[int]] = defaultdict(list)
    for index, instance in enumerate(assembly.instances):
        for depth in range(1, len(instance.path)):
            below[instance.path[:depth]].append(index)
    return below
