# SPDX-License-Identifier: LGPL-2.1-or-later
"""The control cases T1 to T11: small assemblies that BOM tools are known to count wrongly.

PA and PB are parts, S1 a sub-assembly, each in a file of its own. The true counts stand in
``tests/data/control/expected.json``.
"""

from __future__ import annotations

from typing import Any

import FreeCAD as App
from freecad_cases.bench import ASSEMBLY, Bench, case


def _parts(b: Bench) -> tuple[Any, Any]:
    return b.part("PA.FCStd", "PA"), b.part("PB.FCStd", "PB")


def _s1(b: Bench, pa: Any, pb: Any) -> Any:
    """The sub-assembly: two PA and one PB."""
    s1 = b.container("S1.FCStd", "S1")
    b.link(s1, pa, "PA1")
    b.link(s1, pa, "PA2")
    b.link(s1, pb, "PB1")
    return s1


@case(ASSEMBLY)
def T01_flat(b: Bench) -> None:
    pa, pb = _parts(b)
    top = b.container()
    for number in (1, 2, 3):
        b.link(top, pa, f"LinkA{number}")
    b.link(top, pb, "LinkB")


@case(ASSEMBLY)
def T02_link_array(b: Bench) -> None:
    pa, pb = _parts(b)
    top = b.container()
    b.link(top, pa, "Row", count=6)
    b.link(top, pb, "LinkB")


@case(ASSEMBLY)
def T03_sub_assembly_twice(b: Bench) -> None:
    s1, top = _s1(b, *_parts(b)), b.container()
    b.link(top, s1, "First")
    b.link(top, s1, "Second")


@case(ASSEMBLY)
def T04_same_part_on_two_levels(b: Bench) -> None:
    pa, pb = _parts(b)
    s1, top = _s1(b, pa, pb), b.container()
    b.link(top, s1, "Sub")
    b.link(top, pa, "LinkA1")
    b.link(top, pa, "LinkA2")
    b.link(top, pb, "LinkB")


@case(ASSEMBLY)
def T05_one_mirrored(b: Bench) -> None:
    pa = b.part("PA.FCStd", "PA")
    top = b.container()
    b.link(top, pa, "Left")
    b.link(top, pa, "Right").ScaleVector = App.Vector(1, -1, 1)


@case(ASSEMBLY)
def T06_one_hidden(b: Bench) -> None:
    pa = b.part("PA.FCStd", "PA")
    top = b.container()
    b.link(top, pa, "Seen")
    b.link(top, pa, "Hidden").Visibility = False


@case(ASSEMBLY)
def T07_assembly_link(b: Bench) -> None:
    s1, top = _s1(b, *_parts(b)), b.container()
    b.assembly_link(top, s1, "AL")


@case(ASSEMBLY)
def T08_missing_file(b: Bench) -> None:
    pa, pb = _parts(b)
    top = b.container()
    b.link(top, pa, "LinkA")
    b.link(top, pb, "LinkB")
    b.save()
    b.close()
    (b.folder / "PB.FCStd").unlink()


@case(ASSEMBLY)
def T09_two_parts_with_one_label(b: Bench) -> None:
    pa = b.part("PA.FCStd", "PA", label="Plate")
    pb = b.part("PB.FCStd", "PB", label="Plate")
    top = b.container()
    b.link(top, pa, "LinkA")
    b.link(top, pb, "LinkB")


@case(ASSEMBLY)
def T10_link_to_a_link(b: Bench) -> None:
    pa = b.part("PA.FCStd", "PA")
    top = b.container()
    b.link(top, b.link(top, pa, "First"), "Second")


@case(ASSEMBLY)
def T11_link_in_a_group(b: Bench) -> None:
    pa, pb = _parts(b)
    top = b.container()
    b.link(top.newObject("App::DocumentObjectGroup", "Group"), pa, "LinkA")
    b.link(top, pb, "LinkB")
