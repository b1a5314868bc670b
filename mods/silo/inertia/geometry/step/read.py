# SPDX-License-Identifier: LGPL-2.1-or-later
"""STEP files: products, instances, placements, and every prototype measured once."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from silo.bom.errors import DocumentError, InputError
from silo.inertia.geometry.checks import coincident_problems, implausible_size, name_problems, scaled_problems
from silo.inertia.geometry.graph import unfold
from silo.inertia.geometry.helpers import Helpers
from silo.inertia.geometry.kernel.brep import measure_all
from silo.inertia.geometry.measured import no_solid
from silo.inertia.geometry.options import Reading, ReadOptions, Report
from silo.inertia.geometry.step.checks import against_stated, lost_stretches, split_problems, stated_totals
from silo.inertia.geometry.step.prepare import Prepared
from silo.inertia.geometry.step.siblings import Siblings
from silo.inertia.geometry.step.xcaf import StepFile, load
from silo.inertia.model import Assembly, GeometryCode, GeometryProblem, Prototype


def read_step(
    path: Path,
    options: ReadOptions,
    report: Report,
    helpers: Helpers | None = None,
    text: Callable[[], Prepared] | None = None,
) -> Reading:
    """The assembly of a STEP file, with what belongs to it from beside it. Raises DocumentError.

    text
        gives what was found in the file's text, where that was begun already.
    """
    helpers = helpers or Helpers()
    report("reading", 0, 0)
    step = load(path, max_instances=options.max_instances, text=text() if text is not None else None)
    siblings = Siblings(step, options, helpers, lambda name: report(f"reading {name}", 0, 0))
    siblings.resolve()
    try:
        unfolded = unfold(step.nodes, step.roots, options.max_instances)
    except InputError as error:
        raise DocumentError(str(path), str(error)) from error
    placed = list(dict.fromkeys(instance.prototype for instance in unfolded.instances))
    unmeasured = [key for key in placed if key not in step.measured]
    found = measure_all(
        [step.shapes.get(key, []) for key in unmeasured],
        options=options,
        helpers=helpers,
        done=lambda number, total: report("measuring", number, total),
    )
    step.measured.update(zip(unmeasured, found, strict=True))
    prototypes = {key: _prototype(step, key, siblings.problems.get(key)) for key in placed}
    problems = [*split_problems(siblings), *stated_totals(step, prototypes)]
    problems += [*lost_stretches(step), *scaled_problems(unfolded.instances)]
    problems += coincident_problems(unfolded.instances)
    problems += implausible_size(prototypes, step.unit or "mm")
    if not step.unit and any(prototype.volume_m3 for prototype in prototypes.values()):
        words = "the file states no unit of length that is understood; it was read as mm"
        problems.append(GeometryProblem(GeometryCode.UNITS, words))
    single = len(step.roots) == 1
    assembly = Assembly(
        name=step.nodes[step.roots[0].product].name if single else path.stem,
        prototypes=prototypes,
        instances=tuple(unfolded.instances),
        problems=tuple(problems),
        source=str(path),
        unit=step.unit,
        frames=unfolded.frames,
    )
    return Reading(assembly, tuple(siblings.used), tuple(siblings.missing), kept=step.kept)


def _prototype(step: StepFile, key: str, known: GeometryProblem | None) -> Prototype:
    node, facts, stated = step.nodes[key], step.facts[key], step.stated[key]
    measured = step.measured[key]
    volume, com, inertia = measured.total
    problems = list(measured.problems)
    if not measured.solids:
        problems.append(known or no_solid(measured))
    elif not node.children:
        problems += against_stated(volume, com, stated)
    if facts.density_problem:
        problems.append(GeometryProblem(GeometryCode.UNITS, facts.density_problem))
    problems += name_problems(node.name, key in step.unnamed)
    return Prototype(
        key=key,
        name=node.name,
        solids=measured.solids,
        volume_m3=volume,
        com_m=com,
        inertia_unit=inertia,
        has_solid=bool(measured.solids),
        problems=tuple(problems),
        step_density=facts.density,
        step_material=facts.material,
        stated_volume_m3=stated.volume_m3,
        part_number=facts.part_number or None,
        mesh=measured.mesh,
    )
