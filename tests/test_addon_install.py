# SPDX-License-Identifier: LGPL-2.1-or-later
"""The add-on into a FreeCAD: asked for its folders, linked or copied, a stranger's folder left alone."""

from __future__ import annotations

import io
import stat
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest

from silo.bom.errors import ConfigError, InputError
from silo.freecads.addon import Installation, ask_freecad, install_folder, install_packages
from silo.shipped_files import shipped

STAND_IN = """#!{python}
import os, runpy, sys, types
assert len(sys.argv[2]) < 200, "FreeCAD 1.1 ends at once if the text is longer"
freecad = types.ModuleType("FreeCAD")
freecad.getUserAppDataDir = lambda: {data!r}
freecad.Version = lambda: {version!r}
sys.modules["FreeCAD"] = freecad
exec(sys.argv[2])
"""


def stand_in(folder: Path, data: Path | str, version: str = "1.0") -> str:
    told = [*version.split("."), "2", "commit"]
    text = STAND_IN.format(python=sys.executable, data=str(data), version=told)
    return program(folder / "freecadcmd", text)


def program(path: Path, text: str) -> str:
    path.write_text(text, encoding="utf-8")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return str(path)


def place(tmp_path: Path) -> Installation:
    return Installation("freecadcmd", tmp_path / "data", tmp_path / "packages", (1, 0), (3, 13))


def test_freecad_is_asked_for_its_folder_and_its_python(tmp_path: Path) -> None:
    """What it answers decides; nothing is guessed from the platform."""
    found = ask_freecad(stand_in(tmp_path, "/data/FreeCAD"))
    assert (found.data, found.freecad, found.python) == (Path("/data/FreeCAD"), (1, 0), sys.version_info[:2])
    assert found.missing == {}
    assert ask_freecad(found.command, Path("/other")).data == Path("/other")


def test_a_freecad_that_fails_is_reported_in_a_sentence(tmp_path: Path) -> None:
    """Its own last words are part of it."""
    command = program(tmp_path / "freecadcmd", "#!/bin/sh\necho 'no libraries' >&2\nexit 1\n")
    with pytest.raises(ConfigError, match="no libraries"):
        ask_freecad(command)


@pytest.mark.parametrize(("version", "inside"), [("0.20", ""), ("1.1", "py{}{}".format(*sys.version_info))])
def test_packages_go_where_that_freecad_looks(tmp_path: Path, version: str, inside: str) -> None:
    """One folder for all in 0.20, one per Python since 1.0 (facts §7.3)."""
    found = ask_freecad(stand_in(tmp_path, "/data", version))
    assert found.packages == Path("/data") / "AdditionalPythonPackages" / inside


def test_the_checkout_is_linked_once(tmp_path: Path) -> None:
    """A repeat finds it there."""
    assert "now leads" in install_folder(place(tmp_path))
    assert place(tmp_path).mod.resolve() == shipped()
    assert "already" in install_folder(place(tmp_path))


def test_a_copy_is_complete_and_is_renewed(tmp_path: Path) -> None:
    """What FreeCAD's loaders want is there, and nothing of the tests."""
    install_folder(place(tmp_path), copy=True)
    (place(tmp_path).mod / "left over").touch()
    install_folder(place(tmp_path), copy=True)
    inside = {path.name for path in place(tmp_path).mod.iterdir()}
    assert inside == {"Init.py", "InitGui.py", "package.xml", "LICENSE", "README.md", "mods", "docs"}
    assert (place(tmp_path).mod / "mods" / "silo" / "workbench" / "freecad" / "host.py").is_file()


def test_a_strangers_folder_is_left_alone(tmp_path: Path) -> None:
    """It may be somebody's work."""
    place(tmp_path).mod.mkdir(parents=True)
    (place(tmp_path).mod / "notes.txt").write_text("mine", encoding="utf-8")
    for copy in (False, True):
        with pytest.raises(InputError, match="move it away"):
            install_folder(place(tmp_path), copy=copy)
    assert (place(tmp_path).mod / "notes.txt").read_text(encoding="utf-8") == "mine"


class Linkless(type(Path())):  # type: ignore[misc]
    """A folder of Windows without developer mode: it takes files, and refuses links."""

    def symlink_to(self, *_: object, **__: object) -> None:
        raise OSError("a required privilege is not held by the client")


def test_where_no_links_can_be_made_the_addon_is_copied(tmp_path: Path) -> None:
    told = install_folder(replace(place(tmp_path), data=Linkless(tmp_path / "data")))
    assert "copied" in told
    assert (place(tmp_path).mod / "mods" / "silo" / "workbench" / "freecad" / "host.py").is_file()


def test_the_folder_of_earlier_versions_goes(tmp_path: Path) -> None:
    """FreeCAD would start both. Somebody else's of that name stays."""
    old = tmp_path / "data" / "Mod" / "Silo"
    (old / "mods" / "silo" / "workbench").mkdir(parents=True)
    (old / "package.xml").touch()
    install_folder(place(tmp_path))
    assert not old.exists()
    old.mkdir()
    install_folder(place(tmp_path))
    assert old.is_dir()


