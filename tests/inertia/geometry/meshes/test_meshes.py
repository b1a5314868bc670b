# SPDX-License-Identifier: LGPL-2.1-or-later
"""Mesh files: volumes where they are closed, words where they are not; and the mathematics below."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from silo.bom.errors import DocumentError
from silo.inertia.assembly import Assembly, Prototype
from silo.inertia.geometry.together import (
    Mesh,
    about_enclosed,
    components,
    is_inside,
    joined,
    mesh_solid,
    mesh_volume,
    open_edges,
    simplified,
    welded,
    winding_number,
    without_doubled,
)
from silo.inertia.notes import GeometryCode


def brick(size: tuple[float, float, float] = (10, 20, 30), at: Any = (0, 0, 0)) -> Any:
    """A closed box of trimesh, its middle at ``at``."""
    return trimesh.creation.box(size).apply_translation(at)


def inside_out(body: Any) -> Any:
    """The same, its triangles looking inwards."""
    result = body.copy()
    result.invert()
    return result


def mesh_of(body: Any) -> Mesh:
    """As our own value."""
    return Mesh(np.array(body.vertices), np.array(body.faces))


def only(assembly: Assembly) -> Prototype:
    """The assembly's only prototype."""
    (prototype,) = assembly.prototypes.values()
    return prototype


def test_corners_that_nearly_meet_are_one_where_that_closes_the_mesh() -> None:
    """Rounding of an exporter, 1e-8 of the size; a real gap of 1e-3 stays open."""
    mesh = mesh_of(brick())
    corners = mesh.vertices[mesh.faces].reshape(-1, 3)
    own = np.arange(len(corners)).reshape(-1, 3)
    noise = np.random.default_rng(1).uniform(-1, 1, corners.shape)
    assert open_edges(welded(corners + 3e-7 * noise, own)) == 0
    for wide in (3e-4, 0.03):
        assert open_edges(welded(corners + wide * noise, own)) == 36


def test_repeated_triangles_and_those_that_meet_their_back() -> None:
    """A triangle is the same whichever corner it begins with; turned over it is its own back."""
    mesh = mesh_of(brick())
    for first in range(len(mesh.faces)):
        again = np.array([np.roll(mesh.faces[first], shift) for shift in (0, 1, 2)])
        kept, repeated = without_doubled(Mesh(mesh.vertices, np.concatenate([mesh.faces, again])))
        assert repeated == 3
        assert sorted(map(tuple, kept.faces.tolist())) == sorted(map(tuple, mesh.faces.tolist()))
    wall = np.array([[0, 3, 5], [5, 3, 0]])
    assert not {frozenset(wall[0].tolist())} & {frozenset(face) for face in mesh.faces.tolist()}
    kept, repeated = without_doubled(Mesh(mesh.vertices, np.concatenate([mesh.faces, wall])))
    assert (repeated, len(kept)) == (0, len(mesh))


@pytest.mark.parametrize("suffix", ["stl", "ply", "obj"])
def test_a_closed_mesh_is_exact_in_mm_and_says_that_it_guessed_the_unit(
    suffix: str, tmp_path: Path, read_in: Any, codes_of: Any
) -> None:
    """A box of 10 x 20 x 30: volume, centre, tensor of the box in mm; the unit is reported as assumed."""
    path = tmp_path / f"part.{suffix}"
    brick(at=(5, 10, 15)).export(path)
    assembly = read_in(path)
    part = only(assembly)
    assert part.volume_m3 == pytest.approx(6e-6, rel=1e-6)
    np.testing.assert_allclose(part.com_m, [0.005, 0.010, 0.015], atol=1e-8)
    np.testing.assert_allclose(np.diag(part.inertia_unit) * 12 / 6e-6, [1.3e-3, 1e-3, 5e-4], rtol=1e-5)
    assert (assembly.name, part.name) == ("part", "part")
    assert codes_of(assembly) == [GeometryCode.UNITS]
    assert codes_of(part) == []


def test_an_ascii_stl_is_read_as_well(tmp_path: Path, read_in: Any) -> None:
    """By its content, whatever its suffix says."""
    path = tmp_path / "part.STL"
    path.write_text(trimesh.exchange.stl.export_stl_ascii(brick()), "ascii")
    assert only(read_in(path)).volume_m3 == pytest.approx(6e-6)


def test_a_named_unit_is_taken_and_needs_no_word(tmp_path: Path, read_in: Any, codes_of: Any) -> None:
    """The user says inch: 25.4 times as long, and no assumption left."""
    path = tmp_path / "part.stl"
    brick((1, 1, 1)).export(path)
    assembly = read_in(path, mesh_unit="inch")
    assert only(assembly).volume_m3 == pytest.approx(0.0254**3, rel=1e-6)
    assert codes_of(assembly) == []


