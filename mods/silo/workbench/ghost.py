# SPDX-License-Identifier: LGPL-2.1-or-later
"""Another revision beside an open document: what is drawn of it, and how many differ."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from silo.inertia.geometry.together import Floats, Mesh


@dataclass(frozen=True, eq=False)
class Ghost:
    """An occurrence in another revision: its path, (4, 4) to the axes of the top, its triangles there [m]."""

    path: tuple[str, ...]
    matrix: Floats
    mesh: Mesh


@dataclass(frozen=True)
class Differences:
    """How many are only in the other revision, stand elsewhere there, are only here, cannot be compared."""

    removed: int
    moved: int
    added: int
    unknown: int
