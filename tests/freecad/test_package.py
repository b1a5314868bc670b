# SPDX-License-Identifier: LGPL-2.1-or-later
"""package.xml, as each FreeCAD and its Addon Manager read it; and the add-on as a clone of the repository."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
from freecad_cases.machines import MOSTLY_ENDS, MOSTLY_NEWEST, REPOSITORY, WANTED, need, wheel, wheels_of
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
    freecad.must_run(SCRIPT, {**freecad.profile(folder / "home"), **env}, cwd=folder)
    told = json.loads(out.read_text())
    assert isinstance(told, dict)
    return {**told, "version": request.param}


def test_freecad_reads_what_we_mean(read: dict[str, Any]) -> None:
    """Its own parser is lenient: what it does not understand is silently empty."""
    told = read["freecad"]
    assert (told["name"], told["license"], told["freecad_min"]) == ("Silo", "LGPL-2.1-or-later", "0.20.0")
    assert told["supports"]
    # No address of the project is public yet, and none is invented.
    assert told["urls"] == []
    assert read["version"] == "0.20" or re.fullmatch(r"\d{4}-\d\d-\d\d", told["date"])
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
    needed, optional = (sorted(FREECAD_PACKAGES), ["keyring", "sseclient-py"])
    if read["version"] == "0.20":
        needed, optional = (sorted(needed + optional), [])
    assert told["python"] == read["freecad"]["depend"] == needed
    assert read["freecad"]["optional"] == optional
    assert told["others"] == []


@pytest.mark.parametrize("version", MOSTLY_NEWEST)
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


def installed(
    program: Sequence[str], freecadcmd: str, env: Mapping[str, str]
) -> subprocess.CompletedProcess[str]:
    """Run ``silo-mod install-addon``, without an index of packages."""
    return subprocess.run(
        [*program, "install-addon", "--json", "--freecadcmd", freecadcmd],
        capture_output=True,
        text=True,
        env={**os.environ, "PIP_NO_INDEX": "1", **env},
        check=False,
    )


@pytest.mark.parametrize("version", MOSTLY_NEWEST)
def test_packages_for_another_python_are_no_success(version: str, tmp_path: Path) -> None:
    """pip does not see it, so install-addon ends with an import inside FreeCAD."""
    freecad = need(version)
    for name in FREECAD_PACKAGES:
        wheel(tmp_path, name, "2.99", "raise ImportError('made for another Python')")
    env = {**freecad.profile(tmp_path / "home"), "SILO_HOME": str(tmp_path / "silo")}
    program = [sys.executable, "-m", "silo.cli.main"]
    run = installed(program, freecad.command, {**env, "PIP_FIND_LINKS": str(tmp_path)})
    assert run.returncode == 2
    assert "FreeCAD cannot import them: requests: ImportError: made for another Python" in run.stderr


@pytest.fixture(name="from_wheel", scope="module")
def _from_wheel(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """``silo-mod`` as the wheel has it, in a folder of its own."""
    folder = tmp_path_factory.mktemp("wheel")
    source, site = folder / "source", folder / "site"
    names = ("mods", "examples", "docs", "package.xml", "Init.py", "InitGui.py", "LICENSE", "README.md")
    without = shutil.ignore_patterns("__pycache__", "*.egg-info")
    source.mkdir()
    for name in (*names, "setup.py", "pyproject.toml"):
        copy = shutil.copytree if (REPOSITORY / name).is_dir() else shutil.copyfile
        copy(REPOSITORY / name, source / name, **({"ignore": without} if copy is shutil.copytree else {}))
    pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]
    build = ["wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", str(folder), str(source)]
    subprocess.run([*pip, *build], check=True)
    (made,) = folder.glob("*.whl")
    subprocess.run([*pip, "install", "--no-deps", "--no-index", "--target", str(site), str(made)], check=True)
    main = "from silo.cli.main import main; sys.exit(main(sys.argv[1:]))"
    return [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(site)!r}); {main}"]


@pytest.mark.parametrize("version", MOSTLY_ENDS)
def test_from_the_wheel_to_a_commit(version: str, from_wheel: list[str], tmp_path: Path) -> None:
    """In a clean user folder, by the window's button and by one command, to a revision in Silo."""
    wheels = tmp_path / "wheels"
    wheels.mkdir()
    with window(version, tmp_path, dependencies=False) as freecad:
        wheels_of(freecad.freecad.dependencies, wheels)
        addon = freecad.home / "Mod" / "silo-mod"
        addon.unlink()
        freecad.packages.mkdir(parents=True)

        # Without an index the add-on is there, and its packages are not.
        run = installed(from_wheel, freecad.freecad.command, freecad.environment())
        assert (run.returncode, "pip could not install" in run.stderr) == (2, True), run.stderr
        # The roots of other Debian releases have no pip; this one serves every Python that is new enough.
        pip = importlib.util.find_spec("pip")
        assert pip is not None
        assert pip.origin is not None
        shutil.copytree(Path(pip.origin).parent, tmp_path / "with-pip" / "pip")
        env = {"SILO_TEST_PIP": str(tmp_path / "with-pip"), "SILO_TEST_WHEELS": str(wheels)}
        said = freecad.run("bare.py", env={**env, "PIP_NO_INDEX": "1"})
        assert {*FREECAD_PACKAGES} <= {found.name for found in freecad.packages.iterdir()}
        shutil.rmtree(freecad.packages)
        env = {**freecad.environment(), "PIP_FIND_LINKS": str(wheels)}
        run = installed(from_wheel, freecad.freecad.command, env)
        assert run.returncode == 0, run.stderr
        told = json.loads(run.stdout)
        assert told["freecad"] == f"FreeCAD {version} with Python {freecad.freecad.python}"
        assert told["packages"] == str(freecad.packages)
        done = freecad.run("installed.py")
        with freecad.server.client() as client:
            (item,) = client.search_items("Lever")
            assert any(one.file_name for one in client.revisions(item.part_number))
    assert os.path.normpath(done["from"]) == str(addon / "mods" / "silo")
    assert len(done["committed"]) == 1

    (line,) = said["report"]
    by_hand = (
        "Silo needs the Python packages requests, pydantic. Install them with silo-mod "
        f"install-addon, or with: python{freecad.freecad.python} -m pip install --target "
        f'"{freecad.packages}" requests pydantic – then start FreeCAD again.'
    )
    assert line.endswith(by_hand)
    # And that is where this FreeCAD looks for them.
    assert said["on_path"]
    assert said["buttons"] == ["Install What Silo Needs…"]
    assert (len(said["pane"]), said["mends"]) == (1, ["Install What Silo Needs…"])
    assert "requests, pydantic" in said["pane"][0]
    assert "requests, pydantic" in said["before"][0]
    assert said["during"] == [True, False]
    assert "could not be installed: pip could not install" in said["failed"][0]
    assert said["failed"][0].endswith(by_hand)
    assert said["again"] == "Try again"
    assert said["after"] == [f"The packages are in {freecad.packages}. Start FreeCAD again to use Silo."]
    assert not said["button"]


@pytest.mark.parametrize("version", MOSTLY_NEWEST)
def test_another_package_of_our_name_is_named_in_the_pane(version: str, tmp_path: Path) -> None:
    """Ours does not start then, and says where the other one lies."""
    with window(version, tmp_path) as freecad:
        foreign = freecad.home / "Mod" / "A-foreign"
        (foreign / "silo").mkdir(parents=True)
        (foreign / "silo" / "__init__.py").touch()
        (foreign / "Init.py").write_text("import silo\n")
        said = freecad.run("foreign.py")
    (text,) = said["pane"]
    assert str(foreign / "silo") in text


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
