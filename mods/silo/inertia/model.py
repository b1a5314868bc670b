# SPDX-License-Identifier: LGPL-2.1-or-later
"""Geometry as the readers hand it over: prototypes measured once, instances that place them.

SI throughout (m, m^3, m^5, kg/m^3). Arrays are numpy float64; the readers may pass lists. Volumes are
positive: a reader that met an inside-out solid turns its sign, marks it ``reversed`` and adds a problem.

Below them rigid bodies: kg, m, kg m^2. A tensor is about the body's own centre of mass, in the axes of the
frame at hand. Off-diagonal elements are tensor elements (-∫xy dm), never "products of inertia" with the sign
turned. What can be done for N bodies at once is done in one numpy expression.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from silo.bom.errors import InputError

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
    NOT_READ = "not_read"  # a file or a shape that is missing or damaged: what it holds is in no mass
    EXTERNAL_FILE = "external_file"  # a split assembly was completed from its other files
    NOT_WATERTIGHT = "not_watertight"
    WINDING = "winding"
    UNITS = "units"  # the unit was not stated, or is implausible
    SCALED = "scaled"  # a placement that scales
    BAKED = "baked"  # geometry far away from its own origin
    NAME = "name"  # lost characters, an unnamed product named by climbing
    READER = "reader"  # what the kernel complained about while reading


DOUBTFUL = (
    GeometryCode.BODY_MISSING,
    GeometryCode.INVALID_SHAPE,
    GeometryCode.MESH_MISMATCH,
    GeometryCode.OPEN_SHELL,
    GeometryCode.OVERLAPPING_SOLIDS,
    GeometryCode.NOT_WATERTIGHT,
    GeometryCode.WINDING,
)
"""Under these a mass is no fact."""


def rounded(value: float) -> float:
    """Round a number to the digits that Silo keeps."""
    # Twelve digits: a second run on another machine must not make a revision of the last bit.
    return float(f"{value + 0.0:.12g}") if abs(value) > 1e-15 else 0.0


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
        _freeze(self, com_m=(3,), inertia_unit=(3, 3))


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
        _freeze(self, com_m=(3,), inertia_unit=(3, 3))


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
        _freeze(self, transform=(4, 4))

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


def _freeze(owner: object, **shapes: tuple[int, ...]) -> None:
    """Turn fields into read-only arrays of these shapes. InputError if they do not fit."""
    for name, shape in shapes.items():
        array = np.array(getattr(owner, name), dtype=np.float64)
        if array.shape != shape:
            raise InputError(f"{name}: wanted an array of shape {shape}, got {array.shape}")
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
    """Return the placed prototypes in order of appearance, but not the :func:`companions` of a solid."""
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
    """Return the prototypes without a solid that always stand beside a solid of the same product.

    Pro/E writes a SOLID and a wire COMPOUND for one product: these are one part, not two with the same name.
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
    """Map the path of each placed sub-assembly to the indices of its instances, in order of appearance."""
    below: dict[tuple[str, ...], list[int]] = defaultdict(list)
    for index, instance in enumerate(assembly.instances):
        for depth in range(1, len(instance.path)):
            below[instance.path[:depth]].append(index)
    return below


