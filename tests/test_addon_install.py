# SPDX-License-Identifier: LGPL-2.1-or-later
"""The add-on into a FreeCAD: asked for its folders, linked or copied, a stranger's folder left alone."""

from __future__ import annotations

import stat
import sys
from pathlib import Path

import pytest

from silo.addon_install import Place, ask_freecad, install_folder, install_packages
from silo.bom.errors import ConfigError, InputError
from silo.files import shipped

STAND_IN = """#!{python}
import sys, types
freecad = types.ModuleType("FreeCAD")
freecad.getUserAppDataDir = lambda: {data!r}
freecad.Version = lambda: ["1", "0", "2", "commit"]
sys.modules["FreeCAD"] = freecad
exec(sys.argv[2])
"""


def program(path: Path, text: str) -> str:
    path.write_text(text, encoding="utf-8")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return str(path)


def place(tmp_path: Path) -> Place:
    return Place(tmp_path / "data", (1, 0), (3, 13))


def test_freecad_is_asked_for_its_folder_and_its_python(tmp_path: Path) -> None:
    """What it answers decides; nothing is guessed from the platform."""
    command = program(tmp_path / "freecadcmd", STAND_IN.format(python=sys.executable, data="/data/FreeCAD"))
    found = ask_freecad(command)
    assert found == Place(Path("/data/FreeCAD"), (1, 0), sys.version_info[:2])
    assert ask_freecad(command, Path("/other")).data == Path("/other")


def test_a_freecad_that_fails_is_reported_in_a_sentence(tmp_path: Path) -> None:
    """Its own last words are part of it."""
    command = program(tmp_path / "freecadcmd", "#!/bin/sh\necho 'no libraries' >&2\nexit 1\n")
    with pytest.raises(ConfigError, match="no libraries"):
        ask_freecad(command)


@pytest.mark.parametrize(
    ("freecad", "folder"),
    [((0, 20), "AdditionalPythonPackages"), ((1, 1), "AdditionalPythonPackages/py314")],
)
def test_packages_go_where_that_freecad_looks(freecad: tuple[int, int], folder: str) -> None:
    """One folder for all in 0.20, one per Python since 1.0 (facts §7.3)."""
    assert Place(Path("/data"), freecad, (3, 14)).packages == Path("/data") / folder


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
    told = install_folder(Place(Linkless(tmp_path / "data"), (1, 0), (3, 13)))
    assert "copied" in told
    assert (place(tmp_path).mod / "mods" / "silo" / "workbench" / "freecad" / "host.py").is_file()


def test_packages_are_installed_by_freecads_own_python(tmp_path: Path) -> None:
    """It knows its processor and version; any other Python would have to be named."""
    log = tmp_path / "log"
    own = program(tmp_path / "python3", f'#!/bin/sh\necho "$*" >> {log}\n')
    found = Place(tmp_path / "data", (1, 1), (3, 11), (str(tmp_path / "none"), own))
    assert install_packages(found) == str(found.packages)
    asked, installed = log.read_text().splitlines()
    assert asked == "-m pip --version"
    assert f"--target {found.packages}" in installed
    assert "--python-version" not in installed
