# SPDX-License-Identifier: LGPL-2.1-or-later
"""The border to FreeCAD: its documents, menus and hooks."""
