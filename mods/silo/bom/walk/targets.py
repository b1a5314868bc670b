# SPDX-License-Identifier: LGPL-2.1-or-later
"""From a link to the real part: chains, sub-object paths, arrays on the way, copy-on-change, mirrors.

``getLinkedObject()`` is no help here: it returns the link itself for every array and for an AssemblyLink
(measured, FreeCAD 0.20 and 1.0). So the chain is followed by ``LinkedObject``, one hop at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from silo.bom.findings import FindingCode
from silo.bom.message import joined, message
from silo.bom.walk.arrays import array_count, elements, is_array
from silo.bom.walk.document import (
    LinkProblem,
    derived,
    first_of,
    is_element_name,
    label_of,
    located,
    object_name,
    own,
    same_document,
    split_sub_name,
)
from silo.bom.walk.kinds import COMPONENTS, Kind, kind_of

Inspect = Callable[[Any], "LinkProblem | None"]

# A longer chain of links, or links inside the sub-names of links, is a loop or an attack.
_MAX_HOPS = 256
_MAX_NESTING = 16
# A smaller change of a scale is rounding.
_SAME_SIZE = 1e-9


@dataclass(frozen=True, slots=True)
class Step:
    """One object on the way of a link: a link, or a container that a sub-name passes through.

    index
        the one element that is meant of the array ``obj``.
    by_link
        its own placement counts only if the link before it says so (``LinkTransform``).
    """

    obj: Any
    index: int | None = None
    by_link: bool = False


class Target(NamedTuple):
    """The end of a link. ``obj`` is None where ``problem`` says why.

    instances
        every array on the way multiplies, an element of an array is one.
    variant
        the changed copy that is shown (copy on change); None where the target itself is.
    element
        the sub-element ("Face1") where the link is a reference to geometry, not a component.
    excluded
        the target, or a link on the way to it, is marked by SiloBomExclude.
    scaled
        a scale other than 1 makes the part larger or smaller.
    configured
        the link that shows the changed copy: it has the values that differ.
    """

    obj: Any
    instances: int = 1
    mirrored: bool = False
    variant: Any = None
    excluded: bool = False
    element: str = ""
    problem: LinkProblem | None = None
    way: tuple[Step, ...] = ()
    by_link: bool = False
    scaled: bool = False
    configured: Any = None


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
    through: tuple[Step, ...] = ()


def is_link(obj: object) -> bool:
    """Return True for an ``App::Link`` (or ``App::LinkPython``), False for elements of arrays and groups."""
    return derived(obj, "App::Link")


def is_assembly_link(obj: object) -> bool:
    """Return True for an instance of an assembly (FreeCAD >= 1.0). Its type is derived from App::Part, so ask
    this first.
    """
    return derived(obj, "Assembly::AssemblyLink")


def is_excluded(obj: object) -> bool:
    """Return True if the object itself is excluded from every BOM."""
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
    """Return True if a scale mirrors the part, which makes its other hand: an odd number of negative axes.

    index
        of one element of an array; without it, any mirrored element decides.
    """
    if (mirrored := _scaled_negative(link)) or not is_array(link):
        return mirrored
    index_range = slice(None) if index is None else slice(index, index + 1)
    scales = tuple(own(link, "ScaleList") or ())[index_range]
    return any(map(_negative, scales)) or any(map(_scaled_negative, elements(link)[index_range]))


def is_scaled(link: object, index: int | None = None) -> bool:
    """Return True if a scale makes the part, or an element of the array, larger or smaller."""
    if _changes_size(own(link, "ScaleVector")) or _changes_size(own(link, "Scale")):
        return True
    if not is_array(link):
        return False
    some = slice(None) if index is None else slice(index, index + 1)
    scales = (
        *tuple(own(link, "ScaleList") or ())[some],
        *(own(e, "ScaleVector") for e in elements(link)[some]),
    )
    return any(map(_changes_size, scales))


def _changes_size(scale: Any) -> bool:
    if isinstance(scale, int | float):
        return abs(abs(scale) - 1) > _SAME_SIZE
    parts = None if scale is None else _components(scale)
    # FreeCAD takes a zero as 1, since it would flatten the part.
    return parts is not None and any(part and abs(abs(part) - 1) > _SAME_SIZE for part in parts)


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
        a damaged file; None if nothing is.
    """
    try:
        target = _resolve(link, _Trail(inspect))
    except _EndlessError:
        return Target(None, problem=LinkProblem(FindingCode.CYCLE, obj=object_name(link)))
    if inspect is not None and target.obj is not None and _is_elsewhere(target.obj, link):
        problem = inspect(target.obj)
        return target if problem is None else target._replace(obj=None, problem=problem)
    return target


