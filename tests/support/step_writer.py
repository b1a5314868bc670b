# SPDX-License-Identifier: LGPL-2.1-or-later
"""Writes STEP files with the geometry kernel, for tests."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from OCP.gp import gp_Trsf
from OCP.Interface import Interface_Static
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_StepModelType
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.TopLoc import TopLoc_Location
from OCP.XCAFDoc import XCAFDoc_DocumentTool

from silo.inertia.geometry import kernel as occt


def trsf_of(translation: ArrayLike = (0, 0, 0), rotation: ArrayLike | None = None) -> gp_Trsf:
    """A rigid kernel placement from [mm] and (3, 3)."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.eye(3) if rotation is None else np.asarray(rotation, float)
    matrix[:3, 3] = translation
    result = gp_Trsf()
    result.SetValues(*(float(v) for v in matrix[:3].ravel()))
    return result


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
        writer = STEPCAFControl_Writer()  # the first one sets all options to their defaults
        Interface_Static.SetCVal_s("write.step.unit", unit)
        try:
            writer.SetNameMode(True)
            mode = STEPControl_StepModelType.STEPControl_AsIs
            assert writer.Transfer(self._document, mode, "" if external else None)
            writer.Write(str(path))
        finally:
            Interface_Static.SetCVal_s("write.step.unit", "MM")
        return path


def emptied(path: Path, *names: str) -> Path:
    """Take the geometry of these products out of a STEP file, as SolidWorks leaves it out."""
    text = path.read_text("ascii")
    for name in names:
        product = re.search(rf"#(\d+) = PRODUCT\('{name}'", text)
        assert product is not None
        formation = re.search(rf"#(\d+) = PRODUCT_DEFINITION_FORMATION\([^#]*#{product[1]}\)", text)
        assert formation is not None
        definition = re.search(rf"#(\d+) = PRODUCT_DEFINITION\([^#]*#{formation[1]},", text)
        assert definition is not None
        shape = re.search(rf"#(\d+) = PRODUCT_DEFINITION_SHAPE\('','',#{definition[1]}\)", text)
        assert shape is not None
        link = re.search(rf"SHAPE_DEFINITION_REPRESENTATION\(#{shape[1]},#(\d+)\)", text)
        assert link is not None
        body = re.search(rf"#{link[1]} = ADVANCED_BREP_SHAPE_REPRESENTATION\('',\((#\d+),([^)]*)\),", text)
        assert body is not None
        text = text.replace(body[0], f"#{link[1]} = SHAPE_REPRESENTATION('',({body[1]}),")
        for solid in re.findall(r"#\d+", body[2]):
            text = re.sub(rf"{solid} = [^;]*;\n", "", text)
    path.write_text(text, "ascii")
    return path
