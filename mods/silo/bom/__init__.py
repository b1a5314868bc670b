# SPDX-License-Identifier: LGPL-2.1-or-later
"""The pure core: values in, values out; no I/O, no clock, standard library only."""

from silo.bom.diff import diff_bom
from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.bom.links import extract, extract_bom_links
from silo.bom.merge import MergePlan, apply_merge, plan_merge
from silo.bom.model import BomChange, BomDiff, BomEntry, Extraction, QuantityChange
from silo.bom.resolve import resolve_part_numbers
from silo.bom.roots import choose_assembly

__all__ = [
    "BomChange",
    "BomDiff",
    "BomEntry",
    "Extraction",
    "Finding",
    "FindingCode",
    "MergePlan",
    "Place",
    "QuantityChange",
    "Severity",
    "apply_merge",
    "choose_assembly",
    "diff_bom",
    "extract",
    "extract_bom_links",
    "plan_merge",
    "resolve_part_numbers",
]
