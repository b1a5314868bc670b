# SPDX-License-Identifier: LGPL-2.1-or-later
"""From a link to the real part: chains, sub-object paths, arrays on the way, copy-on-change, mirrors.

``getLinkedObject()`` is no help here: it returns the link itself for every array and for an AssemblyLink
(measured, FreeCAD 0.20 and 1.0). So the chain is followed by ``LinkedObject``, one hop at a time.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

from silo.bom.document import LinkProblem, derived, object_name, own, same_document
from silo.bom.findings import FindingCode

Inspect = Callable[[Any], "LinkProblem | None"]

# FreeCAD's names of geometry in a sub-name; ";" and "?" begin mapped and missing element names.
_ELEMENT = re.compile(r"(?:Face|Edge|Vertex|Wire|Shell|Solid|CompSolid|Compound)\d+$|[;?].*")

# A longer chain of links is a loop or an attack.
_MAX_HOPS = 256


@dataclass(frozen=True, slots=True)
class Target:
    """The end of a link. ``obj`` is None where ``problem`` says why.

    count
        instances: every array on the way multiplies.
    element
        the sub-element ("Face1") where the link is a reference to geometry, not a component.
    """

    obj: Any
    count: int = 1
    mirrored: bool = False
    variant: bool = False
    element: str = ""
    problem: LinkProblem | None = None


def is_link(obj: object) -> bool:
    """An ``App::Link`` (or ``App::LinkPython``); elements of arrays and groups are none."""
    return derived(obj, "App::Link")


def is_assembly_link(obj: object) -> bool:
    """An instance of an assembly (FreeCAD >= 1.0); derived from App::Part, so ask this first."""
    return derived(obj, "Assembly::AssemblyLink")


def array_count(link: object) -> int:
    """Instances of one link object: ``max(1, ElementCount)``, its elements not counted again."""
    count = own(link, "ElementCount", 0)
    return count if isinstance(count, int) and count > 0 else 1


def is_array(link: object) -> bool:
    """True for a link array, also one with a single element."""
    count = own(link, "ElementCount", 0)
    return isinstance(count, int) and count > 0


def _components(vector: Any) -> tuple[float, float, float] | None:
    try:
        if hasattr(vector, "x"):
            return float(vector.x), float(vector.y), float(vector.z)
        x, y, z = vector
        return float(x), float(y), float(z)
    except (TypeError, ValueError):
        return None


def _negative(vector: Any) -> bool:
    parts = _components(vector)
    return parts is not None and parts[0] * parts[1] * parts[2] < 0


def is_mirrored(link: object) -> bool:
    """True for a negative scale: an odd number of negative axes makes the other hand of a part."""
    scales: Iterable[Any] = own(link, "ScaleList") or ()
    if any(_negative(vector) for vector in scales):
        return True
    vector = getattr(link, "ScaleVector", None)
    if _negative(vector):
        return True
    scale = own(link, "Scale")
    return isinstance(scale, int | float) and scale < 0 and _components(vector) in (None, (1.0, 1.0, 1.0))


def _no_target(link: object, inspect: Inspect | None) -> LinkProblem:
    known = getattr(link, "LinkProblem", None)
    if not isinstance(known, LinkProblem) and inspect is not None:
        known = inspect(link)
    if isinstance(known, LinkProblem):
        return known
    return LinkProblem(FindingCode.BROKEN_LINK)


def _copy_source(link: object) -> Any:
    """The original of a copy-on-change link: ``LinkedObject`` is then a local copy with other parameters."""
    source = own(link, "LinkCopyOnChangeSource")
    return source[0] if isinstance(source, tuple) else source


def resolve_target(link: object, inspect: Inspect | None = None) -> Target:
    """Follow ``link`` to the real part or assembly; a broken link gives a ``problem``, no exception."""
    found = Target(obj=None, count=1)
    current: Any = link
    for _ in range(_MAX_HOPS):
        if is_link(current):
            found = replace(
                found,
                count=found.count * array_count(current),
                mirrored=found.mirrored ^ is_mirrored(current),
            )
        elif not is_assembly_link(current) and not derived(current, "App::LinkElement"):
            return replace(found, obj=current)
        source = _copy_source(current)
        if source is not None:
            found, following = replace(found, variant=True), source
        else:
            following = getattr(current, "LinkedObject", None)
        if following is None:
            return replace(found, obj=None, problem=_no_target(current, inspect))
        if isinstance(following, tuple):
            following, element = _follow_sub(following[0], following[1])
            if following is None:
                return replace(found, problem=_no_target_in(current, inspect, element))
            found = replace(found, element=found.element or element)
        elif source is None and _lost_its_source(current, following):
            return replace(found, problem=LinkProblem(FindingCode.BROKEN_LINK, detail="copy without source"))
        current = following
    return replace(found, problem=LinkProblem(FindingCode.CYCLE, obj=object_name(link)))


def _lost_its_source(link: object, target: object) -> bool:
    mode = own(link, "LinkCopyOnChange")
    return mode in ("Owned", "Tracking") and same_document(
        getattr(link, "Document", None), getattr(target, "Document", None)
    )


def _no_target_in(link: object, inspect: Inspect | None, missing: str) -> LinkProblem:
    problem = _no_target(link, inspect)
    if problem.code is not FindingCode.BROKEN_LINK:
        return problem
    return LinkProblem(FindingCode.MISSING_OBJECT, obj=missing)


def _first(value: Any) -> str:
    if isinstance(value, str):
        return value
    return next((str(part) for part in value or ()), "")


def _follow_sub(start: Any, sub: Any) -> tuple[Any, str]:
    """Follow a sub-name such as ``Inner.``, ``Sub.Bolt.`` or ``Face1`` from ``start``.

    Returns the object and the sub-element ("" where the whole object is meant), or None and the name that
    is not there. Sub-names are written by FreeCAD: object names end in a dot, geometry names do not.
    """
    *steps, last = _first(sub).split(".")
    current = start
    for step in steps:
        if not step or step.isdigit():  # "3." is an element of an array: the array's own target
            continue
        current = _child(current, step)
        if current is None:
            return None, step
    if not last:
        return current, ""
    if _ELEMENT.match(last) or (inner := _child(current, last)) is None:
        return current, last
    return inner, ""


def _child(container: Any, name: str) -> Any:
    holder = container
    if is_link(holder) or is_assembly_link(holder):
        holder = resolve_target(holder).obj
    if holder is None:
        return None
    by_label = name.startswith("$")
    wanted = name[1:] if by_label else name
    for attribute in ("Group", "ElementList"):
        for member in getattr(holder, attribute, None) or ():
            if (getattr(member, "Label", None) if by_label else getattr(member, "Name", None)) == wanted:
                return member
    # Objects of a Body or a boolean are no members of a Group; the document knows them all the same.
    look_up = getattr(getattr(holder, "Document", None), "getObject", None)
    return None if by_label or not callable(look_up) else look_up(wanted)
