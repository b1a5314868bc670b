# SPDX-License-Identifier: LGPL-2.1-or-later
"""BOM exports, CSV files and workbooks: read tolerantly, and nothing unreadable is silent."""

from silo.inertia.bom.parser import BOMParser
from silo.inertia.bom.table import BomCode, BOMEntry, BomTable, BomWarning, as_table

__all__ = ["BOMEntry", "BOMParser", "BomCode", "BomTable", "BomWarning", "as_table"]
