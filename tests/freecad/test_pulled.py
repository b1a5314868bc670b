# SPDX-License-Identifier: LGPL-2.1-or-later
"""A project committed on one computer and pulled into an empty folder opens whole in every FreeCAD."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest
from freecad_cases import answers, corpora, machines
from freecad_cases.machines import WANTED

from silo.api.client import SiloClient
from silo.bom.findings import FindingCode
from silo.bom.links import extract
from silo.bom.model import Extraction
from silo.bom.roots import choose_assembly
from silo.cli.main import main
from silo.fcstd import Library
from silo.fcstd.linked import identity_in
from silo.freecads import run_freecad
from silo_server.run import running_server

pytestmark = pytest.mark.freecad


DATA = Path(__file__).resolve().parents[3] / "shared" / "data" / "assemblies"


@pytest.mark.parametrize("top", ["asm4/link_to_assembly/top.FCStd", "alarm_clock/parts/asm_main.FCStd"])
@pytest.mark.parametrize("version", WANTED)
def test_a_pulled_project_opens_with_no_missing_link(
    version: str, top: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Through a real server and the command line; the BOMs in FreeCAD are equal on both computers."""
    freecad = machines.need(version)
    if version == "0.20" and top.startswith("alarm"):
        pytest.skip("the alarm clock was made by a newer FreeCAD")
    folder, name = top.rsplit("/", 1)
    corpus = corpora.unpack(corpora.ARCHIVES / "corpus-0.20.zip", tmp_path / "corpus")
    source = DATA / folder if top.startswith("alarm") else corpus.base(folder)
    if not source.is_dir():
        pytest.skip(f"{source} is not here; NOT tested")
    work = tmp_path / "first" / "project"
    shutil.copytree(source, work, copy_function=shutil.copyfile)
    for made, _, _ in os.walk(work):
        os.chmod(made, 0o755)  # the real data are read-only
    token = "silo_" + "d2" * 20

    def at(computer: str) -> None:
        for variable in ("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME"):
            monkeypatch.setenv(variable, str(tmp_path / computer / variable.lower()))

    at("first")
    with running_server(f"sqlite:///{tmp_path / 'silo.db'}", token=token) as server:
        monkeypatch.setenv("SILO_API_URL", server.base_url)
        monkeypatch.setenv("SILO_API_TOKEN", token)
        assert main(["register", str(work / name), "--yes"]) == 0
        assert main(["commit", str(work / name), "--root", str(work)]) == 0
        with SiloClient(server.base_url, token) as client, Library() as library:
            item = client.get_item_by_uuid(identity_in(library, str(work / name)))
        assert item is not None
        at("second")
        into = tmp_path / "second" / "empty"
        assert main(["pull", item.part_number, "--to", str(into)]) == 0
    here, there = (opened(freecad, folder / name, tmp_path) for folder in (work, into))
    assert here == there
    with Library() as library:
        read = extract(choose_assembly(library.open(into / name)))
    assert answers.bom_of(read.entries, str(into)) == there


def opened(freecad: machines.FreeCAD, top: Path, scratch: Path) -> object:
    """The BOM that this FreeCAD has of a project's top; no link of it is broken."""
    ((_, found),) = run_freecad(
        [str(top)],
        command=freecad.command,
        env=freecad.profile(scratch / f"profile {top.parent.name}"),
    )
    assert isinstance(found, Extraction), found
    broken = {FindingCode.MISSING_FILE, FindingCode.MISSING_OBJECT}
    assert not [finding for finding in found.findings if finding.code in broken]
    assert found.entries
    return answers.bom_of(found.entries, str(top.parent))
