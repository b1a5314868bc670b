# SPDX-License-Identifier: LGPL-2.1-or-later
"""Case 21: mass strings. Read right, or a problem in words; never an exception, never nothing in silence."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from silo.bom.numbers import Mark, parse_number
from silo.inertia.bom.mass_cell import column_mark, is_empty, parse_mass
from silo.inertia.bom.table import BomCode, BomTable

LB = 0.45359237

# text, kg (None: a problem), half of the last digit in kg
STRINGS = [
    ("0.3 kg", 0.3, 0.05),
    ("0.3kg", 0.3, 0.05),
    ("0.3 kg*", 0.3, 0.05),
    ("0 kg", 0.0, 0.5),
    ("0.3 KG", 0.3, 0.05),
    (".5 kg", 0.5, 0.05),
    ("300 g", 0.3, 0.0005),
    ("0.66 lb", 0.66 * LB, 0.005 * LB),
    ("10.5 oz", 10.5 * LB / 16, 0.05 * LB / 16),
    ("1,234.5 g", 1.2345, 5e-5),
    ("1,234.5 kg", 1234.5, 0.05),
    ("0,3 kg", 0.3, 0.05),
    ("1.234,5 kg", 1234.5, 0.05),
    ("1e-3 kg", 1e-3, 5e-4),
    ("500 mg", 5e-4, 5e-7),
    ("2 t", 2000.0, 500.0),
    ("1.2.3 kg", None, 0),
    ("0.3", 0.3, 0.05),
    ("1 234,5 g", 1.2345, 5e-5),
    ("3.5 lbs", 3.5 * LB, 0.05 * LB),
    ("0.009 kg", 0.009, 0.0005),
]


# With other signs, or more than a number: a tolerance is the rounding where it is wider; pounds and ounces
# add up; "each" says nothing new; a mass may look like any quantity.
MORE = [
    ("1'234.5 g", 1.2345, 5e-5), ("１．５ｋｇ", 1.5, 0.05), ("0.5 千克", 0.5, 0.05),
    ("250 グラム", 0.25, 5e-4),
    ("0.3 kilograms", 0.3, 0.05), ("5e3 g", 5.0, 0.5), ("½ kg", 0.5, None), ("1½ lb", 1.5 * LB, None),
    ("1_000 g", 1.0, 5e-4), ("５ ｋｇ", 5.0, 0.5), ("2 ± 0.1 kg", 2, 0.5), ("2.0 kg ± 100 g", 2, 0.1),
    ("2.00±0.001", 2, 0.005), ("2 +/- 0,5", 2, 0.5), ("1 lb 3 oz", LB * 19 / 16, LB / 32),
    ("2 kg each", 2, 0.5), ("12 g/pc", 0.012, 0.0005), ("1 kg 200 g", 1.2, 0.0005),
    ("1kg, 200g", 1.2, 0.0005), ("2 t 50 kg", 2050, 0.5), ("1 lb. 8 oz.", 1.5 * LB, LB / 32),
    ("kg 1.2", 1.2, 0.05), ("kg1,2", 1.2, 0.05), ("KG 0.350", 0.35, 0.0005), ("g 12", 0.012, 0.0005),
    ("lb. 2", 2 * LB, LB / 2), ("2.5 lbmass", 2.5 * LB, 0.05 * LB),
]  # fmt: skip


@pytest.mark.parametrize(("text", "kg", "quantum"), [*STRINGS, *MORE])
def test_mass_strings(text: str, kg: float | None, quantum: float | None) -> None:
    """The 22 strings and others: value in kg and what rounding leaves open."""
    cell = parse_mass(text)
    if kg is None:
        assert cell.kg is None
        assert cell.problem
        return
    assert (cell.problem, cell.doubt) == (None, "")
    assert cell.kg == pytest.approx(kg, rel=1e-14)
    assert quantum is None or cell.quantum_kg == pytest.approx(quantum, rel=1e-12)


@pytest.mark.parametrize("text", ["", "   ", "No value", "- None -"])
def test_the_four_empty_forms(text: str) -> None:
    """Nothing, in the forms of the spec: no mass and no problem."""
    cell = parse_mass(text)
    assert (cell.kg, cell.problem) == (None, None)


EMPTY = """- Keine -|Kein Wert|Aucune valeur|- Aucun -|Sin valor|Nessun valore|- なし -|无值|n/a|—|
<not specified>|Material <not specified>|<none>"""


@pytest.mark.parametrize("text", EMPTY.replace("\n", "").split("|"))
def test_localised_empty_forms(text: str) -> None:
    """Case 30: nothing, in other languages."""
    assert is_empty(text)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("12 bananas", "unknown unit “bananas”"),
        ("-0.3 kg", "negative"),
        ("1e400 kg", "not finite"),
        ("1 Mg", "unknown unit “Mg”"),
        ("heavy", "no mass"),
        ("1.2.3.4 kg", "no number"),
        ("12,34,56 g", "no number"),
        ("kg", "no mass"),
    ],
)
def test_what_cannot_be_read_says_why(text: str, words: str) -> None:
    """A problem is named; the cell has no mass."""
    cell = parse_mass(text)
    assert cell.kg is None
    assert words in (cell.problem or "")


def test_override_mark_is_kept() -> None:
    """Onshape marks masses that were set by hand."""
    assert parse_mass("0.3 kg*").overridden
    assert not parse_mass("0.3 kg").overridden


def test_ambiguous_until_the_column_decides() -> None:
    """ "1,234 kg" can be read two ways; the column's other cells decide."""
    assert parse_mass("1,234 kg").ambiguous
    assert parse_mass("1,234 kg 5 g").ambiguous
    assert parse_mass("1,234 kg", mark=Mark.POINT).kg == 1234
    assert parse_mass("1,234 kg", mark=Mark.COMMA).kg == pytest.approx(1.234)
    assert column_mark(["1,234 kg", "0,5 kg"]) is Mark.COMMA
    assert column_mark(["1,234 kg", "0.5 kg"]) is Mark.POINT
    assert column_mark(["1,234 kg", "0.5 kg", "0,5 kg"]) is None
    assert column_mark(["1,234 kg", "7 kg", ""]) is None


