# SPDX-License-Identifier: LGPL-2.1-or-later
"""A BOM's lines: how they change, their history, the tree below and above, files in and out."""
