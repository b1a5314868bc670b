# SPDX-License-Identifier: LGPL-2.1-or-later
"""The rows of a comparison with the server, for a table and as JSON values."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from typing import Any

from silo.bom.compare.bom_diff import BomDiff, rows_as_dicts
from silo.bom.message import message


def diff_json(diff: BomDiff) -> dict[str, Any]:
    """Return a comparison with the server as JSON values."""
    return {field.name: rows_as_dicts(getattr(diff, field.name)) for field in fields(diff)}


_TOLD = ("added", "quantity_changed", "conflicts", "removed", "kept", "manual")


def diff_rows(diff: BomDiff) -> Iterator[tuple[str, str, str]]:
    """Yield each line that differs or is a user's own: (field of the diff, part number, quantity in
    words).
    """
    disputed = {change.part_number for change in diff.conflicts}
    for kind in _TOLD:
        for change in getattr(diff, kind):
            if kind == "quantity_changed":
                quantity = f"{_quantity(change.remote_quantity)} → {_quantity(change.local_quantity)}"
            elif kind == "conflicts":
                kept = change.on_server(_quantity(change.remote_quantity))
                quantity = message(
                    "CAD {local_quantity}, Silo {kept}",
                    local_quantity=_quantity(change.local_quantity),
                    kept=kept,
                )
            elif kind == "manual" and change.part_number in disputed:
                continue
            else:
                quantity = _quantity(change.quantity)
            yield kind, change.part_number, quantity


def _quantity(value: float | None) -> str:
    return "?" if value is None else f"{value:g}"
