# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is ordered: quantity × N, whole packs, minimum, the price of that quantity; against brute force."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from itertools import count

from hypothesis import example, given
from hypothesis import strategies as st

from silo.bom.quantities import decimal_text
from silo_server.services.suppliers import (
    SupplierPart,
    choose,
    from_json,
    numbers_of,
    texts_of,
    to_json,
)
from silo_server.services.suppliers import _Reader as Reader

amounts = st.decimals("0.001", "5000", places=3)
sizes = st.decimals("0.5", "50", places=1)
prices = st.lists(
    st.tuples(
        st.integers(1, 400).map(Decimal), st.decimals("0", "9", places=4) | st.decimals("0", "99", places=3)
    ),
    max_size=5,
    unique_by=lambda one: one[0],
).map(lambda pairs: tuple(sorted(pairs)))
parts = st.builds(
    SupplierPart,
    supplier=st.sampled_from(["A", "B", "Ü & Co"]),
    number=st.text("0123456789-", max_size=5),
    link=st.sampled_from(["", "https://acme.example/4711"]),
    pack_size=sizes,
    minimum=st.decimals("0", "300", places=0),
    prices=prices,
    currency=st.sampled_from(["EUR", "USD", "XXX"]),
    lead_time_days=st.none() | st.integers(0, 300),
    preferred=st.booleans(),
)
RATES = {"EUR": Decimal(1), "USD": Decimal("0.9")}


def by_counting(part: SupplierPart, needed: Decimal) -> Decimal:
    """Packs are put on a heap until they are enough."""
    for packs in count():
        heap = Fraction(part.pack_size) * packs
        if heap >= Fraction(needed) and heap >= Fraction(part.minimum):
            return packs * part.pack_size
    raise AssertionError


def by_looking(part: SupplierPart, amount: Decimal) -> Decimal | None:
    """Of all prices from a quantity that is reached, that of the largest; less than 1 costs as 1 does."""
    reached = {least: price for least, price in part.prices if least <= max(amount, Decimal(1))}
    return reached[max(reached)] if reached else None


TWO_PRICES = SupplierPart("A", prices=((Decimal(1), Decimal(2)), (Decimal(100), Decimal(1))))


@given(parts, amounts)
@example(TWO_PRICES, Decimal(100))
@example(TWO_PRICES, Decimal(50))
def test_amount_and_price(part: SupplierPart, needed: Decimal) -> None:
    """The least number of whole packs that is enough, at the price of that many."""
    offer = choose([part], needed, RATES)
    assert offer is not None
    assert offer.amount == by_counting(part, needed)
    assert offer.price == by_looking(part, offer.amount)
    assert offer.cost == (None if offer.price is None else offer.price * offer.amount)
    rate = RATES.get(part.currency)
    assert offer.in_base == (None if offer.cost is None or rate is None else offer.cost * rate)
    if offer.cost is None:
        return
    larger = [by_counting(part, least) for least, _ in part.prices if least > offer.amount]
    costs = [(price * more, more) for more in larger if (price := by_looking(part, more)) is not None]
    best = min((one for one in costs if one[0] < offer.cost), default=None)
    assert offer.cheaper == (best and (best[1], best[0]))


@given(st.lists(parts, max_size=5), amounts)
def test_the_choice(several: list[SupplierPart], needed: Decimal) -> None:
    """The preferred; else the cheapest in the site's currency, the first of equals; nothing for nothing."""
    chosen = choose(several, needed, RATES)
    if not several:
        assert chosen is None
        return
    assert chosen is not None
    among = [one for one in several if one.preferred] or several
    assert chosen.of in among
    alone = [choose([one], needed, RATES) for one in among]
    costs = [one.in_base for one in alone if one and one.in_base is not None]
    if costs:
        assert chosen.in_base == min(costs)
        assert chosen == next(one for one in alone if one and one.in_base == min(costs))
    elif any(one and one.cost is not None for one in alone):
        assert chosen.cost is not None
    else:
        assert chosen == alone[0]
    nothing = choose(several, Decimal(0), RATES)
    assert nothing is not None
    assert nothing.amount == 0


@given(parts)
def test_what_is_shown_is_read_back(part: SupplierPart) -> None:
    """Through the cells of the table, and through what is stored; money is exact."""
    assert from_json(to_json(part)) == part
    for write in (decimal_text, lambda value: decimal_text(value).replace(".", ",")):
        texts = texts_of(part, write)
        assert not [text for text in texts["prices"].replace(":", ";").split("; ") if text.endswith(".0")]
        read, problems = Reader(known=numbers_of([part], write)).read(texts)
        assert (read, problems) == (part, [])


@given(st.text(max_size=30), st.text(max_size=30), st.text(max_size=30))
def test_any_text_is_read_or_refused(prices: str, size: str, days: str) -> None:
    """A hostile cell costs a sentence, never a fault; what is read fits the bounds."""
    part, problems = Reader().read(
        {"supplier": "A", "prices": prices, "pack_size": size, "lead_time_days": days, "preferred": days}
    )
    if not problems:
        assert part.pack_size > 0
        assert all(price >= 0 and least > 0 for least, price in part.prices)
        assert from_json(to_json(part)) == part
