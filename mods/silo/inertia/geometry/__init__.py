# SPDX-License-Identifier: LGPL-2.1-or-later
"""Geometry for the inertia part: any file in, prototypes and placed instances out.

Light to import: the geometry kernel and trimesh are loaded where a file is read, which is in a child process.
"""

from silo.inertia.geometry.options import Progress, ReadOptions
from silo.inertia.geometry.read import read
from silo.inertia.geometry.together import Mesh

__all__ = ["Mesh", "Progress", "ReadOptions", "read"]
