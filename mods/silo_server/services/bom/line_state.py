# SPDX-License-Identifier: LGPL-2.1-or-later
"""The stored forms of a line's state: as columns, as JSON of the history, and the mark of what a user saw."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from decimal import Decimal
from functools import lru_cache
from typing import Any

from silo_server.fields import names_of
from silo_server.user_json import dumps
from silo_server.values import LineState


def state_to_json(state: LineState) -> dict[str, Any]:
    """Write a line's state as the history stores it: only the fields that are set.

    Quantities are JSON numbers that read back exactly (:func:`silo.bom.quantities.quantity_of`).
    """
    fields = ((name, _json_of(getattr(state, name))) for name in names_of(LineState))
    return {
        name: value
        for name, value in fields
        if value is not None and value is not False and value != () and value != {}
    }


def _json_of(value: Any) -> Any:
    return float(value) if isinstance(value, Decimal) else value


def mark_of(state: LineState, cad_quantity: Decimal | None = None) -> str:
    """Make a short mark of what a user saw of a line; another state has another mark.

    cad_quantity
        the quantity in CAD that a conflict shows beside the line.
    """
    seen = dumps([state_to_json(state), _json_of(cad_quantity)])
    return hashlib.sha256(seen.encode()).hexdigest()[:16]


@lru_cache(maxsize=16384)
def stored_state(text: str) -> LineState:
    """Read a state that :func:`state_to_json` wrote."""
    values = dict(json.loads(text))
    if "reference_designators" in values:
        values["reference_designators"] = tuple(values["reference_designators"])
    return replace(LineState(values.pop("quantity"), values.pop("source")), **values)


def state_columns(state: LineState) -> dict[str, Any]:
    """Write a line's state as values for the columns of the table."""
    return {name: getattr(state, name) for name in names_of(LineState)} | {
        "reference_designators": dumps(list(state.reference_designators)),
        "metadata": dumps(dict(state.metadata)),
    }
