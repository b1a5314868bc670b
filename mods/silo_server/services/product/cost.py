# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a part costs for a quantity, and where that comes from: the one answer.

A bought part costs what its supplier part asks for that quantity
(:func:`silo_server.services.suppliers.choose`): the price of the break that the ordered amount reaches. A
part without such a price costs its ``standard_cost``. A part with neither is not known, and is counted.

A product costs the sum over the parts of its flat list, each for its whole quantity. A bought assembly is
one part there: its own price counts, and not that of what is in it. So the sum of a roll-up, of an item's
page, of an order list and of an export is one number. What is paid for whole packs and minimum amounts is
another question, which an order list answers beside it.

A price that is the same for every quantity is steady: it adds up level by level. A graded price depends on
the quantity of the whole product, or on the rates, and is asked for when the product is shown.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from decimal import ROUND_CEILING, Decimal
from enum import StrEnum
from typing import NamedTuple

from silo.bom.quantities import as_decimal, exact_product, exact_sum
from silo.bom.units import unit_of
from silo_server.services.product.amounts import UNIT_OPEN, amount_of
from silo_server.services.product.flat import flatten
from silo_server.services.product.graph import Graph, order_of
from silo_server.services.product.parts import RolledItem, currency_of, positive_number
from silo_server.services.product.worth import MassAndCost
from silo_server.services.suppliers import SupplierOffer, choose, supplier_parts_of

ONE = Decimal(1)


class CostSource(StrEnum):
    """Where the cost of a part comes from."""

    SUPPLIER = "supplier part"
    PRICE_BREAK = "price break"
    STANDARD = "standard cost"
    UNKNOWN = "not known"


class PartCost(NamedTuple):
    """What a quantity of a part costs.

    price
        of one, in ``currency``; None if it is not known.
    offer
        of a bought part with a supplier: what to order, in whole packs.
    """

    quantity: Decimal
    price: Decimal | None = None
    currency: str | None = None
    source: CostSource = CostSource.UNKNOWN
    offer: SupplierOffer | None = None

    @property
    def cost(self) -> Decimal | None:
        """Return what the quantity costs; None if it is not known."""
        return None if self.price is None else exact_product((self.quantity, self.price))

    @property
    def words(self) -> str:
        """Describe where the cost comes from."""
        if self.offer is None or self.source not in (CostSource.SUPPLIER, CostSource.PRICE_BREAK):
            return self.source
        return f"{self.source}: {self.offer.of.supplier} {self.offer.of.number}".strip()


def part_cost(part: RolledItem, quantity: Decimal, rates: Mapping[str, Decimal]) -> PartCost:
    """Return what so much of a part costs, in the part's own unit, and where that comes from.

    rates
        as in :func:`silo_server.services.suppliers.choose`.
    """
    whole = unit_of(part.unit).counts_pieces
    needed = quantity.to_integral_value(ROUND_CEILING) if whole else quantity
    offer = choose(supplier_parts_of(part), needed, rates, whole=whole) if part.is_bought else None
    if offer is not None and offer.price is not None and part.supplier_parts:
        first = offer.of.prices[0][1] == offer.price
        source = CostSource.SUPPLIER if first else CostSource.PRICE_BREAK
        return PartCost(quantity, offer.price, offer.of.currency, source, offer)
    standard = positive_number(part.properties, "standard_cost")
    if standard is None:
        return PartCost(quantity, offer=offer)
    return PartCost(quantity, as_decimal(standard), currency_of(part.properties), CostSource.STANDARD, offer)


def steady_cost(part: RolledItem) -> PartCost | None:
    """Return what one piece costs if one always costs that; None if the price is graded."""
    if part.is_bought and part.supplier_parts:
        offers = supplier_parts_of(part)
        offers = [offer for offer in offers if offer.preferred] or offers
        prices = offers[0].prices
        if len(offers) > 1 or len(prices) > 1 or (prices and prices[0][0] > 1):
            return None
    return part_cost(part, ONE, {})


def own_worth(item_id: int, part: RolledItem) -> MassAndCost:
    """Return what one piece of an item weighs [kg] and costs by itself, whatever is in it."""
    mass, steady = positive_number(part.properties, "mass_kg"), steady_cost(part)
    exact = None if mass is None else as_decimal(mass)
    if steady is None:
        return MassAndCost(exact, mass is not None, {}, cost_whole=True, graded={item_id: ONE})
    known = steady.price is not None and steady.currency is not None
    costs = {str(steady.currency): steady.price} if steady.price is not None else {}
    return MassAndCost(exact, mass is not None, costs, known)