def test_an_implausible_size_asks_for_the_unit(tmp_path: Path, read_in: Any, codes_of: Any) -> None:
    """A part exported in metres and read in mm measures a tenth of a millimetre."""
    path = tmp_path / "part.stl"
    brick((0.1, 0.05, 0.02)).export(path)
    assembly = read_in(path)
    assert codes_of(assembly) == [GeometryCode.UNITS, GeometryCode.UNITS]
    assert "was another unit meant" in assembly.problems[1].message


def open_brick() -> Any:
    body = brick()
    body.update_faces(np.arange(len(body.faces)) > 1)
    return body


def one_turned() -> Any:
    body = brick()
    body.faces[0] = body.faces[0][::-1]
    return body


ODD = {
    # Its number looks like any other.
    "open": (open_brick(), None, [GeometryCode.NOT_WATERTIGHT], "4 free or shared edges"),
    # Closed, and its volume still not to be trusted.
    "one triangle turned": (one_turned(), None, [GeometryCode.WINDING], ""),
    "inside out": (inside_out(brick()), 6000, [GeometryCode.NEGATIVE_VOLUME], ""),
    "a cavity": (trimesh.util.concatenate([brick(), inside_out(brick((4, 4, 4)))]), 6000 - 64, [], ""),
    "beside it, inside out": (
        trimesh.util.concatenate([brick(), inside_out(brick((4, 4, 4), (50, 0, 0)))]), 6000 + 64,
        [GeometryCode.NEGATIVE_VOLUME], "",
    ),
    "a lone triangle": (
        trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), 0,
        [GeometryCode.NOT_WATERTIGHT, GeometryCode.NO_SOLID], "",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", ODD)
def test_what_is_odd_about_a_mesh_is_reported(name: str, tmp_path: Path, read_in: Any, codes_of: Any) -> None:
    """A volume is right, or in doubt; a negative one is turned, unless it is a cavity."""
    body, volume, codes, words = ODD[name]
    body.export(tmp_path / "part.ply")
    part = only(read_in(tmp_path / "part.ply"))
    assert codes_of(part) == codes
    assert words in " ".join(problem.message for problem in part.problems)
    assert volume is None or part.volume_m3 * 1e9 == pytest.approx(volume)
    assert np.linalg.eigvalsh(part.inertia_unit).min() >= 0


def test_a_glb_keeps_its_tree_and_its_metres(tmp_path: Path, read_in: Any, codes_of: Any) -> None:
    """Nodes become instances with their paths, a mesh used twice is one prototype, nothing is assumed."""
    scene = trimesh.Scene()
    cube = brick((0.1, 0.1, 0.1))
    shift = trimesh.transformations.translation_matrix([0.5, 0, 0])
    mirror = np.diag([-1.0, 1.0, 1.0, 1.0])
    scene.graph.update("arm", "world", matrix=shift)
    scene.add_geometry(cube, node_name="left", geom_name="cube", parent_node_name="arm", transform=shift)
    scene.graph.update("right", "arm", matrix=mirror, geometry="cube")
    path = tmp_path / "scene.glb"
    scene.export(path)
    assembly = read_in(path)
    assert sorted(i.name for i in assembly.instances) == ["left", "right"]
    assert len(assembly.prototypes) == 1
    assert assembly.unit == "m"
    assert codes_of(assembly) == []
    by_name = {i.path[-1]: i.transform for i in assembly.instances}
    assert by_name["left"][0, 3] == pytest.approx(1.0)
    assert np.linalg.det(by_name["right"][:3, :3]) == pytest.approx(-1)


@pytest.mark.parametrize("suffix", ["stl", "ply", "glb", "obj"])
def test_damaged_meshes_are_errors(suffix: str, tmp_path: Path, read_in: Any) -> None:
    """Cut in half: a plain sentence, of whatever the loader tripped over."""
    path = tmp_path / f"part.{suffix}"
    brick().export(path)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2] if suffix != "obj" else b"nothing here\n")
    with pytest.raises(DocumentError):
        read_in(path)


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf, 3e38])
@pytest.mark.parametrize("suffix", ["stl", "ply", "glb"])
def test_coordinates_that_cannot_be_meant_are_refused(
    suffix: str, number: float, tmp_path: Path, read_in: Any
) -> None:
    """NaN would run through every sum, and a huge number through every product."""
    path = tmp_path / f"bad.{suffix}"
    body = brick()
    body.vertices[0] = number
    with np.errstate(all="ignore"):
        body.export(path)
    with pytest.raises(DocumentError, match="not finite, or larger than 1e\\+12; repair the file"):
        read_in(path)


