# SPDX-License-Identifier: LGPL-2.1-or-later
"""Materials: what a text says of a density, by tables of materials and by FreeCAD's cards."""
