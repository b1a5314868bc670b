# SPDX-License-Identifier: LGPL-2.1-or-later
"""The summary of a product over HTTP."""

from __future__ import annotations

from typing import Any

from silo.bom.quantities import plain
from silo_server.fields import to_wire
from silo_server.routes.bom import bom_router
from silo_server.routes.call import Viewer
from silo_server.services.items import get_item
from silo_server.services.product.summary import Summary
from silo_server.services.product.summary_read import product_cost, summary_of
from silo_server.times import wire_time

router = bom_router("bom")


def open_to_wire(summary: Summary) -> dict[str, Any]:
    boms = summary.open.values()
    return {
        "open": {each.part_number: each.questions for each in boms if each.questions},
        "incomplete": {each.part_number: each.incomplete for each in boms if each.incomplete},
    }


@router.get("/summary")
def get_summary(call: Viewer, part_number: str) -> dict[str, Any]:
    """Return the summary of a product over all levels: what is open, mass, cost, counts, the last change.

    ``total_mass_kg`` and ``totals`` do not include the parts that ``mass_missing`` and ``cost_missing``
    count; the first of these are named.
    """
    with call.read() as tx:
        item = get_item(tx, part_number)
        summary = summary_of(tx, item)
        cost = product_cost(tx, summary)
    return {
        "part_number": item.part_number,
        **open_to_wire(summary),
        "questions": summary.questions,
        **to_wire(
            summary, "open", "worth", "as_part", "levels", "no_mass", "no_cost", "open_graded", "changed"
        ),
        "levels": len(summary.levels),
        "total_mass_kg": plain(summary.worth.mass),
        "totals": [
            {"currency": currency, "total_cost": plain(total)} for currency, total in cost.totals.items()
        ],
        "mass_missing": {"count": summary.no_mass, "first": list(summary.mass_missing)},
        "cost_missing": {"count": cost.unknown, "first": list(cost.missing)},
        "last_change": {
            "at": wire_time(summary.changed.at),
            "user": summary.changed.username,
            "item": summary.changed.part_number,
        },
    }
