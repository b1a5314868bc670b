# SPDX-License-Identifier: LGPL-2.1-or-later
"""What STEP files say of materials and volumes, read with its unit and compared with the geometry."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from silo.inertia.notes import GeometryCode

UNITS = {
    "kg/m3": """
#9001=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.));
#9002=(MASS_UNIT()NAMED_UNIT(*)SI_UNIT(.KILO.,.GRAM.));""",
    "g/mm3": """
#9001=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#9002=(MASS_UNIT()NAMED_UNIT(*)SI_UNIT($,.GRAM.));""",
    "lb/in3": """
#9003=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.CENTI.,.METRE.));
#9004=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(2.54),#9003);
#9005=DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);
#9001=(CONVERSION_BASED_UNIT('INCH',#9004)LENGTH_UNIT()NAMED_UNIT(#9005));
#9006=(MASS_UNIT()NAMED_UNIT(*)SI_UNIT(.KILO.,.GRAM.));
#9007=MASS_MEASURE_WITH_UNIT(MASS_MEASURE(0.45359237),#9006);
#9008=DIMENSIONAL_EXPONENTS(0.,1.,0.,0.,0.,0.,0.);
#9002=(CONVERSION_BASED_UNIT('POUND',#9007)MASS_UNIT()NAMED_UNIT(#9008));""",
}


def with_density(path: Path, value: float, unit: str, name: str | None = "Steel") -> Path:
    """The file with a material on its only product, as Fusion 360 writes it."""
    text = path.read_text("ascii")
    product = re.search(r"#(\d+) = PRODUCT_DEFINITION\(", text)
    context = re.search(r"SHAPE_REPRESENTATION\('',\([^)]*\),#(\d+)\)", text)
    assert product is not None
    assert context is not None
    added = (
        UNITS[unit]
        + f"""
#9010=DERIVED_UNIT_ELEMENT(#9002,1.);
#9011=DERIVED_UNIT_ELEMENT(#9001,-3.);
#9012=DERIVED_UNIT((#9010,#9011));
#9013=MEASURE_REPRESENTATION_ITEM('density measure',POSITIVE_RATIO_MEASURE({value!r}),#9012);
#9014=REPRESENTATION('density',(#9013),#{context[1]});
#9015=PROPERTY_DEFINITION('material property','density of part',#{product[1]});
#9016=PROPERTY_DEFINITION_REPRESENTATION(#9015,#9014);
"""
    )
    if name is not None:
        added += f"""#9020=DESCRIPTIVE_REPRESENTATION_ITEM('{name}','{name}');
#9021=REPRESENTATION('material name',(#9020),#{context[1]});
#9022=PROPERTY_DEFINITION('material property','material name',#{product[1]});
#9023=PROPERTY_DEFINITION_REPRESENTATION(#9022,#9021);
"""
    path.write_text(text.replace("ENDSEC;\nEND-ISO", added + "ENDSEC;\nEND-ISO"), "ascii")
    return path


@pytest.mark.parametrize(
    ("value", "unit", "kg_m3"),
    [(7850.0, "kg/m3", 7850.0), (0.00785, "g/mm3", 7850.0), (0.2852, "lb/in3", 7894.24)],
)
def test_a_density_is_read_with_its_unit(
    value: float, unit: str, kg_m3: float, box: Any, step_part: Any, read_in: Any
) -> None:
    """Steel is 7850 kg/m3 in whatever unit the file gives it (the kernel's own reading says 0.00785)."""
    (part,) = read_in(with_density(step_part(box(1, 2, 3)), value, unit)).prototypes.values()
    assert part.step_density == pytest.approx(kg_m3, rel=1e-5)
    assert part.step_material == "Steel"


def test_a_density_without_a_material_name_is_read(box: Any, step_part: Any, read_in: Any) -> None:
    """The kernel drops such a density; the text has it."""
    path = with_density(step_part(box(1, 2, 3)), 2700.0, "kg/m3", name=None)
    (part,) = read_in(path).prototypes.values()
    assert part.step_density == pytest.approx(2700.0)
    assert part.step_material is None


