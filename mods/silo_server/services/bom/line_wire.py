# SPDX-License-Identifier: LGPL-2.1-or-later
"""A BOM line as the API sends it."""

from __future__ import annotations

from typing import Any

from silo.bom.quantities import plain
from silo_server.fields import to_wire
from silo_server.services.product.amounts import unit_is_open
from silo_server.values import Line, LineState


def line_to_wire(line: Line, parent_part_number: str) -> dict[str, Any]:
    """Return a line as ``GET …/bom`` sends it.

    It has the contract's keys, and ours for overrides and newer revisions.
    """
    return {
        "id": line.id,
        "parent_part_number": parent_part_number,
        **child_to_wire(line),
        **line_state_to_wire(line.state),
        **revisions_to_wire(line),
        "unit_open": unit_is_open(line),
    }


def child_to_wire(line: Line) -> dict[str, Any]:
    """Return the child of a line as the API sends it."""
    return {
        "child_part_number": line.child_part_number,
        "child_id": line.child_uuid,
        "child_name": line.child_name,
        "child_description": line.child_description,
        "child_item_type": line.child_item_type,
        "child_archived": line.child_archived,
        "child_unit": line.child_unit,
    }


def line_state_to_wire(state: LineState) -> dict[str, Any]:
    """Return a line's state as the API sends it, with all fields."""
    return to_wire(state) | {"quantity": plain(state.quantity), "cad_quantity": plain(state.cad_quantity)}


def revisions_to_wire(line: Line) -> dict[str, Any]:
    """Return which revision of the child counts, and whether there is a newer one."""
    pinned, newest = line.state.child_revision, line.child_current_revision
    return {
        "effective_revision": pinned if pinned is not None else newest,
        "newer_revision_exists": line.newer_revision_exists,
    }
