# SPDX-License-Identifier: LGPL-2.1-or-later
"""Identities that we write into files are read by every FreeCAD, and survive when it saves them."""

from __future__ import annotations

import json
import uuid
from pathlib import Path

import pytest
from freecad_cases import answers, corpora, machines
from freecad_cases.machines import WANTED
from freecad_cases.truth import BOLT, PLATE, SUB

from silo.bom.entry import Extraction
from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly
from silo.fcstd import Library, stamp
from silo.freecads.run import run_freecad

pytestmark = pytest.mark.freecad

RESAVE = Path(__file__).parent / "freecad_cases" / "resave.py"


@pytest.mark.parametrize("version", WANTED)
def test_freecad_reads_and_keeps_what_we_stamp(version: str, tmp_path: Path) -> None:
    """Each file's identity is that of its component in live FreeCAD, and in the file that FreeCAD saves."""
    freecad = machines.need(version)
    corpus = corpora.unpack(corpora.ARCHIVES / "corpus-0.20.zip", tmp_path / "corpus")
    folder = corpus.base("asm4/link_to_assembly")
    top = folder / "top.FCStd"
    identities = {name: str(uuid.uuid4()) for name in ("top", "sub", "bolt", "plate")}
    objects = {"sub": SUB, "bolt": BOLT, "plate": PLATE}
    objects = {name: key.partition("#")[2] for name, key in objects.items()}
    for name, identity in identities.items():
        path = str(folder / f"{name}.FCStd")
        if name == "top":
            with Library() as library:
                objects["top"] = str(choose_assembly(library.open(path)).Name)
        assert stamp(path, identity, item_object=objects[name])
    wanted = {SUB: identities["sub"], BOLT: identities["bolt"], PLATE: identities["plate"]}

    env = freecad.profile(tmp_path / "profile")
    ((_, live),) = run_freecad([str(top)], command=freecad.command, env=env)
    assert isinstance(live, Extraction), live
    assert live.assembly.silo_uuid == identities["top"]
    assert answers.uuids_of(live.entries, str(folder)) == wanted

    files = [str(folder / f"{name}.FCStd") for name in ("bolt", "plate", "sub", "top")]
    freecad.must_run(RESAVE, {**env, "SILO_FILES": json.dumps(files)}, cwd=tmp_path)
    with Library() as library:
        document = library.open(top)
        assert document.ProgramVersion.startswith(version)
        found = extract(choose_assembly(document))
    assert found.assembly.silo_uuid == identities["top"]
    for name, identity in identities.items():
        path = str(folder / f"{name}.FCStd")
        with Library() as library:
            assert library.open(path).getObject(objects[name]).SiloItemId == identity
    assert answers.uuids_of(found.entries, str(folder)) == wanted
    assert answers.bom_of(found.entries, str(folder)) == {SUB: (1, {BOLT: 2, PLATE: 1})}