def sub_assemblies(assembly: Assembly) -> tuple[Product, ...]:
    """Return the products that contain others, by name, in order of appearance; ``count`` counts their
    instances.
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


# --- rigid bodies: mass, centre of mass and inertia tensor, moved and summed ---

RIGID_TOLERANCE = 1e-6
"""How far the columns of a placement may be from orthonormal (STEP files print about nine digits)."""

CHECK_TOLERANCE = 1e-9
"""Relative to the largest principal moment: what counts as rounding when a tensor is checked."""

_EYE3 = np.eye(3)


@dataclass(frozen=True)
class InertialProperties:
    """Mass, centre of mass and inertia tensor of one rigid body, as URDF wants them (spec, Task 2).

    mass
        [kg]
    com
        (x, y, z) [m], in the link's frame.
    ixx, iyy, izz, ixy, ixz, iyz
        tensor elements [kg m^2] about the centre of mass, axes of the link's frame; the products are the
        elements themselves (-∫xy dm), so that they go into a URDF unchanged.
    """

    mass: float
    com: tuple[float, float, float]
    ixx: float
    iyy: float
    izz: float
    ixy: float = 0.0
    ixz: float = 0.0
    iyz: float = 0.0


class TensorProblem(StrEnum):
    """Why no rigid body can have these mass properties."""

    NOT_FINITE = "not_finite"  # a value is NaN or infinite
    NOT_SYMMETRIC = "not_symmetric"
    ZERO_MASS = "zero_mass"  # physics engines refuse a moving link without mass
    NEGATIVE_MASS = "negative_mass"
    ZERO_INERTIA = "zero_inertia"  # a point mass: refused by MuJoCo on a moving link
    NOT_POSITIVE_DEFINITE = "not_positive_definite"
    TRIANGLE_INEQUALITY = "triangle_inequality"  # a principal moment exceeds the sum of the two others


_TENSOR_WORDS = {
    TensorProblem.NOT_FINITE: "has a value that is not finite",
    TensorProblem.NOT_SYMMETRIC: "is not symmetric",
    TensorProblem.ZERO_MASS: "has no mass",
    TensorProblem.NEGATIVE_MASS: "has a negative mass",
    TensorProblem.ZERO_INERTIA: "has no inertia (a point mass); MuJoCo refuses it on a moving link",
    TensorProblem.NOT_POSITIVE_DEFINITE: "has a principal moment that is not above zero",
    TensorProblem.TRIANGLE_INEQUALITY: "has a principal moment above the sum of the two others",
}


def tensor_words(problems: Iterable[TensorProblem]) -> str:
    """Say why no rigid body has a tensor, as the end of a sentence."""
    return ", ".join(_TENSOR_WORDS[problem] for problem in problems)


@dataclass(frozen=True, eq=False, repr=False)
class MassProps:
    """Mass properties of one rigid body in one frame; what a report has for each link.

    mass : float [kg]
    com : (3,) float [m], in the frame
    inertia : (3, 3) float [kg m^2], about ``com``, axes of the frame
    frame : which frame, in words; "" if nobody said. Bodies of two named frames cannot be added.

    ``center_mass``, ``moment_inertia`` and the principal ones are the same under the names that trimesh has.
    """

    mass: float
    com: Floats
    inertia: Floats
    frame: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "mass", float(self.mass))
        _freeze(self, com=(3,), inertia=(3, 3))

    def __reduce__(self) -> tuple[Any, ...]:
        # By the constructor, so that copies are read-only as well.
        return type(self), (self.mass, self.com, self.inertia, self.frame)

    def _values(self) -> tuple[Any, ...]:
        return self.mass, *self.com, *self.inertia.flat, self.frame

    def __eq__(self, other: object) -> bool:
        """Compare to the last bit, in one frame; ``np.allclose`` compares with a tolerance."""
        return self._values() == other._values() if isinstance(other, MassProps) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._values())

    @classmethod
    def nothing(cls) -> MassProps:
        """Return a body without mass, the neutral element of :func:`combine`."""
        return cls(0.0, np.zeros(3), np.zeros((3, 3)))

    @property
    def center_mass(self) -> Floats:
        """Return the centre of mass (3,) [m]."""
        return self.com

    @property
    def moment_inertia(self) -> Floats:
        """Return the tensor (3, 3) [kg m^2] about the centre of mass.

        Off-diagonals are tensor elements (-∫xy dm).
        """
        return self.inertia

    @property
    def principal_inertia_components(self) -> Floats:
        """Return the principal moments (3,) [kg m^2], ascending."""
        return self.principal()[0]

    @property
    def principal_inertia_vectors(self) -> Floats:
        """Return (3, 3): in each row the unit axis of a principal moment, right-handed."""
        return self.principal()[1].T

    def __add__(self, other: object) -> MassProps:
        """Combine both into one rigid body. InputError if their frames are known to differ."""
        if not isinstance(other, MassProps):
            return NotImplemented
        if self.frame and other.frame and self.frame != other.frame:
            raise InputError(
                f"these bodies are given in two frames ({self.frame}; {other.frame}) and cannot be added; "
                "bring one into the other's frame with transformed(T), or ask for all in the assembly's frame"
            )
        return replace(combine((self, other)), frame=self.frame or other.frame)

    def __radd__(self, other: object) -> MassProps:
        # sum() begins with 0.
        return self if other == 0 else NotImplemented

    def __repr__(self) -> str:
        centre = ", ".join(f"{v:.6g}" for v in self.com)
        finite = np.isfinite(self.inertia).all()
        moments = ", ".join(f"{v:.6g}" for v in self.principal()[0]) if finite else "not finite"
        where = f", frame={self.frame!r}" if self.frame else ""
        return f"MassProps(mass={self.mass:.6g} kg, com=[{centre}] m, principal=[{moments}] kg m²{where})"

    def transformed(self, placement: ArrayLike, frame: str = "") -> MassProps:
        """Move the body by ``placement`` ((4, 4), rigid or mirrored); ``frame`` names the new frame.

        A placement that scales is refused (InputError), since a mass does not show what scaling does to it.
        Scaled *geometry* is handled exactly, by :func:`place`.
        """
        matrix = as_placement(placement)
        if not is_rigid(matrix):
            raise InputError(
                "a body with a mass can be moved, turned and mirrored, but not scaled; "
                f"the placement's axes have the lengths {np.linalg.norm(matrix[:3, :3], axis=0).tolist()}"
            )
        turn = matrix[:3, :3]
        return MassProps(self.mass, turn @ self.com + matrix[:3, 3], turn @ self.inertia @ turn.T, frame)

    def principal(self) -> tuple[Floats, Floats]:
        """Return the principal moments ((3,) [kg m^2], ascending) and axes ((3, 3), columns,
        right-handed).
        """
        moments, axes = np.linalg.eigh((self.inertia + self.inertia.T) / 2)
        if np.linalg.det(axes) < 0:
            axes = axes * np.array([1.0, 1.0, -1.0])
        return moments, axes

    def check(self, tolerance: float = CHECK_TOLERANCE) -> tuple[TensorProblem, ...]:
        """Find everything that keeps this from being a rigid body; () if nothing does.

        It checks the eigenvalues, not the diagonal: diag(.02, .02, .02) with ixy = .015 looks right, but is
        not. ``tolerance`` is relative to the largest principal moment; a flat plate (a + b = c) is fine.
        """
        if not (np.isfinite(self.mass) and np.isfinite(self.com).all() and np.isfinite(self.inertia).all()):
            return (TensorProblem.NOT_FINITE,)
        problems: list[TensorProblem] = []
        scale = float(np.abs(self.inertia).max())
        if np.abs(self.inertia - self.inertia.T).max() > tolerance * scale:
            problems.append(TensorProblem.NOT_SYMMETRIC)
        if self.mass <= 0:
            problems.append(TensorProblem.ZERO_MASS if self.mass == 0 else TensorProblem.NEGATIVE_MASS)
        if scale == 0:
            return (*problems, TensorProblem.ZERO_INERTIA)
        low, mid, high = self.principal()[0]
        if low <= 0:
            problems.append(TensorProblem.NOT_POSITIVE_DEFINITE)
        if low + mid < high * (1 - tolerance):
            problems.append(TensorProblem.TRIANGLE_INEQUALITY)
        return tuple(problems)

    def to_inertial(self) -> InertialProperties:
        """Convert to the spec's plain type, with an exactly symmetric tensor."""
        x, y, z = self.com.tolist()
        (ixx, ixy, ixz), (_, iyy, iyz), (_, _, izz) = ((self.inertia + self.inertia.T) / 2).tolist()
        return InertialProperties(self.mass, (x, y, z), ixx, iyy, izz, ixy, ixz, iyz)


