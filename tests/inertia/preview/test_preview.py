# SPDX-License-Identifier: LGPL-2.1-or-later
"""Previews: what is in the GLB, and what is seen in the picture."""

from __future__ import annotations

import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from silo.bom.errors import InputError
from silo.inertia.core import MassProps
from silo.inertia.geometry import Mesh
from silo.inertia.geometry.mesh import mesh_volume
from silo.inertia.model import Assembly, Instance, Prototype
from silo.inertia.preview.glb import write_glb
from silo.inertia.preview.legend import fitted, mass_words, width_of, write
from silo.inertia.preview.picture import preview_bytes, write_picture, write_preview
from silo.inertia.preview.raster import Canvas
from silo.inertia.preview.scene import LinkView, colour_of, inertia_ellipsoid, views_of
from silo.inertia.preview.shading import ellipsoid, shaded


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


# --- the picture -------------------------------------------------------------------------------------------


def pixels(data: bytes) -> NDArray[np.uint8]:
    """(height, width, 3) of a PNG."""
    with Image.open(io.BytesIO(data)) as image:
        assert (image.format, image.mode) == ("PNG", "RGB")
        return np.array(image)


def hue_count(image: NDArray[np.uint8], colour: tuple[float, float, float]) -> int:
    """Pixels whose colour has the hue of ``colour``, bright or dark."""
    wanted = np.array(colour) / np.linalg.norm(colour)
    values = image.astype(float)
    norm = np.linalg.norm(values, axis=2)
    return int(((values @ wanted) / np.maximum(norm, 1) > 0.997).sum())


def test_each_link_is_seen_in_its_colour(scene: Any) -> None:
    """Both links' colours cover a good part of the picture; so does the background."""
    image = pixels(write_picture(*scene, width=700, height=450))
    assert image.shape == (450, 700, 3)
    stage = image[:, :500]
    assert hue_count(stage, colour_of(0)) > 2000
    assert hue_count(stage, colour_of(1)) > 2000
    assert (stage.min(axis=2) > 225).mean() > 0.3


def test_the_mark_of_the_centre_of_mass_is_on_top(scene: Any) -> None:
    """A black and white disc, though the centre lies inside of the body."""
    image = pixels(write_picture(*scene, width=700, height=450))[:, :500]
    black = (image.max(axis=2) < 25).sum()
    assembly, views = scene
    without = [LinkView(v.name, v.instances) for v in views]
    plain = pixels(write_picture(assembly, without, width=700, height=450))[:, :500]
    assert black > (plain.max(axis=2) < 25).sum() + 100


def test_nothing_to_draw_is_still_a_picture() -> None:
    """No meshes at all: the page with its legend, no error."""
    empty = Assembly("nothing", {}, ())
    assert pixels(write_picture(empty, [LinkView("x", ())], width=400, height=300)).shape == (300, 400, 3)


def test_hostile_names_are_drawn_as_text(scene: Any) -> None:
    """Control characters, an endless name, a foreign script: boxes and a cut, never an error."""
    assembly, views = scene
    odd = [LinkView("x" * 5000 + "\x00\x1b[31m", views[0].instances, views[0].props), LinkView("漢字\n", ())]
    assert len(write_picture(assembly, odd, width=400, height=300)) > 1000


def test_nearer_triangles_hide_farther_ones() -> None:
    """The depth buffer decides, not the order of drawing."""
    normals = np.tile([0.0, 0.0, 1.0], (3, 1))
    faces = np.array([[0, 1, 2]])
    far = np.array([[0.0, 0, 5], [40, 0, 5], [0, 40, 5]])
    near = np.array([[0.0, 0, 1], [20, 0, 1], [0, 20, 1]])
    for order in ((far, near), (near, far)):
        canvas = Canvas.empty(40, 40)
        for points in order:
            canvas.draw(points, normals, faces, 1 if points is near else 0)
        assert canvas.thing[2, 2] == 1
        assert canvas.thing[25, 2] == 0
        assert canvas.thing[39, 39] == -1


@given(st.lists(st.tuples(*[st.floats(-20, 60)] * 2), min_size=3, max_size=3))
def test_a_triangle_covers_the_pixels_whose_centres_it_holds(corners: Any) -> None:
    """Against the plain definition, pixel by pixel, also where it leaves the canvas."""
    points = np.column_stack([np.array(corners), np.zeros(3)])
    canvas = Canvas.empty(40, 30)
    canvas.draw(points, np.tile([0.0, 0, 1], (3, 1)), np.array([[0, 1, 2]]), 0)
    x, y = np.meshgrid(np.arange(40) + 0.5, np.arange(30) + 0.5)
    sides = []
    for i in range(3):
        (ax, ay), (bx, by) = corners[i], corners[(i + 1) % 3]
        sides.append((bx - ax) * (y - ay) - (by - ay) * (x - ax))
    inside = np.all([s > 1e-6 for s in sides], axis=0) | np.all([s < -1e-6 for s in sides], axis=0)
    outside = np.any([s > 1e-6 for s in sides], axis=0) & np.any([s < -1e-6 for s in sides], axis=0)
    assert (canvas.thing[inside] == 0).all()
    assert (canvas.thing[outside] == -1).all()


