# SPDX-License-Identifier: LGPL-2.1-or-later
"""Geometry and structure of FreeCAD files: colours, products, what cannot be drawn; making and sending."""

from __future__ import annotations

import gzip
import hashlib
import json
import struct
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from drawn import corners, drawn, known_as, products_of
from fcstd_writer import Doc, Raw, locals_
from model_scenes import body as ball_or_rod
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
from OCP.BRepTools import BRepTools
from public_projects import ASSEMBLIES

from silo.api.wire import Structure
from silo.bom.errors import NotFoundError
from silo.bom.view.flat_list import flat_lines
from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly
from silo.bom.walk.standard import standard_uuid
from silo.drawing import models as making
from silo.drawing.models import KernelDrawer, draw, send_models
from silo.fcstd import Library
from silo.inertia.geometry.together import Floats, Mesh, mesh_volume
from silo.testing import FakeSilo
from silo_server.services.scene import check_glb, check_structure

pytestmark = pytest.mark.usefixtures("warm")

RED, BLUE = 0xFF000000, 0x0000FF00


@pytest.fixture(name="box")
def _box(tmp_path: Path) -> Any:
    """``box(doc, name)``: a box of 10 × 20 × 30 mm in a document."""
    BRepTools.Write_s(BRepPrimAPI_MakeBox(10, 20, 30).Shape(), str(tmp_path / "box.brp"))
    content = (tmp_path / "box.brp").read_bytes()

    def add(doc: Doc, name: str = "Box", content: bytes = content, **values: Any) -> Doc:
        doc.entries[f"{name}.Shape.brp"] = content
        shape = Raw("Part::PropertyPartShape", f'<Part file="{name}.Shape.brp"/>')
        return doc.add("Part::Feature", name, Shape=shape, **values)

    return add


def looks(doc: Doc, **views: dict[str, str]) -> Doc:
    """Say how objects look: property → XML of its value."""
    text = "".join(
        f'<ViewProvider name="{name}"><Properties>'
        + "".join(f'<Property name="{one}">{xml}</Property>' for one, xml in values.items())
        + "</Properties></ViewProvider>"
        for name, values in views.items()
    )
    doc.entries["GuiDocument.xml"] = (
        f"<Document><ViewProviderData>{text}</ViewProviderData></Document>".encode()
    )
    return doc


def colours(*packed: int) -> bytes:
    """A ``PropertyColorList``."""
    return struct.pack(f"<{1 + len(packed)}I", len(packed), *packed)


def materials(*several: tuple[int, float]) -> bytes:
    """A ``PropertyMaterialList`` of diffuse colours and transparencies."""
    rows = b"".join(struct.pack("<4I2f", 1, one, 2, 3, 0.9, clear) for one, clear in several)
    return struct.pack("<I", len(several)) + rows + struct.pack("<3I", 0, 0, 0) * len(several)


SIX = (RED, RED, RED, BLUE, BLUE, BLUE)
LOOKS: dict[str, tuple[dict[str, str], dict[str, bytes], set[tuple[float, ...]]]] = {
    "nothing": ({}, {}, {(0.6121, 0.6121, 0.6121, 1)}),
    "0.20, one": ({"DiffuseColor": '<ColorList file="D"/>'}, {"D": colours(RED)}, {(1, 0, 0, 1)}),
    "0.20, six": (
        {"DiffuseColor": '<ColorList file="D"/>', "Transparency": '<Integer value="40"/>'},
        {"D": colours(*SIX)},
        {(1, 0, 0, 0.6), (0, 0, 1, 0.6)},
    ),
    "0.20, clear faces": (
        {"DiffuseColor": '<ColorList file="D"/>'},
        {"D": colours(*(one | 0x80 for one in SIX))},
        {(1, 0, 0, 0.498), (0, 0, 1, 0.498)},
    ),
    "0.20, the shape's": ({"ShapeColor": f'<PropertyColor value="{BLUE}"/>'}, {}, {(0, 0, 1, 1)}),
    "1.0, one": (
        {"ShapeAppearance": '<MaterialList file="A" version="3"/>', "DiffuseColor": '<ColorList file="D"/>'},
        {"A": materials((BLUE, 0.25)), "D": colours(RED)},
        {(0, 0, 1, 0.75)},
    ),
    "1.0, six": (
        {"ShapeAppearance": '<MaterialList file="A" version="3"/>'},
        {"A": materials(*((one, 0.0) for one in SIX))},
        {(1, 0, 0, 1), (0, 0, 1, 1)},
    ),
    "of other faces": ({"DiffuseColor": '<ColorList file="D"/>'}, {"D": colours(RED, BLUE)}, {(1, 0, 0, 1)}),
    "damaged": (
        {"DiffuseColor": '<ColorList file="D"/>', "ShapeAppearance": '<MaterialList file="A"/>'},
        {"D": struct.pack("<I", 4_000_000_000), "A": struct.pack("<I", 4_000_000_000)},
        {(0.6121, 0.6121, 0.6121, 1)},
    ),
    "gone": ({"DiffuseColor": '<ColorList file="D"/>'}, {}, {(0.6121, 0.6121, 0.6121, 1)}),
}