PIP = """#!{python}
import pathlib, sys
words = sys.argv[1:]
if words[0] == "-c":
    print({version!r})
    sys.exit()
with open({log!r}, "a") as log:
    print(*words, file=log)
if any(word.startswith({absent!r}) for word in words):
    sys.exit("ERROR: No matching distribution found for " + words[-1])
folder = pathlib.Path(words[words.index("--target") + 1])
folder.mkdir(parents=True, exist_ok=True)
for name in ("requests", "pydantic"):
    (folder / (name + ".py")).write_text({content!r})
"""


def own_python(folder: Path, version: str, content: str = "", absent: str = "no-package") -> tuple[str, Path]:
    """A Python with a pip that notes what it is asked for, and installs modules of that content.

    absent
        the package that its index does not have.
    """
    folder.mkdir()
    log = folder / "log"
    log.touch()
    text = PIP.format(python=sys.executable, version=version, log=str(log), content=content, absent=absent)
    return program(folder / "python3", text), log


HERE = "{} {}".format(*sys.version_info)


def test_packages_are_installed_by_freecads_own_python(tmp_path: Path) -> None:
    """It knows its processor; one of another version would bring packages that FreeCAD cannot load."""
    other, told_other = own_python(tmp_path / "other", "3 99")
    own, told = own_python(tmp_path / "own", HERE)
    found = ask_freecad(stand_in(tmp_path, tmp_path / "data"))
    found = replace(found, pythons=(other, own), missing={"pydantic": "No module named 'pydantic'"})
    assert install_packages(found) == str(found.packages)
    assert told_other.read_text() == ""
    assert told.read_text().split() == [
        *("-m", "pip", "install", "--quiet", "--target", str(found.packages), "pydantic>=2.10")
    ]


def test_what_is_there_is_replaced_only_if_nobody_can_use_it(tmp_path: Path) -> None:
    """Other add-ons use the same folder."""
    own, told = own_python(tmp_path / "own", HERE)
    found = replace(ask_freecad(stand_in(tmp_path, tmp_path / "data")), pythons=(own,))
    (found.packages / "pydantic").mkdir(parents=True)
    assert install_packages(found) == str(found.packages)
    assert told.read_text() == "", "nothing is missing"
    install_packages(replace(found, missing={"requests": "No module named 'requests'"}))
    assert "--upgrade" not in told.read_text()
    install_packages(replace(found, missing={"pydantic": "No module named 'pydantic_core._pydantic_core'"}))
    assert "--upgrade" in told.read_text()


def test_success_is_an_import_inside_freecad(tmp_path: Path) -> None:
    """pip ended well, and FreeCAD says why it does not help."""
    own, _ = own_python(tmp_path / "own", HERE, "raise ImportError('made for another Python')")
    found = replace(ask_freecad(stand_in(tmp_path, tmp_path / "data")), pythons=(own,))
    command = Path(found.command)
    bare = "sys.path[:] = [entry for entry in sys.path if 'site-packages' not in entry]\nexec(sys.argv[2])"
    command.write_text(command.read_text().replace("exec(sys.argv[2])", bare))
    with pytest.raises(ConfigError, match=r"FreeCAD cannot import them: .*made for another Python"):
        install_packages(replace(found, missing={"requests": ""}))


def missing_here(tmp_path: Path, *names: str, absent: str) -> Installation:
    """A FreeCAD that lacks these packages; its pip does not find ``absent``."""
    own, _ = own_python(tmp_path / "own", HERE, absent=absent)
    found = ask_freecad(stand_in(tmp_path, tmp_path / "data"))
    return replace(found, pythons=(own,), missing=dict.fromkeys(names, "ModuleNotFoundError"))


def test_an_optional_package_that_is_not_found_keeps_no_needed_one_back(tmp_path: Path) -> None:
    """The needed ones are there; what is not there is reported, with what that means."""
    found = missing_here(tmp_path, "requests", "pydantic", "sseclient", absent="sseclient-py")
    with pytest.raises(ConfigError, match=r"could not install sseclient-py\S+ for Python .* no live events$"):
        install_packages(found)
    assert {path.name for path in found.packages.iterdir()} == {"requests.py", "pydantic.py"}


def test_without_a_needed_package_nothing_else_is_tried(tmp_path: Path) -> None:
    found = missing_here(tmp_path, "requests", "pydantic", "sseclient", absent="pydantic")
    with pytest.raises(ConfigError, match=r"could not install requests\S+ pydantic\S+ for Python [^;]*$"):
        install_packages(found)
    assert not found.packages.exists()


def test_an_archive_of_the_repository_is_small(tmp_path: Path) -> None:
    """FreeCAD's Addon Manager fetches it; what only developers need stays out."""
    root = Path(__file__).resolve().parents[1]
    if not (root / ".git").exists():
        pytest.skip("not a checkout")
    command = ["git", "archive", "--format=zip", "HEAD"]
    packed = subprocess.run(command, cwd=root, capture_output=True, check=True).stdout
    # A download of a moment on a slow line. A picture or a model that was added by mistake exceeds it.
    assert len(packed) <= 3_000_000
    names = zipfile.ZipFile(io.BytesIO(packed)).namelist()
    assert {"InitGui.py", "package.xml", "mods/silo/__init__.py"} <= set(names)
    assert not [name for name in names if name.startswith(("tests/", "benchmarks/", "deploy/", "scripts/"))]
