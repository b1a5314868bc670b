# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD as a child process: what it reads and measures for the command line."""
