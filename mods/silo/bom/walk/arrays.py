# SPDX-License-Identifier: LGPL-2.1-or-later
"""How many instances an array shows."""

from __future__ import annotations

import math
from typing import Any

from silo.bom.walk.document import own
from silo.bom.walk.standard import millimetres


def left_out_by(obj: Any) -> str:
    """Return the object's own property that leaves it out of every BOM; "" if none does."""
    if own(obj, "Suppressed") is True:
        return "Suppressed"
    return "SiloBomExclude" if own(obj, "SiloBomExclude") is True else ""


def is_array(link: object) -> bool:
    """Return True for a link array, even one with a single element."""
    count = own(link, "ElementCount", 0)
    return isinstance(count, int) and count > 0


def elements(link: object) -> tuple[Any, ...]:
    """Return the element objects of a link array; () if it only has a count."""
    return tuple(own(link, "ElementList") or ()) if is_array(link) else ()


def array_count(link: object) -> int:
    """Count the instances of a link object: 1, or the elements of its array that are not excluded one
    by one.
    """
    if not is_array(link):
        return 1
    count: int = own(link, "ElementCount")
    return max(0, count - sum(map(bool, map(left_out_by, elements(link)))))


def draft_elements(array: object) -> tuple[Any, ...]:
    """Return the elements of an expanded Draft array; () if it is not expanded."""
    return tuple(own(array, "ElementList") or ())


def draft_count(array: object) -> int | None:
    """Count the instances of a Draft array; None if neither its count nor its pattern gives the number.

    Elements that are left out one by one do not count.
    """
    count = _all_of_draft(array)
    return None if count is None else max(0, count - sum(map(bool, map(left_out_by, draft_elements(array)))))


def _all_of_draft(array: object) -> int | None:
    count = own(array, "Count")
    if isinstance(count, int) and count > 0:
        return count
    pattern = {"ortho": _ortho, "polar": _polar, "circular": _circular}
    kind = own(array, "ArrayType")
    return pattern[kind](array) if isinstance(kind, str) and kind in pattern else None


def _whole(array: object, name: str) -> int | None:
    value = own(array, name)
    return value if isinstance(value, int) and not isinstance(value, bool) else None


def _ortho(array: object) -> int | None:
    numbers = [_whole(array, name) for name in ("NumberX", "NumberY", "NumberZ")]
    if any(number is None for number in numbers):
        return None
    x, y, z = (max(0, number or 0) for number in numbers)
    # Draft draws the original even if the first number is 0.
    return x * max(1, y) * max(1, z) if x else 1


def _polar(array: object) -> int | None:
    number = _whole(array, "NumberPolar")
    return None if number is None else max(1, number)


def _circular(array: object) -> int | None:
    rings, symmetry = _whole(array, "NumberCircles"), _whole(array, "Symmetry")
    radial, tangential = (millimetres(own(array, name)) for name in ("RadialDistance", "TangentialDistance"))
    if rings is None or radial is None or not tangential or tangential < 0:
        return None
    total, step = 1, max(1, symmetry or 1)
    for ring in range(1, min(rings, 10_000)):
        places = math.floor(2 * ring * radial * math.pi / tangential)
        total += math.floor(places / step) * step
    return total
