# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod doctor`` on this machine: what is where, and a remedy for what is not in order."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import pytest

from silo.cli.main import main
from silo.platform.user_folders import cache_folder, config_folder, data_folder

FREECAD = """#!{python}
import json, os
with open(os.environ["SILO_OUT"], "w", encoding="utf-8") as out:
    json.dump({{"data": {data!r}, "packages": {data!r} + "/packages", "freecad": [1, 1], "python": [3, 13],
               "prefix": "/nowhere", "missing": {missing!r}, "constraints": ""}}, out)
"""


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A user without configuration, server and FreeCAD."""
    monkeypatch.setenv("SILO_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("HOME", str(tmp_path))
    for name in ("SILO_API_URL", "SILO_API_TOKEN", "SILO_FREECADCMD"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    return tmp_path / "home"


def freecad(folder: Path, monkeypatch: pytest.MonkeyPatch, missing: dict[str, str] | None = None) -> Path:
    command, data = folder / "freecadcmd", folder / "FreeCAD"
    command.write_text(FREECAD.format(python=sys.executable, data=str(data), missing=missing or {}))
    command.chmod(0o755)
    monkeypatch.setenv("SILO_FREECADCMD", str(command))
    return data


def seen(capsys: pytest.CaptureFixture[str]) -> dict[str, str]:
    assert main(["doctor", "--json"]) == 2  # there is no server
    found: dict[str, str] = json.loads(capsys.readouterr().out)
    return found


def test_it_says_where_each_part_looks(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Also where no server is configured: that is one line among the others."""
    found = seen(capsys)
    assert found["configuration"].startswith(str(home / "config" / "config.toml"))
    assert (found["data"], found["cache"]) == (str(home / "data"), str(home / "cache"))
    assert "silo-mod serve" in found["address"]
    assert f"Python {sys.version.split()[0]}" in found["silo-mod"]
    assert not home.exists()


def test_a_folder_that_cannot_be_made_is_named(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    home.write_text("a file in the way")
    assert main(["doctor"]) == 2
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("✗")]
    assert [line.split()[1] for line in lines] == ["configuration", "data", "cache", "address"]
    assert f"{home} is no folder that you can write to; SILO_HOME names another one" in lines[1]


def test_a_damaged_configuration_hides_nothing_else(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (home / "config").mkdir(parents=True)
    (home / "config" / "config.toml").write_text("[server\n")
    found = seen(capsys)
    assert "cannot be read" in found["configuration"]
    assert found["data"] == str(home / "data")


@pytest.mark.usefixtures("needs_modes")
def test_the_add_on_and_its_packages(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    data = freecad(tmp_path, monkeypatch)
    found = seen(capsys)
    assert found["FreeCAD"] == f"{os.environ['SILO_FREECADCMD']}: 1.1, Python 3.13"
    assert found["add-on"] == f"not in {data / 'Mod' / 'silo-mod'}: `silo-mod install-addon` puts it there"
    (data / "Mod" / "silo-mod").mkdir(parents=True)
    assert seen(capsys)["add-on"] == str(data / "Mod" / "silo-mod")
    freecad(tmp_path, monkeypatch, {"pydantic": "ImportError: it is for another Python"})
    assert seen(capsys)["add-on"].endswith(
        "without pydantic (ImportError: it is for another Python): `silo-mod install-addon` installs it"
    )


@pytest.mark.parametrize(
    "dies",
    ["kill -SEGV $$", "echo Program received signal SIGSEGV, Segmentation fault.; echo '#0 0x7f'; exit 1"],
)
def test_a_freecad_that_crashes_is_named_as_the_culprit(
    dies: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """By the signal, or as FreeCAD itself reports it; nothing is installed then, nor if there is none."""
    data = freecad(tmp_path, monkeypatch)
    Path(os.environ["SILO_FREECADCMD"]).write_text(f"#!/bin/sh\necho 'Illegal storage access'\n{dies}\n")
    words = "it crashed (SIGSEGV). It said: Illegal storage access"
    assert seen(capsys)["FreeCAD"].endswith(words)
    assert main(["install-addon"]) == 2
    assert capsys.readouterr().err.strip().endswith(words)
    assert not data.exists()
    monkeypatch.setenv("SILO_FREECADCMD", str(tmp_path / "nowhere"))
    assert "cannot be run" in seen(capsys)["FreeCAD"]


def test_another_distribution_with_our_import_name_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """There is one of that name; its files and ours would lie in one folder."""
    info = tmp_path / "silo-9.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: silo\nVersion: 9\n")
    (info / "top_level.txt").write_text("silo\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert "silo also has a package named silo" in seen(capsys)["silo-mod"]


def test_clean_deletes_what_is_remembered_and_no_more(run: Any, gearbox: Path) -> None:
    """The next run reads the files afresh. Commits that wait and the configuration stay, also where the same
    folder has all of it, as on Windows.
    """
    assert run("bom", gearbox.parent).code == 0
    assert any(cache_folder().rglob("*"))
    kept = [data_folder() / "outbox.sqlite3", config_folder() / "config.toml"]
    kept += [cache_folder() / "outbox.sqlite3", cache_folder() / "revisions" / "A" / "Top.FCStd"]
    for path in kept:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    done = run("doctor", "--clean")
    assert (done.code, "deleted" in done.out) == (0, True)
    assert not list(cache_folder().glob("documents.sqlite3*"))
    assert all(path.is_file() for path in kept)
    assert run("bom", gearbox.parent).code == 0
    assert run("doctor", "--clean").code == 0
