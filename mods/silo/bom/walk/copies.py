# SPDX-License-Identifier: LGPL-2.1-or-later
"""An AssemblyLink's own ``Group``: copies of what its assembly held when it was last recomputed.

They are never counted. Where they differ from the assembly as it is now, what a person sees is old (measured:
opening and recomputing the parent does not mend it, facts §1.4). Each copy points at the object that it
stands for, except that FreeCAD 1.1 copies a link array as an array of its own of the same part (measured).
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from typing import Any

from silo.bom.document import label_of
from silo.bom.walk.kinds import COMPONENTS, kind_of
from silo.bom.walk.targets import array_count, first_of, is_array, is_assembly_link, is_link, resolve_target


def stale_copies(link: Any, assembly: Any, key: Callable[[Any], Hashable]) -> tuple[list[str], list[str]]:
    """Labels of what the copies still show though it is gone, and of what they lack; sorted.

    link
        the AssemblyLink.
    assembly
        what it stands for in the end.
    """
    source = first_of(getattr(link, "LinkedObject", None))
    originals = list(_group(source if is_assembly_link(source) else assembly))
    copies = [copy for copy in _group(link) if kind_of(copy) in COMPONENTS]
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
