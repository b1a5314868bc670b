# SPDX-License-Identifier: LGPL-2.1-or-later
"""Masses inside FreeCAD: its own shapes, placements and materials give what our reader of files gives."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from freecad_cases import machines
from freecad_cases.machines import MOSTLY_ENDS, REPOSITORY, WANTED, FreeCAD
from public_projects import ASSEMBLIES

from silo.bom.errors import InputError
from silo.inertia.assembly import Assembly
from silo.inertia.geometry import ReadOptions, read
from silo.inertia.geometry.stored import load
from silo.inertia.notes import GeometryCode

pytestmark = [pytest.mark.freecad, pytest.mark.slow]

PLACES = REPOSITORY / "tests" / "inertia" / "geometry" / "freecad" / "freecad_shapes.py"
MATERIALS = Path(__file__).with_name("shape_cases") / "materials.py"
MEASURE = MATERIALS.with_name("measure.py")
# Resolved, for FreeCAD names a file that a link leads to by its own place.

VOLUME = 1e-7
"""Relative: how well both engines agree on real parts whose edges meet."""

TENSOR = 1e-4
"""Relative: the kernel's own tensors are no better on threads, at the tolerance that is its default here."""


@pytest.fixture(name="freecad", params=WANTED)
def _freecad(request: pytest.FixtureRequest) -> FreeCAD:
    return machines.need(request.param)


@pytest.fixture(name="in_freecad")
def _in_freecad(freecad: FreeCAD, tmp_path: Path) -> Callable[[Path], Assembly]:
    """``in_freecad(path)``: read by this FreeCAD, in a profile of its own; InputError if it fails."""
    env = freecad.profile(tmp_path / "profile")

    def reading(path: Path) -> Assembly:
        out = tmp_path / "measured.npz"
        job = {"SILO_MODS": str(REPOSITORY / "mods"), "SILO_TOP": str(path), "SILO_OUT": str(out)}
        done = freecad.run(MEASURE, {**env, **job}, cwd=tmp_path, timeout_s=900)
        if not out.exists():
            raise InputError(done.stdout)
        return load(out)[0]

    return reading


@pytest.fixture(name="built")
def _built(freecad: FreeCAD, tmp_path: Path) -> Callable[[Path], Path]:
    """``built(script)``: the folder into which a script wrote inside this FreeCAD."""

    def run(script: Path) -> Path:
        out = tmp_path / "out"
        out.mkdir()
        freecad.must_run(
            script, {"SILO_OUT": str(out), **freecad.profile(tmp_path / "builder")}, cwd=tmp_path
        )
        return out

    return run


def same(one: Assembly, two: Assembly) -> None:
    """The same products at the same places with the same mass properties and the same remarks."""
    assert [(i.path, i.product_path, i.prototype) for i in one.instances] == [
        (i.path, i.product_path, i.prototype) for i in two.instances
    ]
    for a, b in zip(one.instances, two.instances, strict=True):
        np.testing.assert_allclose(a.transform, b.transform, atol=1e-9)
    assert {(p.code, p.message) for p in one.problems} == {(p.code, p.message) for p in two.problems}
    for key, ours in two.prototypes.items():
        live = one.prototypes[key]
        assert live.volume_m3 == pytest.approx(ours.volume_m3, rel=VOLUME), key
        size = max(ours.volume_m3, 1e-30) ** (1 / 3)
        np.testing.assert_allclose(live.com_m, ours.com_m, atol=1e-5 * size, err_msg=key)
        scale = np.abs(ours.inertia_unit).max()
        np.testing.assert_allclose(live.inertia_unit, ours.inertia_unit, atol=TENSOR * scale, err_msg=key)
        assert live.has_solid == ours.has_solid
        assert {p.code for p in live.problems} == {p.code for p in ours.problems}, key


def test_every_way_of_placing(built: Callable[[Path], Path], in_freecad: Callable[[Path], Assembly]) -> None:
    """Links, chains, arrays, groups, mirrors, scales, sub-objects, sub-assemblies, rigid and flexible."""
    path = built(PLACES) / "top.FCStd"
    same(in_freecad(path), read(path, options=ReadOptions(cache=False)))


def test_shapes_and_materials(built: Callable[[Path], Path], in_freecad: Callable[[Path], Assembly]) -> None:
    """Every kind of surface, a void, an inside-out solid, surfaces, curves, bodies that are none; every way
    to state a material.
    """
    out = built(MATERIALS)
    told = json.loads((out / "told.json").read_text())
    by_name = {p.name: p for p in in_freecad(out / "parts.FCStd").prototypes.values()}
    ours = read(out / "parts.FCStd", options=ReadOptions(cache=False))
    for prototype in ours.prototypes.values():
        live, codes = by_name[prototype.name], {p.code for p in prototype.problems}
        if prototype.name != "OnShape":  # its density is in FreeCAD's library, which may not be here
            assert {p.code for p in live.problems} == codes - {GeometryCode.NOT_CONVERGENT}, live.name
        if GeometryCode.NOT_CONVERGENT not in codes:
            assert live.volume_m3 == pytest.approx(prototype.volume_m3, rel=VOLUME), live.name
    assert by_name["Splines"].volume_m3 == pytest.approx(told["splines"] * 1e-9, rel=1e-8)
    assert not by_name["Star"].problems
    densities = {name: (p.step_material, p.step_density) for name, p in by_name.items()}
    assert densities["Linked"] == ("Steel", 7900.0)
    assert densities["OtherUnit"][1] == pytest.approx(8500)
    assert densities["NoDensity"] == ("Goo", None)
    assert densities["Feather"][1] is None, "1 kg/m³ is nobody's density"
    assert densities["Untouched"] == (None, None)
    assert densities["OnShape"][1] == told["density"]
    assert GeometryCode.NEGATIVE_VOLUME in {p.code for p in by_name["InsideOut"].problems}
    assert by_name["InsideOut"].volume_m3 == pytest.approx(60e-9)
    assert [p.code for p in by_name["Sheet"].problems] == [GeometryCode.NO_SOLID]
    missing = {n for n, p in by_name.items() if GeometryCode.BODY_MISSING in {w.code for w in p.problems}}
    assert missing == {"Lidless", "LooseFaces", "Emptied"}
    assert by_name["ClosedFaces"].volume_m3 == pytest.approx((729 + 512) * 1e-9)


# Tops whose parts are measured in seconds; FreeCAD 0.20 loses the assemblies of the last one.
TOPS = {
    "asm4-examples/Asm4_Example1/asm_tuto1.FCStd": WANTED,
    "asm4-examples/Asm4_Example3/asm_Hypnotic.fcstd": WANTED,
    "asm4-examples/Asm4_Example2/asm_V4.FCStd": WANTED,
    "dingo-batterytray/SubAssemblies/BatteryTray/BatteryTrayAssembly.FCStd": ("1.0", "1.1"),
}


@pytest.mark.parametrize("freecad", MOSTLY_ENDS, indirect=True)
@pytest.mark.parametrize("top", TOPS)
def test_public_assemblies(top: str, freecad: FreeCAD, in_freecad: Callable[[Path], Assembly]) -> None:
    """Real parts: the same masses from FreeCAD's objects as from the files."""
    path = ASSEMBLIES / top
    if not path.exists():
        pytest.skip(f"{path} is not there")
    if freecad.short not in TOPS[top]:
        with pytest.raises(InputError, match="too old to load its assemblies"):
            in_freecad(path)
        return
    same(in_freecad(path), read(path))