def _is_elsewhere(target: Any, link: Any) -> bool:
    """Return True if the target is in another file, or is ``link`` itself (an assembly)."""
    return target is link or not same_document(target.Document, link.Document)


def _resolve(link: object, trail: _Trail) -> Target:
    current: Any = link
    index: int | None = None
    count, mirrored, excluded, element, by_link = 1, False, False, "", False
    variant: Any = None
    configured: Any = None
    scaled = False
    way: list[Step] = []
    while True:
        if is_link(current):
            count *= array_count(current) if index is None else 1
            mirrored ^= is_mirrored(current, index)
            scaled = scaled or is_scaled(current, index)
        elif derived(current, "App::LinkElement"):
            mirrored ^= _scaled_negative(current)
            scaled = scaled or is_scaled(current)
        elif not is_assembly_link(current):
            end = (current, count, mirrored, variant, excluded, element)
            return Target(*end, None, tuple(way), by_link, scaled, configured)
        trail.hops -= 1
        if trail.hops < 0:
            raise _EndlessError
        if variant is None:  # which is what is shown, wherever its original leads
            way.append(Step(current, index, by_link))
        hop, copy = _next_hop(current, trail)
        if hop.problem is not None:
            return Target(None, count, mirrored, variant, excluded, element, hop.problem)
        if variant is None:
            way += hop.through
            by_link, variant = not hop.through, copy
            configured = current if copy is not None else None
        current, index = hop.obj, hop.index
        element = element or hop.element
        excluded = excluded or is_excluded(current)


def _next_hop(link: Any, trail: _Trail) -> tuple[_Hop, Any]:
    """Follow a link by one step; returns where it leads, and the changed copy that it shows instead."""
    linked = getattr(link, "LinkedObject", None)
    source, copy = first_of(own(link, "LinkCopyOnChangeSource")), first_of(linked)
    if source is not None:
        # LinkedObject is then a changed local copy (facts §1.2): of a standard part another one.
        if copy is None:
            return _Hop(None, problem=_deleted_copy(link)), None
        if copy is source or kind_of(copy) is Kind.STANDARD:
            return _Hop(copy), None
        return _Hop(source), copy
    if linked is None:
        return _Hop(None, problem=_no_target(link, trail.inspect)), None
    if isinstance(linked, tuple):
        if linked[0] is None:
            return _Hop(None, problem=_no_target(link, trail.inspect)), None
        return _follow_sub(linked[0], linked[1], trail), None
    if _lost_its_source(link, linked):
        return _Hop(None, problem=_no_source(link, trail.inspect)), None
    return _Hop(linked), None


def _deleted_copy(link: Any) -> LinkProblem:
    """Return the problem of a link whose changed copy was deleted: FreeCAD shows nothing, not the original.

    The link itself stands for what is missing.
    """
    return LinkProblem(FindingCode.DELETED_COPY, _file_of(link), object_name(link))


def _lost_its_source(link: object, target: object) -> bool:
    mode = own(link, "LinkCopyOnChange")
    return mode in ("Owned", "Tracking") and same_document(
        getattr(link, "Document", None), getattr(target, "Document", None)
    )


def _no_source(link: object, inspect: Inspect | None) -> LinkProblem:
    problem = _no_target(link, inspect)
    if not problem.file:
        return LinkProblem(
            FindingCode.BROKEN_LINK, detail=message("the original of its changed copy is lost")
        )
    words = message("it is the original of a changed copy")
    return replace(problem, detail=joined("; ", (problem.detail, words)) if problem.detail else words)


def _file_of(obj: object) -> str:
    return getattr(getattr(obj, "Document", None), "FileName", "") or ""


def _no_target(link: object, inspect: Inspect | None) -> LinkProblem:
    problem = getattr(link, "LinkProblem", None)
    if not isinstance(problem, LinkProblem) and inspect is not None:
        problem = inspect(link)
    if not isinstance(problem, LinkProblem):
        return LinkProblem(FindingCode.BROKEN_LINK)
    if problem.file:
        return replace(problem, file=located(problem.file, _file_of(link)))
    return replace(problem, file=_file_of(link)) if problem.code is FindingCode.MISSING_OBJECT else problem


def _follow_sub(start: Any, sub: Any, trail: _Trail) -> _Hop:
    """Follow a sub-name such as ``Inner.``, ``Sub.Bolt.``, ``$Label.``, ``3.`` or ``Face1``."""
    steps, element = split_sub_name(sub)
    current, index = start, None
    through: list[Step] = []
    for step in steps:
        if step.isdigit():
            index = int(step)
            continue
        through.append(Step(current, index, not through))
        hop = _child(current, step, trail)
        if hop.problem is not None:
            return hop
        current, index = hop.obj, None
    if (
        element
        and not is_element_name(element)
        and (named := _child(current, element, trail).obj) is not None
    ):
        # FreeCAD writes a dot after object names; people and scripts forget it.
        through.append(Step(current, index, not through))
        current, element = named, ""
    return _Hop(current, element, index if is_link(current) else None, through=tuple(through))


