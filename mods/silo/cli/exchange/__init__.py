# SPDX-License-Identifier: LGPL-2.1-or-later
"""The commands that bring files, BOMs and commits to Silo, or files back."""
