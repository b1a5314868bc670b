# SPDX-License-Identifier: LGPL-2.1-or-later
"""Parts and rows of a BOM: what a piece weighs, and which part is warned of (inertia-facts §9, 23 to 34)."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pytest
from bodies import box, shape_only

HEAD = "Item,Quantity,Part number,Material,Mass,Name\n"
Fixture = Callable[..., Any]


@dataclass(frozen=True)
class Case:
    """An assembly, the rows of its BOM, and what follows.

    parts
        ``3 arm*2/motor/bolt @ 2; …``: in the motor of each of two arms three cubes "bolt" of 2 cm. Without
        ``@ …`` a cube has 1 cm; ``@ 0`` has no solid.
    rows
        below :data:`HEAD`, each in one line.
    grams
        mass of a piece of each of ``parts``; None: it is no part of its own.
    codes
        ``part code, …``: all warnings.
    words
        what the warnings say, separated by " … ".
    by
        how rows of one name were kept apart.
    """

    parts: str
    rows: str
    grams: list[float | None]
    codes: str = ""
    words: str = ""
    by: str = ""


def placed(text: str) -> dict[str, tuple[str, Any, None, str]]:
    """Path of each instance → what ``assemble`` takes."""
    found = {}
    for entry in text.split("; "):
        count, path, size = re.fullmatch(r"(?:(\d+) )?(.*?)(?: @ ([\d.]+))?", entry).groups()  # type: ignore[union-attr]
        *around, name = path.split("/")
        edge = float(size or 1) / 100
        key = f"{name} {size}"
        part = box(name, edge, edge, edge, key=key) if edge else shape_only(name, key=key)
        names = [level.partition("*")[0] for level in around]
        times = [range(int(level.partition("*")[2] or 1)) for level in around]
        for numbers in itertools.product(*times, range(int(count or 1))):
            above = [f"{one}<{number}>" for one, number in zip(names, numbers[:-1], strict=True)]
            where = "/".join([*above, f"{part.key} {numbers[-1]}"])
            found[where] = (where, part, None, "/".join([*names, name]))
    return found


CASES = {
    "case 23: duplicates kept apart by quantity": Case(
        "2 l/Part 1; 3 l/Part 1 @ 2", "1,3,,,5.000 g,Part 1 | 2,2,,,2.000 g,Part 1",
        [2, 5], "Part 1 bom_duplicate_name", by="quantity",
    ),
    "case 24: duplicates kept apart by mass and material": Case(
        "l/Part 1; l/Part 1 @ 2", "1,1,,steel,0.0628 kg,Part 1 | 2,1,,aluminum,0.0027 kg,Part 1",
        [2.7, 62.8], "Part 1 bom_duplicate_name",
    ),
    "case 25: duplicates that nothing keeps apart": Case(
        "l/Part 1; l/Part 1 @ 2", "1,1,,,0.1000 kg,Part 1 | 2,1,,,0.2000 kg,Part 1", [100, 200],
        "Part 1 bom_duplicate_name, Part 1 ambiguous, Part 1 mass_implausible, Part 1 ambiguous, "
        "Part 1 mass_implausible", by="order",
    ),
    "five products of one name, as Onshape exports them": Case(
        "l/Part 1; 2 l/Part 1 @ 2; 3 l/Part 1 @ 3; 4 l/Part 1 @ 4; 4 l/Part 1 @ 5",
        "1,1,,,0.1000 kg,Part 1 | 2,2,,,0.2000 kg,Part 1 | 3,3,,,0.3000 kg,Part 1 | "
        "4,4,,,0.4000 kg,Part 1 | 5,4,,,0.5000 kg,Part 1", [100, 200, 300, 400, 500],
        "Part 1 bom_duplicate_name, Part 1 mass_implausible, Part 1 mass_implausible, "
        "Part 1 ambiguous, Part 1 ambiguous",
    ),
    "duplicates kept apart by the sub-assembly around them": Case(
        "arm/Part 1; leg/Part 1 @ 2",
        "1,1,,,,leg | 1.1,1,,,8.00 g,Part 1 | 2,1,,,,arm | 2.1,1,,,1.00 g,Part 1",
        [1, 8], "Part 1 bom_duplicate_name", by="parent",
    ),
    "one mass for several shapes is doubtful": Case(
        "l/Part 1; l/Part 1 @ 2", "1,2,,,0.1000 kg,Part 1",
        [100, 100], "Part 1 ambiguous, Part 1 mass_implausible",
    ),
    "one material for several shapes is no doubt": Case(
        "l/Part 1; l/Part 1 @ 2", "1,2,,steel,,Part 1", [7.85, 62.8],
    ),
    "one row whose quantity is that of one shape": Case(
        "l/Part 1; 2 l/Part 1 @ 2", "1,1,,,0.1000 kg,Part 1",
        [100, 8], "Part 1 mass_implausible, Part 1 not_in_bom",
    ),
    "case 26: masses at every level never add up twice": Case(
        "2 arm/joint/bolt; arm/joint/pin @ 2",
        "1,1,,,0.5 kg,arm | 1.1,1,,,0.5 kg,joint | 1.1.1,2,,,0.1 kg,bolt | 1.1.2,1,,,0.3 kg,pin",
        [100, 300], "bolt mass_rounded, bolt mass_implausible, pin mass_rounded, pin mass_implausible",
    ),
    "case 26: the mass of a sub-assembly is compared": Case(
        "2 arm/joint/bolt; arm/joint/pin @ 2",
        "1,1,,,0.5 kg,arm | 1.1,1,,,0.9 kg,joint | 1.1.1,2,,,0.1 kg,bolt | 1.1.2,1,,,0.3 kg,pin",
        [100, 300],
        "bolt mass_rounded, bolt mass_implausible, bolt sub_assembly_mass_differs, pin mass_rounded, "
        "pin mass_implausible",
    ),
    "the mass of a bought motor is shared by volume": Case(
        "arm/motor/rotor; arm/motor/stator @ 2", "1,1,,,9.00 g,motor",
        [1, 8], "rotor sub_assembly_mass_shared, stator sub_assembly_mass_shared",
    ),
    "a mass that the known parts use up is nothing for the others": Case(
        "arm/motor/rotor; arm/motor/case @ 2", "1,1,,,0.900 kg,motor | 2,1,,,0.900 kg,rotor",
        [900, 8], "rotor mass_implausible, case not_in_bom",
    ),
    "two motors weigh twice as much as one": Case(
        "3 arm/motor*2/rotor", "1,2,,,0.900 kg,motor",
        [300], "rotor sub_assembly_mass_shared, rotor mass_implausible",
    ),
    "rows without data below a row with a mass": Case(
        "arm/motor/rotor; arm/motor/case @ 2",
        "1,1,,,0.9 kg,motor | 1.1,1,,,,rotor | 1.2,1,,,No value,case", [100, 800],
        "rotor sub_assembly_mass_shared, rotor mass_implausible, case sub_assembly_mass_shared, "
        "case mass_implausible",
    ),
    "a part of an unknown material below a row with a mass": Case(
        "arm/motor/rotor; arm/motor/case @ 2",
        "1,1,,,90.0 g,motor | 1.1,1,,Unobtainium,,rotor | 1.2,1,,,,case",
        [1, 89], "rotor unknown_material, case sub_assembly_mass_shared",
    ),
    "what a scale says of a sub-assembly wins over the data of its parts": Case(
        "arm/motor/rotor; arm/motor/case @ 2",
        "1,1,,,9.0 g*,motor | 1.1,1,,steel,,rotor | 1.2,1,,steel,,case",
        [1, 8], "rotor sub_assembly_mass_shared, case sub_assembly_mass_shared", "sum up to 0.07065 kg",
    ),
    "a little less than its parts is no rounding": Case(
        "arm/motor/rotor; arm/motor/case @ 2",
        "1,1,,,70.2 g*,motor | 1.1,1,,steel,,rotor | 1.2,1,,steel,,case",
        [7.8, 62.4], "rotor sub_assembly_mass_shared, case sub_assembly_mass_shared",
    ),
    "a part that was weighed keeps its mass in a sub-assembly that was weighed": Case(
        "arm/motor/rotor; arm/motor/case @ 2",
        "1,1,,,20.0 g*,motor | 1.1,1,,steel,8.00 g*,rotor | 1.2,1,,steel,,case",
        [8, 12], "case sub_assembly_mass_shared",
    ),
    "a sub-assembly that was weighed within one that was weighed": Case(
        "a/arm/motor/rotor; a/arm/motor/case @ 2; a/arm/cap @ 4",
        "1,1,,,30.0 g*,arm | 1.1,1,,,18.0 g*,motor | 1.1.1,1,,steel,,rotor | 1.1.2,1,,steel,,case "
        "| 1.2,1,,steel,,cap",
        [2, 16, 12],
        "rotor sub_assembly_mass_shared, case sub_assembly_mass_shared, cap sub_assembly_mass_shared",
    ),
    "two scales that contradict each other": Case(
        "arm/motor/rotor; arm/motor/case @ 2",
        "1,1,,,20.00 g*,motor | 1.1,1,,,8.00 g*,rotor | 1.2,1,,,8.00 g*,case",
        [8, 8], "rotor sub_assembly_mass_differs", "were weighed, too",
    ),
    "a gap gets the rest of what was weighed, and the parts with data keep theirs": Case(
        "arm/motor/rotor; arm/motor/case @ 2", "1,1,,,10 g*,motor | 1.1,1,,steel,,rotor | 1.2,1,,,,case",
        [7.85, 2.15], "case sub_assembly_mass_shared",
    ),
    "a gap gets its share also where a sibling has data": Case(
        "arm/motor/rotor; arm/motor/case @ 2", "1,1,,,10 g,motor | 1.1,1,,steel,,rotor | 1.2,1,,,,case",
        [7.85, 2.15], "case sub_assembly_mass_shared",
    ),
    "a rest within the rounding is not dropped": Case(
        "arm/motor/rotor; arm/motor/case @ 2", "1,1,,,8 g,motor | 1.1,1,,steel,,rotor | 1.2,1,,,,case",
        [7.85, 0.15], "case sub_assembly_mass_shared",
    ),
    "the material of a sub-assembly is that of parts that the BOM lacks": Case(
        "arm/print/body a; arm/print/body b; arm/nut", "1,1,,PLA,,print | 2,1,,steel,,nut",
        [1.25, 1.25, 7.85],
    ),
    "case 27: the quantity is not the count": Case(
        "3 l/bolt", "1,4,,steel,,bolt", [7.85], "bolt count_differs", "4 … 3",
    ),
    "a row too many of a name": Case(
        "l/Part 1", "1,1,,steel,,Part 1 | 2,3,,brass,,Part 1", [7.85],
        "Part 1 bom_duplicate_name, Part 1 row_unused", "all parts of this name belong to other rows",
    ),
    "case 28: a row without geometry": Case(
        "l/a", "1,1,,steel,,a | 2,1,,,0.02 kg,glue", [7.85], "glue row_unused",
    ),
    "case 29: a part that the BOM lacks, and a name near to it": Case(
        "l/Hexbolt M4", "1,1,,steel,,Hex bolt M4",
        [1], "Hexbolt M4 not_in_bom, Hex bolt M4 row_unused", "which has “Hex bolt M4”",
    ),
    "case 30: nothing": Case(
        "l/a; l/b", "1,1,,- None -,,a | 2,1,,steel,,b", [0, 7.85], "a no_mass_no_material",
    ),
    "case 30: No value": Case(
        "l/a; l/b", "1,1,,- None -,No value,a | 2,1,,steel,,b", [0, 7.85], "a no_mass_no_material",
    ),
    "case 30: zero is a mass if no material says more": Case(
        "l/a; l/b", "1,1,,,0 kg,a | 2,1,,,0.125 kg,b",
        [0, 125], "a bom_zero_mass, b mass_implausible", "0.0005",
    ),
    "zero of a known material, less than the BOM shows": Case(
        "l/a @ 0.3; l/b", "1,1,,steel,0 kg,a | 2,1,,,0.125 kg,b",
        [0.21195, 125], "a bom_zero_mass, b mass_implausible", "shows ± 0.0005 kg only",
    ),
    "zero of a known material that the BOM would show": Case(
        "l/a; l/b", "1,1,,steel,0 kg,a | 2,1,,,0.125 kg,b",
        [7.85, 125], "a bom_zero_mass, b mass_implausible", "Was the mass set to zero?",
    ),
    "zero of 8 kg of a known material": Case(
        "l/a @ 10; l/b", "1,1,,steel,0 kg,a | 2,1,,,0.125 kg,b",
        [7850, 125], "a mass_implausible, b mass_implausible", "Was the mass set to zero?",
    ),
    "a zero that was set by hand": Case(
        "l/a @ 10; l/b", "1,1,,steel,0 kg*,a | 2,1,,,0.125 kg,b",
        [0, 125], "a bom_zero_mass, b mass_implausible", "was set to 0",
    ),
    "zero of a material that is not known": Case(
        "l/a", "1,1,,unobtainium,0 kg,a", [0], "a bom_zero_mass,  zero_mass_link",
    ),
    "case 31: mass and material disagree": Case(
        "l/a @ 10", "1,1,,steel,2.700 kg,a", [2700], "a mass_differs", "7.85 kg",
    ),
    "mass and material agree within the rounding": Case(
        "l/a", "1,1,,steel,0.008 kg,a", [8], "a mass_rounded",
    ),
    "case 32: the mass of the row": Case(
        "4 l/b @ 10", "1,4,,steel,31.4 kg,b", [31400], "b row_total", "4 times",
    ),
    "one mass, two shapes, two spellings": Case(
        "l/bolt; l/Bolt @ 2; l/bolt (2)", "1,3,,,2.70 g,bolt",
        [2.7, 2.7, 2.7], "bolt ambiguous, Bolt ambiguous, bolt (2) ambiguous",
    ),
    "one mass, one shape, two spellings": Case(
        "l/bolt; l/Bolt", "1,2,,,2.70 g,bolt", [2.7, 2.7],
    ),
    "a ratio tells parts apart": Case(
        "l/gear 1:5", "1,1,,,2.70 g,gear 1:10", [1], "gear 1:5 not_in_bom, gear 1:10 row_unused",
    ),
    "a running number tells parts apart": Case(
        "l/cover (2)", "1,1,,,2.70 g,cover (3)", [1], "cover (2) not_in_bom, cover (3) row_unused",
    ),
    "an occurrence is not another one": Case(
        "l/leg <1>", "1,1,,,2.70 g,leg <2>", [1], "leg <1> not_in_bom, leg <2> row_unused",
    ),
    "a mass that fits two rows is settled by the quantity": Case(
        "2 l/b; 2 l/b @ 2", "1,5,,steel,7.86 g,b | 2,2,,steel,7.85 g,b",
        [7.85, 7.86], "b bom_duplicate_name, b mass_differs, b count_differs",
    ),
    "a surface beside a solid of another spelling": Case(
        "l/bolt; k/Bolt @ 0", "1,2,,,2.70 g,bolt", [2.7, 2.7], "Bolt point_mass,  bad_tensor",
    ),
    "two parts of one count are not told apart by it": Case(
        "2 l/b @ 2; 2 l/b", "1,2,,steel,7.85 g,b | 2,3,,steel,62.80 g,b",
        [62.8, 7.85], "b bom_duplicate_name, b count_differs",
    ),
    "quantities below a parent, without evidence": Case(
        "6 arm/b @ 2; 2 arm/b", "1,2,,,,arm | 1.1,1,,,2.00 g,b | 1.2,3,,,9.00 g,b",
        [9, 2], "b bom_duplicate_name, arm count_differs",
    ),
    "quantities below a parent, contradicting evidence": Case(
        "6 arm/b @ 2; 2 arm/b; 6 arm/c @ 3; 3 arm/d @ 3",
        "1,2,,,,arm | 1.1,1,,,2.00 g,b | 1.2,3,,,9.00 g,b | 1.3,3,,steel,,c | 1.4,3,,steel,,d",
        [9, 2, 211.95, 211.95], "b bom_duplicate_name, arm count_differs",
    ),
    "quantities below a parent, proven": Case(
        "6 arm/b @ 2; 2 arm/b; 6 arm/c @ 3",
        "1,2,,,,arm | 1.1,1,,,2.00 g,b | 1.2,3,,,9.00 g,b | 1.3,3,,steel,,c",
        [9, 2, 211.95], "b bom_duplicate_name, arm count_differs",
    ),
    "another spelling: too many for quantities in all": Case(
        "4 arm/bolt; 2 arm/Bolt; 3 arm/witness", "1,2,,,,arm | 1.1,4,,steel,,bolt | 1.2,3,,steel,,witness",
        [7.85, 1, 7.85], "Bolt not_in_bom, arm count_differs",
    ),
    "another spelling: room for two below two parents": Case(
        "4 arm/bolt; 2 arm/Bolt; 6 arm/witness", "1,2,,,,arm | 1.1,4,,steel,,bolt | 1.2,3,,steel,,witness",
        [7.85, 7.85, 7.85], "bolt count_differs, arm count_differs",
    ),
    "another spelling: room for four below two parents": Case(
        "4 arm/bolt; 4 arm/Bolt; 6 arm/witness", "1,2,,,,arm | 1.1,4,,steel,,bolt | 1.2,3,,steel,,witness",
        [7.85, 7.85, 7.85], "arm count_differs",
    ),
    "another spelling: too many below two parents": Case(
        "4 arm/bolt; 5 arm/Bolt; 6 arm/witness", "1,2,,,,arm | 1.1,4,,steel,,bolt | 1.2,3,,steel,,witness",
        [7.85, 1, 7.85], "Bolt not_in_bom, bolt count_differs, arm count_differs",
    ),
    "case 34: bracket and bracket_2 side by side": Case(
        "l/bracket; l/bracket_2", "1,1,,,0.200 kg,bracket_2 | 2,1,,,0.100 kg,bracket",
        [100, 200], "bracket mass_implausible, bracket_2 mass_implausible",
    ),
    "an occurrence mark does not take a used row": Case(
        "l/Plate; l/Plate (2) @ 2", "1,1,,,0.100 kg,Plate",
        [100, 8], "Plate mass_implausible, Plate (2) not_in_bom",
    ),
    "case 13: a mass without a solid is a point": Case(
        "l/x @ 0", "1,1,,,0.400 kg,x", [400], "x point_mass,  bad_tensor",
    ),
    "a material without a solid is zero": Case(
        "l/x @ 0", "1,1,,steel,,x", [0], "x no_volume,  zero_mass_link",
    ),
    "case 4: a wire beside its solid is one part": Case(
        "l/plate; l/plate @ 0", "1,1,,,1.00 g,plate", [1, None],
    ),
    "the mass of a motor is that of its parts without a row": Case(
        "arm/motor/rotor @ 2; arm/motor/bolt", "1,1,,,90.0 g,motor | 2,1,,,10.0 g,bolt",
        [80, 10], "rotor sub_assembly_mass_shared",
    ),
    "a mass without any solid is spread evenly": Case(
        "arm/unit/a @ 0; arm/unit/b @ 0", "1,1,,,0.800 kg,unit",
        [400, 400], "a sub_assembly_mass_shared, b sub_assembly_mass_shared,  bad_tensor", "as points",
    ),
    "the innermost row with a mass wins": Case(
        "arm/unit/motor/rotor; arm/unit/case",
        "1,1,,,2.000 kg,unit | 1.1,1,,,0.900 kg,motor | 1.2,1,,,1.100 kg,case",
        [900, 1100], "rotor sub_assembly_mass_shared, rotor mass_implausible, case mass_implausible",
    ),
    "the outer of two sub-assemblies shares what is left": Case(
        "outer/inner/a; outer/b", "1,1,,,3 kg,outer | 2,1,,,1 kg,inner", [1000, 2000],
        "a sub_assembly_mass_shared, a mass_implausible, b sub_assembly_mass_shared, b mass_implausible",
    ),
    "the material of a sub-assembly on a part without a solid": Case(
        "arm/print/a; arm/print/wires @ 0", "1,1,,PLA,,print", [1.25, 0], "wires no_volume",
    ),
    "a material that varies": Case(
        "l/a @ 10; l/b @ 10; l/c @ 10", "1,1,,EPS,,a | 2,1,,EPS,0.0280 kg,b | 3,1,,steel,7.85 kg,c",
        [20, 28, 7850], "a density_varies", "± 50%",
    ),
    "more than a material varies": Case(
        "l/a @ 10; l/b @ 10; l/c @ 10", "1,1,,EPS,0.045 kg,a | 2,1,,steel,7.85 kg,b | 3,1,,steel,7.85 kg,c",
        [45, 7850, 7850], "a mass_differs",
    ),
    "grams for kilograms, a litre as light as steel in grams": Case(
        "l/a @ 10", "1,1,,,7.85 g,a", [7.85], "a mass_implausible",
    ),
    "grams for kilograms, a litre as light as aluminium in grams": Case(
        "l/a @ 10", "1,1,,,2.7 g,a", [2.7], "a mass_implausible",
    ),
    "a litre of foam": Case(
        "l/a @ 10", "1,1,,,15 g,a", [15], "a mass_rounded",
    ),
    "a guessed material of a sub-assembly": Case(
        "arm/a", "1,1,P-7,tin can,,arm", [7.29], "a material_guessed",
    ),
    "a varying material of a sub-assembly": Case(
        "arm/a @ 10; arm/b", "1,1,P-7,EPS,,arm", [20, 0.02], "a density_varies, b density_varies",
    ),
    "a part whose own row says nothing gets no material from around it": Case(
        "arm/print/a; arm/print/b", "1,1,,PLA,,print | 2,1,,,,b", [1.25, 0], "b no_mass_no_material",
    ),
    "either reading of quantities holds if parts disagree": Case(
        "3 arm*2/bolt; 2 arm*2/pin @ 2", "1,2,,,,arm | 1.1,3,,,1.0 g,bolt | 1.2,4,,,2.0 g,pin",
        [1, 2], "bolt mass_rounded, pin mass_rounded, bolt mass_rounded, pin mass_rounded",
    ),
    "of two shapes of one name the row is that of the shape that weighs it": Case(
        "l/x; l/x @ 3", "1,1,,steel,7.85 g,x", [7.85, 27], "x not_in_bom",
    ),
    "a mass in another unit, and the material is known": Case(
        "l/a @ 10", "1,1,P-1,steel,7.85 g,a", [7.85], "a mass_differs, a mass_implausible",
    ),
    "the mass of a row, and a wrong quantity": Case(
        "l/a @ 10", "1,4,P-1,steel,31.4 kg,a", [31400], "a row_total, a count_differs",
    ),
    "grams called kilograms": Case(
        "l/a", "1,1,,,2.70 kg,a", [2700], "a mass_implausible", "denser than any metal",
    ),
    "50 g for a cubic centimetre": Case(
        "l/a", "1,1,,,50.0 g,a", [50], "a mass_implausible", "denser than any metal",
    ),
    "grams divided once too often": Case(
        "l/a", "1,1,,,0.00300 g,a", [0.003], "a mass_implausible", "lighter than any solid",
    ),
    "osmium": Case(
        "l/a", "1,1,,,0.0225 kg,a", [22.5],
    ),
    "rounding is given its due: 1 g may be 0.5 g": Case(
        "l/a @ 0.31", "1,1,,,0.001 kg,a", [1], "a mass_rounded",
    ),
    "a light foam": Case(
        "l/a", "1,1,,,0.00001 kg,a", [0.01], "a mass_rounded",
    ),
    "165 kg of a servo": Case(
        "arm/servo/case @ 5; arm/servo/horn", "1,1,,,165 kg,servo", [163690.5, 1309.524],
        "case sub_assembly_mass_shared, case mass_implausible, horn sub_assembly_mass_shared, "
        "horn mass_implausible",
    ),
    "a mass without a solid has no density to doubt": Case(
        "l/a; l/b @ 0", "1,1,,steel,,a | 2,1,,,5.0 kg,b", [7.85, 5000], "b point_mass",
    ),
    "a column of row totals makes all rows doubtful": Case(
        "4 l/bolt; 2 l/nut; l/lid", "1,4,,steel,0.0314 kg,bolt | 2,2,,,0.0060 kg,nut | 3,1,,,0.0030 kg,lid",
        [31.4, 6, 3], "bolt row_total, nut row_total",
    ),
    "a row that is no total clears the others": Case(
        "4 l/bolt; 3 l/nut; 2 l/pin",
        "1,4,,steel,0.0314 kg,bolt | 2,3,,,0.0090 kg,nut | 3,2,,steel,0.0079 kg,pin",
        [31.4, 9, 7.9], "bolt row_total",
    ),
    "a sub-assembly that the geometry does not have": Case(
        "l/rotor; l/case @ 2", "1,1,,,0.090 kg,motor | 1.1,1,,,,rotor | 1.2,1,,,,case",
        [0, 0], "rotor no_mass_no_material, case no_mass_no_material,  zero_mass_link, motor row_unused",
    ),
    "such a sub-assembly, and its parts have data": Case(
        "l/rotor; l/case @ 2", "1,1,,,0.090 kg,motor | 1.1,1,,steel,,rotor | 1.2,1,,steel,,case",
        [7.85, 62.8],
    ),
    "the bolts prove that quantities are per parent": Case(
        "2 top/module*3/bolt; 2 top/module*3/clip @ 2; 2 top/base/clip @ 3",
        "1,1,,,,base frame | 1.1,2,,,50.00 g,clip | 2,3,,,,module kit | 2.1,2,,,10.00 g,bolt | "
        "2.2,2,,,20.00 g,clip", [10, 20, 50], "clip bom_duplicate_name",
    ),
    "the bolts prove that quantities are sums": Case(
        "2 top/module*3/bolt; 2 top/module*3/clip @ 2; 2 top/base/clip @ 3",
        "1,1,,,,base frame | 1.1,2,,,50.00 g,clip | 2,3,,,,module kit | 2.1,6,,,10.00 g,bolt | "
        "2.2,6,,,20.00 g,clip", [10, 20, 50], "clip bom_duplicate_name",
    ),
    "a wrong quantity, although another reading would fit": Case(
        "2 top/module*3/bolt; 2 top/module*3/nut; 2 top/module*3/pin",
        "1,3,,,,module | 1.1,2,,,10.00 g,bolt | 1.2,2,,,10.00 g,nut | 1.3,6,,,10.00 g,pin",
        [10, 10, 10], "pin count_differs",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_masses_and_warnings_of_parts(assemble: Fixture, compute: Fixture, name: str) -> None:
    case = CASES[name]
    report = compute(assemble(*placed(case.parts).values()), HEAD + "\n".join(case.rows.split(" | ")) + "\n")
    found = {path: part.mass * 1000 for _, part in report.parts() for path in part.paths}
    for entry, grams in zip(case.parts.split("; "), case.grams, strict=True):
        assert [found.get(path) for path in placed(entry)] == pytest.approx([grams] * len(placed(entry)))
    assert ", ".join(f"{warning.part_name} {warning.code}" for warning in report.warnings) == case.codes
    said = " ".join(warning.message for warning in report.warnings)
    assert all(words in said for words in case.words.split(" … "))
    assert not case.by or {part.decided_by for _, part in report.parts()} == set(case.by.split(" "))
