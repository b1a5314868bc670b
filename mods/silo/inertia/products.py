# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is matched with BOM rows: an assembly's products, leaves and sub-assemblies, with counts. Pure."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

from silo.inertia.model import Assembly


@dataclass(frozen=True, slots=True)
class Product:
    """One thing a BOM row may stand for.

    key
        the prototype's key; for a sub-assembly its product name.
    count
        instances in the whole assembly.
    volume_m3
        of one [m^3]; 0 for sub-assemblies and for products without a solid.
    density
        that the geometry file states [kg/m^3], None where it states none.
    parents
        product names directly around its instances ("" = the top assembly).
    """

    key: str
    name: str
    part_number: str
    count: int
    volume_m3: float = 0.0
    density: float | None = None
    parents: frozenset[str] = frozenset()


def leaf_products(assembly: Assembly) -> tuple[Product, ...]:
    """Placed prototypes in order of appearance, without companions of a solid (see :func:`companions`)."""
    beside = companions(assembly)
    counts: dict[str, int] = defaultdict(int)
    parents: dict[str, set[str]] = defaultdict(set)
    for instance in assembly.instances:
        counts[instance.prototype] += 1
        path = instance.product_path
        parents[instance.prototype].add(path[-2] if len(path) > 1 else "")
    return tuple(
        Product(
            key=key,
            name=assembly.prototypes[key].name,
            part_number=assembly.prototypes[key].part_number or "",
            count=count,
            volume_m3=assembly.prototypes[key].volume_m3,
            density=assembly.prototypes[key].step_density,
            parents=frozenset(parents[key]),
        )
        for key, count in counts.items()
        if key not in beside
    )


def companions(assembly: Assembly) -> frozenset[str]:
    """Prototypes without a solid that only ever stand beside a solid of the same product.

    Pro/E writes a SOLID and a wire COMPOUND for one product: that is one part, not two of one name.
    """
    if all(prototype.has_solid for prototype in assembly.prototypes.values()):
        return frozenset()
    solid_places = {
        (i.path[:-1], i.product_path[-1:])
        for i in assembly.instances
        if assembly.prototypes[i.prototype].has_solid
    }
    places: dict[str, set[tuple[tuple[str, ...], tuple[str, ...]]]] = defaultdict(set)
    for i in assembly.instances:
        if not assembly.prototypes[i.prototype].has_solid:
            places[i.prototype].add((i.path[:-1], i.product_path[-1:]))
    return frozenset(key for key, where in places.items() if where <= solid_places)


def sub_assemblies(assembly: Assembly) -> tuple[Product, ...]:
    """Products that contain others, by name, in order of appearance; ``count`` is that of their instances."""
    paths: dict[str, set[tuple[str, ...]]] = {}
    parents: dict[str, set[str]] = defaultdict(set)
    for instance in assembly.instances:
        names = instance.product_path
        for depth in range(1, len(names)):
            paths.setdefault(names[depth - 1], set()).add(instance.path[:depth])
            parents[names[depth - 1]].add(names[depth - 2] if depth > 1 else "")
    return tuple(
        Product(key=name, name=name, part_number="", count=len(where), parents=frozenset(parents[name]))
        for name, where in paths.items()
    )