def parallel_axis(masses: Floats, offsets: Floats) -> Floats:
    """Return the tensor (3, 3) [kg m^2] of point masses ((N,) [kg]) at ``offsets`` ((N, 3) [m]) about the
    origin.
    """
    second = np.einsum("n,ni,nj->ij", masses, offsets, offsets)
    tensor: Floats = np.trace(second) * _EYE3 - second
    return tensor


def combine(bodies: Sequence[MassProps]) -> MassProps:
    """Combine all bodies into one rigid body, in their common frame."""
    if not bodies:
        return MassProps.nothing()
    return combine_arrays(
        np.array([b.mass for b in bodies]),
        np.array([b.com for b in bodies]),
        np.array([b.inertia for b in bodies]),
    )


def combine_arrays(masses: ArrayLike, coms: ArrayLike, inertias: ArrayLike) -> MassProps:
    """Do what :func:`combine` does, from (N,) [kg], (N, 3) [m], (N, 3, 3) [kg m^2].

    Without any mass there is no centre, and the origin is returned.
    """
    mass = np.asarray(masses, float)
    com = np.asarray(coms, float)
    total = float(mass.sum())
    if total == 0:
        return MassProps(total, np.zeros(3), np.asarray(inertias, float).sum(axis=0).reshape(3, 3))
    centre = (mass[:, None] * com).sum(axis=0) / total
    tensor = np.asarray(inertias, float).sum(axis=0) + parallel_axis(mass, com - centre)
    return MassProps(total, centre, (tensor + tensor.T) / 2)


