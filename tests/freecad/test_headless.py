# SPDX-License-Identifier: LGPL-2.1-or-later
"""Batches with real FreeCAD and a real server: freecadcmd without our command line."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import uuid
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest
from freecad_cases import corpora, machines
from freecad_cases.machines import MOSTLY_ENDS, MOSTLY_NEWEST, REPOSITORY, WANTED, FreeCAD
from real_silo import TOKEN, Moods, RealSilo, real_silo
from server_testing import sqlite_database

from silo.api.client import SiloClient
from silo.cli.main import main
from silo.fcstd import Library
from silo_server.run import running_server

pytestmark = pytest.mark.freecad

HEADLESS_PAGE = REPOSITORY / "docs" / "headless.md"
HEADLESS = REPOSITORY / "mods" / "silo" / "workbench" / "headless.py"


@dataclass(frozen=True)
class Vault:
    """A folder with one good assembly (top.FCStd, sub.FCStd and their parts), and a server that knows it."""

    folder: Path
    client: SiloClient
    env: dict[str, str]
    numbers: dict[str, str] = field(default_factory=dict)

    def lines(self, part_of: str) -> dict[str, float]:
        """What the server's BOM of an assembly holds, by file name of the component."""
        names = {number: name for name, number in self.numbers.items()}
        lines = self.client.get_bom(self.numbers[part_of])
        return {names[line.child_part_number]: line.quantity for line in lines}


