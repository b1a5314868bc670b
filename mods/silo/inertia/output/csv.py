# SPDX-License-Identifier: LGPL-2.1-or-later
"""A report as CSV: one row per link and part."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable

from silo.bom.headers import safe_cell
from silo.inertia.report import InertiaReport, PartResult

CSV_COLUMNS: dict[str, str | Callable[[str, PartResult], object]] = {
    "Link": lambda link, part: link,
    "Part": "name",
    "Part number": "part_number",
    "Quantity": "quantity",
    "Mass (kg)": "mass",
    "Total mass (kg)": "total_mass",
    "Volume (m3)": "volume",
    "Density (kg/m3)": "density",
    "Source": "source",
    "Rule": "rule",
    "Decided by": "decided_by",
    "Material": "material",
    "BOM lines": lambda link, part: " ".join(map(str, part.lines)),
    "Path": lambda link, part: part.paths[0],
    "Warnings": lambda link, part: " ".join(dict.fromkeys(str(w.code) for w in part.warnings)),
}
"""What is in a column: an attribute of the part, or what a function makes of the link's name and the part."""


def report_csv(report: InertiaReport) -> str:
    """Write one row for each link and part (RFC 4180).

    Text that a spreadsheet would take for a formula is quoted.
    """
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(CSV_COLUMNS)
    for link, part in report.parts():
        cells = (
            getattr(part, column) if isinstance(column, str) else column(link, part)
            for column in CSV_COLUMNS.values()
        )
        writer.writerow(map(safe_cell, cells))
    return out.getvalue()