def at_prices(worth: MassAndCost, prices: Mapping[int, PartCost]) -> MassAndCost:
    """Return a worth with the graded prices added; a part without a price leaves it incomplete."""
    if not worth.graded:
        return worth
    totals, known = {currency: [cost] for currency, cost in worth.costs.items()}, worth.cost_whole
    for part_id, amount in worth.graded.items():
        found = prices.get(part_id)
        if found is None or found.price is None or found.currency is None:
            known = False
            continue
        totals.setdefault(found.currency, []).append(exact_product((amount, found.price)))
    costs = {currency: exact_sum(of_it) for currency, of_it in totals.items()}
    return worth._replace(costs=costs, cost_whole=known, graded={})


@dataclass(frozen=True, slots=True)
class ProductCost:
    """What so many pieces of a product cost.

    totals
        per currency, without the ``unknown`` parts; ``missing`` are the first of their part numbers.
    prices
        of its parts, by internal id, each for its whole quantity.
    """

    totals: Mapping[str, Decimal]
    unknown: int
    missing: Sequence[str]
    prices: Mapping[int, PartCost]


def in_base(totals: Mapping[str, Decimal], rates: Mapping[str, Decimal]) -> Decimal:
    """Add up costs in the site's own currency, without those in a currency that has no rate."""
    return exact_sum(exact_product((cost, rates[code])) for code, cost in totals.items() if code in rates)


def added_up(costs: Iterable[PartCost]) -> dict[str, Decimal]:
    """Add up the costs that are known, per currency."""
    totals: dict[str, list[Decimal]] = {}
    for part in costs:
        if part.cost is not None:
            totals.setdefault(str(part.currency), []).append(part.cost)
    return {currency: exact_sum(of_it) for currency, of_it in totals.items()}


def bought_whole(graph: Graph, parts: Mapping[int, RolledItem]) -> set[int]:
    """Find the items below the root (internal ids) that are bought: each is one part, whatever is in it."""
    return {item_id for item_id, part in parts.items() if part.is_bought} - {graph.root.id}


def prices_in(
    graph: Graph, parts: Mapping[int, RolledItem], rates: Mapping[str, Decimal], pieces: int = 1
) -> dict[int, PartCost]:
    """Return the cost of each part of a product, for all that so many pieces of the product need of it."""
    return {
        row.line.child_id: part_cost(parts[row.line.child_id], exact_product((row.total, pieces)), rates)
        for row in flatten(graph, bought_whole(graph, parts))
    }


def with_costs(
    graph: Graph,
    parts: Mapping[int, RolledItem],
    worths: Mapping[int, MassAndCost],
    prices: Mapping[int, PartCost],
) -> dict[int, MassAndCost]:
    """Return the worth of each item of a whole graph at these prices; masses stay as they are."""
    made = {item_id: at_prices(own_worth(item_id, part), prices) for item_id, part in parts.items()}
    whole = bought_whole(graph, parts)
    for item_id in reversed(order_of(graph)):
        lines = graph.components(item_id)
        if not lines or item_id in whole:
            continue
        totals: dict[str, list[Decimal]] = {}
        known = True
        for line in lines:
            below, amount = made[line.child_id], amount_of(line)
            if amount is None:
                known = False
                continue
            known = known and below.cost_whole
            for currency, cost in below.costs.items():
                totals.setdefault(currency, []).append(exact_product((amount, cost)))
        costs = {currency: exact_sum(of_it) for currency, of_it in totals.items()}
        made[item_id] = made[item_id]._replace(costs=costs, cost_whole=known)
    return {
        item_id: made[item_id]._replace(mass=worth.mass, mass_whole=worth.mass_whole)
        for item_id, worth in worths.items()
        if item_id in made
    }


def shown_worth(
    worth: MassAndCost, prices: Mapping[int, PartCost], doubts: Collection[str] = ()
) -> MassAndCost:
    """Return the worth of a row at these prices; what the unit of a line leaves open is incomplete."""
    priced = at_prices(worth, prices)
    return priced._replace(mass_whole=False, cost_whole=False) if UNIT_OPEN in doubts else priced
