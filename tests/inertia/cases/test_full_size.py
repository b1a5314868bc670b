# SPDX-License-Identifier: LGPL-2.1-or-later
"""Case 20 of inertia-facts §9 at its full size, and case 18 from file to mass."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from step_writer import trsf_of

from silo.inertia.notes import GeometryCode
from silo.inertia.rigid import combine_arrays

Fixture = Callable[..., Any]
PARTS, KINDS, MODULES, EACH = 20, 4, 100, 100
TURN = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])


@pytest.mark.slow
def test_case_20_ten_thousand_instances_of_twenty_parts(
    step: Fixture, tmp_path: Path, pipeline: Fixture, codes: Fixture
) -> None:
    """Mass, centre and tensor of 10 000 placed boxes in 100 sub-assemblies of 4 kinds, against closed forms.

    Half of the parts have a mass in the BOM, half a material; each row's quantity is 500. Speed is measured
    in benchmarks/.
    """
    document = step()
    top = document.assembly("rig")
    sizes = np.array([[1 + k, 2 + k, 3 + k] for k in range(PARTS)], float)
    parts = [document.part(BRepPrimAPI_MakeBox(*sizes[k]).Shape(), f"part {k:02}") for k in range(PARTS)]
    which, centres, turned, modules = [], [], [], []
    for kind in range(KINDS):
        modules.append(document.assembly(f"module {kind}"))
        for n in range(EACH):
            at = np.array([40.0 * n, 7 * kind, (n * kind) % 13])
            document.place(modules[kind], parts[n % PARTS], trsf_of(at, TURN if kind % 2 else None), f"p{n}")
    for m in range(MODULES):
        kind, outer = m % KINDS, TURN.T if m % 3 else np.eye(3)
        document.place(top, modules[kind], trsf_of((0, 0, 50 * m), outer), f"module {m}")
        turn = outer @ (TURN if kind % 2 else np.eye(3))
        for n in range(EACH):
            at = outer @ [40.0 * n, 7 * kind, (n * kind) % 13] + [0, 0, 50 * m]
            which.append(n % PARTS)
            centres.append(turn @ (sizes[n % PARTS] / 2) + at)
            turned.append(turn)
    volumes = sizes.prod(axis=1) * 1e-9
    rows = [f"500,,{8e6 * volumes[k]:.6f} g,part {k:02}" for k in range(PARTS // 2)]
    rows += [f"500,aluminum,,part {k:02}" for k in range(PARTS // 2, PARTS)]
    bom = "Quantity,Material,Mass,Name\n" + "\n".join(rows) + "\n"
    report = pipeline(document.write(tmp_path / "rig.step"), bom)

    each = np.where(np.arange(PARTS) < PARTS // 2, 8000, 2700) * volumes
    square = (sizes * 1e-3) ** 2
    moments = each[:, None] * (square.sum(axis=1)[:, None] - square) / 12
    turns = np.array(turned)
    tensors = turns @ (np.eye(3) * moments[which][:, :, None]) @ turns.transpose(0, 2, 1)
    wanted = combine_arrays(each[which], np.array(centres) * 1e-3, tensors)

    assert sum(part.quantity for _, part in report.parts()) == 10_000
    assert len(report.links) == MODULES
    assert report.total.mass == pytest.approx(wanted.mass, rel=1e-9)
    np.testing.assert_allclose(report.total.com, wanted.com, rtol=1e-9)
    np.testing.assert_allclose(report.total.inertia, wanted.inertia, atol=1e-9 * wanted.inertia.max())
    assert codes(report) == []


@pytest.mark.parametrize(
    ("stated", "size"), [("SI_UNIT(.KILO.,.METRE.)", "1e+04 m"), ("SI_UNIT(.MICRO.,.METRE.)", "1e-05 m")]
)
def test_case_18_a_unit_that_cannot_be_meant_is_reported(
    step: Fixture, tmp_path: Path, pipeline: Fixture, codes: Fixture, stated: str, size: str
) -> None:
    """A bracket of 10 mm in a file that says kilometres weighs a mountain: asked, and the size is named."""
    document = step()
    document.part(BRepPrimAPI_MakeBox(10, 10, 10).Shape(), "cube")
    path = document.write(tmp_path / "cube.step")
    text = path.read_text("ascii")
    assert "SI_UNIT(.MILLI.,.METRE.)" in text
    path.write_text(text.replace("SI_UNIT(.MILLI.,.METRE.)", stated), "ascii")
    report = pipeline(path, "Name,Material,Mass\ncube,steel,\n")
    assert codes(report) == [GeometryCode.UNITS]
    assert f"measures {size}: was another unit meant?" in report.warnings[0].message


def test_case_18_a_file_without_a_unit_is_reported(
    step: Fixture, tmp_path: Path, pipeline: Fixture, codes: Fixture
) -> None:
    """The kernel takes it for mm in silence."""
    document = step()
    document.part(BRepPrimAPI_MakeBox(10, 10, 10).Shape(), "cube")
    path = document.write(tmp_path / "cube.step")
    context = re.compile(r"GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\(#\d+,")
    path.write_text(context.sub("GLOBAL_UNIT_ASSIGNED_CONTEXT((", path.read_text("ascii")), "ascii")
    report = pipeline(path, "Name,Material,Mass\ncube,steel,\n")
    assert report.total.mass == pytest.approx(7850e-6)
    assert codes(report) == [GeometryCode.UNITS]


@pytest.mark.parametrize(("unit", "metres"), [("M", 1.0), ("INCH", 0.0254), ("MM", 1e-3)])
def test_case_18_the_unit_of_the_file_is_the_unit_of_the_mass(
    step: Fixture, tmp_path: Path, pipeline: Fixture, codes: Fixture, unit: str, metres: float
) -> None:
    """A cube with an edge of one unit, of steel: 7850 kg in a file in metres, 7.85 mg in one in mm."""
    document = step()
    document.part(BRepPrimAPI_MakeBox(*[metres * 1e3] * 3).Shape(), "cube")
    report = pipeline(document.write(tmp_path / "cube.step", unit), "Name,Material,Mass\ncube,steel,\n")
    assert report.total.mass == pytest.approx(7850 * metres**3, rel=1e-9)
    assert report.total.com == pytest.approx([metres / 2] * 3, rel=1e-9)
    assert codes(report) == []
