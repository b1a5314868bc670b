# SPDX-License-Identifier: LGPL-2.1-or-later
"""Densities: the package's table with its sources, a user's table on top, FreeCAD's cards behind."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from silo.inertia.materials.cards import installed_cards
from silo.inertia.materials.files import package_rows, user_rows
from silo.inertia.materials.table import Material, MaterialHit, MaterialMiss, MaterialTable

if TYPE_CHECKING:
    MATERIAL_DENSITIES: Mapping[str, float]

__all__ = [
    "MATERIAL_DENSITIES",
    "Material",
    "MaterialHit",
    "MaterialMiss",
    "MaterialTable",
    "load_materials",
]


@cache
def _densities() -> Mapping[str, float]:
    rows = {row.name: row.density for row in package_rows()}
    aliases = {alias: row.density for row in package_rows() for alias in row.aliases}
    return MappingProxyType({**aliases, **rows, "default": 1000.0})


def __getattr__(name: str) -> Any:
    # The spec's table as plain values [kg/m^3], aliases included; made when somebody wants it.
    if name == "MATERIAL_DENSITIES":
        return _densities()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def load_materials(paths: Iterable[Path | str] = (), *, freecad: bool = True) -> MaterialTable:
    """The usual table. ``paths``: user tables, the last one wins; ``freecad``: look at installed cards."""
    layers = [user_rows(path) for path in paths]
    layers.reverse()
    return MaterialTable((*layers, package_rows()), installed_cards if freecad else lambda: ())
