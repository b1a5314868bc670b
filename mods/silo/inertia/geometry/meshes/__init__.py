# SPDX-License-Identifier: LGPL-2.1-or-later
"""Mesh files: STL, OBJ, PLY, GLB and 3MF."""
