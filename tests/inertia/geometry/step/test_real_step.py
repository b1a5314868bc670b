# SPDX-License-Identifier: LGPL-2.1-or-later
"""The public STEP files (inertia-facts §9, cases 3, 6, 8 and 11): what they hold, to the digit they state."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from silo.inertia.assembly import Assembly
from silo.inertia.notes import GeometryCode
from silo.inertia.placements import place
from silo.inertia.rigid import MassProps, combine_arrays


def volumes(assembly: Assembly) -> dict[str, float]:
    """Product name → volume of one [m^3]."""
    return {p.name: p.volume_m3 for p in assembly.prototypes.values()}


def whole(assembly: Assembly) -> MassProps:
    """Everything as one body of density 1."""
    used = [assembly.prototypes[i.prototype] for i in assembly.instances]
    placed = place(
        [p.volume_m3 for p in used],
        [p.com_m for p in used],
        [p.inertia_unit for p in used],
        [i.transform for i in assembly.instances],
    )
    return combine_arrays(*placed)


def test_as1_has_eighteen_instances_of_five_parts(real: Any, codes_of: Any) -> None:
    """Nested three deep, shared sub-assemblies; the rod is πr²h, which the default integration misses."""
    assembly = real("as1-oc-214.stp")
    assert (len(assembly.instances), len(assembly.prototypes)) == (18, 5)
    assert volumes(assembly)["rod"] * 1e9 == pytest.approx(np.pi * 25 * 200, rel=1e-7)
    assert assembly.instances[3].name == "l-bracket-assembly_1/nut-bolt-assembly_1/bolt_1"
    assert codes_of(assembly) == []
    assert all(p.problems == () for p in assembly.prototypes.values())


def test_dm1_agrees_with_the_volumes_that_it_states(real: Any, codes_of: Any) -> None:
    """B-splines in inches. The assembly within 1e-6, and its bracket; bolt and nut state 2.4e-6 and 1.1e-6.

    Both are converged (the same to 1e-8 at a tolerance of 1e-12): the statements are off, by their authors'
    own integration. The default integration that all peers use is off by 6e-3 on the bolt.
    """
    assembly = real("dm1-id-214.stp")
    assert assembly.unit == "inch"
    stated_whole = 1.0915987569404586e-4
    assert whole(assembly).mass == pytest.approx(stated_whole, rel=1e-6)
    for prototype in assembly.prototypes.values():
        tolerance = 1e-6 if prototype.name == "l-bracket" else 2.6e-6
        assert prototype.volume_m3 == pytest.approx(prototype.stated_volume_m3, rel=tolerance)
        assert codes_of(prototype) == []


def test_dm1_densities_are_read_in_pounds_per_cubic_inch(real: Any) -> None:
    """Hung on raw materials, without a material name property: the kernel drops them."""
    by_name = {p.name: p for p in real("dm1-id-214.stp").prototypes.values()}
    assert {n: p.step_material for n, p in by_name.items()} == {
        "l-bracket": "Titanium 6-4",
        "bolt": "Greek Ascoloy",
        "nut": "Inconel 718",
    }
    densities = {n: p.step_density for n, p in by_name.items()}
    assert densities == pytest.approx({"l-bracket": 4432.4, "bolt": 7895.3, "nut": 8227.7}, rel=1e-4)


def test_an_empty_product_and_a_body_of_the_assembly_itself(real: Any, codes_of: Any) -> None:
    """SO-101 wrist: an empty product with a material, and an unnamed solid that belongs to the assembly."""
    assembly = real("so101_wrist_roll_pitch.step")
    by_name = {p.name: p for p in assembly.prototypes.values()}
    body, holder = by_name["Wrist_Roll_Pitch_SO101 v2"], by_name["Wiring_holder v1"]
    assert body.volume_m3 * 1e9 == pytest.approx(32312.7, rel=1e-5)
    assert body.step_density is None
    assert not holder.has_solid
    assert codes_of(holder) == [GeometryCode.NO_GEOMETRY]
    assert (holder.step_material, holder.step_density) == ("ABS Plastic", pytest.approx(1060.0))


def test_fusion_densities_are_read(real: Any) -> None:
    """Fusion 360 writes material and density in kg/m3."""
    (part,) = real("so101_base.step").prototypes.values()
    assert (part.step_material, part.step_density) == ("ABS Plastic", pytest.approx(1060.0))


def test_a_bearing_has_sixteen_products_and_fourteen_of_one_name(real: Any) -> None:
    """Names are not unique: fourteen different products "Ball", each placed once."""
    assembly = real("asm4_bearing.stp")
    names = [p.name for p in assembly.prototypes.values()]
    assert (len(names), names.count("Ball")) == (16, 14)
    assert len({i.path for i in assembly.instances}) == 16
    # The balls lie on a ring about the x axis: they balance.
    np.testing.assert_allclose(whole(assembly).com, [0.0045, 0, 0], atol=1e-7)


@pytest.mark.parametrize(
    ("name", "volume_mm3", "unit"),
    [
        ("io1-cm-214.stp", 78234.4, "mm"),
        ("mayo_cube.step", 1000.0, "mm"),
        ("odri_foot.step", 3172.32, "mm"),
        ("odri_motor.step", 413.399, "mm"),
        ("trimesh_featuretype.step", 190447.66, "inch"),
    ],
)
def test_single_parts(name: str, volume_mm3: float, unit: str, real: Any, codes_of: Any) -> None:
    """One product, one solid, nothing to say of it."""
    assembly = real(name)
    (part,) = assembly.prototypes.values()
    assert part.volume_m3 * 1e9 == pytest.approx(volume_mm3, rel=1e-5)
    assert assembly.unit == unit
    assert codes_of(part) == []
