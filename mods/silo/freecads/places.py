# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where FreeCADs lie on Windows, macOS and Linux: the command, material cards, caches, folders they read.

Gathered from FreeCAD's installers and packages (the Windows installer for all users or for one, the bundle
for macOS, Debian, conda, Snap, Flatpak). Of several versions the newest comes first. Standard library only.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path

from silo.platform.spelling import Spelling
from silo.platform.system import NAME

_COMMANDS = ("freecadcmd", "FreeCADCmd", "freecadcmd-daily", "freecad.cmd")
_FLATPAK = "org.freecad.FreeCAD"
_ROOT = Path("/")
_MOVED_CACHES = (("FREECAD_USER_TEMP", ""), ("FREECAD_USER_HOME", "temp"))
_WINDOWS_CACHES = (("LOCALAPPDATA", "/cache"), ("TEMP", ""))
_APPIMAGES = ("~/Applications", "~/AppImages", "~/.local/bin", "/opt")
_BUNDLES = ("/Applications", "~/Applications")


def commands(env: Mapping[str, str] = os.environ, platform: str = NAME, root: Path = _ROOT) -> Iterator[str]:
    """Yield every ``freecadcmd`` that can be started here, those on the PATH first. ``root``: the root of the
    disk.
    """
    on_path = (shutil.which(name, path=env.get("PATH")) for name in _COMMANDS)
    elsewhere = (str(path) for path in _matching(env, root, *_command_places(env, platform)))
    # Windows and macOS find one program under two of these names.
    real, seen = Spelling().real, set()
    for command_path in (*filter(None, on_path), *elsewhere):
        if os.access(command_path, os.X_OK) and real(command_path) not in seen:
            seen.add(real(command_path))
            yield command_path


def _command_places(env: Mapping[str, str], platform: str) -> tuple[str, ...]:
    if platform == "win32":
        return tuple(f"{base}/bin/{name}.exe" for base in _windows(env) for name in _COMMANDS[:2])
    if platform == "darwin":
        return tuple(f"{base}/FreeCAD*.app/Contents/Resources/bin/freecadcmd" for base in _BUNDLES)
    return (
        "/snap/bin/freecad.cmd",
        "/usr/local/bin/freecadcmd",
        "~/.local/bin/freecadcmd",
        *(f"{base}/exports/bin/{_FLATPAK}" for base in _flatpak_bases()),
        *(f"{folder}/FreeCAD*.AppImage" for folder in _APPIMAGES),
    )


def start(command: str) -> list[str]:
    """Return the command line that starts FreeCAD without its window; for some packages that is more than a
    path.
    """
    name = os.path.basename(command)
    if name.casefold().endswith(".appimage"):
        return [command, "freecadcmd"]  # an AppImage runs the program that its first argument names
    if name == _FLATPAK:
        return ["flatpak", "run", "--die-with-parent", "--command=FreeCADCmd", _FLATPAK]
    return [command]


def material_folders(
    env: Mapping[str, str] = os.environ, platform: str = NAME, root: Path = _ROOT
) -> Iterator[Path]:
    """Yield folders with material cards: FreeCAD's own, then the user's. ``root``: the root of the disk."""
    if platform == "win32":
        shipped = [f"{base}/{data}Mod/Material" for base in _windows(env) for data in ("data/", "")]
        own = ["{APPDATA}/FreeCAD"]
    elif platform == "darwin":
        inside = ("share/Mod", "data/Mod", "Mod")
        shipped = [f"{b}/FreeCAD*.app/Contents/Resources/{m}/Material" for b in _BUNDLES for m in inside]
        own = ["~/Library/Application Support/FreeCAD", "~/Library/Preferences/FreeCAD"]
    else:
        bases = (
            "/usr/share/freecad",
            "/usr/lib/freecad",
            "/usr/local/share/freecad",
            "/usr/lib/freecad-daily",
        )
        packed = (
            "/snap/freecad/current/usr/share/freecad",
            *(f"{base}/app/{_FLATPAK}/current/active/files" for base in _flatpak_bases()),
            *(f"{base}/app/{_FLATPAK}/current/active/files/share/freecad" for base in _flatpak_bases()),
        )
        shipped = [f"{base}/Mod/Material" for base in (*bases, *packed)]
        own = ["~/.local/share/FreeCAD", f"~/.var/app/{_FLATPAK}/data/FreeCAD", "~/snap/freecad/common"]
    yield from _matching(env, root, *shipped)
    # FreeCAD 1.1 keeps a folder of the user for each version.
    yield from _matching(env, root, *(f"{folder}/{part}Material" for folder in own for part in ("", "v*/")))


