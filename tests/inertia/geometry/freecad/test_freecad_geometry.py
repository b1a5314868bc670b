# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD documents: shapes, placements and materials as FreeCAD itself has them."""

from __future__ import annotations

import json
import struct
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from drawn import drawn
from fcstd_writer import Doc, Local, Raw, XLink, locals_
from freecad_cases.machines import WANTED, need
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
from OCP.BRepTools import BRepTools
from OCP.gp import gp_Pnt

from silo.bom.errors import DocumentError
from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly
from silo.fcstd import Library
from silo.inertia.assembly import Assembly
from silo.inertia.geometry import ReadOptions, read
from silo.inertia.geometry.fcstd import placed
from silo.inertia.geometry.together import Mesh
from silo.inertia.notes import GeometryCode
from silo.inertia.placements import place

SCRIPT = Path(__file__).with_name("freecad_shapes.py")

# Of the leaves that FreeCAD shows: the operands of cuts and arrays, and what is hidden beside its result.
NOT_COUNTED = {
    "Part.Base.", "Part.Drill.", "Part.Spare.", "Mirrored.Base.", "Mirrored.Drill.", "Mirrored.Spare.",
    "ArrayBase.", "ArrayCube.",
}  # fmt: skip

OWN_PLACEMENT = {
    "WithTransform.", "Scaled.", "SubByLink.BoltB.", "SubObject.", "Instance.BoltB001.", "Flexible.BoltB.",
}  # fmt: skip


def middle_of(mesh: Mesh) -> np.ndarray:
    """Centre of volume [m]."""
    corners = mesh.vertices[mesh.faces]
    volumes = np.linalg.det(corners)
    middle: np.ndarray = volumes @ corners.sum(axis=1) / 4 / volumes.sum()
    return middle


def placed_bodies(assembly: Assembly) -> list[tuple[str, float, np.ndarray]]:
    """(first name of the path, volume [mm^3], centre [mm]) of every instance."""
    found = []
    for instance in assembly.instances:
        part = assembly.prototypes[instance.prototype]
        volumes, coms, _ = place([part.volume_m3], [part.com_m], [part.inertia_unit], [instance.transform])
        found.append((instance.path[0].split("<")[0], float(volumes[0]) * 1e9, coms[0] * 1e3))
    return found


def joined_arrays(bodies: list[tuple[str, float, np.ndarray]]) -> list[tuple[float, np.ndarray]]:
    """FreeCAD shows a Draft array as one shape: ours are put together as well."""
    result = [(v, c) for name, v, c in bodies if not name.startswith("Array")]
    for array in {name for name, _, _ in bodies if name.startswith("Array")}:
        parts = [(v, c) for name, v, c in bodies if name == array]
        volume = sum(v for v, _ in parts)
        result.append((volume, sum((v * c for v, c in parts), np.zeros(3)) / volume))
    return result


@pytest.mark.freecad
@pytest.mark.slow
@pytest.mark.parametrize("version", WANTED)
def test_every_way_of_placing_is_as_freecad_places_it(version: str, tmp_path: Path, read_in: Any) -> None:
    """Links, chains, arrays, groups, mirrors, scales, sub-objects, sub-assemblies, rigid and flexible.

    Built by FreeCAD, which also says volume and centre of each leaf in the assembly's axes; ours are the
    same to what its own integration and its rebuilt scaled shapes allow.
    """
    freecad = need(version)
    out = tmp_path / "out"
    out.mkdir()
    environment = {"SILO_OUT": str(out), **freecad.profile(tmp_path / "profile")}
    done = freecad.run(SCRIPT, environment, cwd=tmp_path)
    assert done.returncode == 0, done.stdout[-2000:]
    leaves = {leaf["path"]: leaf for leaf in json.loads((out / "leaves.json").read_text())}
    wanted = {path: leaf for path, leaf in leaves.items() if path not in NOT_COUNTED}
    assembly = read_in(out / "top.FCStd")
    ours = joined_arrays(placed_bodies(assembly))
    assert len(ours) == len(wanted)
    for path, leaf in wanted.items():
        close = [
            (v, c)
            for v, c in ours
            if v == pytest.approx(leaf["volume"], rel=2e-3) and np.linalg.norm(c - leaf["centre"]) < 0.05
        ]
        assert close, f"{path} of FreeCAD {version} is not among ours"
    # What is drawn stands where FreeCAD itself puts it.
    occurrences, missing = drawn(out / "top.FCStd")
    assert missing == []
    assert len(occurrences) == len(assembly.instances)
    alike = set()
    for path, leaf in wanted.items():
        matrix = np.array(leaf["matrix"]).reshape(4, 4)
        matrix[:3, 3] /= 1000
        if any(np.allclose(matrix, one.matrix, atol=1e-6) for one in occurrences):
            alike.add(path)
    # FreeCAD counts the own placement of these as part of the way, we as part of the shape.
    assert set(wanted) - alike <= OWN_PLACEMENT
    bodies = [one.mesh.moved(one.matrix) for one in occurrences]
    middles = [middle_of(one) * 1e3 for one in bodies]
    for path in OWN_PLACEMENT & set(wanted):
        assert min(np.linalg.norm(one - wanted[path]["centre"]) for one in middles) < 0.5, path
    by_name = {p.name: p for p in assembly.prototypes.values()}
    assert (by_name["Bracket"].step_material, by_name["Bracket"].step_density) == ("Steel", 7900.0)
    assert {p.code for p in assembly.problems} == {"hidden", GeometryCode.SCALED}


