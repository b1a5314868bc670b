# SPDX-License-Identifier: LGPL-2.1-or-later
"""The commands about this machine: the connection, a server, FreeCAD, the shell."""
