# SPDX-License-Identifier: LGPL-2.1-or-later
"""How many instances an array shows: link arrays, Draft arrays, and single elements that are left out.

Draft arrays have ``Count`` where they are made of links. Those without links have none before FreeCAD 1.0,
and some are saved with 0; then the numbers of the pattern count (``draftobjects/array.py``, 0.20 to 1.1).
"""

from __future__ import annotations

import math
from typing import Any

from silo.bom.document import own
from silo.bom.walk.standard import millimetres


def left_out_by(obj: Any) -> str:
    """The object's own property that leaves it out of every BOM; "" where none does."""
    if own(obj, "Suppressed") is True:
        return "Suppressed"
    return "SiloBomExclude" if own(obj, "SiloBomExclude") is True else ""


def is_array(link: object) -> bool:
    """True for a link array, also one with a single element."""
    count = own(link, "ElementCount", 0)
    return isinstance(count, int) and count > 0


def elements(link: object) -> tuple[Any, ...]:
    """The elements of a link array that has them as objects; none where the array only has a count."""
    return tuple(own(link, "ElementList") or ()) if is_array(link) else ()


def array_count(link: object) -> int:
    """Instances of one link object: 1, or the elements of its array that are not left out one by one."""
    count = own(link, "ElementCount", 0)
    if not isinstance(count, int) or count <= 0:
        return 1
    return max(0, count - sum(1 for element in elements(link) if left_out_by(element)))


def draft_count(array: object) -> int | None:
    """Instances of a Draft array; None where neither its count nor its pattern says."""
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
    # Draft draws the original also where the first number is 0.
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
