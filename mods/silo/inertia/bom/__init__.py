# SPDX-License-Identifier: LGPL-2.1-or-later
"""Bills of materials, as a mass calculation reads them: a file in, a table that keeps every row out."""

from __future__ import annotations

from silo.inertia.bom.parser import BOMParser
from silo.inertia.bom.table import BOMEntry

__all__ = ["BOMEntry", "BOMParser"]
