# SPDX-License-Identifier: LGPL-2.1-or-later
"""A project committed on one computer and pulled into an empty folder opens whole in every FreeCAD."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest
from freecad_cases import answers, corpora, machines
from freecad_cases.machines import NEWEST, WANTED
from public_projects import ASSEMBLIES
from server_testing import sqlite_database

from silo.api.client import SiloClient
from silo.bom.entry import Extraction
from silo.bom.findings import FindingCode
from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly
from silo.cli.main import main
from silo.fcstd import Library
from silo.fcstd.linked import identity_in
from silo.freecads.run import run_freecad
from silo_server.run import running_server

pytestmark = pytest.mark.freecad


# Folder of the project, its top, and the FreeCADs that open it; the last one lacks a file from the beginning.
PROJECTS = (
    ("asm4/link_to_assembly", "top.FCStd", WANTED),
    ("alarm_clock", "parts/asm_main.FCStd", NEWEST),
    ("dingo-batterytray", "SubAssemblies/BatteryTray/BatteryTrayAssembly.FCStd", NEWEST),
    ("asm4-examples/Asm4_Example1", "asm_tuto1.FCStd", ("1.0", "1.1")),
    ("asm4-examples/Asm4_Example2", "asm_V4.FCStd", NEWEST),
    ("asm4-examples/Asm4_Example3", "asm_Hypnotic.fcstd", NEWEST),
    ("lmn3", "assemblies/assembly.FCStd", NEWEST),
)


@pytest.mark.parametrize(
    ("version", "folder", "name"),
    [(version, folder, name) for folder, name, versions in PROJECTS for version in versions],
)
def test_a_pulled_project_opens_with_no_missing_link(
    version: str, folder: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """None beyond the original's; through a real server and the command line, with equal BOMs in FreeCAD."""
    freecad = machines.need(version)
    is_real, lacks = folder != "asm4/link_to_assembly", folder == "lmn3"
    corpus = corpora.unpack(corpora.ARCHIVES / "corpus-0.20.zip", tmp_path / "corpus")
    source = ASSEMBLIES / folder if is_real else corpus.base(folder)
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
    with running_server(sqlite_database(tmp_path / "silo.db"), token=token) as server:
        monkeypatch.setenv("SILO_API_URL", server.base_url)
        monkeypatch.setenv("SILO_API_TOKEN", token)
        assert main(["register", str(work / name), "--yes"]) in (0, lacks)
        more = ["--allow-missing"] if lacks else []
        assert main(["commit", str(work / name), "--root", str(work), *more]) == 0
        with SiloClient(server.base_url, token) as client, Library() as library:
            item = client.get_item_by_uuid(identity_in(library, str(work / name)))
        assert item is not None
        at("second")
        into = tmp_path / "second" / "empty"
        assert main(["pull", item.part_number, "--into", str(into)]) == lacks
    here, there = (opened(freecad, root, name, tmp_path) for root in (work, into))
    assert here == there
    assert len(there[1]) == lacks
    with Library() as library:
        read = extract(choose_assembly(library.open(into / name)))
    assert answers.bom_of(read.entries, str(into)) == there[0]


def opened(freecad: machines.FreeCAD, root: Path, name: str, scratch: Path) -> tuple[object, set[str]]:
    """The BOM that this FreeCAD has of a project's top, and the files that its links do not find."""
    top = root / name
    ((_, found),) = run_freecad(
        [str(top)],
        command=freecad.command,
        env=freecad.profile(scratch / f"profile {root.name}"),
    )
    assert isinstance(found, Extraction), found
    broken = {FindingCode.MISSING_FILE, FindingCode.MISSING_OBJECT}
    assert found.entries
    missing = {finding.file for finding in found.findings if finding.code in broken}
    return answers.bom_of(found.entries, str(root)), {os.path.relpath(file, root) for file in missing}
