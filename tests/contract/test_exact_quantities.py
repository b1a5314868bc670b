# SPDX-License-Identifier: LGPL-2.1-or-later
"""What was typed comes back, digit by digit, and 0.1 × 3 is 0.3; on both databases."""

from __future__ import annotations

import json
from decimal import Decimal

import pytest
from hunting import BOTH
from hypothesis import given
from hypothesis import strategies as st
from server_testing import Api, bom

from silo.bom.quantities import decimal_text, quantity_of

# Fifteen digits: as many as a JSON number of any reader holds.
TYPED = ("0.1", "0.3", "1.005", "123456789.123456", "0.000000000000001", "3.00", "1e-7", "99999999.9999999")


@given(st.decimals("0.000000001", "999999999", places=None, allow_nan=False).filter(bool))
def test_fifteen_digits_travel_as_a_number(typed: Decimal) -> None:
    """Through a double and its text; a brute-force reader of JSON finds the digits that were typed."""
    short = Decimal(f"{typed:.14e}")
    sent = json.dumps(float(short))
    assert quantity_of(json.loads(sent)) == short
    assert Decimal(decimal_text(quantity_of(json.loads(sent)))) == short


@pytest.mark.parametrize(
    ("computed", "meant"), [(0.1 + 0.2, "0.3"), (0.1 * 3, "0.3"), (1.1 + 2.2, "3.3"), (4.35 * 100, "435")]
)
def test_the_dust_of_arithmetic_is_none_of_a_quantity(computed: float, meant: str) -> None:
    """A double that was typed with seventeen digits keeps them."""
    assert decimal_text(quantity_of(computed)) == meant
    assert quantity_of(0.12345678901234567) == Decimal("0.12345678901234566")  # the same double


@BOTH
def test_what_was_typed_comes_back(api: Api) -> None:
    """As a number and as text, in the line, in its history, in the file and in a frozen revision."""
    parent = api.item()
    for text in TYPED:
        for sent in (text, float(text)):
            child = api.item()
            api.good("POST", bom(parent), {"child_part_number": child, "quantity": sent})
            raw = api.call("GET", bom(parent)).body.decode()
            (line,) = (
                one for one in json.loads(raw, parse_float=Decimal) if one["child_part_number"] == child
            )
            assert Decimal(str(line["quantity"])) == Decimal(text), text
    many = "0.12345678901234567890"
    answer = api.bad(400, "POST", bom(parent), {"child_part_number": api.item(), "quantity": many})
    assert "at most 15 digits" in str(answer)


@BOTH
def test_three_times_a_tenth(api: Api) -> None:
    """Over levels, in a merge that adds up, and in what a user edits."""
    top, sub, part = api.items(3)
    api.add_line(top, sub, quantity=3)
    api.add_line(sub, part, quantity=0.1)
    (row,) = api.get(bom(top, "flat"))["flat_bom"]
    assert row["total_quantity"] == 0.3
    other = api.item()
    entries = [{"child_part_number": part, "quantity": 0.1}] * 3
    answer = api.good("POST", bom(other, "merge"), {"source": "assembly", "entries": entries})
    assert answer["diff"]["added"] == [{"part_number": part, "quantity": 0.3}]
    assert api.lines(other)[part]["quantity"] == 0.3
    api.merge(other, {part: 0.1 + 0.2})
    assert api.get(bom(other, "review"))["version"] == 1
