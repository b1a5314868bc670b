# SPDX-License-Identifier: LGPL-2.1-or-later
"""Products that contain products, and their unfolding into placed instances. Pure; the same for all formats.

A product is kept once, however often it is used; only :func:`unfold` multiplies. It counts before it does:
a small hostile file can name 2**40 instances.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from silo.bom.errors import InputError
from silo.bom.message import message
from silo.inertia.assembly import Instance

Floats = NDArray[np.float64]
IDENTITY: Floats = np.eye(4)


@dataclass(frozen=True, eq=False)
class Child:
    """One use of a product. ``transform`` (4, 4), lengths in m: product axes → axes of its parent."""

    name: str
    product: str
    transform: Floats = field(default_factory=lambda: np.eye(4))


@dataclass(frozen=True, eq=False)
class Node:
    """One product. ``has_geometry``: it has shapes of its own, and so a prototype with the same key."""

    key: str
    name: str
    children: tuple[Child, ...] = ()
    has_geometry: bool = False


def in_metres(matrix: Floats, unit: float = 1e-3) -> Floats:
    """Convert the translation of a placement (4, 4) from ``unit`` [m], mm by default, to m."""
    converted = matrix.copy()
    converted[:3, 3] *= unit
    return converted


MAX_DEPTH = 200
"""Levels of sub-assemblies; real ones stay below 15, and Python's own stack ends near 500."""


class Unfolded:
    """The unfolding at work, and its result: ``instances``, and ``frames`` of sub-assemblies by path."""

    def __init__(self, nodes: Mapping[str, Node]) -> None:
        self._nodes = nodes
        self._inside: dict[str, tuple[tuple[str, ...], Floats]] = {}
        self.instances: list[Instance] = []
        self.frames: dict[tuple[str, ...], Floats] = {}

    @property
    def placed(self) -> list[str]:
        """Return the products with geometry that are placed, each once, in order."""
        return list(dict.fromkeys(instance.prototype for instance in self.instances))

    def place(self, key: str, path: tuple[str, ...], products: tuple[str, ...], transform: Floats) -> None:
        """Add one use of a product at ``path``; ``products`` are the names of those around it."""
        node = self._nodes[key]
        products = (*products, node.name)
        if node.children:
            self.frames[path] = transform
            self.fill(key, path, products, transform)
        elif node.has_geometry:
            self.instances.append(Instance(path, products, key, transform))

    def fill(self, key: str, path: tuple[str, ...], products: tuple[str, ...], transform: Floats) -> None:
        """Add the inside of an assembly: its own shapes, then its children."""
        node = self._nodes[key]
        names, stack = self._named(key)
        placed = transform @ stack
        if node.has_geometry:
            own = products or (node.name,)
            self.instances.append(Instance((*path, names[0]), own, key, transform))
            names = names[1:]
        for name, child, matrix in zip(names, node.children, placed, strict=True):
            self.place(child.product, (*path, name), products, matrix)

    def _named(self, key: str) -> tuple[tuple[str, ...], Floats]:
        if key not in self._inside:
            node = self._nodes[key]
            wanted = [node.name] if node.has_geometry else []
            wanted += [child.name for child in node.children]
            stack = np.array([child.transform for child in node.children]).reshape(-1, 4, 4)
            self._inside[key] = (tuple(unique_names(wanted)), stack)
        return self._inside[key]


def unfold(nodes: Mapping[str, Node], roots: Sequence[Child], max_instances: int) -> Unfolded:
    """List all instances below ``roots``.

    A single root that holds others is the top assembly, which is not in the paths. If several uses in one
    parent have the same name, the second is called ``name<2>``, and so on, so that each path is unique.
    Shapes that belong to an assembly itself are among its children, under the assembly's own name.

    Raises InputError for a product that contains itself, for more than ``max_instances`` and for more than
    MAX_DEPTH levels.
    """
    count = 0
    for root in roots:
        order = bottom_up(nodes, root.product)
        if depth(nodes, order) > MAX_DEPTH:
            raise InputError(
                message("it nests its assemblies more than {max_depth} deep", max_depth=MAX_DEPTH)
            )
        count += count_instances(nodes, order)
    if count > max_instances:
        raise InputError(
            message(
                "it unfolds to {count} placed parts, more than the {max_instances} allowed",
                count=count,
                max_instances=max_instances,
            )
        )
    unfolded = Unfolded(nodes)
    if len(roots) == 1 and nodes[roots[0].product].children:
        unfolded.fill(roots[0].product, (), (), roots[0].transform)
    else:
        for name, root in zip(unique_names([r.name for r in roots]), roots, strict=True):
            unfolded.place(root.product, (name,), (), root.transform)
    return unfolded


def unique_names(wanted: Sequence[str]) -> list[str]:
    """Mark repeated names in order: ``<2>``, ``<3>`` …

    "/" would break a path and becomes "|".
    """
    taken: set[str] = set()
    counts: dict[str, int] = {}
    names = []
    for raw in wanted:
        name = raw.replace("/", "|")
        unique = name
        while unique in taken:
            counts[name] = counts.get(name, 1) + 1
            unique = f"{name}<{counts[name]}>"
        taken.add(unique)
        names.append(unique)
    return names


def count_instances(nodes: Mapping[str, Node], order: Sequence[str]) -> int:
    """Count the placed prototypes to which the last product of a :func:`bottom_up` order unfolds."""
    done: dict[str, int] = {}
    for key in order:
        node = nodes[key]
        done[key] = int(node.has_geometry) + sum(done[child.product] for child in node.children)
    return done[order[-1]]


def depth(nodes: Mapping[str, Node], order: Sequence[str]) -> int:
    """Count the levels of the last product of a :func:`bottom_up` order, itself included."""
    done: dict[str, int] = {}
    for key in order:
        done[key] = 1 + max((done[child.product] for child in nodes[key].children), default=0)
    return done[order[-1]]


def bottom_up(nodes: Mapping[str, Node], root: str) -> list[str]:
    """Order all products below ``root`` and itself by key, each once, children before parents.

    Without recursion: a file may nest deeper than Python's stack. InputError on a cycle.
    """
    order: list[str] = []
    state: dict[str, int] = {}
    stack = [(root, False)]
    while stack:
        key, finished = stack.pop()
        if finished:
            state[key] = 2
            order.append(key)
            continue
        if state.get(key) == 2:
            continue
        if state.get(key) == 1:
            raise InputError(message("the product '{name}' contains itself", name=nodes[key].name))
        state[key] = 1
        stack.append((key, True))
        stack.extend((child.product, False) for child in nodes[key].children if state.get(child.product) != 2)
    return order
