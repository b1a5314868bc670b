# SPDX-License-Identifier: LGPL-2.1-or-later
"""How large a workbook may be: in bytes when it is unpacked, and in cells."""

from __future__ import annotations

MAX_UNPACKED = 128 * 1024 * 1024
"""[bytes] of all parts of a workbook."""

MOST_CELLS = 500_000
"""Cells of a sheet."""
