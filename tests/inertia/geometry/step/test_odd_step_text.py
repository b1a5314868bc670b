# SPDX-License-Identifier: LGPL-2.1-or-later
"""STEP text that is allowed, or nearly, and that few programs write: units, comments, entities elsewhere."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

END = "ENDSEC;\nEND-ISO-10303-21;"
INCH = """#90000=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#90001=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#90000);
#90002=DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);
#90003=(CONVERSION_BASED_UNIT('INCH',#90001)LENGTH_UNIT()NAMED_UNIT(#90002));
"""
CURVE = """#95000=CARTESIAN_POINT('',(0.,0.,50.));
#95001=DIRECTION('',(1.,0.,0.));
#95002=VECTOR('',#95001,30.);
#95003=LINE('',#95000,#95002);
#95004=CARTESIAN_POINT('',(30.,0.,50.));
#95005=TRIMMED_CURVE('',#95003,(#95000),(#95004),.T.,.CARTESIAN.);
#95006=GEOMETRIC_CURVE_SET('',(#95005));
"""


@pytest.fixture(name="pair")
def _pair(box: Any, step: Any, trsf: Any, tmp_path: Path) -> Path:
    """Two parts, the products N1 and N2, both called "same", one 100 mm beside the other."""
    document = step()
    top = document.assembly("top")
    for number in (1, 2):
        part = document.part(box(10, 20, 30 * number), f"p{number}")
        document.place(top, part, trsf((100 * number, 0, 0)), f"i{number}")
    path: Path = document.write(tmp_path / "pair.step")
    text = path.read_text("ascii")
    for number in (1, 2):
        text = text.replace(f"PRODUCT('p{number}','p{number}'", f"PRODUCT('N{number}','same'")
    path.write_text(text, "ascii")
    return path


def representations(text: str) -> list[tuple[str, str]]:
    """(id, id of the context) of all representations that hold a solid, in file order."""
    return re.findall(r"#(\d+) = ADVANCED_BREP_SHAPE_REPRESENTATION\([^;]*,#(\d+)\);", text)


def numbers(read_in: Callable[..., Any], path: Path) -> dict[str | None, float]:
    """Part number → volume [mm³]."""
    parts = read_in(path, mesh_check=False).prototypes.values()
    return {part.part_number: round(part.volume_m3 * 1e9, 3) for part in parts}


def test_each_part_may_have_its_own_unit(pair: Path, read_in: Any) -> None:
    """One part in inches in an assembly in mm: its size is in inches, its place is not."""
    text = pair.read_text("ascii")
    (_, context), _ = representations(text)
    (old,) = re.findall(rf"#{context} = \( GEOMETRIC_REPRESENTATION_CONTEXT.*?\);", text, re.DOTALL)
    (unit,) = re.findall(r"GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\s*\(#(\d+)", old)
    text = text.replace(old, re.sub(rf"#{unit}\b", "#90003", old)).replace(END, INCH + END)
    pair.write_text(text, "ascii")
    assert numbers(read_in, pair) == {"N1": pytest.approx(6000 * 25.4**3), "N2": 12000}
    steps = [i.transform[:3, 3] for i in read_in(pair).instances]
    np.testing.assert_allclose(steps, [[0.1, 0, 0], [0.2, 0, 0]])


@pytest.mark.parametrize(
    "comment", ["/* #9=CARTESIAN_POINT('',(0.,0.,0.)); */", "/* it's #9=POINT( */", "/**/"]
)
def test_a_comment_is_no_entity(comment: str, pair: Path, read_in: Any) -> None:
    """Part numbers are found by counting entities as the kernel does."""
    text = pair.read_text("ascii")
    pair.write_text(text.replace("DATA;\n", f"DATA;\n{comment}\n"), "ascii")
    assert numbers(read_in, pair) == {"N1": 6000, "N2": 12000}


def test_where_the_kernel_counts_otherwise_no_number_goes_to_another_part(pair: Path, read_in: Any) -> None:
    """A text that looks like an entity moves all positions by one: rather no part number than the next one's.

    The entities that belong to products stand in pairs here, so that one further is the other product.
    """
    text = pair.read_text("ascii")
    moved = ""
    for keyword in ("PRODUCT_DEFINITION", "ADVANCED_BREP_SHAPE_REPRESENTATION", "MANIFOLD_SOLID_BREP"):
        found = re.findall(rf"#\d+ = {keyword}\([^;]*;\n", text)
        assert len(found) >= 2
        for entity in found:
            text = text.replace(entity, "")
            moved += entity
    pair.write_text(text.replace(END, moved + END), "ascii")
    assert numbers(read_in, pair) == {"N1": 6000, "N2": 12000}
    trap = "#99001=DESCRIPTIVE_REPRESENTATION_ITEM('','#99002=CARTESIAN_POINT(');\n"
    pair.write_text(pair.read_text("ascii").replace("DATA;\n", "DATA;\n" + trap), "ascii")
    found = {round(p.volume_m3 * 1e9): p.part_number for p in read_in(pair).prototypes.values()}
    assert found == {6000: None, 12000: None}


def test_a_solid_and_a_curve_in_two_representations_are_one_product(pair: Path, read_in: Any) -> None:
    """Pro/E writes so; the kernel makes an assembly of two unnamed leaves of it."""
    text = pair.read_text("ascii")
    (first, context), _ = representations(text)
    curve = (
        f"{CURVE}#95007=GEOMETRICALLY_BOUNDED_WIREFRAME_SHAPE_REPRESENTATION('',(#95006),#{context});\n"
        f"#95008=SHAPE_REPRESENTATION_RELATIONSHIP('','',#{first},#95007);\n"
    )
    pair.write_text(text.replace(END, curve + END), "ascii")
    assembly = read_in(pair)
    assert [i.path for i in assembly.instances] == [("i1",), ("i2",)]
    assert [(p.part_number, p.has_solid, len(p.problems)) for p in assembly.prototypes.values()] == [
        ("N1", True, 0),
        ("N2", True, 0),
    ]
