# SPDX-License-Identifier: LGPL-2.1-or-later
"""From components of a CAD model to items of Silo: look-up, names, categories, proposals."""
