# SPDX-License-Identifier: LGPL-2.1-or-later
"""Previews: what is in the GLB."""

from __future__ import annotations

import io
import json
import struct
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from silo.drawing import shaded
from silo.drawing.page import LinkView, ellipsoid, inertia_ellipsoid, views_of, write_glb
from silo.inertia.assembly import Assembly, Instance, Prototype
from silo.inertia.geometry import Mesh
from silo.inertia.geometry.together import mesh_volume
from silo.inertia.rigid import MassProps


def cube_mesh(size: float = 0.1) -> Mesh:
    """A cube about the origin."""
    body = trimesh.creation.box((size,) * 3)
    return Mesh(np.array(body.vertices), np.array(body.faces))


def at(x: float, y: float = 0.0, z: float = 0.0) -> NDArray[np.float64]:
    """A placement without a turn."""
    result = np.eye(4)
    result[:3, 3] = (x, y, z)
    return result


def cube_props(x: float, mass: float = 2.0, size: float = 0.1) -> MassProps:
    """A cube's mass properties."""
    return MassProps(mass, np.array([x, 0, 0]), np.eye(3) * mass * size**2 / 6)


@pytest.fixture(name="scene")
def _scene() -> tuple[Assembly, list[LinkView]]:
    """Two links of cubes that share one prototype, one cube that no link has."""
    cube = Prototype("cube", "cube", mesh=cube_mesh())
    bare = Prototype("bare", "bare", has_solid=False)
    instances = (
        Instance(("a", "one"), ("A", "cube"), "cube", at(0)),
        Instance(("a", "two"), ("A", "cube"), "cube", at(0, 0, 0.2)),
        Instance(("b",), ("cube",), "cube", at(0.5) @ np.diag([-1.0, 1, 1, 1])),
        Instance(("c",), ("bare",), "bare", at(9)),
        Instance(("d",), ("cube",), "cube", at(0.25)),
    )
    assembly = Assembly("pair", {"cube": cube, "bare": bare}, instances)
    views = [
        LinkView("left", instances[:2], cube_props(0.0)),
        LinkView("right", instances[2:4], cube_props(0.5)),
        LinkView("", instances[4:]),
    ]
    return assembly, views


def document(data: bytes) -> dict[str, Any]:
    """The JSON of a GLB."""
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack_from("<I4s", data, 12)
    assert kind == b"JSON"
    found: dict[str, Any] = json.loads(data[20 : 20 + size])
    return found


def test_a_glb_holds_each_mesh_once_and_each_link_as_a_node(scene: Any) -> None:
    """Five uses, three colours, one set of vertices for the cube and one for all ellipsoids."""
    found = document(write_glb(*scene))
    roots = found["nodes"][0]["children"]
    assert [found["nodes"][n]["name"] for n in roots] == ["left", "right", "no link"]
    positions = {m["primitives"][0]["attributes"]["POSITION"] for m in found["meshes"]}
    assert len(positions) == 2
    names = [node["name"] for node in found["nodes"]]
    assert names.count("left inertia ellipsoid") == 1
    assert names.count("left centre of mass") == 1
    left = found["nodes"][roots[0]]
    assert left["extras"]["mass_kg"] == 2.0
    assert "extras" not in found["nodes"][roots[2]]


def test_an_independent_reader_sees_the_scene(scene: Any) -> None:
    """trimesh finds the cubes where they are (Y up there: a quarter turn about x), mirrored ones too."""
    loaded = trimesh.load_scene(io.BytesIO(write_glb(*scene)), file_type="glb")
    turn = trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0])
    for node, wanted in (("a/two", at(0, 0, 0.2)), ("b", at(0.5) @ np.diag([-1.0, 1, 1, 1]))):
        found, _ = loaded.graph[node]
        np.testing.assert_allclose(found, turn @ wanted, atol=1e-7)
    shape, _ = loaded.graph["right inertia ellipsoid"]
    np.testing.assert_allclose(shape[:3, 3], [0.5, 0, 0], atol=1e-7)
    # A cube's ellipsoid is a ball: m/5 (2 r²) = m a²/6, so r = a sqrt(5/12).
    radii = np.linalg.norm(shape[:3, :3], axis=0)
    np.testing.assert_allclose(radii, 0.1 * np.sqrt(5 / 12), rtol=1e-6)


@given(st.tuples(*[st.floats(0.01, 2)] * 3), st.floats(0.1, 100), st.floats(0, 3))
def test_the_ellipsoid_has_the_inertia_that_it_stands_for(radii: Any, mass: float, angle: float) -> None:
    """Back from the radii: I_a = m/5 (b² + c²), turned as the body is."""
    a, b, c = np.array(radii) ** 2
    turn = trimesh.transformations.rotation_matrix(angle, [1, 2, 3])[:3, :3]
    inertia = turn @ np.diag([b + c, a + c, a + b]) @ turn.T * mass / 5
    found = inertia_ellipsoid(MassProps(mass, np.zeros(3), inertia))
    assert found is not None
    np.testing.assert_allclose(sorted(found.radii), sorted(radii), rtol=1e-5, atol=1e-5)
    squares = found.radii**2
    back = found.axes @ np.diag(squares.sum() - squares) @ found.axes.T * mass / 5
    np.testing.assert_allclose(back, inertia, atol=1e-7 * inertia.max() + 1e-12)


def test_a_link_without_mass_has_no_ellipsoid() -> None:
    """Nothing to draw, no error."""
    assert inertia_ellipsoid(MassProps.nothing()) is None


def test_normals_are_smooth_over_a_ball_and_sharp_on_a_cube() -> None:
    """A ball's normals point outwards everywhere; each corner of a cube has three."""
    assert mesh_volume(ellipsoid(40, 80)) == pytest.approx(4 / 3 * np.pi, rel=1e-2)
    ball = shaded(ellipsoid())
    np.testing.assert_allclose(ball.normals, ball.vertices, atol=0.12)
    assert len(ball.vertices) <= len(ellipsoid().vertices)  # one normal at each, but for the poles
    cube = shaded(cube_mesh())
    assert len(cube.vertices) == 24
    assert np.sort(np.abs(cube.normals), axis=1)[:, 2].min() == pytest.approx(1)


def test_a_report_becomes_views(assemble: Any, compute: Any) -> None:
    """Links in the report's order with parts and mass, in the assembly's frame."""
    from bodies import box

    block = box("block", 0.1, 0.1, 0.1, mesh=cube_mesh())
    assembly = assemble(("arm/one", block, at(0)), ("hand/two", block, at(0.4)))
    report = compute(assembly, "Name,Mass,Material,Quantity\nblock,2 kg,,2\n")
    views = views_of(report, assembly)
    assert [v.name for v in views] == ["arm", "hand"]
    assert [[i.name for i in v.instances] for v in views] == [["arm/one"], ["hand/two"]]
    assert views[1].props is not None
    np.testing.assert_allclose(views[1].props.com, [0.4, 0, 0])
