# SPDX-License-Identifier: LGPL-2.1-or-later
"""Who owns a line of the server's BOM: the CAD assembly, or the people who edit it (spec bom-sync §4)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from silo.bom.units import counts_pieces


def is_manual(line: Mapping[str, Any]) -> bool:
    """Return True if a line belongs to people: no component, not counted in pieces, or not from an assembly.

    A line with an unknown source belongs to somebody; an assembly may only change what assemblies wrote.
    """
    from_cad = (line.get("source") or "assembly") == "assembly" and counts_pieces(line.get("unit"))
    return not is_component(line) or not from_cad


def is_component(line: Mapping[str, Any]) -> bool:
    """Return True if a line counts parts; ``alternate`` and ``reference`` lines do not."""
    return (line.get("rel_type") or "component") == "component"
