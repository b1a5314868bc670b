# SPDX-License-Identifier: LGPL-2.1-or-later
"""Masses of all instances: a decision per product, then one mass per instance, then the sub-assembly rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from silo.inertia.codes import MassCode, Source
from silo.inertia.core import Floats, place, rigid_mask
from silo.inertia.doubts import TOTAL_BY_OTHERS, Note, looks_like_totals
from silo.inertia.groups import Groups, Occurrence
from silo.inertia.massrule import Decision, MassRule
from silo.inertia.matching import Matching
from silo.inertia.model import Assembly, GeometryCode
from silo.inertia.products import companions


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
    groups = tuple(Groups(instances, volume, mass, decisions, counted, rule).apply(matching.groups))
    return Placed(volume, com, unit, mass, decisions, counted, groups)


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
    """Where the masses that can be checked are row totals, those that cannot are doubtful as well."""
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
