# SPDX-License-Identifier: LGPL-2.1-or-later
"""The bodies that a file's text names, against the solids that the kernel's reader made of them.

The reader drops what it does not know: replicas, primitives, CSG trees, swept areas, triangles beside an
exact body; and a body whose faces it cannot read is no solid any more. It is silent if the product has
another solid. What is missing is made here from the file's own entities, or named in a warning.
"""

from __future__ import annotations

import math
from contextlib import suppress
from typing import Any

import numpy as np
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakePrism,
    BRepPrimAPI_MakeRevol,
    BRepPrimAPI_MakeSphere,
    BRepPrimAPI_MakeTorus,
    BRepPrimAPI_MakeWedge,
)
from OCP.gp import gp_Ax2, gp_Trsf, gp_Vec
from OCP.StepData import StepData_Factors
from OCP.StepToGeom import StepToGeom
from OCP.StepToTopoDS import StepToTopoDS_Builder, StepToTopoDS_TranslateCurveBoundedSurface
from OCP.TopLoc import TopLoc_Location

from silo.inertia.geometry.kernel import occt
from silo.inertia.geometry.kernel.occt import xyz
from silo.inertia.geometry.step.part21 import ProductFacts, Products
from silo.inertia.geometry.together import Floats
from silo.inertia.model import GeometryCode, Note

MOST_ASKED = 200
"""Solids of one product whose entity the kernel is asked for, which is slow; of more, the number decides."""

MOST_PARTS = 500
"""Of one CSG tree; a hostile one of a kilobyte may unfold to 2**40."""

_OPERATIONS = {
    ".UNION.": BRepAlgoAPI_Fuse,
    ".DIFFERENCE.": BRepAlgoAPI_Cut,
    ".INTERSECTION.": BRepAlgoAPI_Common,
}


def _given(value: Any) -> Any:
    # The kernel ends the process where it is handed nothing.
    if value is None:
        raise ValueError("the entity is not complete")
    return value


