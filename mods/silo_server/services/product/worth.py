# SPDX-License-Identifier: LGPL-2.1-or-later
"""What one piece of an item weighs and costs, and what one unit of a line does."""

from __future__ import annotations

from collections.abc import Mapping
from decimal import Decimal
from typing import NamedTuple

from silo.bom.quantities import exact_product
from silo_server.services.product.amounts import of_one
from silo_server.values import Line

_NONE: Mapping[int, Decimal] = {}


class MassAndCost(NamedTuple):
    """What one piece of an item weighs [kg] and costs, per currency; of an assembly, all that is in it.

    ``whole``: nothing that belongs to it is without a value.

    graded
        parts (internal ids) whose price depends on the quantity → how much of each is in one piece. Their
        cost is not in ``costs`` (:mod:`silo_server.services.product.cost`).
    """

    mass: Decimal | None
    mass_whole: bool
    costs: Mapping[str, Decimal]
    cost_whole: bool
    graded: Mapping[int, Decimal] = _NONE

    def times(self, amount: Decimal | int) -> MassAndCost:
        """Return the worth of so much."""
        return self._replace(
            mass=None if self.mass is None else exact_product((self.mass, amount)),
            costs={currency: exact_product((cost, amount)) for currency, cost in self.costs.items()},
            graded={part_id: exact_product((held, amount)) for part_id, held in self.graded.items()},
        )


NOTHING_KNOWN = MassAndCost(None, mass_whole=False, costs={}, cost_whole=False)


def in_unit_of(line: Line, worth: MassAndCost) -> MassAndCost:
    """Return what one unit of a line weighs and costs, from what one unit of its child does."""
    if line.state.unit is None and line.child_unit is None:
        return worth
    one = of_one(line)
    return NOTHING_KNOWN if one is None else worth.times(one)
