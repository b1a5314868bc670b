# SPDX-License-Identifier: LGPL-2.1-or-later
"""From the walk over FreeCAD objects to an assembly, whoever measures the shapes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from silo.bom.errors import DocumentError
from silo.inertia.geometry import checks
from silo.inertia.geometry.freecad.walk import Leaf, Walk
from silo.inertia.geometry.graph import Child, unfold
from silo.inertia.geometry.measured import Measured
from silo.inertia.geometry.options import ReadOptions, Report
from silo.inertia.model import Assembly, GeometryCode, GeometryProblem, Prototype

Measure = Callable[[Sequence[Leaf], Callable[[int, int], Any]], Sequence[Measured | str]]
"""Measures products, or says why the shapes of one cannot be had; calls back with (number, of how many)."""


def assembled(
    walk: Walk, top: str, source: str, options: ReadOptions, measure: Measure, report: Report
) -> Assembly:
    """The assembly that the walk found below the product ``top``. InputError where it does not end."""
    name = walk.nodes[top].name
    unfolded = unfold(walk.nodes, [Child(name, top)], options.max_instances)
    keys = unfolded.placed
    found = measure(
        [walk.leaves[key] for key in keys], lambda number, total: report("measuring", number, total)
    )
    prototypes = {key: _prototype(walk, key, one) for key, one in zip(keys, found, strict=True)}
    problems = [GeometryProblem(code, message) for code, listed in walk.notes.items() for message in listed]
    return checks.assembled(unfolded, prototypes, problems, name=name, source=source, unit="mm")


def one_by_one(measure: Callable[[Leaf], Measured]) -> Measure:
    """One product after the other; ``measure`` raises DocumentError where the shapes cannot be had."""

    def measured(leaves: Sequence[Leaf], done: Callable[[int, int], Any]) -> list[Measured | str]:
        found: list[Measured | str] = []
        for number, leaf in enumerate(leaves, start=1):
            done(number, len(leaves))
            try:
                found.append(measure(leaf))
            except DocumentError as error:
                found.append(error.reason)
        return found

    return measured


def _prototype(walk: Walk, key: str, found: Measured | str) -> Prototype:
    leaf = walk.leaves[key]
    measured = Measured((), (), None, False) if isinstance(found, str) else found
    broken = leaf.broken or (found if isinstance(found, str) else "")
    stated = leaf.material
    return measured.prototype(
        key,
        walk.nodes[key].name,
        *([GeometryProblem("material", stated.problem)] if stated.problem else []),
        empty=GeometryProblem(GeometryCode.NO_GEOMETRY, broken) if broken else None,
        step_density=stated.density,
        step_material=stated.name,
    )