class Bodies:
    """The bodies of one file, which its reader still holds."""

    def __init__(self, reader: Any, products: Products) -> None:
        session = reader.Reader()
        self._model = session.StepModel()
        self._transfer = session.WS().TransferReader()
        self._products = products
        self._left = 0

    def dropped(self, bodies: tuple[int, ...], shapes: list[Any]) -> list[int]:
        """Return those of ``bodies`` that are no solid of ``shapes``."""
        solids = [solid for shape in shapes for solid in occt.solids_of(shape) if occt.faces_of(solid)]
        if len(solids) == len(bodies) and not 1 < len(solids) <= MOST_ASKED:
            return []
        read = [self._transfer.EntityFromShapeResult(s.Located(TopLoc_Location()), 1) for s in solids]
        known = {id(entity) for entity in read if entity is not None}
        return [number for number in bodies if id(self._entity(number)) not in known]

    def made(self, number: int, facts: ProductFacts) -> Any:
        """Return the shape of a body that was dropped, None if it cannot be made."""
        factors = StepData_Factors()
        factors.InitializeFactors(facts.unit_mm or 1.0, facts.unit_rad, 1.0)
        self._left = MOST_PARTS
        # A body of faces that the reader could not close would be none here either.
        if number in facts.mapped or self._products.solids[number][0].endswith(("BREP", "VOIDS")):
            return None
        with occt.Attempt(), suppress(AttributeError, LookupError, TypeError):
            shape = self._made(number, factors)
            if any(map(occt.faces_of, occt.solids_of(shape))):
                return shape
        return None

    def problem(self, number: int) -> Note:
        """Say that a body is missing."""
        entity, keyword = self._entity(number), self._products.solids[number][0]
        name = entity.Name() if hasattr(entity, "Name") else None
        what = f"{keyword} #{number}" + (f" “{name.ToCString()}”" if name and name.Length() else "")
        words = f"the file has a body that could not be read as a solid, {what}: its volume is missing"
        return Note(GeometryCode.BODY_MISSING, words)

    def _entity(self, number: int) -> Any:
        return self._model.Entity(self._products.solids[number][1])

    def _made(self, number: int, factors: Any) -> Any:
        self._left -= 1
        keyword = self._products.solids[number][0]
        word, parts = self._products.trees.get(number, ("", ()))
        if self._left < 0:
            raise ValueError("a tree without end")
        if keyword == "CSG_SOLID":
            return self._made(parts[0], factors)
        if keyword == "BOOLEAN_RESULT":
            one, other = (self._made(part, factors) for part in parts)
            return _OPERATIONS[word](one, other).Shape()
        entity = self._entity(number)
        if keyword == "SOLID_REPLICA":
            place = TopLoc_Location(_operator(_given(entity.Transformation()), factors))
            return self._made(parts[0], factors).Moved(place, False)
        return self._primitive(keyword, entity, factors)

    def _primitive(self, keyword: str, entity: Any, factors: Any) -> Any:
        unit = factors.LengthFactor()

        def place() -> gp_Ax2:
            position = _given(entity.Position())
            if keyword in ("BLOCK", "RIGHT_ANGULAR_WEDGE"):
                return StepToGeom.MakeAxis2Placement_s(position, factors).Ax2()
            axis = StepToGeom.MakeAxis1Placement_s(position, factors).Ax1()
            return gp_Ax2(axis.Location(), axis.Direction())

        def size(*names: str) -> list[float]:
            return [getattr(entity, name)() * unit for name in names]

        if keyword == "BLOCK":
            return BRepPrimAPI_MakeBox(place(), *size("X", "Y", "Z")).Shape()
        if keyword == "RIGHT_ANGULAR_WEDGE":
            return BRepPrimAPI_MakeWedge(place(), *size("X", "Y", "Z", "Ltx")).Shape()
        if keyword == "RIGHT_CIRCULAR_CYLINDER":
            return BRepPrimAPI_MakeCylinder(place(), *size("Radius", "Height")).Shape()
        if keyword == "RIGHT_CIRCULAR_CONE":
            radius, height = size("Radius", "Height")
            wider = radius + height * math.tan(entity.SemiAngle() * factors.PlaneAngleFactor())
            return BRepPrimAPI_MakeCone(place(), radius, wider, height).Shape()
        if keyword == "TORUS":
            return BRepPrimAPI_MakeTorus(place(), *size("MajorRadius", "MinorRadius")).Shape()
        if keyword == "SPHERE":
            centre = StepToGeom.MakeCartesianPoint_s(_given(entity.Centre()), factors).Pnt()
            return BRepPrimAPI_MakeSphere(centre, *size("Radius")).Shape()
        process = self._transfer.TransientProcess()
        if keyword in ("EXTRUDED_AREA_SOLID", "REVOLVED_AREA_SOLID"):
            area = StepToTopoDS_TranslateCurveBoundedSurface(
                _given(entity.SweptArea()), process, factors
            ).Value()
            if keyword == "REVOLVED_AREA_SOLID":
                axis = StepToGeom.MakeAxis1Placement_s(_given(entity.Axis()), factors).Ax1()
                return BRepPrimAPI_MakeRevol(area, axis, entity.Angle() * factors.PlaneAngleFactor()).Shape()
            along = StepToGeom.MakeDirection_s(_given(entity.ExtrudedDirection())).Dir()
            return BRepPrimAPI_MakePrism(area, gp_Vec(along).Multiplied(*size("Depth"))).Shape()
        builder = StepToTopoDS_Builder()
        builder.Init(entity, process, *([False] if keyword == "TESSELLATED_SOLID" else []), factors)
        return builder.Value()


def _operator(operator: Any, factors: Any) -> gp_Trsf:
    """Return the transformation of a replica, which may scale and mirror; the kernel's own does neither."""

    def axis(given: Any, default: int, *across: Floats) -> Floats:
        for found in ([xyz(StepToGeom.MakeDirection_s(given).Dir())] if given is not None else []) + [
            *np.roll(np.eye(3), -default, axis=0)
        ]:
            left = np.array(found) - sum(np.dot(found, one) * one for one in across)
            if np.linalg.norm(left) > 1e-6:
                break
        result: Floats = left / np.linalg.norm(left)
        return result

    z = axis(operator.Axis3(), 2)
    x = axis(operator.Axis1(), 0, z)
    y = axis(operator.Axis2(), 1, z, x)
    scale = operator.Scale() if operator.HasScale() else 1.0
    origin = xyz(StepToGeom.MakeCartesianPoint_s(_given(operator.LocalOrigin()), factors).Pnt())
    step = gp_Trsf()
    step.SetValues(*np.column_stack([scale * x, scale * y, scale * z, origin]).ravel().tolist())
    return step
