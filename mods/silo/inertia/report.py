# SPDX-License-Identifier: LGPL-2.1-or-later
"""The report: results per link and part, and every warning with link, part and code (spec, Task 2)."""

from __future__ import annotations

import logging
import math
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from silo.bom.errors import counted
from silo.inertia.codes import Decided, MassCode, Rule, Source

if TYPE_CHECKING:
    from silo.inertia.links.frames import LinkFrame
    from silo.inertia.reconciliation import Reconciliation
    from silo.inertia.rigid import MassProps, TensorProblem
    from silo.inertia.types import InertialProperties


logger = logging.getLogger(__name__)

HEAVY = 0.05
"""Of the robot: a row without geometry that weighs as much comes first."""

NO_CODE = "note"
"""The code of a warning that a caller adds without one."""

MISSING_MASS = (
    NO_CODE,
    MassCode.NO_MASS_NO_MATERIAL,
    MassCode.NOT_IN_BOM,
    MassCode.NO_BOM,
    MassCode.UNKNOWN_MATERIAL,
    MassCode.NO_VOLUME,
)
"""The warnings about a part to which neither BOM nor geometry gives a mass."""


@dataclass(frozen=True)
class PartWarning:
    """A warning about one part of one link; ``link_name`` or ``part_name`` is "" if it is about none.

    kg
        by how much the mass may be wrong [kg]; None: by all of the part, or of the link.
    """

    link_name: str
    part_name: str
    message: str
    code: str = NO_CODE
    kg: float | None = field(default=None, compare=False)


@dataclass(frozen=True)
class PartResult:
    """Equal pieces of one product in one link.

    mass, total_mass
        of one piece and of all [kg].
    volume, com
        of one piece [m^3]; its centre of mass in the part's own axes [m], None if the pieces have
        axes of their own each (equal shapes that a file holds one by one).
    paths
        instance paths of the pieces, ``/`` between levels.
    material, material_name
        the BOM's text, and the row of the material table it was understood as.
    material_card
        the file of the FreeCAD card that the density is from; "" if it is from a table.
    density
        [kg/m^3] that was used, or that the given mass amounts to; None without a volume.
    quantum
        the BOM mass is ``mass`` ± this [kg]; 0 if the mass is no rounded figure.
    part_number
        by the BOM, else by the geometry file; "" if neither has one.
    lines
        BOM lines it came from.
    products
        keys of the prototypes it stands for: one, or several that are alike.
    reach
        mean distance [m] of the pieces from the centre of mass of the whole assembly.
    """

    name: str
    paths: tuple[str, ...]
    mass: float
    volume: float
    com: tuple[float, float, float] | None
    source: Source
    rule: Rule
    decided_by: Decided
    material: str | None = None
    material_name: str | None = None
    material_card: str = ""
    density: float | None = None
    density_source: str = ""
    quantum: float = 0.0
    part_number: str = ""
    lines: tuple[int, ...] = ()
    products: tuple[str, ...] = ()
    reach: float = 0.0
    warnings: tuple[PartWarning, ...] = ()

    @property
    def quantity(self) -> int:
        """Return the number of pieces."""
        return len(self.paths)

    @property
    def total_mass(self) -> float:
        """Return the mass [kg] of all pieces."""
        return self.mass * self.quantity


@dataclass(frozen=True)
class SubAssemblyResult:
    """A sub-assembly with a mass of its own in the BOM. It is part of no sum: its parts have their masses.

    mass, quantum
        by the BOM, of one [kg] ± this.
    volume, com
        of one: all its parts [m^3], and their centre of mass in its own axes [m]; None if its occurrences
        differ or the file does not say where they are.
    agrees
        its parts sum up to this mass, or got theirs from it.
    doubtful
        the mass can be read two ways, or nothing in its volume weighs that much, or the row may be another's.
    """

    name: str
    part_number: str
    paths: tuple[str, ...]
    mass: float
    quantum: float
    agrees: bool
    line: int
    doubtful: bool = False
    volume: float | None = None
    com: tuple[float, float, float] | None = None


@dataclass(frozen=True, eq=False)
class LinkResult:
    """One link: its mass properties in its frame, its parts, and what is wrong with its tensor."""

    name: str
    props: MassProps
    frame: LinkFrame
    parts: tuple[PartResult, ...] = ()
    problems: tuple[TensorProblem, ...] = ()


@dataclass(frozen=True)
class Cause:
    """All warnings of one code, the one with the largest effect first.

    mass
        by how much [kg] the sum may be wrong.
    effect
        the larger of that and of its moment about the centre of mass, each as a share of the whole's.
    """

    code: str
    mass: float
    warnings: tuple[PartWarning, ...]
    effect: float = 0.0


