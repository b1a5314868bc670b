# SPDX-License-Identifier: LGPL-2.1-or-later
"""Values as the API sends them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pydantic_core

from silo_server.services.bom.last_sync import LastSync
from silo_server.services.bom.lines import child_to_wire, line_state_to_wire, revisions_to_wire
from silo_server.services.bom.tree import Occurrence
from silo_server.values import Item, LineState, number, to_wire


def item_to_wire(item: Item, last_sync: LastSync | None = None) -> dict[str, Any]:
    """An item, under the contract's names; ``last_sync`` where it was looked up."""
    told = {} if last_sync is None else {"last_sync": last_sync.to_wire()}
    return told | {"id": item.uuid} | to_wire(item, "id", "uuid", "created_as")


def render_expanded(rows: Sequence[Occurrence]) -> bytes:
    """The rows as a JSON list, each a line with ``depth`` and ``total_quantity``.

    Written from pieces that are made once per child and once per state: a tree of 100 000 occurrences has few
    of either. The pieces are those of ``line_to_wire``.
    """
    children: dict[int, bytes] = {}
    parents: dict[str, bytes] = {}
    states: dict[int, bytes] = {}
    keep: list[LineState] = []  # states are found by their identity, which must not be given out anew
    parts: list[bytes] = []
    for line, parent, depth, total in rows:
        line_state = line.state
        if (child := children.get(line.child_id)) is None:
            child = children[line.child_id] = _members(child_to_wire(line))
        if (state := states.get(id(line_state))) is None:
            keep.append(line_state)
            state = states[id(line_state)] = _members(line_state_to_wire(line_state))
        if (above := parents.get(parent)) is None:
            above = parents[parent] = pydantic_core.to_json(parent)
        if line_state.child_revision is None:
            revisions = b'"effective_revision":%d,"newer_revision_exists":false' % line.child_current_revision
        else:
            revisions = _members(revisions_to_wire(line))
        parts.append(
            b'{"id":"%b","parent_part_number":%b,%b,%b,%b,"depth":%d,"total_quantity":%b}'
            % (line.id.encode(), above, child, state, revisions, depth, repr(number(total)).encode())
        )
    return b"[" + b",".join(parts) + b"]"


def _members(value: Mapping[str, Any]) -> bytes:
    return pydantic_core.to_json(value)[1:-1]