def _child(parent: Any, name: str, trail: _Trail) -> _Hop:
    """Find the object ``name`` below ``parent``, as FreeCAD's ``getSubObject`` does."""
    child = _member(parent, name)
    if child is not None:
        return _Hop(child)
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
        child = _member(holder, name)
    if child is None and not name.startswith("$"):
        # Objects of a Body or a boolean are no members of a Group; the document knows them anyway.
        look_up = getattr(getattr(holder, "Document", None), "getObject", None)
        child = look_up(name) if callable(look_up) else None
    if child is None:
        missing = LinkProblem(FindingCode.MISSING_OBJECT, file=_file_of(holder), obj=name)
        return _Hop(None, problem=missing)
    return _Hop(child)


def _member(holder: Any, name: str) -> Any:
    attribute, wanted = ("Label", name[1:]) if name.startswith("$") else ("Name", name)
    for property_name in ("Group", "ElementList"):
        for member in own(holder, property_name) or ():
            if getattr(member, attribute, None) == wanted:
                return member
    return None


# --- an AssemblyLink's own ``Group`` ---
#
# Copies of what its assembly held when it was last recomputed. They are never counted. Where they differ
# from the assembly as it is now, what a user sees is old (measured: opening and recomputing the parent does
# not help, facts §1.4). Each copy points at the object that it stands for, except that FreeCAD 1.1 copies
# a link array as an array of its own of the same part (measured).


def stale_copies(link: Any, assembly: Any, key: Callable[[Any], Hashable]) -> tuple[list[str], list[str]]:
    """Return the labels of copies whose original is gone, and of originals without a copy; sorted.

    link
        the AssemblyLink.
    assembly
        the assembly for which it stands.
    """
    originals = _originals(link, assembly)
    own = {key(part) for part in own_parts(link, assembly, key)}
    copies = [copy for copy in _group(link) if kind_of(copy) in COMPONENTS and key(copy) not in own]
    if not copies:  # never recomputed: nothing is shown, so nothing is wrong
        return [], []
    by_key = {key(original): original for original in originals}
    arrays = _arrays(originals, key)
    shown: set[Hashable] = set()
    gone: list[str] = []
    for copy in copies:
        end = first_of(getattr(copy, "LinkedObject", None))
        if end is not None and key(end) in by_key:
            shown.add(key(end))
        elif end is not None and is_array(copy) and (same := arrays.get((key(end), array_count(copy)))):
            shown.add(same.pop())
        else:
            gone.append(label_of(copy))
    lacking = [
        label_of(original)
        for name, original in by_key.items()
        if name not in shown and kind_of(original) in COMPONENTS
    ]
    return sorted(gone), sorted(lacking)


def own_parts(link: Any, assembly: Any, key: Callable[[Any], Hashable]) -> list[Any]:
    """Return what a user put into a flexible AssemblyLink: standard parts, and links that are no copies.

    A copy leads to an object of the assembly's file, most often a link. A link array of FreeCAD 1.1 leads to
    the part itself, so an array is taken for a copy.
    """
    source = first_of(getattr(link, "LinkedObject", None))
    documents = [obj.Document for obj in (assembly, source) if obj is not None]
    originals = {key(obj) for obj in _originals(link, assembly)}
    parts = []
    for member in _group(link):
        kind = kind_of(member)
        if kind is Kind.STANDARD:
            parts.append(member)
        elif kind in COMPONENTS and not is_array(member):
            end = first_of(getattr(member, "LinkedObject", None))
            if end is None or key(end) in originals or is_link(end) or is_assembly_link(end):
                continue
            if not any(same_document(end.Document, document) for document in documents):
                parts.append(member)
    return parts


def _originals(link: Any, assembly: Any) -> list[Any]:
    source = first_of(getattr(link, "LinkedObject", None))
    return list(_group(source if is_assembly_link(source) else assembly))


def _group(container: Any) -> Iterable[Any]:
    return getattr(container, "Group", None) or ()


def _arrays(
    originals: Iterable[Any], key: Callable[[Any], Hashable]
) -> dict[tuple[Hashable, int], list[Hashable]]:
    """Map what link arrays repeat, and how often, to these arrays."""
    arrays: dict[tuple[Hashable, int], list[Hashable]] = {}
    for original in originals:
        if is_link(original) and is_array(original):
            ends = (first_of(getattr(original, "LinkedObject", None)), resolve_target(original).obj)
            for end in {key(end) for end in ends if end is not None}:
                arrays.setdefault((end, array_count(original)), []).append(key(original))
    return arrays
