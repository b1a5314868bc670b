# SPDX-License-Identifier: LGPL-2.1-or-later
"""The BOM's sum beside the sum that was counted, and what the warnings are about by effect."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from silo.inertia.assembly import Assembly, Instance, Prototype
from silo.inertia.bom.table import BOMEntry, BomTable
from silo.inertia.calculation import calculate
from silo.inertia.codes import MassCode
from silo.inertia.geometry.together import Mesh
from silo.inertia.notes import GeometryCode
from silo.inertia.output.json import report_data
from silo.inertia.output.markdown import report_markdown
from silo.inertia.reconciliation import bom_total
from silo.inertia.report import InertiaReport

CM3 = 1e-6


def _cube(name: str, volume: float, at: float = 0.0) -> tuple[Prototype, Instance]:
    side = volume ** (1 / 3)
    prototype = Prototype(name, name, volume, np.zeros(3), np.eye(3) * volume * side**2 / 6)
    place = np.eye(4)
    place[0, 3] = at
    return prototype, Instance((name,), (name,), name, place)


def _assembly(*parts: tuple[Prototype, Instance]) -> Assembly:
    return Assembly("robot", {p.key: p for p, _ in parts}, tuple(instance for _, instance in parts))


def _row(name: str, kg: float | None, line: int, **more: Any) -> BOMEntry:
    return BOMEntry(
        name, more.pop("material", None), kg, quantity=more.pop("quantity", 1.0), line=line, **more
    )


def _report(parts: Sequence[tuple[Prototype, Instance]], *rows: BOMEntry) -> InertiaReport:
    return calculate(_assembly(*parts), BomTable(tuple(rows)))


def test_a_row_without_geometry_is_in_the_sum_and_comes_first() -> None:
    report = _report(
        [_cube("plate", 100 * CM3), _cube("cube", 10 * CM3, 0.1)],
        _row("plate", 0.27, 2),
        _row("cube", 0.03, 3),
        _row("glue", 0.02, 4, quantity=2.0),
    )
    found = report.reconciliation
    assert found is not None
    assert (found.bom, found.counted) == (pytest.approx(0.34), pytest.approx(0.30))
    assert found.sentence == (
        "BOM total 0.34 kg · counted 0.3 kg · not counted 0.04 kg: glue (0.04 kg, no part, BOM line 4)"
    )
    assert report.causes()[0].code == MassCode.ROW_UNUSED
    assert report.causes()[0].mass == pytest.approx(0.04)
    assert found.sentence in report_markdown(report).replace("\\", "")
    assert report_data(report)["reconciliation"]["not_counted"][0]["mass"] == pytest.approx(0.04)


def test_pieces_that_the_geometry_lacks_or_has_more_of() -> None:
    bolt, one = _cube("bolt", CM3)
    two = Instance(("bolt#2",), ("bolt",), "bolt", np.diag([1.0, 1.0, 1.0, 1.0]) + np.eye(4, k=3))
    lack = _report([(bolt, one)], _row("bolt", 0.008, 2, quantity=3.0)).reconciliation
    more = _report([(bolt, one), (bolt, two)], _row("bolt", 0.008, 2)).reconciliation
    assert lack is not None
    assert more is not None
    assert (lack.missing_kg, lack.double_kg) == (pytest.approx(0.016), 0)
    assert (more.missing_kg, more.double_kg) == (0, pytest.approx(0.008))


def test_the_sums_and_their_differences_agree() -> None:
    bolt, one = _cube("bolt", CM3)
    rows = (
        _row("bolt", 0.008, 2, quantity=3.0),
        _row("tape", 0.1, 3),
        _row("plate", None, 4, material="steel"),
    )
    found = _report([(bolt, one), _cube("plate", CM3, 0.1)], *rows).reconciliation
    assert found is not None
    assert found.bom is not None
    assert found.bom - found.missing_kg + found.double_kg + found.estimated == pytest.approx(found.counted)
    assert "0.00785 kg of it by densities" in found.sentence


def test_a_part_that_stands_twice_at_one_place_is_double() -> None:
    bolt, one = _cube("bolt", CM3)
    again = Instance(("bolt#2",), ("bolt",), "bolt", np.eye(4))
    for quantity in (1.0, 2.0):
        found = _report(
            [(bolt, one), (bolt, again)], _row("bolt", 0.008, 2, quantity=quantity)
        ).reconciliation
        assert found is not None
        assert found.double_kg == pytest.approx(0.008)


def test_the_total_of_a_tree_takes_each_mass_once() -> None:
    rows = (
        _row("arm", 1.0, 2, has_children=True),
        _row("motor", 0.4, 3, parent=0, quantity=2.0),
        _row("case", 0.1, 4, parent=0),
        _row("base", 2.0, 5, has_children=True, overridden=True),
        _row("plate", 0.5, 6, parent=3),
        _row("leg", None, 7, has_children=True, quantity=4.0),
        _row("foot", 0.25, 8, parent=5, quantity=2.0),
        _row("screen", 0.3, 9, has_children=True),
        _row("glass", 0.1, 10, parent=7),
        _row("film", None, 11, parent=7),
    )
    # 0.9 of the arm's rows, 2 as weighed, four legs of two feet, and the screen's own: its rows have gaps.
    assert bom_total(BomTable(rows)) == pytest.approx(0.9 + 2.0 + 2.0 + 0.3)


def test_warnings_are_ordered_by_what_they_may_change() -> None:
    """A heavy part whose mass is rounded by 3 % comes after a light one that nothing is known of."""
    report = _report(
        [_cube("frame", 1000 * CM3), _cube("box", 300 * CM3, 0.1)],
        _row("frame", 2.7, 2, quantum_kg=0.081),
        _row("nothing", None, 3),
    )
    codes = [cause.code for cause in report.causes()]
    assert codes.index(MassCode.NOT_IN_BOM) < codes.index(MassCode.ROUNDED)
    rounded = next(cause for cause in report.causes() if cause.code == MassCode.ROUNDED)
    assert rounded.mass == pytest.approx(0.081)


def test_a_part_far_out_counts_by_its_moment() -> None:
    near, far = _cube("near", 30 * CM3, 0.01), _cube("far", 25 * CM3, 1.0)
    report = _report(
        [_cube("frame", 1000 * CM3), near, far],
        _row("frame", 2.7, 2),
        _row("near", 0.03, 3, material="wood"),
        _row("far", 0.025, 4, quantum_kg=0.012),
    )
    effects = {cause.code: cause.effect for cause in report.causes()}
    assert effects[MassCode.ROUNDED] > 0.012 / 2.755


@pytest.mark.parametrize(("factor", "word"), [(10.0, "centimetres"), (25.4, "inches"), (0.1, "centimetres")])
def test_a_unit_that_all_masses_speak_against_is_named_once(factor: float, word: str) -> None:
    size = factor**-3
    report = _report(
        [_cube("plate", 100 * CM3 * size), _cube("cube", 10 * CM3 * size, 0.1)],
        _row("plate", 0.27, 2, material="Aluminum"),
        _row("cube", 0.0785, 3, material="Steel"),
    )
    (warning,) = [w for w in report.warnings if w.code == GeometryCode.UNITS]
    assert word in warning.message


def test_bare_masses_tell_the_unit_too() -> None:
    report = _report(
        [_cube("plate", 0.1 * CM3), _cube("cube", 0.001 * CM3, 0.1)],
        _row("plate", 0.27, 2),
        _row("cube", 0.003, 3),
    )
    assert any(w.code == GeometryCode.UNITS and "centimetres" in w.message for w in report.warnings)


def test_names_of_screws_tell_the_unit_without_any_mass() -> None:
    parts = []
    for name, length in (("M8x20", 0.028 / 25.4), ("ISO 4762 M5 x 16", 0.021 / 25.4)):
        prototype, instance = _cube(name, 1e-10)
        corners = np.array([[0.0, 0, 0], [length, 0, 0], [0, length / 3, 0], [0, 0, length / 3]])
        mesh = Mesh(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
        parts.append((Prototype(prototype.key, name, 1e-10, mesh=mesh), instance))
    report = calculate(_assembly(*parts), None)
    assert any(w.code == GeometryCode.UNITS and "inches" in w.message for w in report.warnings)


def test_healthy_masses_raise_no_doubt_of_the_unit() -> None:
    report = _report(
        [_cube("plate", 100 * CM3), _cube("foam", 1000 * CM3, 0.1)],
        _row("plate", 0.27, 2),
        _row("foam", 0.03, 3),
    )
    assert not [w for w in report.warnings if w.code == GeometryCode.UNITS]
