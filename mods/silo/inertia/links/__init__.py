# SPDX-License-Identifier: LGPL-2.1-or-later
"""The links of a robot: which parts belong to each, and in which frame its numbers are."""
