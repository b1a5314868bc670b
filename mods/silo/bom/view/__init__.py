# SPDX-License-Identifier: LGPL-2.1-or-later
"""A BOM as it is shown: JSON values, lists and rows, with short paths."""