def cache_folders(env: Mapping[str, str] = os.environ, platform: str = NAME) -> Iterator[Path]:
    """Yield the cache folders of this user's FreeCADs."""
    # Both are used as they are; the others get a folder for the program (App/ApplicationDirectories).
    moved = [Path(env[name], part) for name, part in _MOVED_CACHES if env.get(name)]
    yield from (folder for folder in moved if folder.is_dir())
    if platform == "win32":
        bases = [f"{{{name}}}{part}" for name, part in _WINDOWS_CACHES if env.get(name)]
    elif platform == "darwin":
        bases = ["~/Library/Caches"]
    else:
        bases = ["{XDG_CACHE_HOME}"] if env.get("XDG_CACHE_HOME") else []
        bases += ["~/.cache", f"~/.var/app/{_FLATPAK}/cache", "~/snap/freecad/common/.cache"]
    yield from _matching(env, _ROOT, *(f"{base}/FreeCAD/Cache" for base in bases))


def exchange_folder(command: str, env: Mapping[str, str] = os.environ) -> str | None:
    """Return the folder in which a FreeCAD can see our files; None if it sees any temporary folder.

    Under Snap and Flatpak, a program has its own ``/tmp`` and sees only a part of the user's home.
    """
    real = os.path.realpath(command)
    home = Path(env.get("HOME") or Path.home())
    if command.startswith(("/snap/", "/var/lib/snapd/")) or os.path.basename(real) == "snap":
        return str(home / "snap" / "freecad" / "common")
    if os.path.basename(command) == _FLATPAK or "flatpak" in command or "flatpak" in real:
        return str(home / ".var" / "app" / _FLATPAK / "cache")
    return None


def _windows(env: Mapping[str, str]) -> list[str]:
    """Find programs that are installed for all users, or for one."""
    roots = [name for name in ("PROGRAMFILES", "PROGRAMW6432", "LOCALAPPDATA") if env.get(name)]
    places = [f"{{{name}}}" for name in roots]
    places += ["{LOCALAPPDATA}/Programs"] if "LOCALAPPDATA" in roots else []
    return [f"{place}/FreeCAD*" for place in places]


def _flatpak_bases() -> tuple[str, str]:
    return "/var/lib/flatpak", "~/.local/share/flatpak"


def _matching(env: Mapping[str, str], root: Path, *patterns: str) -> Iterator[Path]:
    """Yield the existing paths that match, each once; those of one pattern with the newest version first."""
    seen = set()
    for pattern in patterns:
        for path in sorted(_glob(env, root, pattern), key=_version, reverse=True):
            if path not in seen:
                seen.add(path)
                yield path


def _glob(env: Mapping[str, str], root: Path, pattern: str) -> Iterator[Path]:
    first, *rest = pattern.split("/")
    if first == "~":
        base = Path(env.get("HOME") or Path.home())
    elif first.startswith("{"):
        base = Path(env.get(first.strip("{}")) or os.devnull)
    else:
        base = root
    return base.glob("/".join(rest))


def _version(path: Path) -> list[tuple[int, ...]]:
    return [tuple(map(int, re.findall(r"\d+", part))) for part in path.parts]
