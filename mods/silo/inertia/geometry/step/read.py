# SPDX-License-Identifier: LGPL-2.1-or-later
"""STEP files: products, instances, placements, and every prototype measured once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from silo.bom.errors import counted, listed
from silo.inertia.geometry.graph import Reading, ReadOptions, Report, bottom_up, unfold
from silo.inertia.geometry.helpers import Helpers
from silo.inertia.geometry.kernel.solids import measure_all
from silo.inertia.geometry.measured import assembled, implausible_size
from silo.inertia.geometry.step.text import Prepared
from silo.inertia.geometry.step.xcaf import Siblings, Stated, StepFile, load
from silo.inertia.geometry.together import Floats, combined
from silo.inertia.model import GeometryCode, Note, Prototype


def read_step(
    path: Path,
    options: ReadOptions,
    report: Report,
    helpers: Helpers,
    text: Callable[[], Prepared] | None = None,
) -> Reading:
    """Return the assembly of a STEP file, with what belongs to it from beside it. Raises DocumentError.

    text
        gives what was found in the file's text, if that was begun already.
    """
    report("reading", 0, 0)
    step = load(path, max_instances=options.max_instances, text=text() if text is not None else None)
    siblings = Siblings(step, options, helpers, lambda name: report(f"reading {name}", 0, 0))
    siblings.resolve()
    unfolded = unfold(step.nodes, step.roots, options.max_instances)
    unmeasured = [key for key in unfolded.placed if key not in step.measured]
    found = measure_all(
        [step.shapes.get(key, []) for key in unmeasured],
        options=options,
        helpers=helpers,
        done=lambda number, total: report("measuring", number, total),
    )
    step.measured.update(zip(unmeasured, found, strict=True))
    prototypes = {key: _prototype(step, key, siblings.problems.get(key)) for key in unfolded.placed}
    problems = [*step.said, *split_problems(siblings), *stated_totals(step, prototypes)]
    problems += implausible_size(prototypes, step.unit or "mm")
    problems += unitless(step, prototypes)
    name = step.nodes[step.roots[0].product].name if len(step.roots) == 1 else path.stem
    assembly = assembled(unfolded, prototypes, problems, name=name, source=str(path), unit=step.unit)
    return Reading(assembly, tuple(siblings.used), tuple(siblings.missing), kept=step.kept)


def unitless(step: StepFile, prototypes: Mapping[str, Prototype]) -> Iterator[Note]:
    """Report products whose lengths have no unit: the kernel takes mm, or, in an assembly, reads nothing."""
    for read, what in (
        (True, "mm are taken"),
        (False, "their bodies cannot be read; export them with a unit"),
    ):
        found = [
            f"“{step.nodes[key].name}”"
            for key, prototype in prototypes.items()
            if bool(prototype.volume_m3) is read
            and ((read and not step.unit) or (step.facts[key].bodies and not step.facts[key].unit_mm))
        ]
        if found:
            words = (
                f"the file states no unit of length that is understood for {listed(found, 4)}; without one, "
            )
            yield Note(GeometryCode.UNITS, words + what)


def _prototype(step: StepFile, key: str, known: Note | None) -> Prototype:
    node, facts, stated, measured = step.nodes[key], step.facts[key], step.stated[key], step.measured[key]
    problems = list(step.problems.get(key, ()))
    if any(problem.code == GeometryCode.BODY_MISSING for problem in problems):  # the surfaces left are of it
        said = tuple(p for p in measured.problems if p.code != GeometryCode.BODY_MISSING)
        measured = replace(measured, problems=said)
    if measured.solids and not node.children:
        whole = combined(measured.solids)
        problems += against_stated(whole.volume_m3, whole.com_m, stated)
    if facts.density_problem:
        problems.append(Note(GeometryCode.UNITS, facts.density_problem))
    if key in step.unnamed:
        words = f"it has no name in the file; called '{node.name}' after what holds it"
        problems.append(Note(GeometryCode.NAME, words))
    return measured.prototype(
        key,
        node.name,
        *problems,
        empty=known,
        step_density=facts.density,
        step_material=facts.material,
        stated_volume_m3=stated.volume_m3,
        part_number=facts.part_number or None,
    )


STATED_TOLERANCE = 1e-3
"""Files state volumes from their own integrations, 2.6e-5 off in one published by the format's authors."""


def against_stated(volume: float, com: Floats, stated: Stated) -> list[Note]:
    """Compare a part's volume [m^3] and centre (3,) [m] with the validation properties that the file
    gives.
    """
    problems = []
    if stated.volume_m3 is not None and abs(volume - stated.volume_m3) > STATED_TOLERANCE * volume:
        problems.append(
            Note(
                GeometryCode.STATED_VOLUME,
                f"the file states a volume of {stated.volume_m3:.6g} m3, the geometry has {volume:.6g} m3 "
                f"({volume / stated.volume_m3 - 1:+.2%})"
                if stated.volume_m3
                else f"the file states no volume, the geometry has {volume:.6g} m3",
            )
        )
    if stated.centroid_m is not None:
        distance = float(np.linalg.norm(com - np.array(stated.centroid_m)))
        if distance > STATED_TOLERANCE * max(volume, 0.0) ** (1 / 3):
            problems.append(
                Note(
                    GeometryCode.STATED_CENTROID,
                    f"the file states a centre of volume {distance * 1e3:.4g} mm away from the geometry's",
                )
            )
    return problems


def split_problems(siblings: Siblings) -> list[Note]:
    """Report which files a split assembly was completed from, and which it lacks."""
    problems = []
    if siblings.used:
        names = listed([path.name for path in siblings.used])
        problems.append(
            Note(
                GeometryCode.EXTERNAL_FILE,
                f"a split assembly: geometry read from {counted(len(siblings.used), 'file')} beside it "
                f"({names})",
            )
        )
    if siblings.missing:
        names = ", ".join(sorted(set(siblings.missing))[:5])
        problems.append(
            Note(
                GeometryCode.NO_GEOMETRY,
                f"{counted(len(siblings.missing), 'product')} without geometry, here or beside the file "
                f"({names}); put their files into its folder, or export the assembly as one file",
            )
        )
    return problems


def stated_totals(step: StepFile, prototypes: Mapping[str, Prototype]) -> list[Note]:
    """Report assemblies whose stated volume is not what their content adds up to."""
    if not any(stated.volume_m3 for stated in step.stated.values()):
        return []
    volumes: dict[str, float] = {}
    problems = []
    for root in step.roots:
        for key in bottom_up(step.nodes, root.product):
            node, stated = step.nodes[key], step.stated[key].volume_m3
            own = prototypes[key].volume_m3 if key in prototypes else 0.0
            volumes[key] = own + sum(
                volumes[c.product] * abs(float(np.linalg.det(c.transform[:3, :3]))) for c in node.children
            )
            if node.children and stated and abs(volumes[key] / stated - 1) > STATED_TOLERANCE:
                problems.append(
                    Note(
                        GeometryCode.STATED_VOLUME,
                        f"the file states {stated:.6g} m3 for the assembly '{node.name}', "
                        f"its parts add up to {volumes[key]:.6g} m3",
                    )
                )
    return problems
