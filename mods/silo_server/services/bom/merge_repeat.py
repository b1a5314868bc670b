# SPDX-License-Identifier: LGPL-2.1-or-later
"""The answer of a merge as it is kept, for a request that repeats the ``sync_id``.

Most of an answer says what is as it was; stored in full, a vault's nightly syncs would be gigabytes. So the
unchanged lines are left out and, for a repeat, read from the history again.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from silo.bom.quantities import plain
from silo_server.db.answers import KeptAnswer
from silo_server.db.transaction import Tx
from silo_server.services.bom.history import state_at
from silo_server.services.bom.line_record import LineRecord
from silo_server.user_json import dumps
from silo_server.values import Item, Line, LineState


def without_unchanged(
    lines_before: Sequence[Line], changes: Sequence[LineRecord], answer: Mapping[str, Any]
) -> str | None:
    """Write the answer without its unchanged lines, which the history has; None if the history lacks them."""
    unchanged = answer["diff"]["unchanged"]
    places = {pair["part_number"]: place for place, pair in enumerate(unchanged)}
    lines = [line for line in lines_before if line.state.rel_type == "component"]
    same = [line for line in lines if line.child_part_number in places]
    order = sorted(range(len(same)), key=lambda n: places[same[n].child_part_number])
    if [_pair(same[n].child_part_number, same[n].state) for n in order] != unchanged:
        return None
    others = {line.id for line in lines} | {change.line_id for change in changes}
    kept = {**answer, "diff": {**answer["diff"], "unchanged": []}}
    stored: dict[str, Any] = {"answer": kept, "others": sorted(others - {line.id for line in same})}
    if order != sorted(order):
        stored["order"] = order
    return dumps(stored)


def rebuilt(tx: Tx, parent: Item, earlier: KeptAnswer) -> str:
    """Write the whole answer again from what :func:`without_unchanged` wrote and the history."""
    kept = json.loads(earlier.text)
    others = set(kept["others"])
    same = [
        _pair(line.child.part_number, line.state)
        for line in state_at(tx, parent, earlier.change_id or 0)
        if line.state.rel_type == "component" and line.line_id not in others
    ]
    kept["answer"]["diff"]["unchanged"] = [same[n] for n in kept.get("order", range(len(same)))]
    return dumps(kept["answer"])


def _pair(part_number: str, state: LineState) -> dict[str, Any]:
    return {"part_number": part_number, "quantity": plain(state.quantity)}