PUBLIC = [
    ("asm4-examples/Asm4_Example1/asm_tuto1.FCStd", 4, 76609.08),
    ("asm4-examples/Asm4_Example2/asm_V4.FCStd", 28, 2390253.9),
    ("asm4-examples/Asm4_Example3/asm_Hypnotic.fcstd", 3, 4698778.07),
    ("dingo-batterytray/SubAssemblies/BatteryTray/BatteryTrayAssembly.FCStd", 23, 268266.0),
]


@pytest.mark.slow
@pytest.mark.parametrize(("path", "instances", "volume"), PUBLIC)
def test_public_assemblies(
    path: str, instances: int, volume: float, public_assemblies: Path, read_in: Any
) -> None:
    """Counts and total volumes of real ones; FreeCAD 0.20 gives the same leaf by leaf, to its integration."""
    assembly = read_in(public_assemblies / path)
    assert len(assembly.instances) == instances
    assert sum(v for _, v, _ in placed_bodies(assembly)) == pytest.approx(volume, rel=1e-3)


@pytest.fixture(name="public_assemblies", scope="module")
def _public_assemblies() -> Path:
    """The public FreeCAD assemblies; without them the test is skipped, loudly."""
    found = Path(__file__).parents[4] / "../shared/data/assemblies"
    if not found.is_dir():
        pytest.skip(f"the FreeCAD test data is not at {found}")
    return found.resolve()


# --- files of our own making -------------------------------------------------------------------------------


def brep(shape: Any, folder: Path) -> bytes:
    """A shape in the kernel's text form, as FreeCAD keeps it."""
    path = folder / "shape.brp"
    assert BRepTools.Write_s(shape, str(path))
    return path.read_bytes()


def at(x: float, y: float = 0.0, z: float = 0.0) -> Raw:
    """A Placement property without a turn."""
    return Raw(
        "App::PropertyPlacement",
        f'<PropertyPlacement Px="{x}" Py="{y}" Pz="{z}" Q0="0" Q1="0" Q2="0" Q3="1"/>',
    )


def shape(entry: str) -> Raw:
    """A Shape property."""
    return Raw("Part::PropertyPartShape", f'<Part ElementMap="0.4" file="{entry}"/>')


PLACES = Raw("App::PropertyPlacementList", '<PlacementList file="Places"/>')


def material(uuid: str) -> Raw:
    """A ShapeMaterial property."""
    return Raw("Materials::PropertyMaterial", f'<PropertyMaterial uuid="{uuid}"/>')


@pytest.fixture(name="body")
def _body(box: Any, tmp_path: Path) -> Any:
    """``body(doc, name, size, **values)``: one Part::Box with its shape in the document."""

    def body(doc: Doc, name: str = "Box", size: Any = (10, 20, 30), **values: Any) -> Doc:
        entry = f"{name}.Shape.brp"
        doc.entries[entry] = brep(box(*size), tmp_path)
        return doc.add("Part::Box", name, Shape=shape(entry), **{"Placement": at(0), **values})

    return body


