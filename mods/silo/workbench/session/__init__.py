# SPDX-License-Identifier: LGPL-2.1-or-later
"""What works between FreeCAD and the server while FreeCAD runs."""
