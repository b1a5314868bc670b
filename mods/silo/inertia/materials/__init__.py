# SPDX-License-Identifier: LGPL-2.1-or-later
"""Densities: the package's table with its sources, a user's table on top, FreeCAD's cards behind."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from silo.inertia.materials.table import (
    DENSEST,
    LIGHTEST,
    Material,
    MaterialHit,
    MaterialMiss,
    MaterialTable,
    card_of,
    cards_fingerprint,
    checked_density,
    load_materials,
    package_rows,
    parse_density,
)

if TYPE_CHECKING:
    MATERIAL_DENSITIES: Mapping[str, float]

__all__ = [
    "DENSEST",
    "LIGHTEST",
    "MATERIAL_DENSITIES",
    "Material",
    "MaterialHit",
    "MaterialMiss",
    "MaterialTable",
    "card_of",
    "cards_fingerprint",
    "checked_density",
    "load_materials",
    "parse_density",
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
