# SPDX-License-Identifier: LGPL-2.1-or-later
"""From a geometry file and a BOM to a report, as the command does it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from step_writer import StepDocument

from silo.inertia.bom.table import BomTable
from silo.inertia.calculation import calculate
from silo.inertia.calculator import read_geometry
from silo.inertia.geometry import ReadOptions
from silo.inertia.report import InertiaReport
from silo.inertia.task import Task


@pytest.fixture(name="step")
def _step() -> Callable[[], StepDocument]:
    """``step()``: a new STEP document."""
    return StepDocument


@pytest.fixture(name="pipeline")
def _pipeline(materials: Any, bom: Callable[..., BomTable]) -> Callable[..., InertiaReport]:
    """``pipeline(path, csv_text | None, **task)``: read in this process, without a cache."""

    def run(path: Path, text: str | None, siblings: bool = True, **task: Any) -> InertiaReport:
        assembly = read_geometry(path, ReadOptions(isolate=False, cache=False, siblings=siblings))
        return calculate(assembly, bom(text) if text is not None else None, Task(materials, **task))

    return run
