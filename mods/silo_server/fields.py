# SPDX-License-Identifier: LGPL-2.1-or-later
"""The fields of a frozen value, named once: made from a row, and as the API sends them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TypeVar

from silo_server.times import wire_time

T = TypeVar("T")


def names_of(kind: Any) -> Iterable[str]:
    """Return the names of the fields of a frozen value's class."""
    names: Iterable[str] = kind.__dataclass_fields__  # dataclasses.fields() makes a new tuple for each row
    return names


def from_row(kind: type[T], row: Any, /, **given: Any) -> T:
    """Make a frozen value from a row with columns named as its fields; ``given`` wins over the row."""
    values = row._asdict() | given  # in half the time of an attribute for each
    return kind(**{name: values[name] for name in names_of(kind)})


def to_wire(value: Any, *left_out: str) -> dict[str, Any]:
    """Return the fields of a frozen value as the API sends them, under their own names."""
    kind = type(value)
    if kind not in _TIMES:
        # Found once for each class: a BOM has thousands of lines.
        _TIMES[kind] = {
            name: name in ("at", "since") or name.endswith(("_at", "_since")) for name in names_of(kind)
        }
    return {
        name: wire_time(getattr(value, name)) if is_time else getattr(value, name)
        for name, is_time in _TIMES[kind].items()
        if name not in left_out
    }


_TIMES: dict[type, dict[str, bool]] = {}  # class → field → whether it is a time
