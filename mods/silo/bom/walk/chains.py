# SPDX-License-Identifier: LGPL-2.1-or-later
"""The way from an assembly to a component: the objects on it, and how often each shows the next."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from silo.bom.key import Key
from silo.bom.walk.contents import Contribution, Count
from silo.bom.walk.kinds import Kind
from silo.bom.walk.tree import Tree


def chains(count: Count, tree: Tree | None) -> Iterator[tuple[tuple[Any, int], ...]]:
    """Yield each way from the assembly to the component: the objects on it, and how often each shows the next
    one.
    """
    starts: Iterable[tuple[Any, ...]] = [()]
    if tree is not None and not count.beside:
        starts = tree.paths(count.shown.key)
    for holders in starts:
        for rest in _below(count.shown, count.key):
            yield (*((holder, 1) for holder in holders), *rest)


def _below(node: Contribution, wanted: Key) -> Iterator[tuple[tuple[Any, int], ...]]:
    within = [(inner, times) for inner, times in node.shown_objects if wanted in inner.brings]
    if not within or (node.kind is Kind.ASSEMBLY_LINK and wanted == next(iter(node.brings))):
        yield ((node.obj, node.brings[wanted][1]),)
        return
    for inner, times in within:
        paths = node.tree.paths(inner.key) if node.tree is not None else [()]
        for holders in paths:
            for rest in _below(inner, wanted):
                shown = 1 if node.tree is not None else times
                yield ((node.obj, shown), *((holder, 1) for holder in holders), *rest)
