# SPDX-License-Identifier: LGPL-2.1-or-later
"""Masses of all instances: decisions per product, sub-assembly rows, then one mass per instance.

Sub-assembly rows never add mass to that of their parts. They are used where the parts themselves have no
data (a bought motor that is one row of the BOM and twelve parts of the STEP file), else only compared.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from silo.inertia.codes import MassCode, Rule, Source
from silo.inertia.core import Floats, place, rigid_mask
from silo.inertia.massrule import MISMATCH_LIMIT, Decision, MassRule, Note
from silo.inertia.matching import Match, Matching
from silo.inertia.model import Assembly, GeometryCode, Instance
from silo.inertia.products import companions


@dataclass(frozen=True, eq=False)
class Placed:
    """Every instance in the assembly's frame.

    volume (N,) [m^3]; com (N, 3) [m]; unit (N, 3, 3) [m^5]; mass (N,) [kg]
    decisions
        one per instance; instances of one product share theirs.
    counted
        (N,) bool; False for wires and surfaces that merely stand beside a solid of the same product.
    """

    volume: Floats
    com: Floats
    unit: Floats
    mass: Floats
    decisions: Sequence[Decision]
    counted: NDArray[np.bool_]

    def inertia(self, index: NDArray[np.intp]) -> Floats:
        """(n, 3, 3) [kg m^2] of some instances, about their own centres of mass."""
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
    _apply_groups(_Groups(instances, volume, mass, decisions, counted), matching.groups, rule)
    return Placed(volume, com, unit, mass, decisions, counted)


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


@dataclass(eq=False)
class _Groups:
    """The arrays that sub-assembly rows may still change."""

    instances: Sequence[Instance]
    volume: Floats
    mass: Floats
    decisions: list[Decision]
    counted: NDArray[np.bool_]

    def occurrences(self, names: Mapping[str, Match]) -> Iterator[tuple[Match, list[int]]]:
        """Each placed sub-assembly that has a row, deepest first, with its instances."""
        if not names:
            return
        below: dict[tuple[str, ...], list[int]] = defaultdict(list)
        product: dict[tuple[str, ...], str] = {}
        for index, instance in enumerate(self.instances):
            if not self.counted[index]:
                continue
            for depth in range(1, len(instance.product_path)):
                name = instance.product_path[depth - 1]
                if name in names:
                    below[instance.path[:depth]].append(index)
                    product[instance.path[:depth]] = name
        for path in sorted(below, key=len, reverse=True):
            yield names[product[path]], below[path]


def _apply_groups(groups: _Groups, matches: Mapping[str, Match], rule: MassRule) -> None:
    shared: dict[tuple[Match, Decision], Decision] = {}
    for match, below in groups.occurrences(matches):
        row = match.row
        informed = [i for i in below if groups.decisions[i].informed or _is_shared(groups.decisions[i])]
        if row.mass_kg is not None and not informed:
            _share(groups, match, below, row.mass_kg, shared)
        elif row.mass_kg is not None:
            _compare(groups, match, below, informed)
        elif not row.has_children:
            _cover(groups, match, below, rule, shared)


def _share(
    groups: _Groups, match: Match, below: list[int], mass: float, made: dict[tuple[Match, Decision], Decision]
) -> None:
    """Spread a sub-assembly's mass over its parts by volume (or evenly, where none has a volume)."""
    row = match.row
    weights = groups.volume[below]
    if weights.sum() <= 0:
        weights = np.ones(len(below))
    groups.mass[below] = mass * weights / weights.sum()
    for index in below:
        note = Note(
            MassCode.SUB_ASSEMBLY_SHARED,
            f"the BOM has no data for it, but {mass:.6g} kg for “{row.name}” around it; "
            "that mass was spread over its parts by volume",
        )
        old = groups.decisions[index]
        groups.decisions[index] = _once(
            made,
            (match, old),
            replace(
                old,
                source=Source.SUB_ASSEMBLY_MASS,
                rule=Rule.SUB_ASSEMBLY,
                decided=match.decided,
                density=None,
                density_source="",
                quantum_kg=row.quantum_kg,
                lines=tuple(r.line for r in match.bundle.rows),
                notes=(*_doubt(match), note),
            ),
        )


def _compare(groups: _Groups, match: Match, below: list[int], informed: list[int]) -> None:
    row = match.row
    total = float(groups.mass[below].sum())
    stated = row.mass_kg or 0.0
    if abs(total - stated) <= max(row.quantum_kg, MISMATCH_LIMIT * stated):
        return
    first = informed[0]
    note = Note(
        MassCode.SUB_ASSEMBLY,
        f"the parts of “{row.name}” sum up to {total:.6g} kg, its own row says {stated:.6g} kg; "
        "the parts were used",
    )
    old = groups.decisions[first]
    if note in old.notes:
        return
    new = replace(old, notes=(*old.notes, note))
    groups.decisions[:] = [new if decision is old else decision for decision in groups.decisions]


def _cover(
    groups: _Groups,
    match: Match,
    below: list[int],
    rule: MassRule,
    made: dict[tuple[Match, Decision], Decision],
) -> None:
    """A row without children stands for the parts that the BOM does not have themselves."""
    row = match.row
    density = rule.density_of(row.material)
    for index in below:
        old = groups.decisions[index]
        if old.rule is not Rule.NONE:
            continue
        groups.decisions[index] = _once(
            made,
            (match, old),
            _covered(old, match, density, rule.options.default_density),
        )
        groups.mass[index] = (groups.decisions[index].density or 0.0) * groups.volume[index]


def _covered(old: Decision, match: Match, density: float | None, default: float) -> Decision:
    row = match.row
    base = replace(
        old,
        rule=Rule.SUB_ASSEMBLY,
        decided=match.decided,
        lines=tuple(r.line for r in match.bundle.rows),
        material=row.material,
        notes=_doubt(match),
    )
    if row.material is None:
        note = Note(
            MassCode.NO_MASS_NO_MATERIAL,
            f"No mass or material assigned to “{row.name}” around it: counted as 0 kg",
        )
        return replace(base, source=Source.ZERO, density=0.0, density_source="", notes=(*base.notes, note))
    if density is None:
        note = Note(
            MassCode.UNKNOWN_MATERIAL,
            f"Unknown material '{row.material}' of “{row.name}” around it; "
            f"the default density ({default:g} kg/m³) was used",
        )
        return replace(
            base,
            source=Source.DEFAULT_DENSITY,
            density=default,
            density_source="default",
            notes=(*base.notes, note),
        )
    return replace(base, source=Source.MATERIAL, density=density, density_source=f"material of “{row.name}”")


def _doubt(match: Match) -> tuple[Note, ...]:
    return (Note(MassCode.AMBIGUOUS, match.doubt),) if match.doubt else ()


def _is_shared(decision: Decision) -> bool:
    return decision.source is Source.SUB_ASSEMBLY_MASS


def _once(
    made: dict[tuple[Match, Decision], Decision], key: tuple[Match, Decision], decision: Decision
) -> Decision:
    """One decision per (row, product): instances of one product stay one part in the report."""
    return made.setdefault(key, decision)
