# SPDX-License-Identifier: LGPL-2.1-or-later
"""Comparisons of BOMs: CAD with the server's lines, and states of a project with each other."""