def place(
    volumes: ArrayLike, coms: ArrayLike, units: ArrayLike, placements: ArrayLike
) -> tuple[Floats, Floats, Floats]:
    """Move the geometry of N instances by their placements.

    volumes : (N,) [m^3]; coms : (N, 3) [m]; units : (N, 3, 3) [m^5], tensors per unit density about the coms
    placements : (N, 4, 4); rigid, mirrored, or any invertible affine map (then exact as well: the second
    moments S = tr(I)/2 - I of a body mapped by A become |det A| A S Aᵀ)

    Returns volumes, coms and units in the outer frame.
    """
    volume = np.asarray(volumes, float)
    matrix = np.asarray(placements, float)
    turn = matrix[:, :3, :3]
    unit = np.asarray(units, float)
    com = np.einsum("nij,nj->ni", turn, np.asarray(coms, float)) + matrix[:, :3, 3]
    moved = turn @ unit @ turn.transpose(0, 2, 1)
    scaled = ~rigid_mask(matrix)
    if scaled.any():
        stretch = np.abs(np.linalg.det(turn[scaled]))
        volume = volume.copy()
        volume[scaled] *= stretch
        moved[scaled] = _stretched(unit[scaled], turn[scaled], stretch)
    return volume, com, moved


def _stretched(unit: Floats, turn: Floats, stretch: Floats) -> Floats:
    trace = np.trace(unit, axis1=1, axis2=2)[:, None, None]
    second = trace / 2 * _EYE3 - unit
    second = stretch[:, None, None] * (turn @ second @ turn.transpose(0, 2, 1))
    tensors: Floats = np.trace(second, axis1=1, axis2=2)[:, None, None] * _EYE3 - second
    return tensors


def rigid_mask(placements: Floats, tolerance: float = RIGID_TOLERANCE) -> NDArray[np.bool_]:
    """Return (N,) bool: True for each of the (N, 4, 4) placements that neither scales nor shears (a mirror is
    rigid).
    """
    turn = placements[:, :3, :3]
    off = np.abs(turn.transpose(0, 2, 1) @ turn - _EYE3)
    mask: NDArray[np.bool_] = off.max(axis=(1, 2)) <= tolerance
    return mask


def is_rigid(placement: Floats, tolerance: float = RIGID_TOLERANCE) -> bool:
    """Return True if a (4, 4) placement neither scales nor shears; a mirror is rigid."""
    return bool(rigid_mask(placement[None], tolerance)[0])


def as_placement(value: ArrayLike) -> Floats:
    """Check a (4, 4) placement: finite, last row 0 0 0 1, invertible. InputError otherwise."""
    try:
        matrix = np.asarray(value, float)
    except (TypeError, ValueError) as error:
        raise InputError(f"a placement is a 4 x 4 matrix of numbers ({error})") from error
    if matrix.shape != (4, 4):
        raise InputError(f"a placement is a 4 x 4 matrix, got the shape {matrix.shape}")
    if not np.isfinite(matrix).all() or not np.allclose(matrix[3], (0, 0, 0, 1), atol=1e-12):
        raise InputError(
            f"a placement needs finite numbers and the last row 0 0 0 1, got {matrix[3].tolist()}"
        )
    if abs(np.linalg.det(matrix[:3, :3])) < 1e-12:
        raise InputError("a placement must be invertible; this one flattens the part")
    return matrix