def test_a_lone_body_is_a_part(body: Any, tmp_path: Path, read_in: Any, codes_of: Any) -> None:
    """A part file without any container: one instance, and its path is the part's name."""
    path = body(Doc("bracket"), Placement=at(5)).save(tmp_path / "bracket.FCStd")
    assembly = read_in(path)
    (part,) = assembly.prototypes.values()
    assert part.volume_m3 == pytest.approx(6e-6)
    assert part.step_material is None
    assert codes_of(part) == []
    assert [instance.path for instance in assembly.instances] == [("Box",)]
    assert (assembly.name, part.name) == ("Box", "Box")


def test_the_default_material_is_no_material(body: Any, read_document: Any, codes_of: Any) -> None:
    """FreeCAD gives every untouched part 1 kg/m3: nobody's density."""
    doc = body(Doc("part"), ShapeMaterial=material("7f9fd73b-50c9-41d8-b7b2-575a030c1eeb"))
    (part,) = read_document(doc).prototypes.values()
    assert (part.step_material, part.step_density) == (None, None)
    assert codes_of(part) == []


CARD = """General:
  UUID: "{uuid}"
  Name: "{name}"
{inherits}Models:
  Density:
    UUID: '454661e5-265b-4320-8e6f-fcf6223ac3af'
{density}"""