@pytest.mark.parametrize("name", LOOKS)
def test_faces_have_the_colours_that_freecad_saved(name: str, box: Any, tmp_path: Path) -> None:
    """Before and since 1.0, for all faces or each; a box keeps its volume and its place."""
    view, entries, wanted = LOOKS[name]
    doc = looks(box(Doc("part")), Box=view)
    doc.entries.update(entries)
    glb, structure = draw(doc.save(tmp_path / "part.FCStd"), KernelDrawer())
    check_glb(glb)
    check_structure(structure.model_dump_json().encode())
    mesh, found = products_of(glb)["Box"]
    assert {tuple(one) for one in found} == wanted
    assert mesh_volume(mesh) == pytest.approx(6e-6, rel=1e-3)
    np.testing.assert_allclose(mesh.vertices.max(axis=0), [0.01, 0.02, 0.03], atol=1e-6)


OVER = {
    "OverrideMaterial": '<Bool value="true"/>',
    "ShapeMaterial": f'<PropertyMaterial diffuseColor="{BLUE}" specularColor="0" transparency="0.5"/>',
}
AT = '<PropertyPlacement Px="{}" Py="0" Pz="0" Q0="0" Q1="0" Q2="0" Q3="1"/>'


def test_a_structure_names_uses_and_the_server_places_them(box: Any, tmp_path: Path) -> None:
    """Over three files: members, identities, an array, a link's colour, what is lost."""
    box(Doc("bolt", extra={"SiloUUID": "u-bolt"})).save(tmp_path / "bolt.FCStd")
    sub = Doc("sub").link("L", "bolt.FCStd", "Box", ElementCount=2)
    rows = [(10.0 * n, 0, 0, 0, 0, 0, 1.0) for n in (1, 2)]
    sub.entries["Places"] = struct.pack("<I", 2) + b"".join(struct.pack("<7d", *row) for row in rows)
    sub.objects["L"][1]["PlacementList"] = Raw("App::PropertyPlacementList", '<PlacementList file="Places"/>')
    sub.add("App::Part", "Sub", Group=locals_("L")).save(tmp_path / "sub.FCStd")
    top = Doc("top").link("S", "sub.FCStd", "Sub", Placement=Raw("App::PropertyPlacement", AT.format(100)))
    top.link("Gone", "gone.FCStd", "Box")
    box(top, "Plate").add("App::Part", "Top", Group=locals_("S", "Gone", "Plate"), Type="Assembly")
    path = looks(top, S=OVER).save(tmp_path / "top.FCStd")
    found, missing = drawn(path)
    assert [(one.key, one.path, one.lines) for one in found] == [
        ("Plate", ("Plate",), ("",)),
        ("Box", ("S", "L.0"), ("", "u-bolt")),
        ("Box", ("S", "L.1"), ("", "u-bolt")),
    ]
    assert [one.matrix[0, 3] for one in found] == pytest.approx([0, 0.11, 0.12])
    assert [one.colour for one in found[1:]] == [[0, 0, 1, 0.5]] * 2
    assert [one["why"] for one in missing] == ["its file gone.FCStd is not in Silo"]


