# SPDX-License-Identifier: LGPL-2.1-or-later
"""From a link to the real part: chains, sub-object paths, arrays on the way, copy-on-change, mirrors.

``getLinkedObject()`` is no help here: it returns the link itself for every array and for an AssemblyLink
(measured, FreeCAD 0.20 and 1.0). So the chain is followed by ``LinkedObject``, one hop at a time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from silo.bom.document import (
    LinkProblem,
    derived,
    is_element_name,
    located,
    object_name,
    own,
    same_document,
    split_sub_name,
)
from silo.bom.findings import FindingCode
from silo.bom.walk.arrays import array_count, elements

Inspect = Callable[[Any], "LinkProblem | None"]

# A longer chain of links, or links inside the sub-names of links, is a loop or an attack.
_MAX_HOPS = 256
_MAX_NESTING = 16


class Target(NamedTuple):
    """The end of a link. ``obj`` is None where ``problem`` says why.

    instances
        every array on the way multiplies, an element of an array is one.
    element
        the sub-element ("Face1") where the link is a reference to geometry, not a component.
    excluded
        the target, or a link on the way to it, is marked by SiloBomExclude.
    """

    obj: Any
    instances: int = 1
    mirrored: bool = False
    variant: bool = False
    excluded: bool = False
    element: str = ""
    problem: LinkProblem | None = None


@dataclass(slots=True)
class _Trail:
    """What is left of one look-up, shared by the look-ups inside it."""

    inspect: Inspect | None
    hops: int = _MAX_HOPS
    nesting: int = _MAX_NESTING


class _EndlessError(Exception):
    """The chain never ends; reported as a finding, never raised to a caller."""


@dataclass(frozen=True, slots=True)
class _Hop:
    """Where one link leads. ``index`` is given where it means one element of the array ``obj``."""

    obj: Any
    element: str = ""
    index: int | None = None
    problem: LinkProblem | None = None


def is_link(obj: object) -> bool:
    """An ``App::Link`` (or ``App::LinkPython``); elements of arrays and groups are none."""
    return derived(obj, "App::Link")


def is_assembly_link(obj: object) -> bool:
    """An instance of an assembly (FreeCAD >= 1.0); derived from App::Part, so ask this first."""
    return derived(obj, "Assembly::AssemblyLink")


def first_of(linked: Any) -> Any:
    """The object of a ``LinkedObject``, which is a tuple (object, sub-name) where there is a sub-name."""
    return linked[0] if isinstance(linked, tuple) else linked


def is_excluded(obj: object) -> bool:
    """True where the object itself is marked as no part of any BOM."""
    return own(obj, "SiloBomExclude") is True


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


def is_mirrored(link: object, index: int | None = None) -> bool:
    """True for a negative scale: an odd number of negative axes makes the other hand of a part.

    index
        of one element of an array; else any mirrored element decides.
    """
    one = slice(None) if index is None else slice(index, index + 1)
    if any(_negative(vector) for vector in tuple(own(link, "ScaleList") or ())[one]):
        return True
    return _scaled_negative(link) or any(_scaled_negative(element) for element in elements(link)[one])


def _scaled_negative(obj: object) -> bool:
    # FreeCAD keeps Scale and ScaleVector in step; a reader may know only one of them.
    vector, scale = own(obj, "ScaleVector"), own(obj, "Scale")
    if vector is not None and _components(vector) != (1.0, 1.0, 1.0):
        return _negative(vector)
    return isinstance(scale, int | float) and scale < 0


def resolve_target(link: object, inspect: Inspect | None = None) -> Target:
    """Follow ``link`` to the real part or assembly; a broken link gives a ``problem``, no exception.

    inspect
        says what is wrong with a live object: why a link has no target, or that FreeCAD opened a target from
        a damaged file; None where nothing is.
    """
    try:
        found = _resolve(link, _Trail(inspect))
    except _EndlessError:
        return Target(None, problem=LinkProblem(FindingCode.CYCLE, obj=object_name(link)))
    if inspect is not None and found.obj is not None and _is_elsewhere(found.obj, link):
        problem = inspect(found.obj)
        return found if problem is None else found._replace(obj=None, problem=problem)
    return found


def _is_elsewhere(target: Any, link: Any) -> bool:
    """True for an object of another file, and for the assembly that was asked for."""
    return target is link or not same_document(target.Document, link.Document)


def _resolve(link: object, trail: _Trail) -> Target:
    current: Any = link
    index: int | None = None
    count, mirrored, variant, excluded, element = 1, False, False, False, ""
    while True:
        if is_link(current):
            count *= array_count(current) if index is None else 1
            mirrored ^= is_mirrored(current, index)
        elif derived(current, "App::LinkElement"):
            mirrored ^= _scaled_negative(current)
        elif not is_assembly_link(current):
            return Target(current, count, mirrored, variant, excluded, element)
        trail.hops -= 1
        if trail.hops < 0:
            raise _EndlessError
        hop, is_variant = _next_hop(current, trail)
        if hop.problem is not None:
            return Target(None, count, mirrored, variant, excluded, element, hop.problem)
        current, index = hop.obj, hop.index
        variant = variant or is_variant
        element = element or hop.element
        excluded = excluded or is_excluded(current)


def _next_hop(link: Any, trail: _Trail) -> tuple[_Hop, bool]:
    """Where a link leads, and whether it shows a variant (a changed copy) of that."""
    linked = getattr(link, "LinkedObject", None)
    source = first_of(own(link, "LinkCopyOnChangeSource"))
    if source is not None:
        # LinkedObject is then a local copy with other parameters (facts §1.2).
        return _Hop(source), first_of(linked) is not source
    if linked is None:
        return _Hop(None, problem=_no_target(link, trail.inspect)), False
    if isinstance(linked, tuple):
        if linked[0] is None:
            return _Hop(None, problem=_no_target(link, trail.inspect)), False
        return _follow_sub(linked[0], linked[1], trail), False
    if _lost_its_source(link, linked):
        return _Hop(None, problem=_no_source(link, trail.inspect)), True
    return _Hop(linked), False


def _lost_its_source(link: object, target: object) -> bool:
    mode = own(link, "LinkCopyOnChange")
    return mode in ("Owned", "Tracking") and same_document(
        getattr(link, "Document", None), getattr(target, "Document", None)
    )


def _no_source(link: object, inspect: Inspect | None) -> LinkProblem:
    known = _no_target(link, inspect)
    if not known.file:
        return LinkProblem(FindingCode.BROKEN_LINK, detail="the original of its changed copy is lost")
    words = "it is the original of a changed copy"
    return replace(known, detail=f"{known.detail}; {words}" if known.detail else words)


def _file_of(obj: object) -> str:
    return getattr(getattr(obj, "Document", None), "FileName", "") or ""


def _no_target(link: object, inspect: Inspect | None) -> LinkProblem:
    known = getattr(link, "LinkProblem", None)
    if not isinstance(known, LinkProblem) and inspect is not None:
        known = inspect(link)
    if not isinstance(known, LinkProblem):
        return LinkProblem(FindingCode.BROKEN_LINK)
    if known.file:
        return replace(known, file=located(known.file, _file_of(link)))
    return replace(known, file=_file_of(link)) if known.code is FindingCode.MISSING_OBJECT else known


def _follow_sub(start: Any, sub: Any, trail: _Trail) -> _Hop:
    """Follow a sub-name such as ``Inner.``, ``Sub.Bolt.``, ``$Label.``, ``3.`` or ``Face1``."""
    steps, element = split_sub_name(sub)
    current, index = start, None
    for step in steps:
        if step.isdigit():
            index = int(step)
            continue
        hop = _child(current, step, trail)
        if hop.problem is not None:
            return hop
        current, index = hop.obj, None
    if (
        element
        and not is_element_name(element)
        and (named := _child(current, element, trail).obj) is not None
    ):
        # FreeCAD writes object names with a dot behind; people and scripts forget it.
        current, element = named, ""
    return _Hop(current, element, index if is_link(current) else None)


def _child(parent: Any, name: str, trail: _Trail) -> _Hop:
    """The object ``name`` below ``parent``, as FreeCAD's ``getSubObject`` finds it."""
    found = _member(parent, name)
    if found is not None:
        return _Hop(found)
    holder = parent
    if is_link(parent) or is_assembly_link(parent) or derived(parent, "App::LinkElement"):
        trail.nesting -= 1
        if trail.nesting < 0:
            raise _EndlessError
        target = _resolve(parent, trail)
        trail.nesting += 1
        if target.obj is None:
            return _Hop(None, problem=target.problem)
        holder = target.obj
        found = _member(holder, name)
    if found is None and not name.startswith("$"):
        # Objects of a Body or a boolean are no members of a Group; the document knows them all the same.
        look_up = getattr(getattr(holder, "Document", None), "getObject", None)
        found = look_up(name) if callable(look_up) else None
    if found is None:
        missing = LinkProblem(FindingCode.MISSING_OBJECT, file=_file_of(holder), obj=name)
        return _Hop(None, problem=missing)
    return _Hop(found)


def _member(holder: Any, name: str) -> Any:
    attribute, wanted = ("Label", name[1:]) if name.startswith("$") else ("Name", name)
    for property_name in ("Group", "ElementList"):
        for member in own(holder, property_name) or ():
            if getattr(member, attribute, None) == wanted:
                return member
    return None
