# SPDX-License-Identifier: LGPL-2.1-or-later
"""The products of an assembly that a row of a BOM may stand for: its leaves, and its sub-assemblies."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

from silo.inertia.assembly import Assembly, placed_below


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
        that the geometry file states [kg/m^3], None if it states none.
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
    """Return the placed prototypes in order of appearance, but not the :func:`companions` of a solid."""
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
    """Return the prototypes without a solid that always stand beside a solid of the same product.

    Pro/E writes a SOLID and a wire COMPOUND for one product: these are one part, not two with the same name.
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
    """Return the products that contain others, by name, in order of appearance; ``count`` counts their
    instances.
    """
    counts: dict[str, int] = defaultdict(int)
    parents: dict[str, set[str]] = defaultdict(set)
    for path, indices in placed_below(assembly).items():
        names = ("", *assembly.instances[indices[-1]].product_path)
        if len(names) > len(path) + 1:  # else it is the sub-assembly's own shape
            counts[names[len(path)]] += 1
            parents[names[len(path)]].add(names[len(path) - 1])
    return tuple(
        Product(key=name, name=name, part_number="", count=count, parents=frozenset(parents[name]))
        for name, count in counts.items()
    )