def test_normals_are_smooth_over_a_ball_and_sharp_on_a_cube() -> None:
    """A ball's normals point outwards everywhere; each corner of a cube has three."""
    assert mesh_volume(ellipsoid(40, 80)) == pytest.approx(4 / 3 * np.pi, rel=1e-2)
    ball = shaded(ellipsoid())
    np.testing.assert_allclose(ball.normals, ball.vertices, atol=0.12)
    cube = shaded(cube_mesh())
    assert len(cube.vertices) == 24
    assert np.sort(np.abs(cube.normals), axis=1)[:, 2].min() == pytest.approx(1)


def test_text_takes_room_and_is_cut_to_fit() -> None:
    """Longer text is wider; what does not fit ends in an ellipsis."""
    assert width_of("bb", 10) > width_of("b", 10)
    assert fitted("a link with a long name", 10, 80).endswith("…")
    assert width_of(fitted("a link with a long name", 10, 80), 10) <= 80
    assert fitted("short", 10, 800) == "short"
    assert fitted("W" * 5000, 10, 80).endswith("W…")


def inked(text: str) -> bytes:
    page = Image.new("RGB", (80, 40), "white")
    write(ImageDraw.Draw(page), text, 5, 30, 18, (0, 0, 0))
    return page.tobytes()


def test_letters_of_the_world_are_no_boxes() -> None:
    """Each has a picture of its own, and none the one of a letter that no font has."""
    box = inked("□")
    drawn = {letter: inked(letter) for letter in "ßØøłŁДжΩμア漢中éñçžİ€²±×°–…"}
    assert box not in drawn.values()
    assert inked(" ") not in drawn.values()
    assert len(set(drawn.values())) == len(drawn)


def test_text_that_no_font_has_is_drawn_all_the_same() -> None:
    """Control characters go, the rest is a box; nothing fails."""
    assert inked("a\x00\x1b[31mb") == inked("a[31mb")
    assert inked("\U00012345") == inked("\U00012346") in (inked("□"), inked("?"))
    assert inked("\U00012345") != inked("")
    assert width_of("line\nbreak", 10) == width_of("line break", 10)


@pytest.mark.parametrize(
    ("mass", "words"), [(0.0, "0 kg"), (0.0123456, "12.35 g"), (1.23456, "1.235 kg"), (1234.5, "1234 kg")]
)
def test_masses_have_a_unit_that_suits_them(mass: float, words: str) -> None:
    """Grams below a kilogram."""
    assert mass_words(mass) == words


def test_a_report_becomes_views_and_files(assemble: Any, compute: Any, tmp_path: Path) -> None:
    """Links in the report's order with parts and mass, in the assembly's frame; the file by its suffix."""
    from bodies import box

    block = box("block", 0.1, 0.1, 0.1, mesh=cube_mesh())
    assembly = assemble(("arm/one", block, at(0)), ("hand/two", block, at(0.4)))
    report = compute(assembly, "Name,Mass,Material,Quantity\nblock,2 kg,,2\n")
    views = views_of(report, assembly)
    assert [v.name for v in views] == ["arm", "hand"]
    assert [[i.name for i in v.instances] for v in views] == [["arm/one"], ["hand/two"]]
    assert views[1].props is not None
    np.testing.assert_allclose(views[1].props.com, [0.4, 0, 0])
    for suffix, magic in ((".glb", b"glTF"), (".png", b"\x89PNG")):
        path = tmp_path / f"preview{suffix}"
        write_preview(report, assembly, path)
        assert path.read_bytes().startswith(magic)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["preview.glb", "preview.png"]


def test_other_suffixes_and_places_are_refused(scene: Any, tmp_path: Path) -> None:
    """A plain sentence for .jpg, and for a folder that is not there."""
    with pytest.raises(InputError, match=r"a \.glb or a \.png file, got '\.jpg'"):
        preview_bytes(*scene, ".jpg")
    from silo.inertia.report import InertiaReport

    with pytest.raises(InputError, match="cannot be written"):
        write_preview(InertiaReport(), scene[0], tmp_path / "gone" / "x.glb")
