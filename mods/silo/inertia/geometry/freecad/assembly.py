# SPDX-License-Identifier: LGPL-2.1-or-later
"""From the walk over FreeCAD objects to an assembly, whoever measures the shapes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from silo.bom.errors import DocumentError, InputError
from silo.inertia.geometry.checks import coincident_problems, name_problems, scaled_problems
from silo.inertia.geometry.freecad.walk import Leaf, Walk
from silo.inertia.geometry.graph import Child, unfold
from silo.inertia.geometry.measured import Measured, no_solid
from silo.inertia.geometry.options import ReadOptions, Report
from silo.inertia.model import Assembly, GeometryCode, GeometryProblem, Prototype

Measure = Callable[[Sequence[Leaf], Callable[[int, int], Any]], Sequence[Measured | str]]
"""Measures products, or says why the shapes of one cannot be had; calls back with (number, of how many)."""


def assembled(
    walk: Walk, top: str, source: str, options: ReadOptions, measure: Measure, report: Report
) -> Assembly:
    """The assembly that the walk found below the product ``top``. Raises DocumentError for ``source``."""
    node = walk.nodes[top]
    try:
        unfolded = unfold(walk.nodes, [Child(node.name, top)], options.max_instances)
    except InputError as error:
        raise DocumentError(source, str(error)) from error
    used = list(dict.fromkeys(instance.prototype for instance in unfolded.instances))
    found = measure(
        [walk.leaves[key] for key in used], lambda number, total: report("measuring", number, total)
    )
    prototypes = {key: _prototype(walk, key, one) for key, one in zip(used, found, strict=True)}
    problems = [GeometryProblem(code, message) for code, listed in walk.notes.items() for message in listed]
    problems += scaled_problems(unfolded.instances)
    problems += coincident_problems(unfolded.instances)
    return Assembly(
        name=node.name,
        prototypes=prototypes,
        instances=tuple(unfolded.instances),
        problems=tuple(problems),
        source=source,
        unit="mm",
        frames=unfolded.frames,
    )


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
    node, leaf = walk.nodes[key], walk.leaves[key]
    problems = name_problems(node.name, unnamed=False)
    measured = Measured((), (), None, False) if isinstance(found, str) else found
    if isinstance(found, str):
        problems.append(GeometryProblem(GeometryCode.NO_GEOMETRY, found))
    problems += measured.problems
    if leaf.broken:
        problems.append(GeometryProblem(GeometryCode.NO_GEOMETRY, leaf.broken))
    elif not measured.solids:
        problems.append(no_solid(measured))
    if leaf.material.problem:
        problems.append(GeometryProblem("material", leaf.material.problem))
    volume, com, inertia = measured.total
    return Prototype(
        key=key,
        name=node.name,
        solids=measured.solids,
        volume_m3=volume,
        com_m=com,
        inertia_unit=inertia,
        has_solid=bool(measured.solids),
        problems=tuple(problems),
        step_density=leaf.material.density,
        step_material=leaf.material.name,
        mesh=measured.mesh,
    )
