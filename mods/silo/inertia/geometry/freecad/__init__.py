# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD objects, from files or live: which have a mass, where they are, and their materials."""
