# SPDX-License-Identifier: LGPL-2.1-or-later
"""How large a table may be. What is above a limit is refused with the limit, before work is done on it."""

from __future__ import annotations

MOST_BYTES = 64 * 1024 * 1024
MOST_ROWS = 200_000
MOST_COLUMNS = 1_000
MOST_CELLS = 2_000_000
LONGEST_CELL = 32_767
"""[characters] as in a spreadsheet program."""
LONGEST_HEADING = 300
"""[characters] a longer text is no heading; what looks into headings may be quadratic in this."""
LONGEST_AMOUNT = 60
"""[characters] of a number with its unit or currency; a longer text is neither."""
HEADER_WITHIN = 40
"""The heading is among this many first lines (title blocks are a few lines long)."""
