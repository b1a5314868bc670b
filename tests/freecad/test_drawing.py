# SPDX-License-Identifier: LGPL-2.1-or-later
"""Models that FreeCAD draws in the background, beside those that the geometry kernel draws."""

from __future__ import annotations

import gzip
import json
import sys
import uuid
from contextlib import suppress
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from drawn import corners, drawn, products_of
from fcstd_writer import Doc, Raw
from freecad_cases import corpora, machines
from hunting import LONG
from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakeSphere
from OCP.BRepTools import BRepTools
from public_projects import ASSEMBLIES

from silo.api.wire import Structure
from silo.bom.errors import DocumentError
from silo.checksums import content_hash
from silo.drawing.models import LINEAR, LOST, KernelDrawer, draw, send_models
from silo.inertia.geometry.together import Mesh, mesh_volume
from silo.testing import FakeSilo

MODS = machines.REPOSITORY / "mods"

pytestmark = pytest.mark.freecad


@pytest.mark.parametrize("version", machines.ENDS)
def test_freecad_draws_what_the_kernel_draws(version: str, tmp_path: Path) -> None:
    """Fewer triangles, the same volume and box; a shape that it cannot read is a sentence in the model."""
    freecad = machines.need(version)
    body = BRepAlgoAPI_Fuse(BRepPrimAPI_MakeCylinder(10, 40).Shape(), BRepPrimAPI_MakeSphere(12).Shape())
    BRepTools.Write_s(body.Shape(), str(tmp_path / "body.brp"))
    doc = Doc("part")
    for name, content in (("Body", (tmp_path / "body.brp").read_bytes()), ("Bad", b"no shape")):
        doc.entries[f"{name}.brp"] = content
        shape = Raw("Part::PropertyPartShape", f'<Part file="{name}.brp"/>')
        doc.add(
            "Part::Feature", name, Shape=shape, Material=Raw("App::PropertyLink", '<Link value="Steel"/>')
        )
    doc.add("App::MaterialObjectPython", "Steel", Material={"Name": "Steel", "Density": "7900 kg/m^3"})
    doc.objects["Body"][1]["SiloUUID"] = str(uuid.uuid4())
    path = doc.save(tmp_path / "part.FCStd")
    silo = FakeSilo()
    silo.upload_file(silo.create_item("kindred-rd", "M01", "part").part_number, path)
    # A child finds what its parent finds; here the parent is of another Python than FreeCAD.
    code = (
        f"import sys; sys.path[:] = [one for one in sys.path if one not in {sys.path!r}]; "
        f"sys.path += {[str(MODS), str(freecad.dependencies)]!r}; "
        "from silo.workbench.freecad.drawer import main; main()"
    )
    sent = send_models(silo, [(path, content_hash(path))], command=[freecad.command, "-c", code])
    assert sent == (1, [])
    glb = gzip.decompress(silo.models[content_hash(path)]["geometry"])
    assert b"that FreeCAD can draw" in glb
    told = Structure.model_validate_json(gzip.decompress(silo.models[content_hash(path)]["structure"]))
    stated, other = told.products["Body"].stated, draw(path, KernelDrawer())[1].products["Body"].stated
    assert stated is not None
    assert other is not None
    assert stated.size_m == other.size_m == [0.024, 0.024, 0.052]
    assert stated.mass_kg == pytest.approx(other.mass_kg, rel=1e-6)
    assert stated.com_m == pytest.approx(other.com_m, abs=1e-9)
    mine, wanted = products_of(glb)["Body"][0], products_of(draw(path, KernelDrawer())[0])["Body"][0]
    assert 50 < len(mine) < 1000
    assert mesh_volume(mine) == pytest.approx(mesh_volume(wanted), rel=0.06)
    assert mine.extents == pytest.approx(wanted.extents, abs=5e-5)


# FreeCAD counts elements that are left out, and those of an array over several parts, in another order.
WAYS = ("array", "link", "mirror", "scale", "nest")
OTHER_NUMBERS = {"excluded_element", "array_over_an_inline_part"}


@pytest.mark.parametrize("version", ["1.0", "1.1"] if LONG else machines.NEWEST)
def test_each_occurrence_stands_where_freecad_shows_it(version: str, tmp_path: Path) -> None:
    """To 1e-6 m: real assemblies; arrays, mirrored, scaled and nested links, flexible AssemblyLinks.

    Each product of the real ones has the box that FreeCAD's surfaces have, and nearly the volume.
    Some paths of the fixtures lead FreeCAD nowhere: those of groups and of arrays without links. With
    SILO_LONG=1 in both FreeCADs that have assemblies.
    """
    freecad = machines.need(version)
    corpus = corpora.unpack(corpora.ARCHIVES / f"corpus-{version}.zip", tmp_path / "corpus")
    real = [
        path.parent.parent / json.loads(path.read_text())["top"] for path in ASSEMBLIES.glob("*/truth/*.json")
    ]
    asked, mine, bodies = {}, {}, {}
    fixtures = [one for one in corpus.built if one.startswith("assembly/") and any(map(one.count, WAYS))]
    for top in (*map(corpus.top, fixtures), *real):
        with suppress(DocumentError):
            root, mine[str(top)], _ = corners(top)
            whole = firsts(top) if top in real else {}
            bodies[str(top)] = whole
            paths = [one.path for one in mine[str(top)]]
            asked[str(top)] = (root, paths, [number for number, path in enumerate(paths) if path in whole])
    (tmp_path / "asked.json").write_text(json.dumps(asked))
    files = {"SILO_ASKED": str(tmp_path / "asked.json"), "SILO_OUT": str(tmp_path / "answers.json")}
    script = Path(__file__).parent / "freecad_cases" / "placed.py"
    freecad.must_run(script, {**freecad.profile(tmp_path / "profile"), **files}, cwd=tmp_path, timeout_s=1800)
    same, measured = 0, []
    for top, answers in json.loads((tmp_path / "answers.json").read_text()).items():
        for one, answer in zip(mine[top], answers, strict=True):
            if isinstance(answer, str):
                # Without their add-on, FreeCAD 1.0 shows no screws.
                assert Path(top) not in real or one.path[-1].startswith(("Screw", "Nut")), (top, one.path)
            elif abs(np.array(answer[0]) / 1e3 - one.points).max() <= 1e-6:
                same += 1
                if answer[1] is not None:
                    measured.append((top, one.path, bodies[top][one.path], answer[1]))
            else:
                assert Path(top).parent.name in OTHER_NUMBERS, (top, one.path)
    assert same > 90 + 80 * bool(real)
    off = []
    for top, path, mesh, (low, high, volume) in measured:
        size = np.linalg.norm(np.subtract(high, low)) / 1e3
        corner = [mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)]
        if size < 1e3:  # a datum plane has no end, and is not drawn
            assert abs(np.array([low, high]) / 1e3 - corner).max() < (LINEAR + LOST) * size, (top, path)
        if volume is not None:
            off.append(abs(mesh_volume(mesh) / (volume * 1e-9) - 1))
            # A spring of thin wire loses 6.4 %.
            assert off[-1] < 0.065, (top, path)
    assert not real or (len(off) > 40 and np.median(off) < 0.02)


@cache
def firsts(top: Path) -> dict[tuple[str, ...], Mesh]:
    """Path → triangles in the axes of the top [m], of the first occurrence of each product."""
    once = {}
    for one in drawn(top)[0]:
        once.setdefault((one.file, one.key), one)
    return {one.path: one.mesh.moved(one.matrix) for one in once.values()}
