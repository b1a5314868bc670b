# SPDX-License-Identifier: LGPL-2.1-or-later
"""Flat assemblies of thousands are read through groups, and nobody sees them (case 20 on one level)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from step_writer import StepDocument, trsf_of

from silo.inertia.geometry.part21 import WANTED, read_products, scan
from silo.inertia.geometry.step_text import GROUP_FROM, GROUP_SIZE, MARK, regrouped

COUNT = GROUP_FROM + 7


@pytest.fixture(name="flat", scope="module")
def _flat(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """COUNT uses of two parts on one level, the n-th at x = n mm, each second one turned."""
    document = StepDocument()
    top = document.assembly("board")
    parts = [document.part(BRepPrimAPI_MakeBox(1, 2, 3).Shape(), name) for name in ("R", "C")]
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    for n in range(COUNT):
        turn = quarter if n % 2 else np.eye(3)
        document.place(top, parts[n % 2], trsf_of((n, 0, 0), turn), f"X{n}")
    return document.write(tmp_path_factory.mktemp("flat") / "board.step")


def test_a_flat_assembly_is_read_as_it_is_written(flat: Path, read_in: Any) -> None:
    """All instances in order, at their places, below the top; no group in any path, no frame of one."""
    assembly = read_in(flat)
    assert [i.path for i in assembly.instances] == [(f"X{n}",) for n in range(COUNT)]
    assert [i.product_path for i in assembly.instances[:2]] == [("R",), ("C",)]
    x = np.array([i.transform[0, 3] for i in assembly.instances])
    np.testing.assert_allclose(x, np.arange(COUNT) * 1e-3, atol=1e-12)
    np.testing.assert_allclose(assembly.instances[1].transform[:2, :2], [[0, -1], [1, 0]], atol=1e-12)
    assert assembly.frames == {}
    assert sorted(p.name for p in assembly.prototypes.values()) == ["C", "R"]
    assert assembly.problems == ()


def test_the_text_gets_groups_and_nothing_else_changes(flat: Path) -> None:
    """Uses keep their numbers, names and placements; the groups hold all of them."""
    data = flat.read_bytes()
    text = scan(data, WANTED)
    before = read_products(text)
    changed, added = regrouped(text, before)
    assert changed is not None
    after = read_products(scan(changed, WANTED))
    assert after.count == before.count + added
    assert {n: pd for n, pd in after.by_ordinal.items() if n <= before.count} == before.by_ordinal
    groups = {pd for pd, facts in after.facts.items() if facts.name.startswith(MARK)}
    assert len(groups) == -(-COUNT // GROUP_SIZE)
    top = next(pd for pd, facts in after.facts.items() if facts.name == "board")
    assert sum(assembly in groups for assembly, _ in after.uses) == COUNT
    assert sum(assembly == top for assembly, _ in after.uses) == len(groups)
    assert {f.name for f in before.facts.values()} == {
        f.name for pd, f in after.facts.items() if pd not in groups
    }


def test_small_assemblies_and_odd_structures_are_left_alone(flat: Path, box: Any, step_part: Any) -> None:
    """No need, or a placement that cannot be found: the kernel gets the file as it is."""
    small = scan(step_part(box(1, 1, 1)).read_bytes(), WANTED)
    assert regrouped(small, read_products(small)) == (None, 0)
    placement, other = b"CONTEXT_DEPENDENT_SHAPE_REPRESENTATION", b"SOME_OTHER_REPRESENTATION"
    odd = scan(flat.read_bytes().replace(placement, other, 1), WANTED)
    assert regrouped(odd, read_products(odd)) == (None, 0)
