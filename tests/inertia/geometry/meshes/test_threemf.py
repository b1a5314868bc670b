# SPDX-License-Identifier: LGPL-2.1-or-later
"""3MF files: units, components, several model parts, and what hostile ones try."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from silo.bom.errors import DocumentError

NAMESPACE = 'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"'
PRODUCTION = 'xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06"'
RELATIONS = (
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Id="r" Target="/{}" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>'
    "</Relationships>"
)


def box(number: int, *sizes: tuple[float, float, float], name: str = "") -> str:
    """An object with a mesh of boxes, each with one corner in the origin."""
    body = trimesh.util.concatenate(
        [trimesh.creation.box(size).apply_translation(np.array(size) / 2) for size in sizes]
    )
    vertices = "".join(f'<vertex x="{x!r}" y="{y!r}" z="{z!r}"/>' for x, y, z in body.vertices.tolist())
    faces = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in body.faces.tolist())
    named = f' name="{name}"' if name else ""
    return (
        f'<object id="{number}"{named} type="model"><mesh><vertices>{vertices}</vertices>'
        f"<triangles>{faces}</triangles></mesh></object>"
    )


def model(resources: str, build: str, unit: str = "millimeter") -> str:
    """A model part."""
    return (
        f'<?xml version="1.0"?><model unit="{unit}" {NAMESPACE} {PRODUCTION}>'
        f"<resources>{resources}</resources><build>{build}</build></model>"
    )


@pytest.fixture(name="write")
def _write(tmp_path: Path) -> Any:
    """``write(parts, root)``: a package with these parts."""

    def write(parts: dict[str, str], root: str = "3D/3dmodel.model") -> Path:
        path = tmp_path / "part.3mf"
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("_rels/.rels", RELATIONS.format(root))
            for name, text in parts.items():
                archive.writestr(name, text)
        return path

    return write


ITEM = '<item objectid="1"/>'


@pytest.mark.parametrize(
    ("unit", "metres"),
    [("millimeter", 1e-3), ("inch", 0.0254), ("micron", 1e-6), ("foot", 0.3048), ("meter", 1.0)],
)
def test_the_unit_is_the_file_s(unit: str, metres: float, write: Any, read_in: Any, codes_of: Any) -> None:
    """All units of the specification; none is assumed."""
    size = (2.0, 3.0, 4.0)
    assembly = read_in(write({"3D/3dmodel.model": model(box(1, size, name="brick"), ITEM, unit)}))
    (part,) = assembly.prototypes.values()
    assert part.volume_m3 == pytest.approx(24 * metres**3)
    assert part.name == "brick"
    assert not any("no unit" in p.message for p in assembly.problems)


def test_components_are_placed_by_their_transforms(write: Any, read_in: Any) -> None:
    """Row vectors, v' = v M: twelve numbers, the translation last; a quarter turn about z and a shift."""
    use = '<component objectid="1" transform="0 1 0 -1 0 0 0 0 1 100 0 0"/><component objectid="1"/>'
    resources = (
        box(1, (10, 20, 30), name="brick")
        + f'<object id="2" name="pair"><components>{use}</components></object>'
    )
    path = write(
        {"3D/3dmodel.model": model(resources, '<item objectid="2" transform="1 0 0 0 1 0 0 0 1 0 0 5"/>')}
    )
    assembly = read_in(path)
    assert [i.name for i in assembly.instances] == ["brick", "brick<2>"]
    assert len(assembly.prototypes) == 1
    turned = assembly.instances[0].transform
    np.testing.assert_allclose(turned[:3, :3] @ [0.010, 0, 0], [0, 0.010, 0], atol=1e-15)
    np.testing.assert_allclose(turned[:3, 3], [0.1, 0, 0.005])
    items = '<item objectid="2"/><item objectid="2" transform="1 0 0 0 1 0 0 0 1 0 0 50"/>'
    frames = read_in(write({"3D/3dmodel.model": model(resources, items)})).frames
    np.testing.assert_allclose(frames[("pair<2>",)][:3, 3], [0, 0, 0.05])
    with pytest.raises(DocumentError, match=f"{path.name}: it unfolds to 4 placed parts"):
        read_in(path, max_instances=1)


