# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD's open documents as the flows know them: made from what, in which order, at one moment."""
