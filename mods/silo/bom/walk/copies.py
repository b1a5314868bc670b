# SPDX-License-Identifier: LGPL-2.1-or-later
"""An AssemblyLink's own ``Group``: copies of what its assembly held when it was last recomputed.

They are never counted. Where they differ from the assembly as it is now, what a person sees is old (measured:
opening and recomputing the parent does not mend it, facts §1.4). Each copy points at the object that it
stands for, except that FreeCAD 1.1 copies a link array as an array of its own of the same part (measured).
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from typing import Any

from silo.bom.document import label_of, same_document
from silo.bom.walk.arrays import array_count, is_array
from silo.bom.walk.kinds import COMPONENTS, Kind, kind_of
from silo.bom.walk.targets import first_of, is_assembly_link, is_link, resolve_target


def stale_copies(link: Any, assembly: Any, key: Callable[[Any], Hashable]) -> tuple[list[str], list[str]]:
    """Labels of what the copies still show though it is gone, and of what they lack; sorted.

    link
        the AssemblyLink.
    assembly
        what it stands for in the end.
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
    """What somebody put into a flexible AssemblyLink himself: standard parts, and links that are no copies.

    A copy leads to an object of the assembly's file, most often a link. A link array of FreeCAD 1.1 leads to
    the part itself, so an array is taken for a copy.
    """
    source = first_of(getattr(link, "LinkedObject", None))
    documents = [one.Document for one in (assembly, source) if one is not None]
    originals = {key(one) for one in _originals(link, assembly)}
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
    """Link arrays by what they repeat, and how often."""
    arrays: dict[tuple[Hashable, int], list[Hashable]] = {}
    for original in originals:
        if is_link(original) and is_array(original):
            ends = (first_of(getattr(original, "LinkedObject", None)), resolve_target(original).obj)
            for end in {key(end) for end in ends if end is not None}:
                arrays.setdefault((end, array_count(original)), []).append(key(original))
    return arrays
