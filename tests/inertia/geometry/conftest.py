# SPDX-License-Identifier: LGPL-2.1-or-later
"""STEP files made on the spot, and reading them in this very process."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.gp import gp_Pnt
from step_writer import StepDocument, trsf_of

from silo.inertia.assembly import Assembly
from silo.inertia.geometry import ReadOptions, read
from silo.inertia.notes import Note

_TESTS = Path(__file__).parents[2]
for _folder in (_TESTS / "fcstd", _TESTS / "freecad"):
    # Test folders are no packages (import mode "importlib"): the writer of FCStd files and the list of this
    # machine's FreeCADs are found through their folders.
    if str(_folder) not in sys.path:
        sys.path.insert(0, str(_folder))


@pytest.fixture(name="step")
def _step() -> Callable[[], StepDocument]:
    """``step()``: a new STEP document."""
    return StepDocument


@pytest.fixture(name="step_part")
def _step_part(tmp_path: Path) -> Callable[..., Path]:
    """``step_part(shape, name, unit)``: a STEP file with one part."""

    def write(shape: Any, name: str = "part", unit: str = "MM") -> Path:
        document = StepDocument()
        document.part(shape, name)
        return document.write(tmp_path / f"{name}.step", unit)

    return write


@pytest.fixture(name="box")
def _box() -> Callable[..., Any]:
    """``box(x, y, z, at)``: a box with one corner at ``at`` [mm]."""

    def box(x: float, y: float, z: float, at: Sequence[float] = (0, 0, 0)) -> Any:
        return BRepPrimAPI_MakeBox(gp_Pnt(*at), x, y, z).Shape()

    return box


@pytest.fixture(name="trsf")
def _trsf() -> Callable[..., Any]:
    """``trsf(translation, rotation)``: a rigid kernel placement from [mm] and (3, 3)."""
    return trsf_of


@pytest.fixture(name="read_in")
def _read_in() -> Callable[..., Assembly]:
    """``read_in(path, **options)``: read without a child process and without a cache."""

    def read_in(path: Path, **options: Any) -> Assembly:
        return read(path, options=ReadOptions(isolate=False, cache=False, **options))

    return read_in


@pytest.fixture(name="read_document")
def _read_document(tmp_path: Path, read_in: Callable[..., Assembly]) -> Callable[..., Assembly]:
    """``read_document(document)``: read what was made, from a STEP or FreeCAD file of its own."""

    def read_document(document: Any) -> Assembly:
        if isinstance(document, StepDocument):
            return read_in(document.write(tmp_path / "document.step"))
        return read_in(document.save(tmp_path / f"{document.label}.FCStd"))

    return read_document


@pytest.fixture(name="codes_of")
def _codes_of() -> Callable[..., list[str]]:
    """The codes of an assembly's problems, or of a prototype's."""

    def codes_of(thing: Any) -> list[str]:
        problems: tuple[Note, ...] = thing.problems
        return [str(problem.code) for problem in problems]

    return codes_of
