# SPDX-License-Identifier: LGPL-2.1-or-later
"""The BOM sync: :mod:`silo.bom_sync.steps` is the page that shows all of it. Here are the names of the spec.

Names are imported when they are first used: who needs the texts alone does not load the walker.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from silo.bom.compare.bom_diff import BomDiff
    from silo.bom.compare.difference import diff_bom
    from silo.bom.compare.merge import plan_merge
    from silo.bom.entry import BomEntry, Extraction
    from silo.bom.items.resolve import resolve_part_numbers
    from silo.bom.walk.links import extract, extract_bom_links
    from silo.bom_sync.resolved import Resolved, resolve
    from silo.bom_sync.steps import Outcome, Status, SyncApi, compare, sync, sync_tree

_HOME = {
    "silo.bom": (
        "BomDiff",
        "BomEntry",
        "Extraction",
        "diff_bom",
        "extract",
        "extract_bom_links",
        "plan_merge",
        "resolve_part_numbers",
    ),
    "silo.bom_sync.resolved": ("Resolved", "resolve"),
    "silo.bom_sync.steps": ("Outcome", "Status", "SyncApi", "compare", "sync", "sync_tree"),
}

__all__ = [
    "BomDiff",
    "BomEntry",
    "Extraction",
    "Outcome",
    "Resolved",
    "Status",
    "SyncApi",
    "compare",
    "diff_bom",
    "extract",
    "extract_bom_links",
    "plan_merge",
    "resolve",
    "resolve_part_numbers",
    "sync",
    "sync_tree",
]


def __getattr__(name: str) -> Any:
    for module, names in _HOME.items():
        if name in names:
            return getattr(import_module(module), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
