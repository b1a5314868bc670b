# SPDX-License-Identifier: LGPL-2.1-or-later
"""Units: spellings, kinds, and exact conversion."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from silo.bom.units import PIECES, UNITS, UnitKind, converted, known_unit, unit_of

# From the definitions of the units, not from our table: [SI units] of one.
DEFINED = {
    "mm": Fraction(1, 1000), "cm": Fraction(1, 100), "m": Fraction(1), "in": Fraction(254, 10000),
    "ft": Fraction(12 * 254, 10000), "g": Fraction(1, 1000), "kg": Fraction(1), "t": Fraction(1000),
    "mm²": Fraction(1, 10**6), "m²": Fraction(1),
}  # fmt: skip


@pytest.mark.parametrize("text", ["Stk.", "PCS", "ea", "", None, "  ", "Stück", "個"])
def test_pieces_are_read_in_every_spelling(text: str | None) -> None:
    assert unit_of(text) == PIECES


@pytest.mark.parametrize(
    ("text", "symbol"), [("MM", "mm"), ("Meter", "m"), ("lfm", "m"), ("m2", "m²"), ("Ltr.", "l")]
)
def test_spellings_of_other_units(text: str, symbol: str) -> None:
    assert unit_of(text).symbol == symbol


def test_no_unit_is_the_unit_of_the_item() -> None:
    assert unit_of("", "m").symbol == "m"
    assert unit_of("mm", "m").symbol == "mm"


def test_a_word_that_is_no_unit_equals_itself_only() -> None:
    box, roll = unit_of("box"), unit_of("roll")
    assert known_unit("box") is None
    assert box.kind is UnitKind.OTHER
    assert converted(Decimal(3), box, unit_of(" box ")) == 3
    assert converted(Decimal(3), box, roll) is None
    assert converted(Decimal(3), box, PIECES) is None


@given(
    st.sampled_from(sorted(DEFINED)),
    st.sampled_from(sorted(DEFINED)),
    st.decimals("0.001", "100000", places=3),
)
def test_a_quantity_converts_by_the_definition_of_its_units(a: str, b: str, quantity: Decimal) -> None:
    result = converted(quantity, UNITS[a], UNITS[b])
    if UNITS[a].kind is not UNITS[b].kind:
        assert result is None
    else:
        assert result is not None
        exact = Fraction(quantity) * DEFINED[a] / DEFINED[b]
        assert abs(Fraction(result) - exact) <= exact / 10**24


def test_half_a_metre_and_500_mm_are_equal() -> None:
    assert converted(Decimal(500), UNITS["mm"], UNITS["m"]) == Decimal("0.5")
    assert str(converted(Decimal("0.5"), UNITS["m"], UNITS["mm"])) == "500"
