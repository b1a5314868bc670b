# SPDX-License-Identifier: LGPL-2.1-or-later
"""How much a geometry file may ask of its reader.

What is counted is what the reader makes: placements of a FreeCAD document, elements of a 3MF model, numbers
that a GLB file claims without holding them. A STEP file is bounded by its own length: see
:mod:`silo.inertia.geometry.part21` and :class:`~silo.inertia.geometry.options.ReadOptions`.
"""

from __future__ import annotations

from silo.budget import MIB, Budget

MODEL = Budget(bytes=4096 * MIB, objects=200_000, cells=100_000_000, depth=60, text=4_000_000)
"""A FreeCAD document with its links: ``objects`` are placements, ``bytes`` unpacked shapes."""

MESH = Budget(bytes=2048 * MIB, objects=12_000_000, cells=100_000_000, depth=60, text=4_000_000)
"""A mesh file: ``objects`` are XML elements, ``cells`` numbers that the file claims and does not hold."""
