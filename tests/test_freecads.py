# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where FreeCADs lie, on disks that look like those of each platform."""

from __future__ import annotations

from pathlib import Path

import pytest

from silo.bom.errors import InputError
from silo.files import documents_in
from silo.freecads.places import cache_folders, commands, exchange_folder, material_folders


def program(path: Path) -> str:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.touch()
    path.chmod(0o755)
    return str(path)


def folder(path: Path) -> Path:
    path.mkdir(parents=True)
    return path


def test_windows_for_all_users_and_for_one(tmp_path: Path) -> None:
    """The newest version first: 1.10 is newer than 1.9."""
    everybody, own, roaming = tmp_path / "Program Files", tmp_path / "Local", tmp_path / "Roaming"
    env = {"PROGRAMFILES": str(everybody), "LOCALAPPDATA": str(own), "APPDATA": str(roaming), "PATH": ""}
    wanted = [
        program(everybody / "FreeCAD 1.10" / "bin" / "freecadcmd.exe"),
        program(everybody / "FreeCAD 1.9" / "bin" / "freecadcmd.exe"),
        program(own / "Programs" / "FreeCAD 1.1" / "bin" / "freecadcmd.exe"),
    ]
    assert list(commands(env, "win32")) == wanted
    cards = [
        folder(everybody / "FreeCAD 1.10" / "data" / "Mod" / "Material"),
        folder(own / "Programs" / "FreeCAD 1.1" / "data" / "Mod" / "Material"),
        folder(roaming / "FreeCAD" / "Material"),
        folder(roaming / "FreeCAD" / "v1-1" / "Material"),
    ]
    assert list(material_folders(env, "win32")) == cards


def test_macos_bundles_of_the_system_and_of_the_user(tmp_path: Path) -> None:
    home = tmp_path / "home"
    env = {"HOME": str(home), "PATH": ""}
    inside = Path("FreeCAD.app", "Contents", "Resources")
    wanted = [
        program(tmp_path / "Applications" / inside / "bin" / "freecadcmd"),
        program(home / "Applications" / inside / "bin" / "freecadcmd"),
    ]
    assert list(commands(env, "darwin", tmp_path)) == wanted
    cards = [
        folder(tmp_path / "Applications" / inside / "share" / "Mod" / "Material"),
        folder(home / "Library" / "Application Support" / "FreeCAD" / "v1-1" / "Material"),
    ]
    assert list(material_folders(env, "darwin", tmp_path)) == cards


def test_linux_packages_snap_and_flatpak(tmp_path: Path) -> None:
    home = tmp_path / "home"
    env = {"HOME": str(home), "PATH": str(tmp_path / "path")}
    wanted = [
        program(tmp_path / "path" / "freecadcmd"),
        program(tmp_path / "snap" / "bin" / "freecad.cmd"),
        program(tmp_path / "var/lib/flatpak/exports/bin/org.freecad.FreeCAD"),
        program(home / "Applications" / "FreeCAD_1.10.0-Linux-x86_64-py311.AppImage"),
        program(home / "Applications" / "FreeCAD_1.9.2-Linux-x86_64-py311.AppImage"),
    ]
    assert list(commands(env, "linux", tmp_path)) == wanted
    flatpak = tmp_path / "var/lib/flatpak/app/org.freecad.FreeCAD/current/active/files"
    cards = [
        folder(tmp_path / "usr" / "share" / "freecad" / "Mod" / "Material"),
        folder(flatpak / "Mod" / "Material"),
        folder(home / ".local" / "share" / "FreeCAD" / "v1-2" / "Material"),
        folder(home / ".local" / "share" / "FreeCAD" / "v1-1" / "Material"),
    ]
    assert list(material_folders(env, "linux", tmp_path)) == cards


@pytest.mark.parametrize("platform", ["win32", "darwin", "linux"])
def test_nothing_is_there(tmp_path: Path, platform: str) -> None:
    env = {"HOME": str(tmp_path), "PATH": ""}
    assert list(commands(env, platform, tmp_path)) == []
    assert list(material_folders(env, platform, tmp_path)) == []


@pytest.mark.usefixtures("needs_modes")
def test_what_cannot_be_started_is_no_command(tmp_path: Path) -> None:
    Path(program(tmp_path / "snap" / "bin" / "freecad.cmd")).chmod(0o644)
    assert list(commands({"HOME": str(tmp_path), "PATH": ""}, "linux", tmp_path)) == []


def test_snap_and_flatpak_see_only_a_part_of_the_disk() -> None:
    env = {"HOME": "/home/d"}
    assert exchange_folder("/usr/bin/freecadcmd", env) is None
    assert exchange_folder("/snap/bin/freecad.cmd", env) == "/home/d/snap/freecad/common"
    command = "/var/lib/flatpak/exports/bin/org.freecad.FreeCAD"
    assert exchange_folder(command, env) == "/home/d/.var/app/org.freecad.FreeCAD/cache"


def test_a_pattern_that_the_shell_left_alone_is_taken_here(tmp_path: Path) -> None:
    """cmd and PowerShell hand ``*.FCStd`` over as it is."""
    for name in ("b.FCStd", "a.FCStd", "[1].FCStd", "c.txt"):
        (tmp_path / name).touch()
    names = [str(tmp_path / name) for name in ("[1].FCStd", "a.FCStd", "b.FCStd")]
    assert documents_in([str(tmp_path / "*.FCStd")]) == names
    # A file whose name looks like a pattern is that file; a pattern that fits nothing is named in the error.
    assert documents_in([names[0]]) == names[:1]
    with pytest.raises(InputError, match=r"\*\.stl: there is no such"):
        documents_in([str(tmp_path / "*.stl")])


def test_cache_folders_of_each_platform(tmp_path: Path) -> None:
    """The user's own settings first; only folders that are there."""
    home, moved = tmp_path / "home", tmp_path / "moved"
    end = Path("FreeCAD", "Cache")
    env = {"HOME": str(home), "LOCALAPPDATA": str(tmp_path / "Local"), "TEMP": str(tmp_path / "Temp")}
    windows = [folder(tmp_path / "Local" / "cache" / end), folder(tmp_path / "Temp" / end)]
    assert list(cache_folders(env, "win32")) == windows
    macos = [folder(home / "Library" / "Caches" / end)]
    assert list(cache_folders(env, "darwin")) == macos
    linux = [
        folder(home / ".cache" / end),
        folder(home / ".var" / "app" / "org.freecad.FreeCAD" / "cache" / end),
        folder(home / "snap" / "freecad" / "common" / ".cache" / end),
    ]
    assert list(cache_folders(env, "linux")) == linux
    own = [folder(moved / "temp"), folder(tmp_path / "xdg" / end)]
    env |= {"FREECAD_USER_HOME": str(moved), "XDG_CACHE_HOME": str(tmp_path / "xdg")}
    assert list(cache_folders(env, "linux")) == [*own, *linux]
    env |= {"FREECAD_USER_TEMP": str(folder(tmp_path / "own"))}
    assert list(cache_folders(env, "linux")) == [tmp_path / "own", *own, *linux]
