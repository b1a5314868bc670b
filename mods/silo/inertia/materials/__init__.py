# SPDX-License-Identifier: LGPL-2.1-or-later
"""Densities: the package's table with its sources, a user's table on top, FreeCAD's cards behind."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from silo.inertia.materials.cards import installed_cards
from silo.inertia.materials.files import package_rows, user_rows
from silo.inertia.materials.table import Found, Material, MaterialHit, MaterialMiss, MaterialTable

__all__ = ["Found", "Material", "MaterialHit", "MaterialMiss", "MaterialTable", "load_materials"]


def load_materials(paths: Iterable[Path | str] = (), *, freecad: bool = True) -> MaterialTable:
    """The usual table. ``paths``: user tables, the last one wins; ``freecad``: look at installed cards."""
    layers = [user_rows(path) for path in paths]
    layers.reverse()
    return MaterialTable((*layers, package_rows()), installed_cards if freecad else lambda: ())