def test_objects_may_lie_in_other_parts(write: Any, read_in: Any) -> None:
    """The production extension: a component by path."""
    other = model(box(7, (1, 1, 1), name="cube"), "")
    use = (
        '<object id="1"><components><component p:path="/3D/other.model" objectid="7"/></components></object>'
    )
    path = write({"3D/3dmodel.model": model(use, ITEM), "3D/other.model": other})
    (part,) = read_in(path).prototypes.values()
    assert (part.name, part.volume_m3) == ("cube", pytest.approx(1e-9))


BAD = {
    "doctype": ('<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "b">]><model/>', "document type"),
    "ring": (
        model('<object id="1"><components><component objectid="1"/></components></object>', ITEM),
        "contains itself",
    ),
    "lost": (model("", ITEM), "object 1 that it does not hold"),
    "lost part": (
        model('<object id="1"><components><component p:path="/3D/gone.model" objectid="7"/></components>'
              '</object>', ITEM),
        r"3D/gone\.model that it does not hold",
    ),
    "nothing": (model(box(1, (1, 1, 1)), ""), "builds nothing"),
    "unit": (model(box(1, (1, 1, 1)), ITEM, "parsec"), "'parsec'"),
    "index": (
        model('<object id="1"><mesh><vertices><vertex x="0" y="0" z="0"/></vertices><triangles>'
              '<triangle v1="0" v2="1" v3="2"/></triangles></mesh></object>', ITEM),
        "vertices that it does not hold",
    ),
    "number": (model(box(1, (1, 1, 1)).replace('x="1.0"', 'x="one"'), ITEM), "damaged"),
    "nan": (model(box(1, (1, 1, 1)).replace('x="1.0"', 'x="nan"'), ITEM), "not finite"),
    "huge": (model(box(1, (1, 1, 1)).replace('x="1.0"', 'x="1e300"'), ITEM), "larger than 1e"),
    "transform": (model(box(1, (1, 1, 1)), '<item objectid="1" transform="1 2 3"/>'), "12 numbers"),
    "xml": ("<model><resources>", "damaged"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_bad_models_are_plain_sentences(case: str, write: Any, read_in: Any) -> None:
    """Entities, rings, missing objects, wild indices, broken numbers and XML."""
    text, reason = BAD[case]
    with pytest.raises(DocumentError, match=reason):
        read_in(write({"3D/3dmodel.model": text}))


def test_what_trimesh_writes_is_read(tmp_path: Path, read_in: Any) -> None:
    """A file of an independent writer."""
    pytest.importorskip("networkx", reason="trimesh writes 3MF with networkx and lxml only")
    pytest.importorskip("lxml", reason="trimesh writes 3MF with networkx and lxml only")
    path = tmp_path / "scene.3mf"
    trimesh.Scene([trimesh.creation.box((1, 2, 3))]).export(path)
    (part,) = read_in(path).prototypes.values()
    assert part.volume_m3 == pytest.approx(6e-9)


SETTINGS, PRUSA = "Metadata/model_settings.config", "Metadata/Slic3r_PE_model.config"
ROOT = "3D/3dmodel.model"


def orca(*subtypes: str) -> str:
    """The settings of Bambu Studio and Orca Slicer: object 9, whose parts are the objects 1, 2 …"""
    parts = "".join(
        f'<part id="{number}" subtype="{word}"><metadata key="name" value="p"/></part>'
        for number, word in enumerate(subtypes, start=1)
    )
    return f'<?xml version="1.0"?><config><object id="9"><metadata key="name"/>{parts}</object></config>'


def prusa(*kinds: str) -> str:
    """PrusaSlicer's: object 1, whose triangles are boxes one after the other."""
    volumes = "".join(
        f'<volume firstid="{12 * n}" lastid="{12 * n + 11}"><metadata type="volume" key="name" value="p"/>'
        f'<metadata type="volume" key="{kind.split()[0]}" value="{kind.split()[1]}"/></volume>'
        for n, kind in enumerate(kinds)
    )
    return f'<?xml version="1.0"?><config><object id="1" instances_count="1">{volumes}</object></config>'


ASSEMBLED = '<object id="9" name="o"><components>{}</components></object>'
MOVED = '<component objectid="2" transform="1 0 0 0 1 0 0 0 1 1 1 1"/>'

SLICED = {
    "a negative part": (orca("normal_part", "negative_part"), "not_counted", 1000 - 8),
    "a modifier": (orca("normal_part", "modifier_part"), "not_counted", 1000),
    "a support enforcer": (orca("normal_part", "support_enforcer"), "not_counted", 1000),
    "a support blocker": (orca("normal_part", "support_blocker"), "not_counted", 1000),
    "two parts": (orca("normal_part", "normal_part"), "", 1008),
}


@pytest.mark.parametrize("case", SLICED)
@pytest.mark.parametrize(("scattered", "typed"), [(False, False), (True, True)])
def test_parts_of_bambu_and_orca(
    case: str, scattered: bool, typed: bool, write: Any, read_in: Any, codes_of: Any
) -> None:
    """A box of 10 mm, and one of 2 mm in it: subtracted or left out by the slicer's word; parts may lie in
    files of their own. Both programs give whatever is not the part the type "other", holes as well."""
    config, code, volume = SLICED[case]
    other = box(2, (2, 2, 2))
    if typed and case != "two parts":
        other = other.replace('type="model"', 'type="other"')
    boxes = box(1, (10, 10, 10)) + other
    if scattered:
        path = ' p:path="/3D/Objects/o.model"'
        used = f'<component{path} objectid="1"/>' + MOVED.replace(" transform", f"{path} transform")
        parts = {ROOT: model(ASSEMBLED.format(used), '<item objectid="9"/>')}
        parts["3D/Objects/o.model"] = model(boxes, "")
    else:
        used = '<component objectid="1"/>' + MOVED
        parts = {ROOT: model(boxes + ASSEMBLED.format(used), '<item objectid="9"/>')}
    assembly = read_in(write({**parts, SETTINGS: config}))
    total = sum(assembly.prototypes[i.prototype].volume_m3 for i in assembly.instances)
    assert total == pytest.approx(volume * 1e-9)
    codes = codes_of(assembly) + [c for p in assembly.prototypes.values() for c in codes_of(p)]
    assert codes == ([code] if code else [])


@pytest.mark.parametrize("kinds", [("normal_part", "negative_part"), ("normal_part", "modifier_part")])
def test_one_mesh_that_is_a_part_and_something_else(kinds: tuple[str, str], write: Any, read_in: Any) -> None:
    """Programs that share meshes name one object twice: the first use is the first part."""
    used = '<component objectid="1"/><component objectid="1" transform="1 0 0 0 1 0 0 0 1 5 0 0"/>'
    config = orca(*kinds).replace('id="2"', 'id="1"')
    parts = model(box(1, (10, 10, 10)) + ASSEMBLED.format(used), '<item objectid="9"/>')
    assembly = read_in(write({ROOT: parts, SETTINGS: config}))
    (instance,) = assembly.instances
    volume = assembly.prototypes[instance.prototype].volume_m3
    assert volume == pytest.approx(5e-7 if "negative_part" in kinds else 1e-6)


def test_objects_of_one_number_in_files_of_one_name(write: Any, read_in: Any) -> None:
    """Their folders differ, and so do they."""
    use = "".join(f'<component p:path="/3D/{folder}/o.model" objectid="7"/>' for folder in "ab")
    parts = {ROOT: model(f'<object id="1"><components>{use}</components></object>', ITEM)}
    parts |= {f"3D/{folder}/o.model": model(box(7, (n, n, n)), "") for n, folder in ((1, "a"), (2, "b"))}
    volumes = sorted(part.volume_m3 for part in read_in(write(parts)).prototypes.values())
    assert volumes == pytest.approx([1e-9, 8e-9])


def test_beams_beside_triangles_are_named(write: Any, read_in: Any, codes_of: Any) -> None:
    """The beam lattice extension: rods along edges, whose volume is not measured."""
    beams = (
        '<b:beamlattice xmlns:b="urn:b" radius="1"><b:beams><b:beam v1="0" v2="7"/></b:beams></b:beamlattice>'
    )
    boxed = box(1, (10, 10, 10), name="strut").replace("</mesh>", f"{beams}</mesh>")
    assembly = read_in(write({ROOT: model(boxed, ITEM)}))
    assert codes_of(assembly) == ["body_missing"]
    assert "strut" in assembly.problems[0].message


def test_a_negative_volume_cuts_where_it_stands(write: Any, read_in: Any) -> None:
    """Both parts are placed, and only corners of 1 mm lie in each other."""
    place = '<component objectid="{}" transform="1 0 0 0 1 0 0 0 1 {}"/>'
    corner = box(1, (10, 10, 10)) + box(2, (2, 2, 2))
    low, high = (5, 0, 0), (14, 9, 9)
    used = place.format(1, "{} {} {}".format(*low)) + place.format(2, "{} {} {}".format(*high))
    parts = model(corner + ASSEMBLED.format(used), '<item objectid="9"/>')
    assembly = read_in(write({ROOT: parts, SETTINGS: orca("normal_part", "negative_part")}))
    (instance,) = assembly.instances
    assert assembly.prototypes[instance.prototype].volume_m3 == pytest.approx(999e-9)


@pytest.mark.parametrize(
    ("kinds", "volume", "said"),
    [
        (("volume_type ModelPart", "volume_type NegativeVolume"), 1000 - 8, True),
        (("volume_type ModelPart", "volume_type ParameterModifier"), 1000, True),
        (("volume_type ModelPart", "volume_type SupportEnforcer"), 1000, True),
        (("volume_type ModelPart", "volume_type SupportBlocker"), 1000, True),
        (("modifier 0", "modifier 1"), 1000, True),
        (("volume_type ModelPart",), 1000, False),
    ],
)
def test_volumes_of_prusaslicer(
    kinds: tuple[str, ...], volume: float, said: bool, write: Any, read_in: Any, codes_of: Any
) -> None:
    """The same, as ranges of the triangles of one mesh."""
    sizes = [(10.0, 10.0, 10.0), (2.0, 2.0, 2.0)][: len(kinds)]
    assembly = read_in(write({ROOT: model(box(1, *sizes), ITEM), PRUSA: prusa(*kinds)}))
    (part,) = assembly.prototypes.values()
    assert part.volume_m3 == pytest.approx(volume * 1e-9)
    assert ("not_counted" in codes_of(assembly) + codes_of(part)) == said


@pytest.mark.parametrize(
    ("word", "said"),
    [("support", "False"), *((word, "True") for word in ("support", "anti_overhang", "infill", "cutting"))],
)
def test_meshes_of_cura(word: str, said: str, write: Any, read_in: Any, codes_of: Any) -> None:
    """Supports, blockers and modifiers are objects of their own, with a setting that says so."""
    setting = (
        f'<metadatagroup><metadata name="cura:{word}_mesh" type="xs:string">{said}</metadata></metadatagroup>'
    )
    boxes = box(1, (10, 10, 10)) + box(2, (2, 2, 2)).replace("<mesh>", setting + "<mesh>")
    assembly = read_in(write({ROOT: model(boxes, ITEM + '<item objectid="2"/>')}))
    left_out = said == "True"
    volume = sum(p.volume_m3 for p in assembly.prototypes.values())
    assert volume == pytest.approx(1e-6 if left_out else 1.008e-6)
    assert codes_of(assembly) == ["not_counted"] * left_out


@pytest.mark.parametrize("nested", ["what is cut", "what cuts"])
def test_assemblies_and_negative_volumes(nested: str, write: Any, read_in: Any, codes_of: Any) -> None:
    """Neither is cut, nor cuts; that is said, and nothing of it is sure."""
    number = {"what is cut": 1, "what cuts": 2}[nested]
    inner = f'<object id="8"><components><component objectid="{number}"/></components></object>'
    used = '<component objectid="1"/><component objectid="2"/>'.replace(f'"{number}"', '"8"')
    boxes = box(1, (10, 10, 10)) + box(2, (2, 2, 2)) + inner + ASSEMBLED.format(used)
    parts = [
        f'<part id="{8 if n == number else n}" subtype="{word}_part"/>'
        for n, word in ((1, "normal"), (2, "negative"))
    ]
    config = f'<config><object id="9">{"".join(parts)}</object></config>'
    assembly = read_in(write({ROOT: model(boxes, '<item objectid="9"/>'), SETTINGS: config}))
    assert "invalid_shape" in codes_of(assembly)
    assert "could not be subtracted" in " ".join(problem.message for problem in assembly.problems)


@pytest.mark.parametrize("kind", ["support", "solidsupport", "surface", "other"])
@pytest.mark.parametrize("inside", [True, False])
def test_objects_of_another_type_are_left_out(
    kind: str, inside: bool, write: Any, read_in: Any, codes_of: Any
) -> None:
    """Built by themselves or as a component; the message names them."""
    boxes = box(1, (10, 10, 10)) + box(2, (2, 2, 2), name="brim").replace('type="model"', f'type="{kind}"')
    if inside:
        used = '<component objectid="1"/><component objectid="2"/>'
        parts = model(boxes + ASSEMBLED.format(used), '<item objectid="9"/>')
    else:
        parts = model(boxes, ITEM + '<item objectid="2"/>')
    assembly = read_in(write({ROOT: parts}))
    assert sum(p.volume_m3 for p in assembly.prototypes.values()) == pytest.approx(1e-6)
    assert codes_of(assembly) == ["not_counted"]
    assert "brim" in assembly.problems[0].message
    assert kind in assembly.problems[0].message


@pytest.mark.parametrize(
    ("build", "why"), [('<item objectid="2" printable="0"/>', "not printed"), ("", "built by nothing")]
)
def test_what_is_not_printed_is_left_out(
    build: str, why: str, write: Any, read_in: Any, codes_of: Any
) -> None:
    """By the item, or because no item names it."""
    assembly = read_in(write({ROOT: model(box(1, (10, 10, 10)) + box(2, (2, 2, 2)), ITEM + build)}))
    assert codes_of(assembly) == ["not_counted"]
    assert why in assembly.problems[0].message


def test_a_body_without_triangles_is_named(write: Any, read_in: Any, codes_of: Any) -> None:
    """Beside one that has some: a lattice, or nothing at all."""
    lattice = '<object id="2" name="lattice"><mesh><vertices/><triangles/></mesh></object>'
    assembly = read_in(write({ROOT: model(box(1, (10, 10, 10)) + lattice, ITEM + '<item objectid="2"/>')}))
    assert codes_of(assembly) == ["body_missing"]
    assert "lattice" in assembly.problems[0].message


def test_a_negative_volume_that_is_open_is_doubted(write: Any, read_in: Any, codes_of: Any) -> None:
    """It cannot be subtracted, and nothing is pushed."""
    holed = re.sub(r"<triangle [^>]*/>", "", box(2, (2, 2, 2)), count=1)
    used = '<component objectid="1"/>' + MOVED
    parts = model(box(1, (10, 10, 10)) + holed + ASSEMBLED.format(used), '<item objectid="9"/>')
    assembly = read_in(write({ROOT: parts, SETTINGS: orca("normal_part", "negative_part")}))
    (part,) = assembly.prototypes.values()
    assert codes_of(part) == ["invalid_shape"]
