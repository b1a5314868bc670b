# SPDX-License-Identifier: LGPL-2.1-or-later
"""STEP files that hold triangles instead of surfaces (AP242 tessellated geometry)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from OCP.BRep import BRep_Builder
from OCP.gp import gp_Pnt
from OCP.Interface import Interface_Static
from OCP.Poly import Poly_Triangle, Poly_Triangulation
from OCP.TopoDS import TopoDS_Face, TopoDS_Shell, TopoDS_Solid

from silo.inertia.geometry.kernel import tessellated
from silo.inertia.geometry.together import Mesh
from silo.inertia.notes import GeometryCode

GIVEN = GeometryCode.READER
"""What each solid of triangles is marked with."""


def shape_of(mesh: Mesh, solid: bool) -> Any:
    """Triangles as one face without a surface, in a shell or a solid."""
    triangulation = Poly_Triangulation(len(mesh.vertices), len(mesh.faces), False)
    for number, point in enumerate((mesh.vertices * 1e3).tolist(), start=1):
        triangulation.SetNode(number, gp_Pnt(*point))
    for number, corners in enumerate((mesh.faces + 1).tolist(), start=1):
        triangulation.SetTriangle(number, Poly_Triangle(*corners))
    builder, face, shell = BRep_Builder(), TopoDS_Face(), TopoDS_Shell()
    builder.MakeFace(face, triangulation)
    builder.MakeShell(shell)
    builder.Add(shell, face)
    if not solid:
        return shell
    whole = TopoDS_Solid()
    builder.MakeSolid(whole)
    builder.Add(whole, shell)
    return whole


@pytest.fixture(name="read_mesh")
def _read_mesh(step: Any, tmp_path: Path, read_in: Any) -> Any:
    """``read_mesh(mesh, solid)``: the only part of a file with this mesh."""

    def read_mesh(mesh: Mesh, solid: bool = True) -> Any:
        document = step()
        document.part(shape_of(mesh, solid), "triangles")
        options = {"write.step.schema": "AP242DIS", "write.step.tessellated": "On"}
        before = {name: Interface_Static.CVal_s(name) for name in options}
        try:
            for name, value in options.items():
                Interface_Static.SetCVal_s(name, value)
            path = document.write(tmp_path / "triangles.step")
        finally:
            for name, value in before.items():
                Interface_Static.SetCVal_s(name, value)
        assert "TRIANGULATED_FACE" in path.read_text("ascii")
        (part,) = read_in(path).prototypes.values()
        return part

    return read_mesh


def faces_changed(mesh: Mesh, how: str) -> Mesh:
    """The mesh with one triangle left out, one turned over, or all of them turned."""
    faces = mesh.faces.copy()
    if how == "open":
        faces = faces[1:]
    elif how == "one turned":
        faces[0] = faces[0][::-1]
    elif how == "all turned":
        faces = faces[:, ::-1]
    return Mesh(mesh.vertices, faces)


@pytest.mark.parametrize("solid", [True, False])
@pytest.mark.parametrize("how", ["closed", "all turned"])
def test_closed_triangles_have_their_exact_volume(how: str, solid: bool, box: Any, read_mesh: Any) -> None:
    """Also as a shell without a solid, which is reported; inside out, too."""
    part = read_mesh(faces_changed(tessellated(box(10, 20, 30))[0], how), solid)
    assert part.volume_m3 == pytest.approx(6000e-9, rel=1e-12)
    np.testing.assert_allclose(part.com_m, [0.005, 0.01, 0.015], rtol=1e-12)
    codes = {GIVEN, *(() if solid else (GeometryCode.SHELL_VOLUME,))}
    assert {p.code for p in part.problems} == codes | (
        {GeometryCode.NEGATIVE_VOLUME} if "all" in how else set()
    )


@pytest.mark.parametrize(
    ("how", "code"), [("open", GeometryCode.NOT_WATERTIGHT), ("one turned", GeometryCode.WINDING)]
)
def test_triangles_that_do_not_close_are_reported(
    how: str, code: GeometryCode, box: Any, read_mesh: Any
) -> None:
    """The volume of a solid would depend on the point that it is taken from; a shell has none."""
    mesh = faces_changed(tessellated(box(10, 20, 30))[0], how)
    assert {p.code for p in read_mesh(mesh).problems} == {GIVEN, code}
    shell = read_mesh(mesh, solid=False)
    assert (shell.volume_m3, [p.code for p in shell.problems]) == (0.0, [GeometryCode.NO_SOLID])
