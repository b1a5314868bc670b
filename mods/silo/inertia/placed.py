# SPDX-License-Identifier: LGPL-2.1-or-later
"""Masses of all instances: a decision per product, then one mass per instance, then sub-assembly rows. Pure.

Rows of sub-assemblies never add mass to that of their parts. A row's mass is used if its parts have no
data of their own: a bought motor is one row of the BOM and twelve parts of the STEP file. Where they have,
the two are compared. A row without children stands for all below it, so that what its mass leaves after the
parts that are listed elsewhere belongs to the others.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from silo.inertia.codes import MassCode, Rule, Source
from silo.inertia.core import Floats, place, rigid_mask
from silo.inertia.masses import (
    MISMATCH_LIMIT,
    TOTAL_BY_OTHERS,
    Decision,
    GivenMass,
    MassRule,
    implausible,
    looks_like_totals,
    two_ways,
)
from silo.inertia.matching import Match, Matching
from silo.inertia.model import Assembly, GeometryCode, Note, companions


@dataclass(frozen=True)
class Occurrence:
    """A placed sub-assembly whose row gives a mass.

    path, below
        its instance path, and the indices of all parts in it.
    agrees
        the parts' masses sum up to it, or were taken from it.
    implausible
        nothing that parts are made of gives this mass in their volume.
    """

    match: Match
    path: tuple[str, ...]
    below: tuple[int, ...]
    agrees: bool
    implausible: bool


@dataclass(eq=False)
class Groups:
    """The masses and decisions of all instances, while sub-assembly rows may still change them.

    ``mass`` and ``decisions`` are changed in place; instances that are not ``counted`` are left alone.
    """

    assembly: Assembly
    volume: Floats
    mass: Floats
    decisions: list[Decision]
    counted: NDArray[np.bool_]
    rule: MassRule
    _made: dict[tuple[Match, Decision, str], Decision] = field(default_factory=dict)

    def apply(self, matches: Mapping[str, Match]) -> Iterator[Occurrence]:
        """Use or compare every matched row, once per placed sub-assembly. ``matches``: by product name."""
        for match, path, below in self._occurrences(matches):
            row = match.row
            known = [i for i in below if _has_data(self.decisions[i])]
            gaps = [i for i in below if not _has_data(self.decisions[i])]
            if row.mass_kg is None:
                if not row.has_children:
                    self._cover(match, gaps)
                continue
            left = row.mass_kg - float(self.mass[known].sum())
            stands_for_all = not row.has_children and left > row.quantum_kg
            agrees = True
            if gaps and (not known or stands_for_all):
                self._share(match, gaps, left, partly=bool(known))
            elif known:
                agrees = self._compare(match, below, known[0])
            volume = float(self.volume[below].sum())
            odd = any(implausible(GivenMass(row.mass_kg, row.quantum_kg), volume))
            yield Occurrence(match, path, tuple(below), agrees, odd)

    def _occurrences(
        self, matches: Mapping[str, Match]
    ) -> Iterator[tuple[Match, tuple[str, ...], list[int]]]:
        """Yield each placed sub-assembly that has a row, deepest first, with its instances."""
        if not matches:
            return
        below: dict[tuple[str, ...], list[int]] = defaultdict(list)
        product: dict[tuple[str, ...], str] = {}
        for index, instance in enumerate(self.assembly.instances):
            if not self.counted[index]:
                continue
            for depth in range(1, len(instance.product_path)):
                name = instance.product_path[depth - 1]
                if name in matches:
                    below[instance.path[:depth]].append(index)
                    product[instance.path[:depth]] = name
        for path in sorted(below, key=len, reverse=True):
            yield matches[product[path]], path, below[path]

    def _share(self, match: Match, gaps: list[int], mass: float, *, partly: bool) -> None:
        """Spread a mass over parts without data by volume, or evenly if none has a volume."""
        row = match.row
        weights = self.volume[gaps]
        solid = bool(weights.sum() > 0)
        if not solid:
            weights = np.ones(len(gaps))
        self.mass[gaps] = mass * weights / weights.sum()
        what = f"{row.mass_kg:.6g} kg for “{row.name}” around it"
        if partly:
            what += f", of which its other parts leave {mass:.6g} kg"
        note = Note(
            MassCode.SUB_ASSEMBLY_SHARED,
            f"the BOM has no data for it, but {what}; that was spread "
            + ("by volume" if solid else "evenly, as points, since there is no solid"),
        )
        volume = float(self.volume[gaps].sum())
        doubts = tuple(implausible(GivenMass(mass, row.quantum_kg), volume)) if solid else ()
        for index in gaps:
            new = replace(
                self.decisions[index],
                rule=Rule.SUB_ASSEMBLY,
                decided=match.decided,
                lines=tuple(line.line for line in match.bundle.rows),
                source=Source.SUB_ASSEMBLY_MASS,
                mass_kg=None,
                density=None,
                density_source="",
                quantum_kg=row.quantum_kg,
                notes=(*_doubt(match), note, *doubts),
            )
            self._set(index, match, new)

    def _compare(self, match: Match, below: list[int], first: int) -> bool:
        row = match.row
        total = float(self.mass[below].sum())
        stated = row.mass_kg or 0.0
        if abs(total - stated) <= max(row.quantum_kg, MISMATCH_LIMIT * stated):
            return True
        note = Note(
            MassCode.SUB_ASSEMBLY,
            f"the parts of “{row.name}” sum up to {total:.6g} kg, its own row says {stated:.6g} kg; "
            "the parts were used",
        )
        old = self.decisions[first]
        if note not in old.notes:
            new = replace(old, notes=(*old.notes, note))
            self.decisions[:] = [new if decision is old else decision for decision in self.decisions]
        return False

    def _cover(self, match: Match, gaps: list[int]) -> None:
        """Let a row without children and mass stand for the parts that the BOM does not list."""
        for index in gaps:
            prototype = self.assembly.prototypes[self.assembly.instances[index].prototype]
            if self.decisions[index].rule is Rule.NONE:
                self._set(index, match, self.rule.decide_by_sub_assembly(prototype, match))
                self.mass[index] = (self.decisions[index].density or 0.0) * self.volume[index]

    def _set(self, index: int, match: Match, new: Decision) -> None:
        """Return one decision per (row, product): instances of one product stay one part in the report."""
        key = (match, self.decisions[index], self.assembly.instances[index].prototype)
        self.decisions[index] = self._made.setdefault(key, new)


def _has_data(decision: Decision) -> bool:
    return decision.informed or decision.source is Source.SUB_ASSEMBLY_MASS


def _doubt(match: Match) -> tuple[Note, ...]:
    return (*((Note(MassCode.AMBIGUOUS, match.doubt),) if match.doubt else ()), *two_ways(match.row))


@dataclass(frozen=True, eq=False)
class Placed:
    """Every instance in the assembly's frame.

    volume (N,) [m^3]; com (N, 3) [m]; unit (N, 3, 3) [m^5]; mass (N,) [kg]
    decisions
        one per instance; instances of one product share theirs.
    counted
        (N,) bool; False for wires and surfaces that merely stand beside a solid of the same product.
    groups
        placed sub-assemblies whose BOM row gives a mass.
    """

    volume: Floats
    com: Floats
    unit: Floats
    mass: Floats
    decisions: Sequence[Decision]
    counted: NDArray[np.bool_]
    groups: Sequence[Occurrence] = ()

    def inertia(self, index: NDArray[np.intp]) -> Floats:
        """Return (n, 3, 3) [kg m^2] of some instances, about their own centres of mass."""
        volume = self.volume[index]
        density = np.divide(self.mass[index], volume, out=np.zeros(len(index)), where=volume > 0)
        result: Floats = self.unit[index] * density[:, None, None]
        return result


def place_all(assembly: Assembly, rule: MassRule, matching: Matching) -> Placed:
    """Decide on every product once, then give every instance its mass."""
    instances = assembly.instances
    volume, com, unit = _geometry(assembly)
    beside = companions(assembly)
    counted = np.array([i.prototype not in beside for i in instances], bool)
    per_product = {
        key: rule.decide(prototype, matching.parts.get(key)) for key, prototype in assembly.prototypes.items()
    }
    _note_totals(per_product)
    _note_scaling(assembly, per_product)
    decisions = [per_product[i.prototype] for i in instances]
    mass = np.array(
        [
            decision.mass_kg if decision.mass_kg is not None else (decision.density or 0.0) * v
            for decision, v in zip(decisions, volume, strict=True)
        ],
        float,
    ).reshape(len(instances))
    mass[~counted] = 0.0
    groups = tuple(Groups(assembly, volume, mass, decisions, counted, rule).apply(matching.groups))
    return Placed(volume, com, unit, mass, decisions, counted, groups)


def weighed(placed: Placed, groups: Sequence[tuple[str, Sequence[int], float]]) -> tuple[Placed, list[Note]]:
    """Return the instances scaled so that each group weighs what a scale says; notes on what cannot be.

    groups
        (name, indices, kg), those inside of others first. What has a weight of its own already keeps it, and
        the rest of its group shares what is left: by its masses, by volume where it has none.
    """
    mass, decisions = placed.mass.copy(), list(placed.decisions)
    notes: list[Note] = []
    for name, indices, kg in groups:
        members = [index for index in indices if placed.counted[index]]
        rest = [index for index in members if decisions[index].source is not Source.TARGET_MASS]
        left = kg - float(mass[members].sum() - mass[rest].sum())
        weights = next((w for w in (mass[rest], placed.volume[rest]) if w.sum() > 0), np.ones(len(rest)))
        if not members or not (left > 0 if rest else abs(left) <= MISMATCH_LIMIT * kg):
            why = f"its weighed parts sum up to {kg - left:.6g} kg" if members else "nothing is called so"
            words = f"{name} shall weigh {kg:.6g} kg, but {why}: that was not used"
            notes.append(Note(MassCode.TARGET_DIFFERS, words))
            continue
        words = f"weighed: {name} is {kg:.6g} kg"
        mass[rest] = left * weights / weights.sum() if rest else []
        made: dict[Decision, Decision] = {}
        for index in rest:
            old = decisions[index]
            if old not in made:
                new = replace(old, source=Source.TARGET_MASS, mass_kg=None, density=None, quantum_kg=0.0)
                made[old] = replace(new, density_source=words)
            decisions[index] = made[old]
    return replace(placed, mass=mass, decisions=decisions), notes


def _geometry(assembly: Assembly) -> tuple[Floats, Floats, Floats]:
    keys = list(assembly.prototypes)
    at = {key: index for index, key in enumerate(keys)}
    which = np.array([at[i.prototype] for i in assembly.instances], int)
    prototypes = list(assembly.prototypes.values())
    volumes = np.array([p.volume_m3 for p in prototypes], float)[which]
    coms = np.array([p.com_m for p in prototypes], float).reshape(-1, 3)[which]
    units = np.array([p.inertia_unit for p in prototypes], float).reshape(-1, 3, 3)[which]
    placements = np.array([i.transform for i in assembly.instances], float).reshape(-1, 4, 4)
    return place(volumes, coms, units, placements)


def _note_totals(decisions: dict[str, Decision]) -> None:
    """Mark the masses that cannot be checked as doubtful if those that can be are row totals."""
    given = {key: decision for key, decision in decisions.items() if decision.source is Source.BOM_MASS}
    totals = {key: any(note.code == MassCode.ROW_TOTAL for note in d.notes) for key, d in given.items()}
    if not looks_like_totals((d.compared, d.pieces, totals[key]) for key, d in given.items()):
        return
    for key, decision in given.items():
        if not decision.compared and decision.pieces >= 2:
            decisions[key] = replace(decision, notes=(*decision.notes, TOTAL_BY_OTHERS))


def _note_scaling(assembly: Assembly, decisions: dict[str, Decision]) -> None:
    placements = np.array([i.transform for i in assembly.instances], float).reshape(-1, 4, 4)
    scaled = {assembly.instances[i].prototype for i in np.flatnonzero(~rigid_mask(placements))}
    for key in sorted(scaled):
        known = {problem.code for problem in assembly.prototypes[key].problems}
        if GeometryCode.SCALED in known:
            continue
        note = Note(
            GeometryCode.SCALED,
            "some of its placements scale the part; its volume and inertia were scaled with it, "
            "a BOM mass was not",
        )
        decisions[key] = replace(decisions[key], notes=(*decisions[key].notes, note))
