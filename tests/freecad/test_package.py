# SPDX-License-Identifier: LGPL-2.1-or-later
"""package.xml, as each FreeCAD and its Addon Manager read it; and the add-on as a clone of the repository."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from freecad_cases.machines import REPOSITORY, WANTED, need, wheel
from gui_cases.window import window

from silo import FREECAD_PACKAGES

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
    return {**told, "version": request.param}


def test_freecad_reads_what_we_mean(read: dict[str, Any]) -> None:
    """Its own parser is lenient: what it does not understand is silently empty."""
    told = read["freecad"]
    assert (told["name"], told["license"], told["freecad_min"]) == ("Silo", "LGPL-2.1-or-later", "0.20.0")
    assert told["supports"]
    assert told["people"] == ["silo-mod contributors"] * 2
    name, classname, folder, icon = told["workbench"]
    assert (name, classname, folder) == ("Silo", "SiloModWorkbench", "./")
    assert told["tags"] == ["assembly", "bom", "pdm", "plm"]
    for path in (told["icon"], icon):
        assert (REPOSITORY / path).is_file()


def test_the_addon_manager_knows_what_to_install(read: dict[str, Any]) -> None:
    """The packages that the add-on asks for at its start, and no other add-on."""
    told = read["manager"]
    assert told["name"] == "Silo"
    assert told["workbench"]
    # 0.20 knows no optional packages, and asks for all.
    needed, optional = (sorted(FREECAD_PACKAGES), ["keyring"])
    if read["version"] == "0.20":
        needed, optional = (sorted(needed + optional), [])
    assert told["python"] == read["freecad"]["depend"] == needed
    assert read["freecad"]["optional"] == optional
    assert told["others"] == []


@pytest.mark.parametrize("version", WANTED)
def test_a_clone_in_mod_works(version: str, tmp_path: Path) -> None:
    """Nothing of the working folder that is not in the repository is needed."""
    if not (REPOSITORY / ".git").exists() or shutil.which("git") is None:
        pytest.skip("not a clone of the repository")
    with window(version, tmp_path) as freecad:
        clone = freecad.home / "Mod" / "silo-mod"
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
        # The folder of earlier versions: FreeCAD starts that as well.
        (freecad.home / "Mod" / "A-old").symlink_to(REPOSITORY, target_is_directory=True)
        said = freecad.run("clone.py")
    assert said["from"].startswith(str(clone))
    wanted = ["Origin_Commit", "Silo_BOM", "Silo_RegisterParts", "Silo_Activity"]
    assert {*wanted, "Silo_Settings"} <= set(said["commands"])
    assert [name for name in said["toolbar"] if name in wanted] == wanted
    assert said["without_icon"] == said["without_tip"] == []
    (line,) = said["report"]
    assert "Silo is installed more than once" in line
    assert f"Only {clone}" in line


@pytest.mark.parametrize("version", WANTED)
@pytest.mark.parametrize("fits", [True, False])
def test_install_addon_ends_with_an_import_inside_freecad(version: str, fits: bool, tmp_path: Path) -> None:
    """From a folder of wheels; one of them may be for another Python, which pip does not see."""
    freecad = need(version)
    for name in FREECAD_PACKAGES:
        wheel(tmp_path, name, "2.99", "" if fits else "raise ImportError('made for another Python')")
    env = {**os.environ, **freecad.profile(tmp_path / "home"), "SILO_HOME": str(tmp_path / "silo")}
    env |= {"PIP_NO_INDEX": "1", "PIP_FIND_LINKS": str(tmp_path)}
    run = subprocess.run(
        [sys.executable, "-m", "silo.cli.main", "install-addon", "--json", "--freecadcmd", freecad.command],
        capture_output=True,
        text=True,
        env=env,
        check=False,
    )
    if not fits:
        assert run.returncode == 2
        assert "FreeCAD cannot import them: requests: ImportError: made for another Python" in run.stderr
        return
    assert run.returncode == 0, run.stderr
    told = json.loads(run.stdout)
    assert told["freecad"] == f"FreeCAD {version} with Python {freecad.python}"
    assert (tmp_path / "home" / "Mod" / "silo-mod" / "package.xml").is_file()
    assert (Path(told["packages"]) / "requests" / "__init__.py").is_file()


SMOKE = """
import importlib.util, json, os, sys, unittest
import FreeCAD
found = [name for name in FreeCAD.__unit_test__ if name.startswith("silo.")]
ran = unittest.TextTestRunner(stream=sys.stdout).run(unittest.defaultTestLoader.loadTestsFromNames(found))
names = ("tests", "docs", "scripts", "benchmarks")
importable = [name for name in names if importlib.util.find_spec(name)]
with open(os.environ["SILO_TEST_OUT"], "w") as out:
    told = {"modules": found, "ran": ran.testsRun, "fine": ran.wasSuccessful()}
    json.dump({**told, "importable": importable}, out)
"""


@pytest.mark.parametrize("version", WANTED)
def test_freecads_test_runner_finds_the_smoke_set(version: str, tmp_path: Path) -> None:
    """And nothing else of the add-on's folder is importable."""
    freecad = need(version)
    env = freecad.profile(tmp_path / "home", dependencies=True)
    (tmp_path / "home" / "Mod").mkdir()
    (tmp_path / "home" / "Mod" / "silo-mod").symlink_to(REPOSITORY, target_is_directory=True)
    script, out = tmp_path / "smoke.py", tmp_path / "out.json"
    script.write_text(SMOKE)
    run = freecad.run(script, {**env, "SILO_TEST_OUT": str(out)}, cwd=tmp_path)
    assert out.is_file(), run.stdout
    told = json.loads(out.read_text())
    assert told == {"modules": ["silo.workbench.smoke"], "ran": 2, "fine": True, "importable": []}, run.stdout
