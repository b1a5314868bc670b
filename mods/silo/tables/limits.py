# SPDX-License-Identifier: LGPL-2.1-or-later
"""How large a table may be. What is above a limit is refused with the limit, before work is done on it."""

from __future__ import annotations

from silo.budget import MIB, Budget

TABLE = Budget(bytes=64 * MIB, objects=200_000, cells=2_000_000, depth=1, text=32_767)
"""For one table: its bytes, rows (objects), cells, and the characters of a cell."""
MOST_COLUMNS = 1_000
LONGEST_HEADING = 300
"""[characters] a longer text is no heading; what looks into headings may be quadratic in this."""
LONGEST_AMOUNT = 60
"""[characters] of a number with its unit or currency; a longer text is neither."""
HEADER_WITHIN = 40
"""The heading is among this many first lines (title blocks are a few lines long)."""