@pytest.mark.parametrize("scale", ["1e200", "NaN", "-Infinity"])
def test_placements_that_cannot_be_meant_are_refused(scale: str, tmp_path: Path, read_in: Any) -> None:
    """A NaN in the scene of a GLB file put the part into the origin."""
    path = tmp_path / "part.glb"
    scene = trimesh.Scene()
    scene.add_geometry(brick(), transform=np.diag([7.0, 7.0, 7.0, 1.0]))
    scene.export(path)
    data = path.read_bytes()
    new = data.replace(b"7.0,", f"{scale},".encode(), 1)
    assert new != data
    size = len(new) - len(data)
    length = int.from_bytes(data[12:16], "little")
    text = new[20 : 20 + length + size]
    text += b" " * (-len(text) % 4)
    head = data[:8] + (len(data) - length + len(text)).to_bytes(4, "little") + len(text).to_bytes(4, "little")
    path.write_bytes(head + b"JSON" + text + data[20 + length :])
    with pytest.raises(DocumentError, match=r"placement of .* not finite"):
        read_in(path)


def test_an_obj_does_not_reach_for_other_files(tmp_path: Path, read_in: Any) -> None:
    """A material library that the file names is not opened, wherever it is."""
    path = tmp_path / "part.obj"
    text = trimesh.exchange.obj.export_obj(brick())
    path.write_text("mtllib ../../../../etc/passwd\nusemtl x\n" + text, "ascii")
    assert only(read_in(path)).volume_m3 == pytest.approx(6e-6)


QUAD = "f 4 3 2 1\n"


@pytest.mark.parametrize("lost", [0, 1, 12])
def test_a_ply_file_that_is_cut_off_is_refused(lost: int, tmp_path: Path, read_in: Any) -> None:
    """Its header says how many lines there are; a whole body may be missing at the end."""
    text = trimesh.util.concatenate([brick(), brick((2, 2, 2), (50, 0, 0))]).export(
        file_type="ply", encoding="ascii"
    )
    lines = (text if isinstance(text, str) else text.decode()).splitlines()
    path = tmp_path / "part.ply"
    path.write_text("\n".join(lines[: len(lines) - lost]) + "\n\n")
    if not lost:
        assert only(read_in(path)).volume_m3 == pytest.approx(6.008e-6)
        return
    with pytest.raises(DocumentError, match="ends in the middle"):
        read_in(path)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("", "", False),
        (QUAD, "f 4 3 2\nf 4 2 1\n", False),
        (QUAD, "f -5 -6 -7 -8\n", False),
        (QUAD, "f 4 3 \\\n2 1\n", True),  # a line that is continued is not read
        (QUAD, QUAD + "cstype bspline\ndeg 1 1\nsurf 0 1 0 1 1 2 3 4\nparm u 0 0 1 1\nend\n", True),
    ],
    ids=["quads", "triangles", "from the end", "continued", "free-form"],
)
def test_what_an_obj_file_lists_is_read_or_named(
    old: str, new: str, said: bool, tmp_path: Path, read_in: Any, codes_of: Any
) -> None:
    """Its lines are the list: each polygon of n corners has n - 2 triangles."""
    corners = "".join(f"v {x} {y} {z}\n" for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))
    rest = "f 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"
    path = tmp_path / "part.obj"
    path.write_text((corners + "o cube\n" + QUAD + rest).replace(old, new) if old else corners + QUAD + rest)
    assert (GeometryCode.BODY_MISSING in codes_of(read_in(path))) == said


def edited(path: Path, edit: Any) -> Path:
    """A GLB file, its tree edited."""
    data = path.read_bytes()
    length = int.from_bytes(data[12:16], "little")
    tree = json.loads(data[20 : 20 + length])
    edit(tree)
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    rest = len(text).to_bytes(4, "little") + b"JSON" + text + data[20 + length :]
    path.write_bytes(data[:8] + (12 + len(rest)).to_bytes(4, "little") + rest)
    return path


@pytest.mark.parametrize(
    ("edit", "codes"),
    [
        (lambda tree: None, []),
        (lambda tree: tree["nodes"].append({"mesh": 0}), [GeometryCode.NOT_COUNTED]),
        (
            lambda tree: tree["nodes"][0].update(extensions={"EXT_mesh_gpu_instancing": {"attributes": {}}}),
            [GeometryCode.BODY_MISSING],
        ),
        (
            lambda tree: tree["meshes"][0]["primitives"][0].update(mode=1),  # lines are no body
            [],
        ),
    ],
    ids=["all", "in no scene", "instanced by an extension", "lines"],
)
def test_what_a_glb_file_lists_is_read_or_named(
    edit: Any, codes: list[str], tmp_path: Path, read_in: Any, codes_of: Any
) -> None:
    """The nodes of its scene are the list."""
    scene = trimesh.Scene([brick(), brick(at=(100, 0, 0))])
    path = tmp_path / "part.glb"
    scene.export(path)
    found = codes_of(read_in(edited(path, edit)))
    assert [code for code in found if code != GeometryCode.UNITS] == codes


