# SPDX-License-Identifier: LGPL-2.1-or-later
"""Mass, centre of mass and inertia of an assembly's links, from its geometry and a BOM.

Names are imported when they are first used: ``import silo.inertia`` loads neither numpy nor the CAD kernel.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from silo.inertia.bom.parser import BOMParser
    from silo.inertia.bom.table import BOMEntry
    from silo.inertia.calculator import (
        MATERIAL_DENSITIES,
        EnhancedInertiaCalculator,
        InertiaCalculator,
        compute_link_inertials,
    )
    from silo.inertia.report import InertiaReport, PartWarning
    from silo.inertia.rigid import MassProps
    from silo.inertia.types import InertialProperties

__all__ = [
    "MATERIAL_DENSITIES",
    "BOMEntry",
    "BOMParser",
    "EnhancedInertiaCalculator",
    "InertiaCalculator",
    "InertiaReport",
    "InertialProperties",
    "MassProps",
    "PartWarning",
    "compute_link_inertials",
]

_HOME = {
    "BOMEntry": "bom",
    "BOMParser": "bom.parser",
    "EnhancedInertiaCalculator": "calculator",
    "InertiaCalculator": "calculator",
    "InertiaReport": "report",
    "InertialProperties": "types",
    "MATERIAL_DENSITIES": "calculator",
    "MassProps": "rigid",
    "PartWarning": "report",
    "compute_link_inertials": "calculator",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
