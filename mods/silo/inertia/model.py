# SPDX-License-Identifier: LGPL-2.1-or-later
"""Geometry as the readers hand it over: prototypes measured once, instances that place them.

SI throughout (m, m^3, m^5, kg/m^3). Arrays are numpy float64; the readers may pass lists. Volumes are
positive: a reader that met an inside-out solid turns its sign, marks it ``reversed`` and adds a problem.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class GeometryCode(StrEnum):
    """The machine names of what a geometry reader noticed."""

    NEGATIVE_VOLUME = "negative_volume"  # an inside-out solid; its sign was turned
    INVALID_SHAPE = "invalid_shape"  # the kernel's own check fails
    MESH_MISMATCH = "mesh_mismatch"  # |V_mesh - V_brep| above 2 %
    NOT_CONVERGENT = "not_convergent"  # the integration did not reach its tolerance
    STATED_VOLUME = "stated_volume"  # the file states another volume (above 1e-3)
    STATED_CENTROID = "stated_centroid"
    OPEN_SHELL = "open_shell"  # a solid whose faces do not close: its volume is no fact
    SHELL_VOLUME = "shell_volume"  # surfaces that close, and are no solid in the file: taken for one
    COINCIDENT_SOLIDS = "coincident_solids"  # a solid that lies exactly on another one: counted once
    OVERLAPPING_SOLIDS = "overlapping_solids"  # solids of one product that share space
    COINCIDENT_PARTS = "coincident_parts"  # a part that is placed twice at one place: both are counted
    BODY_MISSING = "body_missing"  # the file names a body that could not be read as a solid
    NOT_COUNTED = "not_counted"  # in the file, and not the part: supports, modifiers, what is not built
    HIDDEN = "hidden"  # the file does not show a body, and it is counted
    NO_SOLID = "no_solid"  # surfaces or wires only
    NO_GEOMETRY = "no_geometry"  # nothing at all: an unresolved external file, an empty product
    EXTERNAL_FILE = "external_file"  # a split assembly's file was found, or was not
    NOT_WATERTIGHT = "not_watertight"
    WINDING = "winding"
    UNITS = "units"  # the unit was not stated, or is implausible
    SCALED = "scaled"  # a placement that scales
    BAKED = "baked"  # geometry far away from its own origin
    NAME = "name"  # lost characters, an unnamed product named by climbing
    READER = "reader"  # what the kernel complained about while reading


@dataclass(frozen=True)
class Note:
    """One thing that was noticed: a sentence, and one of :class:`GeometryCode`, of the other codes, or a
    reader's own word."""

    code: str
    message: str


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
        _freeze(self, "com_m", (3,))
        _freeze(self, "inertia_unit", (3, 3))


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
        _freeze(self, "com_m", (3,))
        _freeze(self, "inertia_unit", (3, 3))


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
        _freeze(self, "transform", (4, 4))

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


def _freeze(owner: object, name: str, shape: tuple[int, ...]) -> None:
    array = np.array(getattr(owner, name), dtype=np.float64).reshape(shape)
    array.flags.writeable = False
    object.__setattr__(owner, name, array)


@dataclass(frozen=True, slots=True)
class Product:
    """One thing a BOM row may stand for.

    key
        the prototype's key; for a sub-assembly its product name.
    count
        instances in the whole assembly.
    volume_m3
        of one [m^3]; 0 for sub-assemblies and for products without a solid.
    density
        that the geometry file states [kg/m^3], None if it states none.
    parents
        product names directly around its instances ("" = the top assembly).
    """

    key: str
    name: str
    part_number: str
    count: int
    volume_m3: float = 0.0
    density: float | None = None
    parents: frozenset[str] = frozenset()


def leaf_products(assembly: Assembly) -> tuple[Product, ...]:
    """Return the placed prototypes in order of appearance, without companions of a solid (see
    :func:`companions`).
    """
    beside = companions(assembly)
    counts: dict[str, int] = defaultdict(int)
    parents: dict[str, set[str]] = defaultdict(set)
    for instance in assembly.instances:
        counts[instance.prototype] += 1
        path = instance.product_path
        parents[instance.prototype].add(path[-2] if len(path) > 1 else "")
    return tuple(
        Product(
            key=key,
            name=assembly.prototypes[key].name,
            part_number=assembly.prototypes[key].part_number or "",
            count=count,
            volume_m3=assembly.prototypes[key].volume_m3,
            density=assembly.prototypes[key].step_density,
            parents=frozenset(parents[key]),
        )
        for key, count in counts.items()
        if key not in beside
    )


def companions(assembly: Assembly) -> frozenset[str]:
    """Return the prototypes without a solid that only ever stand beside a solid of the same product.

    Pro/E writes a SOLID and a wire COMPOUND for one product: that is one part, not two of one name.
    """
    if all(prototype.has_solid for prototype in assembly.prototypes.values()):
        return frozenset()
    solid_places = {
        (i.path[:-1], i.product_path[-1:])
        for i in assembly.instances
        if assembly.prototypes[i.prototype].has_solid
    }
    places: dict[str, set[tuple[tuple[str, ...], tuple[str, ...]]]] = defaultdict(set)
    for i in assembly.instances:
        if not assembly.prototypes[i.prototype].has_solid:
            places[i.prototype].add((i.path[:-1], i.product_path[-1:]))
    return frozenset(key for key, where in places.items() if where <= solid_places)


def placed_below(assembly: Assembly) -> dict[tuple[str, ...], list[int]]:
    """Return the indices of the instances in each placed sub-assembly, by its path, as they appear."""
    below: dict[tuple[str, ...], list[int]] = defaultdict(list)
    for index, instance in enumerate(assembly.instances):
        for depth in range(1, len(instance.path)):
            below[instance.path[:depth]].append(index)
    return below


def sub_assemblies(assembly: Assembly) -> tuple[Product, ...]:
    """Return the products that contain others, by name, in order of appearance.

    ``count`` is that of their instances.
    """
    counts: dict[str, int] = defaultdict(int)
    parents: dict[str, set[str]] = defaultdict(set)
    for path, indices in placed_below(assembly).items():
        names = ("", *assembly.instances[indices[-1]].product_path)
        if len(names) > len(path) + 1:  # else it is the sub-assembly's own shape
            counts[names[len(path)]] += 1
            parents[names[len(path)]].add(names[len(path) - 1])
    return tuple(
        Product(key=name, name=name, part_number="", count=count, parents=frozenset(parents[name]))
        for name, count in counts.items()
    )