@pytest.fixture
def vault(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Iterator[Vault]:
    """The case ``link_to_assembly`` as FreeCAD 0.20 wrote it, so that every FreeCAD reads it; registered."""
    corpus = corpora.unpack(corpora.ARCHIVES / "corpus-0.20.zip", tmp_path / "corpus")
    folder = tmp_path / "vault"
    shutil.copytree(corpus.base("asm4/link_to_assembly"), folder)
    token = "silo_" + uuid.uuid4().hex
    for name in ("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME"):
        monkeypatch.setenv(name, str(tmp_path / "home"))
    with running_server(sqlite_database(tmp_path / "silo.db"), token=token) as server:
        env = {"SILO_API_URL": server.base_url, "SILO_API_TOKEN": token}
        for name, value in env.items():
            monkeypatch.setenv(name, value)
        assert main(["register", "--yes", str(folder / "top.FCStd")]) == 0
        capsys.readouterr()
        with SiloClient(server.base_url, token) as client, Library() as library:
            ids = {path.stem: library.open(path).Meta["SiloUUID"] for path in folder.glob("*.FCStd")}
            items = client.get_items_by_uuid(ids.values())
            numbers = {name: items[identity].part_number for name, identity in ids.items()}
            yield Vault(folder, client, env, numbers)


# --- freecadcmd without our command line --------------------------------------------------------------------


def headless(
    freecad: FreeCAD, vault: Vault, args: Any, tmp_path: Path, *, dependencies: bool
) -> subprocess.CompletedProcess[str]:
    profile = freecad.profile(tmp_path / f"profile-{uuid.uuid4().hex}", dependencies=dependencies)
    text = args if isinstance(args, str) else json.dumps(args)
    return freecad.run(HEADLESS, {**profile, **vault.env, "SILO_ARGS": text}, cwd=vault.folder.parent)


@pytest.mark.parametrize("version", WANTED)
def test_freecadcmd_alone_syncs_and_reports(vault: Vault, version: str, tmp_path: Path) -> None:
    """The documented line does what the command line does: reports, progress, exit code."""
    freecad = machines.need(version)
    (vault.folder / "zzz.FCStd").write_text("no zip")
    args = {"tops": ["vault"], "recursive": True, "json": "out.json", "report": "out.md"}
    done = headless(freecad, vault, args, tmp_path, dependencies=True)
    assert done.returncode == 1, done.stdout
    assert vault.lines("top") == {"sub": 1}
    assert vault.lines("sub") == {"bolt": 2, "plate": 1}
    results = json.loads((tmp_path / "out.json").read_text())["results"]
    assert {Path(one["top"]).name: one["ok"] for one in results} == {
        "bolt.FCStd": True,
        "plate.FCStd": True,
        "sub.FCStd": True,
        "top.FCStd": True,
        "zzz.FCStd": False,
    }
    assert "4 of 5 files in order" in (tmp_path / "out.md").read_text()
    assert "[5/5]" in done.stdout


# FreeCAD runs this within a function, so that what it imports is not known in methods.
DEADLY = """
import FreeCAD


class Deadly:
    def slotCreatedObject(self, obj):
        import os
        import signal

        name = obj.Document.FileName
        if "deadly" in name:
            os.kill(os.getpid(), signal.SIGSEGV)
        if "patient" in name:
            report = os.environ["SILO_WATCHED"]
            with open(report) as file, open(report + ".seen", "w") as seen:
                seen.write(file.read())


FreeCAD.addDocumentObserver(Deadly())
"""


@pytest.mark.parametrize("version", MOSTLY_ENDS)
def test_freecad_that_dies_of_a_file_loses_that_one_only(vault: Vault, version: str, tmp_path: Path) -> None:
    """The run continues in a new process, and what is done is in the reports while it runs."""
    freecad = machines.need(version)
    profile = freecad.profile(tmp_path / "profile", dependencies=True)
    deadly = tmp_path / "profile" / "Mod" / "Deadly"
    deadly.mkdir(parents=True)
    (deadly / "Init.py").write_text(DEADLY)
    for name in ("aaa deadly", "zz patient"):
        shutil.copy(vault.folder / "top.FCStd", vault.folder / f"{name}.FCStd")
    report = tmp_path / "out.json"
    args = {"tops": ["vault"], "json": "out.json", "report": "out.md"}
    env = {**profile, **vault.env, "SILO_ARGS": json.dumps(args), "SILO_WATCHED": str(report)}
    done = freecad.run(HEADLESS, env, cwd=tmp_path)
    assert done.returncode == 1, done.stdout
    results = {Path(one["top"]).stem: one for one in json.loads(report.read_text())["results"]}
    assert len(results) == 6
    told = results["aaa deadly"]["error"]["message"]
    assert told.endswith("FreeCAD died while it read this file: it crashed (SIGSEGV)")
    assert results["top"]["assemblies"][0]["status"] == "merged"
    early = json.loads((tmp_path / "out.json.seen").read_text())["results"]
    assert Path(early[0]["top"]).stem == "aaa deadly"
    assert len(early) < len(results)


@pytest.mark.parametrize(
    ("moods", "code", "words"),
    [
        (Moods(merge="missing"), 0, ("merged", "has no merge", "one by one")),
        (Moods(merge="fails"), 3, ("failed", "deadlock detected")),
    ],
    ids=["no merge", "merge fails"],
)
def test_freecadcmd_syncs_with_the_real_silo(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, moods: Moods, code: int, words: tuple[str, ...]
) -> None:
    """Both assemblies arrive in each mood, a second run changes nothing, and a failure is printed."""
    freecad = machines.need(WANTED[0])
    corpus = corpora.unpack(corpora.ARCHIVES / "corpus-0.20.zip", tmp_path / "corpus")
    folder = tmp_path / "vault"
    shutil.copytree(corpus.base("asm4/link_to_assembly"), folder)
    for name in ("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME"):
        monkeypatch.setenv(name, str(tmp_path / "home"))
    with real_silo() as silo, SiloClient(silo.url, TOKEN) as client:
        env = {"SILO_API_URL": silo.url, "SILO_API_TOKEN": TOKEN}
        for name, value in env.items():
            monkeypatch.setenv(name, value)
        assert main(["register", "--yes", str(folder / "top.FCStd")]) == 0
        silo.moods = moods
        vault, args = Vault(folder, client, env), {"tops": ["vault/top.FCStd"], "recursive": True}
        done = headless(freecad, vault, args, tmp_path, dependencies=True)
        assert done.returncode == code, done.stdout
        assert [word for word in words if word not in done.stdout] == [], done.stdout
        wanted = [1, 1, 2] if code == 0 else []
        assert quantities(silo) == wanted
        if code == 0:
            again = headless(freecad, vault, args, tmp_path, dependencies=True)
            assert (again.returncode, again.stdout.count("unchanged")) == (0, 2), again.stdout
            assert quantities(silo) == wanted


def quantities(silo: RealSilo) -> list[float]:
    """Of all BOM lines that the server holds."""
    return sorted(line["quantity"] for item in silo.items.values() for line in item.lines)


@pytest.mark.parametrize("version", MOSTLY_NEWEST)
def test_the_line_in_the_docs_works_as_it_stands(vault: Vault, version: str, tmp_path: Path) -> None:
    """Copied from docs/headless.md into a shell: it syncs the folder and writes both reports."""
    freecad = machines.need(version)
    line = re.search(r"```sh\n(SILO_ARGS=.*?)```", HEADLESS_PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert line is not None
    env = {
        **os.environ,
        **vault.env,
        **freecad.profile(tmp_path / "profile", dependencies=True),
        "SILO_MOD": str(REPOSITORY),
        "PATH": f"{Path(freecad.command).parent}:{os.environ['PATH']}",
    }
    done = subprocess.run(
        ["sh", "-c", line[1]], cwd=tmp_path, env=env, capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert vault.lines("sub") == {"bolt": 2, "plate": 1}
    assert "4 of 4 files in order" in (tmp_path / "sync.md").read_text()
    assert len(json.loads((tmp_path / "sync.json").read_text())["results"]) == 4


@pytest.mark.parametrize("version", MOSTLY_ENDS)
def test_freecadcmd_without_packages_still_writes_the_boms(
    vault: Vault, version: str, tmp_path: Path
) -> None:
    """No requests in FreeCAD's Python: one plain sentence, the BOMs as JSON, exit code 2, no traceback."""
    args = {"tops": ["vault/top.FCStd"], "json": "out.json"}
    done = headless(machines.need(version), vault, args, tmp_path, dependencies=False)
    assert done.returncode == 2, done.stdout
    assert "Traceback" not in done.stdout
    assert "has no package" in done.stdout
    (result,) = json.loads((tmp_path / "out.json").read_text())["results"]
    (entry,) = result["bom"]["entries"]
    assert (entry["object"], entry["quantity"]) == ("Sub", 1)
    assert {child["object"]: child["quantity"] for child in entry["children"]} == {"Bolt": 2, "Plate": 1}


@pytest.mark.parametrize(
    ("args", "words"),
    [
        ("nonsense", "must be a JSON object"),  # tests/workbench/test_headless.py has the other mistakes
        ('{"tops": ["empty"]}', "no FreeCAD files"),
        ('{"tops": ["vault"], "report": "no/such/folder/out.md"}', "no/such/folder"),
    ],
)
def test_a_wrong_job_is_refused_before_anything_is_done(args: str, words: str, tmp_path: Path) -> None:
    """Exit code 2 and a sentence; a job that looks into the wrong folder must not be green."""
    freecad = machines.need(WANTED[0])
    for name in ("empty", "vault"):
        (tmp_path / name).mkdir()
    (tmp_path / "vault" / "top.FCStd").touch()
    profile = freecad.profile(tmp_path / "profile", dependencies=True)
    away = {"SILO_API_URL": "http://127.0.0.1:9", "SILO_API_TOKEN": "x"}
    done = freecad.run(HEADLESS, {**profile, **away, "SILO_ARGS": args}, cwd=tmp_path)
    assert (done.returncode, words in done.stdout) == (2, True), done.stdout
    assert "Traceback" not in done.stdout


@pytest.mark.parametrize("version", MOSTLY_NEWEST)
def test_a_server_that_does_not_answer_is_told_as_such(vault: Vault, version: str, tmp_path: Path) -> None:
    """Exit code 3, and the reports are written anyway."""
    away = replace(vault, env={**vault.env, "SILO_API_URL": "http://127.0.0.1:9"})
    args = {"tops": ["vault/top.FCStd"], "json": "out.json", "report": "out.md"}
    done = headless(machines.need(version), away, args, tmp_path, dependencies=True)
    assert done.returncode == 3, done.stdout
    (result,) = json.loads((tmp_path / "out.json").read_text())["results"]
    assert result["error"]["code"] == "unreachable"
    assert "0 of 1 files in order" in (tmp_path / "out.md").read_text()
