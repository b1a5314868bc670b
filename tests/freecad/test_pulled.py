# SPDX-License-Identifier: LGPL-2.1-or-later
"""A project committed on one computer and pulled into an empty folder opens whole in every FreeCAD."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from freecad_cases import answers, corpora, machines
from freecad_cases.machines import WANTED

from silo.bom.findings import FindingCode
from silo.bom.links import extract
from silo.bom.model import Extraction
from silo.bom.roots import choose_assembly
from silo.cli.main import main
from silo.fcstd import Library
from silo.fcstd.stamp import stamp
from silo.freecadcmd.run import run_freecad
from silo.outbox.entry import UNKNOWN, Commit
from silo.outbox.send import send_all
from silo.outbox.store import Store
from silo_server.run import running_server

pytestmark = pytest.mark.freecad


@pytest.mark.parametrize("version", WANTED)
def test_a_pulled_project_opens_with_no_missing_link(
    version: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Through a real server and the command line; the BOMs in FreeCAD are equal on both computers."""
    freecad = machines.need(version)
    corpus = corpora.unpack(corpora.ARCHIVES / "corpus-0.20.zip", tmp_path / "corpus")
    work = tmp_path / "first" / "project"
    shutil.copytree(corpus.base("asm4/link_to_assembly"), work)
    token = "silo_" + "d2" * 20
    for name in ("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME"):
        monkeypatch.setenv(name, str(tmp_path / "second" / name.lower()))
    with running_server(f"sqlite:///{tmp_path / 'silo.db'}", token=token) as server:
        monkeypatch.setenv("SILO_API_URL", server.base_url)
        monkeypatch.setenv("SILO_API_TOKEN", token)
        number = committed(work, tmp_path / "first" / "outbox.sqlite3", server.base_url, token)
        into = tmp_path / "second" / "empty"
        assert main(["pull", number, "--into", str(into)]) == 0
    here, there = (opened(freecad, folder, tmp_path) for folder in (work, into))
    assert here == there
    with Library() as library:
        read = extract(choose_assembly(library.open(into / "top.FCStd")))
    assert answers.bom_of(read.entries, str(into)) == there


def committed(folder: Path, outbox: Path, url: str, token: str) -> str:
    """Items for all files of a folder, and their commits; gives the top's number."""
    from silo.api.client import SiloClient

    store, numbers = Store(outbox), {}
    with SiloClient(url, token) as client:
        for path in sorted(folder.rglob("*.FCStd")):
            item = client.create_item("kindred-rd", "M01", path.stem)
            numbers[path.stem] = item.part_number
            stamp(path, item.id)
            store.add(
                Commit(
                    path=str(path), taken_at=1.0, label=path.stem, identity=item.id, file=path, origin=UNKNOWN
                )
            )
        send_all(store, client)
    assert store.entries() == ()
    return numbers["top"]


def opened(freecad: machines.FreeCAD, folder: Path, scratch: Path) -> object:
    """The BOM that this FreeCAD has of a project's top; no link of it is broken."""
    ((_, found),) = run_freecad(
        [str(folder / "top.FCStd")],
        command=freecad.command,
        env=freecad.profile(scratch / f"profile {folder.name}"),
    )
    assert isinstance(found, Extraction), found
    broken = {FindingCode.MISSING_FILE, FindingCode.MISSING_OBJECT}
    assert not [finding for finding in found.findings if finding.code in broken]
    assert found.entries
    return answers.bom_of(found.entries, str(folder))