@dataclass(repr=False)
class InertiaReport:
    """What a calculation found. Filled once, in a stable order: links as mapped, parts as placed.

    link_properties
        link → the spec's plain values, in the link's frame.
    links
        link → everything about it.
    unclaimed
        parts that no link has; not in any link's mass.
    sub_assemblies
        those that the BOM gives a mass.
    total
        the whole assembly in its own frame, unclaimed parts included; None before a calculation.
    reconciliation
        the BOM's sum beside the sum that was counted; None without a BOM.
    assembly, source, bom
        name and file of the geometry, file of the BOM ("" without one).
    """

    link_properties: dict[str, InertialProperties] = field(default_factory=dict)
    warnings: list[PartWarning] = field(default_factory=list)
    links: dict[str, LinkResult] = field(default_factory=dict)
    unclaimed: tuple[PartResult, ...] = ()
    sub_assemblies: tuple[SubAssemblyResult, ...] = ()
    total: MassProps | None = None
    assembly: str = ""
    source: str = ""
    bom: str = ""
    default_density: float = 1000.0
    reconciliation: Reconciliation | None = None
    _told: set[PartWarning] = field(default_factory=set, init=False, repr=False, compare=False)

    def add_warning(
        self, link_name: str, part_name: str, message: str, code: str = NO_CODE, kg: float | None = None
    ) -> None:
        """Add a warning; equal warnings are kept once."""
        warning = PartWarning(link_name, part_name, message, code, kg)
        if warning not in self._told:
            self._told.add(warning)
            self.warnings.append(warning)

    def causes(self) -> list[Cause]:
        """Group the warnings by code; the cause with the largest effect on mass or moment comes first.

        Rows without geometry that weigh a twentieth of the robot come before all others.
        """
        masses: dict[tuple[str, str], float] = defaultdict(float)
        reaches: dict[tuple[str, str], float] = defaultdict(float)
        for link in self.links.values():
            masses[link.name, ""] = link.props.mass
        for name, part in self.parts():
            masses[name, part.name] += part.total_mass
            reaches[name, part.name] = max(reaches[name, part.name], part.reach)
        whole, gyration = self._size()

        def at_stake(warning: PartWarning) -> float:
            mass = masses.get((warning.link_name, warning.part_name), 0.0)
            return mass if warning.kg is None else warning.kg

        def effect(warning: PartWarning) -> float:
            reach = reaches.get((warning.link_name, warning.part_name), 0.0)
            return at_stake(warning) / whole * max(1.0, reach / gyration)

        groups: dict[str, list[PartWarning]] = defaultdict(list)
        for warning in sorted(self.warnings, key=lambda warning: -effect(warning)):
            groups[str(warning.code)].append(warning)
        causes = []
        for code, warnings in groups.items():
            worst: dict[tuple[str, str], PartWarning] = {}
            for warning in warnings:  # the largest effect of a place comes first
                worst.setdefault((warning.link_name, warning.part_name), warning)
            mass = sum(map(at_stake, worst.values()))
            causes.append(Cause(code, mass, tuple(warnings), sum(map(effect, worst.values()))))

        def rank(cause: Cause) -> tuple[bool, float]:
            missing = cause.code == MassCode.ROW_UNUSED and cause.mass >= HEAVY * whole
            return (not (missing and cause.mass > 0), -cause.effect)

        return sorted(causes, key=rank)

    def _size(self) -> tuple[float, float]:
        """Return the mass [kg] and the radius of gyration [m] of the whole; 1 for what is not known."""
        if self.total is None or not self.total.mass > 0:
            return 1.0, 1.0
        radius = math.sqrt(max(float(self.total.inertia.trace()), 0.0) / 2 / self.total.mass)
        return self.total.mass, radius or 1.0

    def get_summary(self) -> str:
        """Write all warnings, link by link: first the parts whose mass is missing, in the spec's words."""
        if not self.warnings:
            return "No warnings - all parts have mass properties."
        missing = [warning for warning in self.warnings if warning.code in MISSING_MASS and warning.part_name]
        others = [warning for warning in self.warnings if warning not in missing]
        parts = len({(warning.link_name, warning.part_name) for warning in missing})
        lines = []
        if missing:
            lines += [f"⚠️  {counted(parts, 'part')} with missing mass properties:", *_by_link(missing)]
        if others:
            start = (
                f"\n{counted(len(others), 'other warning')}"
                if missing
                else f"⚠️  {counted(len(others), 'warning')}"
            )
            lines += [f"{start}:", *_by_link(others)]
        return "\n".join(lines)

    def print_summary(self) -> None:
        """Send the summary to the log: as a warning if there are any."""
        if self.warnings:
            logger.warning(self.get_summary())
        else:
            logger.info(self.get_summary())

    @property
    def bodies(self) -> dict[str, MassProps]:
        """Return link → mass properties in the link's frame, as numpy arrays that can be added and moved."""
        return {name: link.props for name, link in self.links.items()}

    def __repr__(self) -> str:
        mass = f", {self.total.mass:.6g} kg" if self.total is not None else ""
        words = f"{counted(len(self.links), 'link')}{mass}, {counted(len(self.warnings), 'warning')}"
        return f"InertiaReport({self.assembly!r}: {words})"

    def parts(self) -> tuple[tuple[str, PartResult], ...]:
        """Return (link, part) for all parts: those of links first, then the unclaimed ones under ""."""
        rows = [(link.name, part) for link in self.links.values() for part in link.parts]
        return (*rows, *(("", part) for part in self.unclaimed))


def _by_link(warnings: Iterable[PartWarning]) -> Iterator[str]:
    """Write the warnings below their links."""
    groups: dict[str, list[PartWarning]] = {}
    for warning in warnings:
        groups.setdefault(warning.link_name, []).append(warning)
    for link, of_link in groups.items():
        yield f"\n  {link or 'whole assembly'}:"
        for warning in of_link:
            name = f"{warning.part_name}: " if warning.part_name else ""
            yield f"    - {name}{warning.message}"
