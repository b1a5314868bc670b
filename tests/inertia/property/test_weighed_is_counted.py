# SPDX-License-Identifier: LGPL-2.1-or-later
"""The law over random BOM trees with stars, shares and gaps: what was weighed is what is counted.

The oracle walks the tree once, from the top, and knows no code of the product: a star is kept unless all
parts below it were weighed themselves.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import pytest

from silo.inertia.assembly import Assembly, Instance, Prototype
from silo.inertia.bom.table import BOMEntry, BomTable
from silo.inertia.calculation import calculate
from silo.inertia.codes import MassCode, Source
from silo.inertia.report import InertiaReport

VOLUME = 1e-5


@dataclass
class Branch:
    """A part, or a sub-assembly with what is in it. ``star``: a scale said ``kg``."""

    name: str
    kg: float | None = None
    star: bool = False
    material: str | None = None
    inside: list[Branch] = field(default_factory=list)

    def parts(self) -> Iterator[Branch]:
        """Yield the leaves."""
        if not self.inside:
            yield self
        for branch in self.inside:
            yield from branch.parts()

    def all_weighed(self) -> bool:
        """Return True if a scale said the mass of each part, alone or with others."""
        return self.star or (bool(self.inside) and all(branch.all_weighed() for branch in self.inside))

    def stars_below(self) -> float:
        """Return the mass that scales said of what is below."""
        if self.star:
            return self.kg or 0.0
        return sum(branch.stars_below() for branch in self.inside)


def grown(rnd: random.Random, depth: int = 0, prefix: str = "n") -> Branch:
    """Grow a branch: rows with masses, with stars, with materials, and with nothing."""
    branch = Branch(prefix)
    if depth < 3 and (depth == 0 or rnd.random() < 0.55):
        branch.inside = [grown(rnd, depth + 1, f"{prefix}{letter}") for letter in "abc"[: rnd.randint(1, 3)]]
    kind = rnd.random()
    count = len(list(branch.parts()))
    if kind < 0.3:
        # Heavier than all that scales say of what is below.
        branch.kg = round(rnd.uniform(0.5, 0.9) * count + sum(b.stars_below() for b in branch.inside), 6)
        branch.star = True
    elif kind < 0.5:
        branch.kg = round(rnd.uniform(0.03, 0.09) * count, 6)
    elif kind < 0.75 and not branch.inside:
        branch.material = "steel"
    return branch


def weighed(tree: Branch) -> InertiaReport:
    """Calculate with each part once, where the tree has it."""
    rows: list[BOMEntry] = []
    instances: list[Instance] = []
    prototypes: dict[str, Prototype] = {}

    def add(branch: Branch, path: tuple[str, ...], parent: int | None) -> None:
        here = (*path, branch.name)
        number = len(rows)
        rows.append(
            BOMEntry(
                branch.name,
                branch.material,
                branch.kg,
                quantity=1.0,
                overridden=branch.star,
                parent=parent,
                level=len(here),
                has_children=bool(branch.inside),
                line=number + 2,
            )
        )
        for inner in branch.inside:
            add(inner, here, number)
        if not branch.inside:
            side = VOLUME ** (1 / 3)
            prototypes[branch.name] = Prototype(
                branch.name, branch.name, VOLUME, np.zeros(3), np.eye(3) * VOLUME * side**2 / 6
            )
            place = np.eye(4)
            place[0, 3] = len(instances) * 0.1
            instances.append(Instance(here, here, branch.name, place))

    for branch in tree.inside:
        add(branch, (), None)
    return calculate(Assembly("robot", prototypes, tuple(instances)), BomTable(tuple(rows)))


def every(branch: Branch) -> Iterator[Branch]:
    yield branch
    for inner in branch.inside:
        yield from every(inner)


@pytest.mark.parametrize("seed", range(150))
def test_what_was_weighed_is_what_is_counted(seed: int) -> None:
    tree = grown(random.Random(seed))
    report = weighed(tree)
    counted = {part.name: 0.0 for _, part in report.parts()}
    for _, part in report.parts():
        counted[part.name] += part.total_mass
    assert report.total is not None
    assert report.total.mass == pytest.approx(sum(counted.values()))
    doubted = [w.message for w in report.warnings if w.code == MassCode.SUB_ASSEMBLY]
    differing = {message.split("“")[1].split("”")[0] for message in doubted}
    for branch in every(tree):
        if branch is tree or not branch.star or branch.kg is None:
            continue
        total = sum(counted[part.name] for part in branch.parts())
        if branch.inside and all(inner.all_weighed() for inner in branch.inside):
            said = total == pytest.approx(branch.kg, rel=1e-6) or branch.name in differing
            assert said, f"{branch.name}: {total} kg counted, {branch.kg} kg weighed, and no word of it"
        else:
            assert total == pytest.approx(branch.kg, rel=1e-9), branch.name


@pytest.mark.parametrize("seed", range(150, 250))
def test_a_gap_beside_data_gets_the_rest_and_none_of_it_vanishes(seed: int) -> None:
    rnd = random.Random(seed)
    kilograms = [round(rnd.uniform(0.01, 0.2), 6) for _ in range(rnd.randint(1, 4))]
    parts = [Branch(f"p{number}", kg) for number, kg in enumerate(kilograms)]
    gaps = [Branch(f"g{number}") for number in range(rnd.randint(1, 3))]
    rest = rnd.choice([1e-6, 0.001, 0.05, 0.4])
    motor = Branch("motor", round(sum(kilograms) + rest, 9), rnd.random() < 0.5, inside=[*parts, *gaps])
    report = weighed(Branch("top", inside=[motor]))
    assert report.total is not None
    assert report.total.mass == pytest.approx(motor.kg, rel=1e-9)
    shared = [part for _, part in report.parts() if part.name.startswith("g")]
    assert sum(part.total_mass for part in shared) == pytest.approx(rest, rel=1e-3)
    assert {part.source for part in shared} == {Source.SUB_ASSEMBLY_MASS}
