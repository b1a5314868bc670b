# SPDX-License-Identifier: LGPL-2.1-or-later
"""A small file that asks for much is refused with a sentence, before what it asks for is made."""

from __future__ import annotations

import json
import struct
import tracemalloc
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from fcstd_writer import Doc, locals_

from silo.bom.errors import DocumentError
from silo.budget import OverBudgetError
from silo.inertia import geometry
from silo.inertia.geometry.fcstd import Entries
from silo.inertia.geometry.limits import MESH, MODEL
from silo.inertia.geometry.options import ReadOptions

HERE = ReadOptions(isolate=False, cache=False)
MB = 1024 * 1024


@contextmanager
def at_most(size: int) -> Iterator[None]:
    """Python's objects never take more than ``size`` bytes."""
    tracemalloc.start()
    try:
        yield
        assert tracemalloc.get_traced_memory()[1] < size
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("counts", [(300_000,), (1000, 1000), (80, 80, 80)])
def test_arrays_that_claim_many_elements_are_refused(counts: tuple[int, ...], tmp_path: Path) -> None:
    """Six hundred bytes took 15 seconds."""
    Doc("bolt").add("Part::Box", "Box").save(tmp_path / "bolt.FCStd")
    doc, file, target = Doc("top"), "bolt.FCStd", "Box"
    for number, count in enumerate(counts):
        doc.link(f"Row{number}", file, target, ElementCount=count)
        file, target = "", f"Row{number}"
    doc.add("App::Part", "Top", Group=locals_(target))
    path = doc.save(tmp_path / "top.FCStd")
    assert path.stat().st_size < 10_000
    with at_most(300 * MB), pytest.raises(DocumentError, match="holds more than 200000 objects"):
        geometry.read(path, options=HERE)


def test_an_array_of_a_usual_size_is_read(tmp_path: Path) -> None:
    Doc("bolt").add("Part::Box", "Box").save(tmp_path / "bolt.FCStd")
    doc = Doc("top").link("Row", "bolt.FCStd", "Box", ElementCount=300)
    doc.add("App::Part", "Top", Group=locals_("Row"))
    assert len(geometry.read(doc.save(tmp_path / "top.FCStd"), options=HERE).instances) == 300


def test_shapes_are_counted_when_they_are_unpacked(tmp_path: Path) -> None:
    """Each shape is small enough; all of them are not."""
    path = tmp_path / "shapes.FCStd"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.brp", b" " * MB)
    entries = Entries(replace(MODEL, bytes=3 * MB))
    try:
        for _ in range(3):
            entries.read(str(path), "a.brp")
        with pytest.raises(OverBudgetError, match="larger than 3 MiB"):
            entries.read(str(path), "a.brp")
    finally:
        entries.close()


def test_a_glb_file_that_claims_numbers_it_does_not_hold_is_refused(tmp_path: Path) -> None:
    """Its reader makes zeros of an accessor without bytes."""
    accessor = {"componentType": 5126, "count": MESH.cells + 1, "type": "VEC3"}
    scene = {
        "asset": {"version": "2.0"},
        "accessors": [accessor],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }
    text = json.dumps(scene).encode()
    text += b" " * (-len(text) % 4)
    path = tmp_path / "claims.glb"
    path.write_bytes(struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A) + text)
    with at_most(50 * MB), pytest.raises(DocumentError, match="holds more than 100000000 values"):
        geometry.read(path, options=HERE)


def test_the_elements_of_a_3mf_model_are_counted(tmp_path: Path) -> None:
    from silo.inertia.geometry.meshes import read_3mf

    path = tmp_path / "many.3mf"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        relation = '<Relationship Target="/m.model" Type="http://x/3dmodel"/>'
        archive.writestr("_rels/.rels", f"<Relationships>{relation}</Relationships>")
        archive.writestr("m.model", "<model><resources>" + "<object/>" * 2000 + "</resources></model>")
    with pytest.raises(OverBudgetError, match="holds more than 1000 objects"):
        read_3mf(path, replace(MESH, objects=1000))