def test_a_density_that_no_material_has_is_not_used(
    box: Any, step_part: Any, read_in: Any, codes_of: Any
) -> None:
    """7850 g/mm3 is a unit written wrong: refused, and said, instead of a part of 47 t."""
    (part,) = read_in(with_density(step_part(box(1, 2, 3)), 7850.0, "g/mm3")).prototypes.values()
    assert part.step_density is None
    assert codes_of(part) == [GeometryCode.UNITS]
    assert "7.85e+09 kg/m3" in part.problems[0].message


def stated(path: Path, volume_mm3: float, centroid: tuple[float, float, float]) -> Path:
    """The file with validation properties on its only product (CAx-IF recommended practice)."""
    text = path.read_text("ascii")
    shape = re.search(r"#(\d+) = PRODUCT_DEFINITION_SHAPE\(", text)
    context = re.search(r"SHAPE_REPRESENTATION\('',\([^)]*\),#(\d+)\)", text)
    length = re.search(r"#(\d+) = \( LENGTH_UNIT\(\)", text)
    assert shape is not None
    assert context is not None
    assert length is not None
    x, y, z = centroid
    added = f"""#9100=DERIVED_UNIT_ELEMENT(#{length[1]},3.);
#9101=DERIVED_UNIT((#9100));
#9102=MEASURE_REPRESENTATION_ITEM('volume measure',VOLUME_MEASURE({volume_mm3!r}),#9101);
#9103=REPRESENTATION('volume',(#9102),#{context[1]});
#9104=PROPERTY_DEFINITION('geometric validation property','volume',#{shape[1]});
#9105=PROPERTY_DEFINITION_REPRESENTATION(#9104,#9103);
#9110=CARTESIAN_POINT('centre point',({x!r},{y!r},{z!r}));
#9111=REPRESENTATION('centroid',(#9110),#{context[1]});
#9112=PROPERTY_DEFINITION('geometric validation property','centroid',#{shape[1]});
#9113=PROPERTY_DEFINITION_REPRESENTATION(#9112,#9111);
"""
    path.write_text(text.replace("ENDSEC;\nEND-ISO", added + "ENDSEC;\nEND-ISO"), "ascii")
    return path


def test_stated_volume_and_centroid_that_agree_are_quiet(
    box: Any, step_part: Any, read_in: Any, codes_of: Any
) -> None:
    """Validation properties within 1e-3 (files round, and integrate worse than we do) are no problem."""
    (part,) = read_in(stated(step_part(box(10, 20, 30)), 6000.5, (5.0, 10.0, 15.0))).prototypes.values()
    assert part.stated_volume_m3 == pytest.approx(6000.5e-9)
    assert codes_of(part) == []


def test_stated_volume_and_centroid_that_differ_are_reported(
    box: Any, step_part: Any, read_in: Any, codes_of: Any
) -> None:
    """A file that says 6600 mm3 of a box of 6000, with the centre elsewhere, was damaged on the way."""
    (part,) = read_in(stated(step_part(box(10, 20, 30)), 6600.0, (5.0, 10.0, 18.0))).prototypes.values()
    assert codes_of(part) == [GeometryCode.STATED_VOLUME, GeometryCode.STATED_CENTROID]
    assert "-9.09%" in part.problems[0].message
    assert "3 mm away" in part.problems[1].message


@pytest.mark.parametrize(("share", "codes"), [(0.5, []), (2.0, [GeometryCode.STATED_CENTROID])])
def test_a_stated_centre_is_compared_by_the_size_of_the_part(share: float, codes: list[GeometryCode]) -> None:
    """The tolerance is a share of the edge of a cube of the part's volume: 10 mm."""
    step = pytest.importorskip("silo.inertia.geometry.step", exc_type=ImportError)
    stated = step.StatedInStep(centroid_m=(share * step.STATED_TOLERANCE * 0.01, 0.0, 0.0))
    assert [note.code for note in step.against_stated(1e-6, (0.0, 0.0, 0.0), stated)] == codes