def test_densities_come_from_installed_material_cards(
    body: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The file holds an id; the card with it gives name and density, its own or its parent's."""
    cards = tmp_path / "cards"
    cards.mkdir()
    parent, child = "11111111-1111-1111-1111-111111111111", "22222222-2222-2222-2222-222222222222"
    (cards / "a.FCMat").write_text(
        CARD.format(uuid=parent, name="Steel", inherits="", density='    Density: "7850 kg/m^3"\n')
    )
    inherits = f'Inherits:\n  Steel:\n    UUID: "{parent}"\n'
    (cards / "b.FCMat").write_text(CARD.format(uuid=child, name="Fine steel", inherits=inherits, density=""))
    monkeypatch.setenv("FREECAD_MATERIALS", str(cards))
    path = body(Doc("part"), ShapeMaterial=material(child.upper())).save(tmp_path / "part.FCStd")
    (part,) = read(path, options=ReadOptions(cache=False)).prototypes.values()
    assert (part.step_material, part.step_density) == ("Fine steel", 7850.0)


def test_a_material_that_is_not_installed_is_reported(body: Any, read_document: Any, codes_of: Any) -> None:
    """An id of somebody's own library: no density, and where to put the cards."""
    doc = body(Doc("part"), ShapeMaterial=material("99999999-9999-9999-9999-999999999999"))
    (part,) = read_document(doc).prototypes.values()
    assert part.step_density is None
    assert codes_of(part) == ["material"]
    assert "FREECAD_MATERIALS" in part.problems[0].message


@pytest.mark.parametrize(("text", "density"), [("7900 kg/m^3", 7900.0), ("1.2 kg/m^3", None), ("much", None)])
def test_a_linked_material_object_gives_name_and_density(
    text: str, density: float | None, body: Any, read_document: Any
) -> None:
    """As FreeCAD 0.20 does it; what is no density is reported, not used."""
    doc = Doc("part").add("App::MaterialObjectPython", "Mat", Material={"Name": "Steel", "Density": text})
    body(doc, Material=Raw("App::PropertyLink", '<Link value="Mat"/>'))
    (part,) = read_document(doc).prototypes.values()
    assert (part.step_material, part.step_density) == ("Steel", density)
    assert bool(part.problems) == (density is None)


def test_a_missing_file_keeps_its_place(body: Any, tmp_path: Path, read_in: Any, codes_of: Any) -> None:
    """The link stays an instance called like the file, so that a BOM's mass finds it."""
    doc = Doc("top").link("L", "parts/bolt.FCStd", "Box", Placement=at(7))
    doc.add("App::Part", "Top", Group=locals_("L"))
    path = doc.save(tmp_path / "top.FCStd")
    (instance,) = read_in(path).instances
    part = read_in(path).prototypes[instance.prototype]
    assert (part.name, part.has_solid) == ("bolt", False)
    assert codes_of(part) == [GeometryCode.NOT_READ]
    assert instance.transform[0, 3] == pytest.approx(0.007)


def test_a_file_that_appears_is_read_and_not_taken_from_the_cache(body: Any, tmp_path: Path) -> None:
    """What was missing is part of what a kept reading depends on; so is a linked file's content."""
    doc = Doc("top").link("L", "bolt.FCStd", "Box").add("App::Part", "Top", Group=locals_("L"))
    path = doc.save(tmp_path / "top.FCStd")
    options = ReadOptions(cache_dir=tmp_path / "cache")

    def volume() -> float:
        return sum(p.volume_m3 for p in read(path, options=options).prototypes.values()) * 1e9

    assert volume() == 0.0
    body(Doc("bolt")).save(tmp_path / "bolt.FCStd")
    assert volume() == pytest.approx(6000)
    body(Doc("bolt"), size=(1, 1, 1)).save(tmp_path / "bolt.FCStd")
    assert volume() == pytest.approx(1)


@pytest.mark.parametrize("how", ["an empty entry", "no entry", "a mesh"])
def test_a_body_without_a_shape_is_named(how: str, body: Any, read_document: Any, codes_of: Any) -> None:
    """Beside a body of the same part: a feature that FreeCAD could not compute, or no solid at all."""
    doc = body(Doc("part"), "Kept")
    if how == "a mesh":
        doc.add("Mesh::Feature", "Lost")
    else:
        entry = "Lost.brp" if how == "an empty entry" else ""
        doc.entries |= {entry: b""} if entry else {}
        doc.add("Part::Feature", "Lost", Shape=Raw("Part::PropertyPartShape", f'<Part file="{entry}"/>'))
    doc.add("App::Part", "Part", Group=locals_("Kept", "Lost"))
    (part,) = read_document(doc).prototypes.values()
    assert part.volume_m3 == pytest.approx(6e-6)
    assert codes_of(part) == [GeometryCode.BODY_MISSING]
    assert "“Lost”" in part.problems[0].message


def test_suppressed_excluded_and_meshes_are_reported(body: Any, read_document: Any) -> None:
    """None of them has a mass here; each is named."""
    doc = body(Doc("top"), "Kept")
    doc.link("Gone", "bolt.FCStd", "Box", Suppressed=True)
    body(doc, "Left", SiloBomExclude=True)
    doc.add("Mesh::Feature", "Scan")
    doc.add("Assembly::AssemblyObject", "Top", Group=locals_("Kept", "Gone", "Left", "Scan"))
    assembly = read_document(doc)
    assert [i.name for i in assembly.instances] == ["Kept"]
    assert [p.code for p in assembly.problems] == ["not_counted"] * 3


@pytest.mark.parametrize("hidden", [False, True], ids=["visible", "hidden"])
@pytest.mark.parametrize("loose", ["a body", "a link", "a part"])
def test_what_lies_beside_the_assembly_is_reported(
    loose: str, hidden: bool, body: Any, tmp_path: Path, read_document: Any
) -> None:
    """The mass is that of the assembly alone; the visible objects that are not in it are named."""
    body(Doc("bolt")).save(tmp_path / "bolt.FCStd")
    doc = body(Doc("top"), "Kept")
    more = {"Visibility": not hidden}
    if loose == "a body":
        body(doc, "Loose", **more)
    elif loose == "a link":
        doc.link("Loose", "bolt.FCStd", "Box", **more)
    else:
        body(doc, "Inner", **more).add("App::Part", "Loose", Group=locals_("Inner"), **more)
    doc.add("Assembly::AssemblyObject", "Top", Group=locals_("Kept"))
    assembly = read_document(doc)
    assert [i.name for i in assembly.instances] == ["Kept"]
    told = [(problem.code, "“Loose”" in problem.message) for problem in assembly.problems]
    assert told == ([] if hidden else [("not_counted", True)])


@pytest.fixture(name="screw")
def _screw(box: Any, tmp_path: Path) -> Any:
    """``screw(doc, name, length, **values)``: a fastener whose shape is a box of that length."""

    def screw(doc: Doc, name: str, length: int = 16, **values: Any) -> Doc:
        entry = f"{name}.Shape.brp"
        doc.entries[entry] = brep(box(4, 4, length), tmp_path)
        made: dict[str, Any] = {"Type": "ISO4762", "Diameter": "M4", "Length": str(length), "Thread": False}
        made = {"Placement": at(0), "Shape": shape(entry), **made, **values}
        return doc.add("Part::FeaturePython", name, **made)

    return screw


def hardware_of_all_kinds(body: Any, screw: Any, folder: Path) -> Path:
    """M4×16 eight times: in the assembly, a part, a compound, linked, an array, another file, beside it."""
    screw(Doc("screws"), "FromElsewhere").save(folder / "screws.FCStd")
    doc = body(Doc("top"), "Plate")
    for number, name in enumerate(("Alone", "Inner", "One", "Two", "Beside")):
        screw(doc, name, Placement=at(100.0 * number))
    screw(doc, "Long", 30)
    doc.add("App::Part", "Inside", Placement=at(0, 50), Group=locals_("Inner"))
    doc.add(
        "Part::Compound",
        "Bundle",
        Placement=at(0, 0, 7),
        Links=locals_("One", "Two"),
        Shape=shape("One.Shape.brp"),
    )
    doc.link("Elsewhere", "screws.FCStd", "FromElsewhere", LinkPlacement=at(0, 200))
    doc.link("Again", "", "Alone", ElementCount=2, PlacementList=PLACES)
    doc.entries["Places"] = struct.pack("<I7d7d", 2, *(0.0, 60, 0, 0, 0, 0, 1), *(0.0, 70, 0, 0, 0, 0, 1))
    members = ("Plate", "Alone", "Inside", "Bundle", "Elsewhere", "Again", "Long")
    doc.add("Assembly::AssemblyObject", "Top", Placement=at(0, 0, 1000), Group=locals_(*members))
    return doc.save(folder / "top.FCStd")


def test_a_standard_part_is_one_product_wherever_it_lies(
    body: Any, screw: Any, tmp_path: Path, read_in: Any
) -> None:
    """One product for each designation, as often as the BOM counts it, each where it stands."""
    path = hardware_of_all_kinds(body, screw, tmp_path)
    assembly = read_in(path)
    counts = Counter(assembly.prototypes[instance.prototype].name for instance in assembly.instances)
    assert counts == {"Plate": 1, "ISO 4762 M4×16": 8, "ISO 4762 M4×30": 1}
    assert assembly.problems == ()
    with Library() as library:
        bom = extract(choose_assembly(library.open(path)))
    assert {entry.standard: entry.quantity for entry in bom.entries} == {
        "ISO 4762 M4×16": 8,
        "ISO 4762 M4×30": 1,
    }
    origins = {
        tuple(np.round(instance.transform[:3, 3] * 1000).astype(int).tolist())
        for instance in assembly.instances
        if assembly.prototypes[instance.prototype].name == "ISO 4762 M4×16"
    }
    near = {(0, 0, 0), (100, 50, 0), (200, 0, 7), (300, 0, 7), (0, 60, 0), (0, 70, 0)}
    assert origins == near | {(0, 200, 0), (400, 0, -1000)}


def test_standard_parts_can_be_left_out_of_the_mass(
    body: Any, screw: Any, tmp_path: Path, read_in: Any
) -> None:
    """All of them, however they are repeated; and the result says so."""
    assembly = read_in(hardware_of_all_kinds(body, screw, tmp_path), hardware=False)
    assert [prototype.name for prototype in assembly.prototypes.values()] == ["Plate"]
    assert [problem.code for problem in assembly.problems] == ["no_hardware"]


def test_a_container_that_is_hidden_as_a_whole_counts(body: Any, read_document: Any) -> None:
    """Sources of links are usually hidden; only hidden bodies beside visible ones are left out."""
    doc = body(Doc("part"), "A", Visibility=False)
    body(doc, "B", (1, 1, 1), Visibility=False)
    doc.add("App::Part", "Part", Group=locals_("A", "B"))
    (part,) = read_document(doc).prototypes.values()
    # The small one lies inside of the large one; both are looked at.
    assert part.volume_m3 * 1e9 == pytest.approx(6000)
    assert [problem.code for problem in part.problems] == [GeometryCode.OVERLAPPING_SOLIDS]


def test_bodies_of_different_materials_stay_apart(body: Any, read_document: Any) -> None:
    """One part, two materials: two products, since one product has one density."""
    doc = Doc("part").add(
        "App::MaterialObjectPython", "Steel", Material={"Name": "Steel", "Density": "7900 kg/m^3"}
    )
    body(doc, "Shaft", Material=Raw("App::PropertyLink", '<Link value="Steel"/>'))
    body(doc, "Grip")
    doc.add("App::Part", "Part", Group=locals_("Shaft", "Grip"))
    found = {p.name: p.step_density for p in read_document(doc).prototypes.values()}
    assert found == {"Shaft": 7900.0, "Grip": None}


def test_the_object_can_be_named(body: Any, tmp_path: Path, read_in: Any) -> None:
    """One of two assemblies, or a single body; without a name, two assemblies are a question."""
    doc = body(body(Doc("two"), "A"), "B", (1, 1, 1))
    for name, member in (("One", "A"), ("Two", "B")):
        doc.add("Assembly::AssemblyObject", name, Group=locals_(member))
    path = doc.save(tmp_path / "two.FCStd")
    for name, volume in (("One", 6000), ("Two", 1), ("B", 1)):
        assembly = read_in(path, object_name=name)
        assert sum(p.volume_m3 for p in assembly.prototypes.values()) * 1e9 == pytest.approx(volume)
    with pytest.raises(DocumentError, match="no assembly named 'Three'"):
        read_in(path, object_name="Three")


@pytest.mark.parametrize("base", ["Bolt", "Pair"])
@pytest.mark.parametrize("name", ["part.FCStd", "top.FCStd"])
def test_an_array_of_one_shape_that_another_file_links_to(
    name: str, base: str, body: Any, tmp_path: Path, read_in: Any, codes_of: Any
) -> None:
    """Without links an array is saved as one shape: one product, whatever many components it shows."""
    body(Doc("bolt")).save(tmp_path / "bolt.FCStd")
    body(Doc("nut")).save(tmp_path / "nut.FCStd")
    doc = body(Doc("part"), "Array", (40, 20, 30))
    doc.objects["Array"] = ("Part::FeaturePython", doc.objects["Array"][1])
    shown: dict[str, Any] = {"Base": Local(base), "Count": 4, "ArrayType": "ortho"}
    doc.objects["Array"][1].update(shown)
    doc.link("Bolt", "bolt.FCStd", "Box")
    if base == "Pair":
        doc.link("Nut", "nut.FCStd", "Box").add("App::Part", "Pair", Group=locals_("Bolt", "Nut"))
    doc.add("Assembly::AssemblyObject", "Part", Group=locals_("Array")).save(tmp_path / "part.FCStd")
    Doc("top").link("Link", "part.FCStd", "Array").add(
        "Assembly::AssemblyObject", "Top", Group=locals_("Link")
    ).save(tmp_path / "top.FCStd")
    assembly = read_in(tmp_path / name)
    assert codes_of(assembly) == []
    assert sum(v for _, v, _ in placed_bodies(assembly)) == pytest.approx(24_000)


def test_a_link_array_takes_its_placements_from_the_side_entry(
    body: Any, tmp_path: Path, read_document: Any
) -> None:
    """Three elements, two placements: the third stands at the origin; both precisions are read."""
    body(Doc("bolt")).save(tmp_path / "bolt.FCStd")
    for form in ("<7d", "<7f"):
        doc = Doc("top").link("Row", "bolt.FCStd", "Box", ElementCount=3, Placement=at(0, 100))
        rows = [(10.0 * n, 0, 0, 0, 0, 0, 1.0) for n in (1, 2)]
        doc.entries["Places"] = struct.pack("<I", 2) + b"".join(struct.pack(form, *row) for row in rows)
        doc.objects["Row"][1]["PlacementList"] = PLACES
        doc.add("App::Part", "Top", Group=locals_("Row"))
        found = read_document(doc).instances
        assert [i.transform[:3, 3].round(6).tolist() for i in found] == [
            [0.01, 0.1, 0],
            [0.02, 0.1, 0],
            [0, 0.1, 0],
        ]


BAD_LISTS = [struct.pack("<I", 2) + b"x" * 30, struct.pack("<I", 4_000_000_000)]


@pytest.mark.parametrize("data", BAD_LISTS)
def test_a_damaged_list_of_placements_is_an_error(
    data: bytes, body: Any, tmp_path: Path, read_document: Any
) -> None:
    """A length that does not fit: no guess where the parts are."""
    body(Doc("bolt")).save(tmp_path / "bolt.FCStd")
    doc = Doc("top").link("Row", "bolt.FCStd", "Box", ElementCount=2)
    doc.entries["Places"] = data
    doc.objects["Row"][1]["PlacementList"] = PLACES
    doc.add("App::Part", "Top", Group=locals_("Row"))
    with pytest.raises(DocumentError, match="placements of Row are damaged"):
        read_document(doc)


def test_an_array_of_a_million_million_is_refused(body: Any, tmp_path: Path, read_document: Any) -> None:
    """A number in the XML is no reason to fill the memory."""
    body(Doc("bolt")).save(tmp_path / "bolt.FCStd")
    doc = Doc("top").link("Row", "bolt.FCStd", "Box", ElementCount=10**12)
    doc.add("App::Part", "Top", Group=locals_("Row"))
    with pytest.raises(DocumentError, match="claims 1000000000000 elements"):
        read_document(doc)


@pytest.mark.parametrize("content", [b"", b"no shape at all", None])
def test_a_damaged_shape_is_that_part_s_problem(
    content: bytes | None, body: Any, read_document: Any, codes_of: Any
) -> None:
    """Empty, nonsense or missing: the other part is measured anyway."""
    doc = body(body(Doc("top"), "Good"), "Bad")
    if content is None:
        del doc.entries["Bad.Shape.brp"]
    else:
        doc.entries["Bad.Shape.brp"] = content
    doc.add("Assembly::AssemblyObject", "Top", Group=locals_("Good", "Bad"))
    by_name = {p.name: p for p in read_document(doc).prototypes.values()}
    assert by_name["Good"].volume_m3 == pytest.approx(6e-6)
    assert not by_name["Bad"].has_solid
    why = GeometryCode.NO_GEOMETRY if content == b"" else GeometryCode.NOT_READ
    assert why in codes_of(by_name["Bad"])


def test_curves_are_no_solid(tmp_path: Path, read_document: Any, codes_of: Any) -> None:
    """A Draft wire in a part's file."""
    doc = Doc("wire").add("Part::Feature", "Wire", Shape=shape("w.brp"), Placement=at(0))
    edge = BRepBuilderAPI_MakeEdge(gp_Pnt(0, 0, 0), gp_Pnt(1, 0, 0)).Edge()
    doc.entries["w.brp"] = brep(edge, tmp_path)
    (part,) = read_document(doc).prototypes.values()
    assert codes_of(part) == [GeometryCode.NO_SOLID]
    assert "curves only" in part.problems[0].message


def test_assemblies_in_a_ring_end(tmp_path: Path, read_in: Any) -> None:
    """a contains b contains a: cut where it closes, and said."""
    for name, other in (("a", "b"), ("b", "a")):
        doc = Doc(name).link("L", f"{other}.FCStd", "Top")
        doc.add("App::Part", "Top", Group=locals_("L"), Type="Assembly").save(tmp_path / f"{name}.FCStd")
    assembly = read_in(tmp_path / "a.FCStd")
    assert [p.code for p in assembly.problems] == ["cycle"]


def test_a_link_to_a_face_is_no_component(body: Any, tmp_path: Path, read_document: Any) -> None:
    """Assembly3 elements link faces: references, no parts."""
    body(Doc("bolt")).save(tmp_path / "bolt.FCStd")
    doc = Doc("top").link("Face", "bolt.FCStd", "Box", LinkedObject=XLink("bolt.FCStd", "Box", ("Face1",)))
    doc.link("Part", "bolt.FCStd", "Box")
    doc.add("App::Part", "Top", Group=locals_("Face", "Part"))
    assembly = read_document(doc)
    assert [i.name for i in assembly.instances] == ["Part"]
    assert [p.code for p in assembly.problems] == ["not_counted"]


def test_a_quaternion_that_is_none_is_no_turn() -> None:
    """Zeros and infinities in a file leave the part where it is."""
    for numbers in ([1, 2, 3, 0, 0, 0, 0], [np.nan, 0, 0, 0, 0, 0, 1]):
        np.testing.assert_array_equal(placed(np.array(numbers, float)), np.eye(4))
    # Not of unit length, as files that were edited have it: the same turn.
    np.testing.assert_allclose(
        placed(np.array([0, 0, 0, 0, 0, 3.0, 3.0]))[:2, :2], [[0, -1], [1, 0]], atol=1e-12
    )