def test_bodies_of_a_part_are_one_product_and_a_ring_ends(box: Any, tmp_path: Path) -> None:
    """Each piece of a BOM is one occurrence, also of several bodies; an assembly that links to itself."""
    part = box(box(Doc("part"), "One"), "Two", Placement=Raw("App::PropertyPlacement", AT.format(50)))
    path = part.add("App::Part", "Part", Group=locals_("One", "Two")).save(tmp_path / "part.FCStd")
    glb, structure = draw(path, KernelDrawer())
    assert structure.roots[0] == "Part"
    assert mesh_volume(products_of(glb)["Part"][0]) == pytest.approx(12e-6, rel=1e-3)
    ring = Doc("ring").link("L", "ring.FCStd", "Top").add("App::Part", "Top", Group=locals_("L"))
    found, missing = drawn(ring.save(tmp_path / "ring.FCStd"))
    assert found == []
    assert missing


def test_an_identity_too_long_to_be_ours_is_not_sent_whole(box: Any, tmp_path: Path) -> None:
    """The model is made all the same."""
    box(Doc("bolt", extra={"SiloUUID": "f" * 80})).save(tmp_path / "bolt.FCStd")
    top = Doc("top").link("S", "bolt.FCStd", "Box").add("App::Part", "Top", Group=locals_("S"))
    found, _ = drawn(top.save(tmp_path / "top.FCStd"))
    assert [one.lines for one in found] == [("f" * 64,)]


def test_a_shape_that_cannot_be_drawn_says_so_and_stops_nothing(box: Any, tmp_path: Path) -> None:
    """A damaged shape, one that is gone, an empty document, a GuiDocument that is none."""
    doc = box(box(Doc("part")), "Bad", content=b"no shape")
    doc.add("Part::Feature", "Lost", Shape=Raw("Part::PropertyPartShape", '<Part file="lost.brp"/>'))
    doc.entries["GuiDocument.xml"] = b'<ViewProvider name="Box"' * 1000
    glb, structure = draw(doc.save(tmp_path / "part.FCStd"), KernelDrawer())
    (length,) = struct.unpack_from("<I", glb, 12)
    nodes = {one["extras"]["key"]: one for one in json.loads(glb[20 : 20 + length])["nodes"]}
    assert {key: structure.products[key].shape for key in ("Box", "Bad", "Lost")} == {
        "Box": True, "Bad": False, "Lost": False,
    }  # fmt: skip
    assert "holds no shape" in nodes["Bad"]["extras"]["missing"]
    assert "mesh" not in nodes["Lost"]
    draw(Doc("empty").save(tmp_path / "empty.FCStd"), KernelDrawer())


def steel(doc: Doc, name: str = "Steel", density: str = "7900 kg/m^3") -> Raw:
    """A material of a document, as a link to it."""
    told = {"Name": name} | ({"Density": density} if density else {})
    doc.add("App::MaterialObjectPython", name, Material=told)
    return Raw("App::PropertyLink", f'<Link value="{name}"/>')


