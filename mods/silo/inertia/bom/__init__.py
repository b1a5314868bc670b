# SPDX-License-Identifier: LGPL-2.1-or-later
"""BOM CSV exports: read tolerantly, with nothing unreadable kept silent. Standard library only."""

from silo.inertia.bom.parser import BOMParser
from silo.inertia.bom.rows import BomCode, BOMEntry, BomTable, BomWarning, as_table

__all__ = ["BOMEntry", "BOMParser", "BomCode", "BomTable", "BomWarning", "as_table"]
