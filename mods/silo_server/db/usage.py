# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which items an item is in, on any level, as a query."""

from __future__ import annotations

from typing import Any

from sqlalchemy import ColumnElement, Select, select

from silo_server.db.tables import bom_lines, items, product_summaries


def uses_of(which: ColumnElement[bool], *, kept: bool = False) -> Select[Any]:
    """Select the ids of these items and of all that they are in, on any level.

    kept
        only items with a summary; above an item without one, nothing has one.
    """
    above = select(items.c.id).where(which).cte("above", recursive=True)
    step = select(bom_lines.c.parent_id).join(above, bom_lines.c.child_id == above.c.id)
    if kept:
        step = step.join(product_summaries, product_summaries.c.item_id == bom_lines.c.parent_id)
    return select(above.union(step).c.id)