def test_what_can_be_an_item_states_mass_material_size_and_description(box: Any, tmp_path: Path) -> None:
    """A lone body in a part, bodies of one part, of two materials, without a density, an assembly, a body of
    others' parts; a turned one keeps its size in the axes of its part."""

    def stated(doc: Doc, key: str = "Part") -> dict[str, Any]:
        _, structure = draw(doc.save(tmp_path / f"{doc.label}.FCStd"), KernelDrawer())
        found = structure.products[key].stated
        return {} if found is None else found.model_dump(exclude_none=True)

    def part(name: str, *bodies: str, **values: Any) -> Doc:
        doc = Doc(name, extra={"Comment": "from the drawing"})
        for number, body in enumerate(bodies):
            material = {"Material": steel(doc, body, f"{1000 * (number + 1)} kg/m^3")} if body else {}
            turned = '<PropertyPlacement Px="50" Py="0" Pz="0" Q0="0.5" Q1="0.5" Q2="0.5" Q3="0.5"/>'
            place = {"Placement": Raw("App::PropertyPlacement", turned)} if number == 1 else {}
            box(doc, f"Box{number}", **material, **place)
        return doc.add("App::Part", "Part", Group=locals_(*(f"Box{n}" for n in range(len(bodies)))), **values)

    volume, size = pytest.approx(6e-6), pytest.approx([0.01, 0.02, 0.03])
    lone = stated(part("lone", "Oak", Label2="Box, 30 long"))
    assert lone == {
        "mass_kg": pytest.approx(6e-3), "volume_m3": volume, "com_m": pytest.approx([5e-3, 0.01, 0.015]),
        "size_m": size, "material": "Oak", "description": "Box, 30 long",
    }  # fmt: skip
    two = stated(part("two", "Oak", "Ash"))
    assert two == {
        "mass_kg": pytest.approx(18e-3), "volume_m3": pytest.approx(12e-6), "material": "Ash, Oak",
        "size_m": pytest.approx([0.08, 0.02, 0.03]), "description": "from the drawing",
        "com_m": pytest.approx([(5 + 2 * 65) / 3e3, (10 + 2 * 5) / 3e3, (15 + 2 * 10) / 3e3]),
    }  # fmt: skip
    assert stated(part("half", "Oak", "")).keys() == {"size_m", "material", "description"}
    assert stated(part("bare", "")) == {"size_m": size, "description": "from the drawing"}
    over = part("over", "", "")
    over.objects["Part"][1]["Material"] = steel(over)
    assert stated(over)["mass_kg"] == pytest.approx(12e-6 * 7900)
    assert stated(part("assembly", "Oak", "Ash", Type="Assembly")) == {"description": "from the drawing"}
    assert stated(part("inner", "Oak"), "Box0") == {}
    bad = part("bad", "Oak", "Ash")
    bad.entries["Box1.Shape.brp"] = b"no shape"
    assert stated(bad).keys() == {"material", "description"}


def test_simplifying_keeps_the_volume(tmp_path: Path, box: Any) -> None:
    """A cylinder of many triangles: fewer, within 6 % and 0.1 % of the diagonal."""
    BRepTools.Write_s(BRepPrimAPI_MakeCylinder(10, 40).Shape(), str(tmp_path / "c.brp"))
    path = box(Doc("part"), content=(tmp_path / "c.brp").read_bytes()).save(tmp_path / "part.FCStd")
    mesh = products_of(draw(path, KernelDrawer())[0])["Box"][0]
    assert mesh_volume(mesh) == pytest.approx(np.pi * 100 * 40 * 1e-9, rel=0.06)
    np.testing.assert_allclose(mesh.extents, [0.02, 0.02, 0.04], atol=1e-4)


def test_a_large_product_stops_losing_triangles_before_it_loses_its_volume(box: Any, tmp_path: Path) -> None:
    """Each round here takes 3 %; the second is one too many."""
    ball = ball_or_rod("ball", 0.02, 120)

    class Losing(KernelDrawer):
        rounds = 0

        def faces(self, path: Path, named: str, place: Floats) -> list[Mesh | None]:
            return [Mesh(np.asarray(ball.vertices), np.asarray(ball.faces))]

        def simplified(self, mesh: Mesh, error: float, keep_border: bool) -> Mesh:
            self.rounds += 1
            return Mesh(mesh.vertices * 0.99**self.rounds, mesh.faces[self.rounds :])

    drawer = Losing()
    mesh = products_of(draw(box(Doc("part")).save(tmp_path / "part.FCStd"), drawer)[0])["Box"][0]
    assert drawer.rounds == 2
    assert mesh.extents == pytest.approx(0.99 * ball.extents, rel=2e-3)


TRUTHS = sorted(ASSEMBLIES.glob("*/truth/*.json"))


