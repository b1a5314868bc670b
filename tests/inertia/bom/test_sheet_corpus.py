# SPDX-License-Identifier: LGPL-2.1-or-later
"""One sheet in three formats: the same masses, the same warnings, and the values that LibreOffice reads."""

from __future__ import annotations

import csv
import io
from functools import cache

import pytest
from sheet_corpus import CASES, FORMATS, read_corpus

from silo.inertia.bom.parser import BOMParser
from silo.workbook.read import read_workbook

pytest.importorskip("xlrd")
corpus = cache(read_corpus)
D2, D3 = (1, 3), (2, 3)
# What is meant differs from what is stored, or LibreOffice has its own name for an error.
OTHERWISE: dict[str, dict[tuple[int, int], tuple[str, str]]] = {
    "error-number": {D3: ("#VALUE!", "Err:502")},
    "error-reference": {D3: ("#VALUE!", "Err:502")},
    "format-of-thousands": {D2: ("12.5kg", "12500"), D3: ("3.25kg", "3250")},
    "format-with-conditions": {D2: ("12.5kg", "12500")},
    "format-of-leading-zeros": {(1, 0): ("00123", "123"), (2, 0): ("00004", "4")},
    "time-for-a-mass": {D3: ("01:30:00", "01:30:00 AM")},
    "format-of-drawings": {(1, 0): ("P-012", "12")},
    "format-scientific": {D2: ("1.25e-05", "0.0000125")},
}


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("name", CASES)
def test_a_sheet_says_the_same_in_every_format(name: str, form: str) -> None:
    case = CASES[name]
    table = BOMParser().parse_bytes(corpus()[f"{name}.{form}"])
    assert {row.name: row.mass_kg for row in table.rows} == {
        part: kg if kg is None else pytest.approx(kg) for part, kg in case.kg.items()
    }
    warnings = [str(warning) for warning in table.warnings]
    assert len(warnings) == len(case.warnings), warnings
    for warning, beginning in zip(warnings, case.warnings, strict=True):
        assert warning.startswith(beginning)


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("name", sorted(CASES))
def test_the_values_are_those_that_libreoffice_reads(name: str, form: str) -> None:
    """As CSV without number formats: a value with its format's unit begins with it."""
    text = corpus()[f"{name}.csv"].decode()
    theirs = {
        (row, column): cell
        for row, cells in enumerate(csv.reader(io.StringIO(text)))
        for column, cell in enumerate(cells)
        if cell
    }
    (ours,) = (grid for grid in read_workbook(corpus()[f"{name}.{form}"], name) if grid.name == "BOM")
    assert ours.cells.keys() == theirs.keys()
    differ = {
        place: (cell.text, theirs[place])
        for place, cell in ours.cells.items()
        if not cell.text.startswith(theirs[place])
    }
    assert differ == OTHERWISE.get(name, {})
