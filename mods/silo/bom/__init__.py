# SPDX-License-Identifier: LGPL-2.1-or-later
"""The pure core: values in, values out; no I/O, no clock, standard library only.

Names are imported when they are first used: who needs the errors alone does not load the walker.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from silo.bom.compare.bom_diff import BomChange, BomDiff, QuantityChange
    from silo.bom.compare.difference import diff_bom
    from silo.bom.compare.merge import MergePlan, apply_merge, plan_merge
    from silo.bom.entry import BomEntry, Extraction
    from silo.bom.findings import Finding, FindingCode, Place, Severity
    from silo.bom.items.resolve import resolve_part_numbers
    from silo.bom.walk.links import extract, extract_bom_links
    from silo.bom.walk.roots import choose_assembly

_HOME = {
    "compare.difference": ("diff_bom",),
    "compare.merge": ("MergePlan", "apply_merge", "plan_merge"),
    "findings": ("Finding", "FindingCode", "Place", "Severity"),
    "walk.links": ("extract", "extract_bom_links"),
    "compare.bom_diff": ("BomChange", "BomDiff", "QuantityChange"),
    "entry": ("BomEntry", "Extraction"),
    "items.resolve": ("resolve_part_numbers",),
    "walk.roots": ("choose_assembly",),
}

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


def __getattr__(name: str) -> Any:
    for module, names in _HOME.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