def _nested(tree: Any) -> None:
    tree["nodes"][0]["children"], tree["scenes"][0]["nodes"] = [1], [0]


def _rooted(tree: Any) -> None:
    tree["nodes"].append({"name": "world", "mesh": 0, "children": [0, 1]})
    tree["scenes"][0]["nodes"] = [2]


@pytest.mark.parametrize(("edit", "count"), [(_nested, 2), (_rooted, 3)])
def test_a_mesh_beside_branches_counts(edit: Any, count: int, tmp_path: Path, read_in: Any) -> None:
    """A node of a GLB file may have a mesh and children, and so may its root."""
    path = tmp_path / "part.glb"
    trimesh.Scene([brick(), brick(at=(100, 0, 0))]).export(path)
    assert len(read_in(edited(path, edit)).instances) == count


# --- the mathematics ---------------------------------------------------------------------------------------


@given(
    st.tuples(*[st.floats(0.1, 50)] * 3),
    st.tuples(*[st.floats(-1000, 1000)] * 3),
)
def test_a_box_anywhere_has_its_closed_form(size: Any, at: Any) -> None:
    """Volume and tensor do not depend on where the box is."""
    found = mesh_solid(mesh_of(brick(size, at)))
    x, y, z = size
    tensor = x * y * z / 12 * np.diag([y * y + z * z, x * x + z * z, x * x + y * y])
    assert found.volume_m3 == pytest.approx(x * y * z, rel=1e-6)
    np.testing.assert_allclose(found.com_m, at, atol=1e-6)
    np.testing.assert_allclose(found.inertia_unit, tensor, atol=1e-5 * tensor.max())


def test_what_an_open_surface_would_enclose() -> None:
    """Cones from its middle, wherever it lies, whichever way its triangles look; a flat one has nothing."""
    mesh = mesh_of(brick((2, 2, 2), (50, 0, 0)))
    whole = about_enclosed(mesh)
    assert whole == pytest.approx(8)
    turned = np.where(np.arange(len(mesh.faces))[:, None] % 2, mesh.faces, mesh.faces[:, ::-1])
    assert about_enclosed(Mesh(mesh.vertices, turned)) == pytest.approx(whole)
    assert about_enclosed(Mesh(mesh.vertices, mesh.faces[2:])) > 4
    assert about_enclosed(Mesh(mesh.vertices, mesh.faces[:1])) == pytest.approx(0, abs=1e-9)


def test_components_are_what_shares_no_vertex() -> None:
    """Three boxes in one mesh are three pieces; one box is one; above the limit it stays whole."""
    three = joined([mesh_of(brick(at=(50 * n, 0, 0))) for n in range(3)])
    pieces = components(three, most=10)
    assert [mesh_volume(piece) for piece in pieces] == pytest.approx([6000.0] * 3)
    assert [len(piece.vertices) for piece in pieces] == [8, 8, 8]
    assert len(components(mesh_of(brick()), most=10)) == 1
    assert len(components(three, most=2)) == 1


def test_the_winding_number_distinguishes_inside_from_outside() -> None:
    """1 inside, 0 outside, -1 inside of an inverted mesh."""
    body, turned = mesh_of(brick()), mesh_of(inside_out(brick()))
    assert winding_number(body, np.array([1.0, 2.0, 3.0])) == pytest.approx(1)
    assert winding_number(body, np.array([9.0, 2.0, 3.0])) == pytest.approx(0, abs=1e-9)
    assert winding_number(turned, np.array([1.0, 2.0, 3.0])) == pytest.approx(-1)
    assert is_inside(mesh_of(brick((1, 1, 1))), body)
    assert not is_inside(body, mesh_of(brick((1, 1, 1))))


def test_a_mesh_for_a_picture_is_small_and_looks_alike() -> None:
    """Simplifying keeps the box and drops triangles; what is small already is left alone."""
    ball = mesh_of(trimesh.creation.icosphere(subdivisions=6))
    small = simplified(ball, 5_000)
    assert 500 < len(small) <= 5_000
    np.testing.assert_allclose(small.extents, ball.extents, rtol=0.05)
    assert simplified(small, 5_000) is small