def test_a_mark_that_contradicts_makes_it_unreadable() -> None:
    """Where the user says "decimal comma", "0.3" is no number, not a guess."""
    assert parse_mass("0.35 kg", mark=Mark.COMMA).problem
    assert parse_mass("1,234.5 g", mark=Mark.COMMA).problem


def test_unit_of_the_header_counts_where_the_cell_has_none() -> None:
    """A cell's own unit wins over the header's."""
    assert parse_mass("300", unit="g").kg == pytest.approx(0.3)
    assert parse_mass("0.3 kg", unit="g").kg == pytest.approx(0.3)


@given(st.decimals(0, 99999, places=3), st.sampled_from([".", ","]), st.booleans())
def test_both_conventions_read_the_same_value(value: object, mark: str, grouped: bool) -> None:
    """A number written with either mark, grouped or not, reads back under that mark."""
    text = f"{value:,.3f}" if grouped else f"{value:.3f}"
    if mark == ",":
        text = text.translate(str.maketrans(",.", ".,"))
    number = parse_number(text, Mark(mark))
    assert number is not None
    assert number.value == pytest.approx(float(value))  # type: ignore[arg-type]


@given(st.text(max_size=40))
def test_no_text_raises(text: str) -> None:
    """Whatever stands in a cell: a mass, nothing, or a problem; and never a negative or infinite mass."""
    cell = parse_mass(text)
    assert (cell.kg is None) or (0 <= cell.kg < float("inf"))
    if cell.kg is None and cell.problem is None:
        assert is_empty(text)


@pytest.mark.parametrize("text", ["~2 kg", "≈2", "(2 kg)", "~(2)"])
def test_a_mass_that_may_not_be_meant_is_in_doubt(text: str, bom: Callable[..., BomTable]) -> None:
    """Roughly, in brackets (a reference, or negative in book-keeping): used, reported, never pushed."""
    table = bom(f'Name,Qty,Material,Mass (kg)\na,1,,"{text}"\n')
    assert (table["a"].mass_kg, table["a"].unsure) == (2, True)
    assert [(w.code, w.line) for w in table.warnings] == [(BomCode.AMBIGUOUS_MASS, 2)]


PROBLEMS = """2 st|2 x 3 kg|1-2 kg|2 kg/m|50 %|<0.1|1 lb 3 oz 2|2±x|2 slug|2 ozf|T3|1 kg 2 kg|1 kg 1000 g|
200 g 1 kg|1 kg 2 mm|#REF!|#DIV/0!|#N/A|Err:502|mm 3|5² kg"""


@pytest.mark.parametrize("text", PROBLEMS.replace("\n", "").split("|"))
def test_what_is_no_one_mass_is_a_problem(text: str) -> None:
    cell = parse_mass(text)
    assert cell.kg is None
    assert cell.problem
