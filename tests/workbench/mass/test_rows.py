# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the mass window shows: the heaviest first, what is missing from the sum, numbers for a spreadsheet."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from bodies import box

from silo.inertia.assembly import Assembly, Instance, Prototype
from silo.inertia.calculation import calculate
from silo.inertia.links.link_map import Link, LinkMap
from silo.inertia.masses import Options
from silo.inertia.materials.table import load_materials
from silo.inertia.notes import Note
from silo.inertia.task import Task
from silo.workbench.mass.rows import MassView, mass_text, shown


def made(name: str, size: float, density: float | None, *problems: Note) -> Prototype:
    """A cube of ``size`` [m]."""
    cube = box(name, size, size, size)
    material = "Steel" if density else None
    return dataclasses.replace(
        cube, key=name, step_density=density, step_material=material, problems=problems
    )


def window(*parts: Prototype, counts: tuple[int, ...] = ()) -> MassView:
    """The window of an assembly with these parts, as often as ``counts`` says."""
    instances = []
    for part, count in zip(parts, counts or (1,) * len(parts), strict=True):
        for n in range(count):
            place = np.eye(4)
            place[0, 3] = n
            instances.append(Instance((f"{part.name}{n}",), (part.name,), part.key, place))
    assembly = Assembly("Machine", {p.key: p for p in parts}, tuple(instances))
    options = Options(step_density=True, unknown_is_zero=True)
    task = Task(load_materials(freecad=False), options, LinkMap((Link("Machine", ("**",)),)), simulated=False)
    return shown(calculate(assembly, None, task))


def test_the_heaviest_part_comes_first_and_pieces_are_counted() -> None:
    """By the mass of all pieces, not of one."""
    seen = window(made("big", 0.02, 8000), made("small", 0.01, 8000), counts=(1, 20))
    assert [(row.name, row.quantity) for row in seen.rows] == [("small", 20), ("big", 1)]
    assert seen.rows[0].total == pytest.approx(0.16)
    assert seen.summary.startswith("224 g in 21 pieces, centre of mass at ")
    assert seen.incomplete == ""


def test_what_has_no_material_is_missing_from_the_sum_and_said() -> None:
    """A zero is no mass; nobody is to take the sum for the whole."""
    seen = window(made("known", 0.01, 8000), made("unknown", 0.05, None))
    assert seen.incomplete == "1 part has no mass; it is missing from the sum."
    assert seen.rows[1].why == "no material with a density"
    assert seen.rows[1].doubtful
    assert seen.rows[1].cells()[2:4] == ("–", "–")


def test_without_any_material_there_is_no_sum() -> None:
    """A plain sentence instead of 0 kg."""
    assert window(made("a", 0.01, None)).summary == "No part of this assembly has a material with a density."


def test_doubts_about_a_shape_stand_in_its_row() -> None:
    """What the measuring noticed."""
    seen = window(made("bad", 0.01, 8000, Note("invalid_shape", "the shape is invalid")))
    assert seen.rows[0].why == "the shape is invalid"


def test_the_clipboard_has_plain_numbers() -> None:
    """kg and cm³ without units, whatever the window shows."""
    table = window(made("cube", 0.01, 8000)).table(("Part", "n", "one", "all", "cm³", "Material", "Remarks"))
    assert table.splitlines()[1].split("\t") == ["cube", "1", "0.008", "0.008", "1", "Steel (8000 kg/m³)", ""]


@pytest.mark.parametrize(
    ("mass", "text"), [(0.0, "–"), (0.0123456, "12.346 g"), (0.99, "990 g"), (12.3456789, "12.346 kg")]
)
def test_masses_have_a_unit_that_suits_them(mass: float, text: str) -> None:
    """Grams below a kilogram."""
    assert mass_text(mass) == text
