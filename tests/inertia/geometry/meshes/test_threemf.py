# SPDX-License-Identifier: LGPL-2.1-or-later
"""3MF files: units, components, several model parts, and what hostile ones try."""

from __future__ import annotations

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


def box(number: int, size: tuple[float, float, float], name: str = "") -> str:
    """An object with the mesh of a box, one corner in the origin."""
    body = trimesh.creation.box(size).apply_translation(np.array(size) / 2)
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
    assembly = read_in(write({"3D/3dmodel.model": model(box(1, size, "brick"), ITEM, unit)}))
    (part,) = assembly.prototypes.values()
    assert part.volume_m3 == pytest.approx(24 * metres**3)
    assert part.name == "brick"
    assert not any("no unit" in p.message for p in assembly.problems)


def test_components_are_placed_by_their_transforms(write: Any, read_in: Any) -> None:
    """Row vectors, v' = v M: twelve numbers, the translation last; a quarter turn about z and a shift."""
    use = '<component objectid="1" transform="0 1 0 -1 0 0 0 0 1 100 0 0"/><component objectid="1"/>'
    resources = (
        box(1, (10, 20, 30), "brick") + f'<object id="2" name="pair"><components>{use}</components></object>'
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
    other = model(box(7, (1, 1, 1), "cube"), "")
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


def test_a_part_that_is_not_there_is_named(write: Any, read_in: Any) -> None:
    """A component in a part that the package lacks."""
    use = '<object id="1"><components><component p:path="/3D/gone.model" objectid="7"/></components></object>'
    with pytest.raises(DocumentError, match=r"3D/gone\.model that it does not hold"):
        read_in(write({"3D/3dmodel.model": model(use, ITEM)}))


def test_what_trimesh_writes_is_read(tmp_path: Path, read_in: Any) -> None:
    """A file of an independent writer."""
    pytest.importorskip("networkx", reason="trimesh writes 3MF with networkx and lxml only")
    pytest.importorskip("lxml", reason="trimesh writes 3MF with networkx and lxml only")
    path = tmp_path / "scene.3mf"
    trimesh.Scene([trimesh.creation.box((1, 2, 3))]).export(path)
    (part,) = read_in(path).prototypes.values()
    assert part.volume_m3 == pytest.approx(6e-9)
