# SPDX-License-Identifier: LGPL-2.1-or-later
"""STEP files made on the spot, and reading them in this very process."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.gp import gp_Pnt, gp_Trsf
from OCP.Interface import Interface_Static
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_StepModelType
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.TopLoc import TopLoc_Location
from OCP.XCAFDoc import XCAFDoc_DocumentTool

from silo.inertia.geometry import ReadOptions, occt, read
from silo.inertia.model import Assembly, GeometryProblem

_TESTS = Path(__file__).parents[2]
for _folder in (_TESTS / "fcstd", _TESTS / "freecad"):
    # Test folders are no packages (import mode "importlib"): the FCStd writer and the list of this machine's
    # FreeCADs are made known by their folders.
    if str(_folder) not in sys.path:
        sys.path.insert(0, str(_folder))


class StepDocument:
    """A STEP file in the making: parts, assemblies, placements."""

    def __init__(self) -> None:
        occt.quiet()
        self._document = TDocStd_Document(TCollection_ExtendedString("XmlXCAF"))
        # Without it, version 7.8 takes the numbers to be in the unit that is written.
        XCAFDoc_DocumentTool.SetLengthUnit_s(self._document, 0.001)
        self._tool = XCAFDoc_DocumentTool.ShapeTool_s(self._document.Main())

    def part(self, shape: Any, name: str) -> Any:
        """A product with a shape."""
        label = self._tool.AddShape(shape, False)
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(name, True))
        return label

    def assembly(self, name: str) -> Any:
        """A product that others are placed in."""
        label = self._tool.NewShape()
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(name, True))
        return label

    def place(self, parent: Any, child: Any, trsf: gp_Trsf | None = None, name: str = "") -> None:
        """One use of ``child`` in ``parent``."""
        label = self._tool.AddComponent(parent, child, TopLoc_Location(trsf or gp_Trsf()))
        if name:
            TDataStd_Name.Set_s(label, TCollection_ExtendedString(name, True))

    def write(self, path: Path, unit: str = "MM", external: bool = False) -> Path:
        """Write the file; ``external`` gives each part a file of its own."""
        self._tool.UpdateAssemblies()
        Interface_Static.SetCVal_s("write.step.unit", unit)
        try:
            writer = STEPCAFControl_Writer()
            writer.SetNameMode(True)
            mode = STEPControl_StepModelType.STEPControl_AsIs
            assert writer.Transfer(self._document, mode, "" if external else None)
            writer.Write(str(path))
        finally:
            Interface_Static.SetCVal_s("write.step.unit", "MM")
        return path


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
def _trsf() -> Callable[..., gp_Trsf]:
    """``trsf(translation, rotation)``: a rigid kernel placement from [mm] and (3, 3)."""

    def trsf(translation: ArrayLike = (0, 0, 0), rotation: ArrayLike | None = None) -> gp_Trsf:
        matrix = np.eye(4)
        matrix[:3, :3] = np.eye(3) if rotation is None else np.asarray(rotation, float)
        matrix[:3, 3] = translation
        result = gp_Trsf()
        result.SetValues(*(float(v) for v in matrix[:3].ravel()))
        return result

    return trsf


@pytest.fixture(name="read_in")
def _read_in() -> Callable[..., Assembly]:
    """``read_in(path, **options)``: read without a child process and without a cache."""

    def read_in(path: Path, **options: Any) -> Assembly:
        return read(path, options=ReadOptions(isolate=False, cache=False, **options))

    return read_in


@pytest.fixture(name="codes_of")
def _codes_of() -> Callable[..., list[str]]:
    """The codes of an assembly's problems, or of a prototype's."""

    def codes_of(thing: Any) -> list[str]:
        problems: tuple[GeometryProblem, ...] = thing.problems
        return [str(problem.code) for problem in problems]

    return codes_of
