# SPDX-License-Identifier: LGPL-2.1-or-later
"""Whole folders of FreeCAD files: what their assemblies hold, and what changed between two states."""
