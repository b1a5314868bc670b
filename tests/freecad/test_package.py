# SPDX-License-Identifier: LGPL-2.1-or-later
"""package.xml, as each FreeCAD and its Addon Manager read it; and the add-on as a clone of the repository."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from freecad_cases.machines import REPOSITORY, WANTED, need
from gui_cases.window import window

from silo.workbench.dependencies import NEEDED

pytestmark = [pytest.mark.freecad, pytest.mark.slow]

SCRIPT = Path(__file__).parent / "freecad_cases" / "package.py"


@pytest.fixture(name="read", scope="module", params=WANTED)
def _read(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    freecad = need(request.param)
    folder = tmp_path_factory.mktemp("package").resolve()
    out = folder / "told.json"
    env = {"SILO_TEST_PACKAGE": str(REPOSITORY / "package.xml"), "SILO_TEST_OUT": str(out)}
    run = freecad.run(SCRIPT, {**freecad.profile(folder / "home"), **env}, cwd=folder)
    assert run.returncode == 0, run.stdout
    told = json.loads(out.read_text())
    assert isinstance(told, dict)
    return told


def test_freecad_reads_what_we_mean(read: dict[str, Any]) -> None:
    """Its own parser is lenient: what it does not understand is silently empty."""
    told = read["freecad"]
    assert (told["name"], told["license"], told["freecad_min"]) == ("Silo", "LGPL-2.1-or-later", "0.20.0")
    assert told["supports"]
    name, classname, folder, icon = told["workbench"]
    assert (name, classname, folder) == ("Silo", "SiloModWorkbench", "./")
    assert told["tags"] == ["BOM", "PDM", "PLM", "assembly"]
    for path in (told["icon"], icon):
        assert (REPOSITORY / path).is_file()


def test_the_version_is_that_of_the_distribution(read: dict[str, Any]) -> None:
    """One number, wherever one looks."""
    text = (REPOSITORY / "pyproject.toml").read_text()
    assert f'version = "{read["freecad"]["version"]}"' in text


def test_the_addon_manager_knows_what_to_install(read: dict[str, Any]) -> None:
    """The packages that the add-on asks for at its start, and no other add-on."""
    told = read["manager"]
    assert told["name"] == "Silo"
    assert told["workbench"]
    assert told["python"] == read["freecad"]["depend"] == sorted(NEEDED.values())
    assert told["others"] == []


@pytest.mark.parametrize("version", WANTED)
def test_a_clone_in_mod_works(version: str, tmp_path: Path) -> None:
    """Nothing of the working folder that is not in the repository is needed."""
    if not (REPOSITORY / ".git").exists() or shutil.which("git") is None:
        pytest.skip("not a clone of the repository")
    with window(version, tmp_path) as freecad:
        clone = freecad.home / "Mod" / "Silo"
        clone.unlink()
        subprocess.run(
            ["git", "clone", "--quiet", "--no-local", "--depth", "1", f"file://{REPOSITORY}", str(clone)],
            check=True,
            env={
                **os.environ,
                "GIT_CONFIG_COUNT": "1",
                "GIT_CONFIG_KEY_0": "safe.directory",
                "GIT_CONFIG_VALUE_0": "*",
            },
        )
        said = freecad.run("clone.py")
    assert said["from"].startswith(str(clone))
    wanted = ["Origin_Commit", "Silo_BOM", "Silo_RegisterParts", "Silo_Activity"]
    assert {*wanted, "Silo_Settings"} <= set(said["commands"])
    assert [name for name in said["toolbar"] if name in wanted] == wanted
    assert said["without_icon"] == said["without_tip"] == []
    assert said["report"] == []