@pytest.mark.parametrize("truth", TRUTHS, ids=[path.stem for path in TRUTHS])
def test_a_line_has_as_many_occurrences_as_the_bom_counts(truth: Path) -> None:
    """Real assemblies: pieces in the scene by where their component is, beside the flat BOM."""
    top = truth.parent.parent / json.loads(truth.read_text())["top"]
    with Library() as library:
        flat = flat_lines(extract(choose_assembly(library.open(top))).entries)
    _, found, bare = corners(top)
    counted = {
        standard_uuid(one.standard) if one.standard else known_as(one.doc_path, one.object_name): number
        for one, number in flat
        if not one.missing
    }
    pieces = {
        (one.path[: place + 1], line)
        for one in found
        for place, line in enumerate(one.lines)
        if line in counted
    }
    drawn_here = Counter(line for _, line in pieces)
    assert drawn_here == {one: number for one, number in counted.items() if one not in bare}
    assert drawn_here or not counted


def committed(silo: FakeSilo, path: Path) -> tuple[Path, str]:
    """A file as a revision of an item."""
    item = silo.create_item("kindred-rd", "M01", path.stem)
    silo.upload_file(item.part_number, path)
    return path, hashlib.sha256(path.read_bytes()).hexdigest()


def test_models_are_made_in_a_child_and_sent_once(box: Any, tmp_path: Path) -> None:
    """With shapes and without; each file once, by content; a file that changed meanwhile has none."""
    silo = FakeSilo()
    part = committed(silo, box(Doc("part")).save(tmp_path / "part.FCStd"))
    doc = Doc("top").link("L", "part.FCStd", "Box").add("App::Part", "Top", Group=locals_("L"))
    top = committed(silo, doc.save(tmp_path / "top.FCStd"))
    late = committed(silo, box(Doc("late")).save(tmp_path / "late.FCStd"))
    late[0].write_bytes(part[0].read_bytes())
    sent, problems = send_models(silo, [part, top, late])
    assert (sent, len(problems)) == (2, 1)
    assert "late.FCStd: no model was made: the file has changed" in problems[0]
    for _, sha256 in (part, top):
        check_glb(gzip.decompress(silo.models[sha256]["geometry"]))
        Structure.model_validate_json(gzip.decompress(silo.models[sha256]["structure"]))
    silo.before = pytest.fail  # nothing more is sent
    assert send_models(silo, [part, top])[0] == 0


def test_a_child_that_dies_costs_one_file(box: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The next child goes on behind it; a server that refuses a model or keeps none stops nothing."""
    silo = FakeSilo()
    files = [committed(silo, box(Doc(name), name.title()).save(tmp_path / f"{name}.FCStd")) for name in "abc"]
    monkeypatch.setattr(making, "_WORKER", DYING)
    monkeypatch.setattr(making.os, "cpu_count", lambda: 1)
    sent, problems = send_models(silo, files)
    assert (sent, len(problems)) == (2, 1)
    assert problems[0].startswith("b.FCStd: no model was made: ")

    def refuse(*_: object) -> None:
        raise NotFoundError("no revision")

    monkeypatch.setattr(silo, "put_model", refuse)
    assert send_models(silo, files[1:2])[0] == 0
    monkeypatch.setattr(silo, "lacking_models", refuse)
    assert send_models(silo, files) == (0, [])


def test_a_missing_kernel_is_said_once(box: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With how to get it, for all files; a file that only places others needs no kernel and is sent."""
    silo = FakeSilo()
    files = [committed(silo, box(Doc(name), name.title()).save(tmp_path / f"{name}.FCStd")) for name in "abc"]
    files.append(committed(silo, Doc("top").link("L", "a.FCStd", "A").save(tmp_path / "top.FCStd")))
    code = "import sys; sys.modules['OCP'] = None; from silo.drawing import models; models.main()"
    monkeypatch.setattr(making, "_WORKER", code)
    sent, (problem,) = send_models(silo, files)
    assert sent == 1
    assert problem.startswith("Silo gets no model, size or mass of 3 files: ")
    assert 'pip install "silo-mod[inertia]"' in problem


DYING = """
import os
from silo.drawing import models
class Dying(models.KernelDrawer):
    def faces(self, path, named, place):
        return os._exit(3) if "b.FCStd" in named else super().faces(path, named, place)
models.work_with(Dying)
"""
