# SPDX-License-Identifier: LGPL-2.1-or-later
"""A report of masses as text: for a terminal, for a program, for a simulator."""
