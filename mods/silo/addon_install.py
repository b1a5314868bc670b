# SPDX-License-Identifier: LGPL-2.1-or-later
"""The add-on into a FreeCAD on this machine: its folder into ``Mod``, its packages where FreeCAD looks.

FreeCAD itself is asked where that is and which Python it has (facts §7.2, §7.3): 0.20 takes packages from
``AdditionalPythonPackages``, later ones from ``AdditionalPythonPackages/py<XY>``. The packages are chosen for
FreeCAD's Python, not for the one that runs this.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from silo.bom.errors import ConfigError, InputError
from silo.files import shipped
from silo.folders import scratch_folder
from silo.freecadcmd.run import find_freecadcmd
from silo.freecads import exchange_folder, start
from silo.platform import child_options, python_beside

# As package.xml declares them to the Addon Manager.
PACKAGES = ("requests>=2.31", "sseclient-py>=1.8", "pydantic>=2.10")
FOLDER = "Silo"

_ASK = """
import importlib.util, json, os, sys
import FreeCAD
missing = [n for n in ("requests", "sseclient", "pydantic") if importlib.util.find_spec(n) is None]
with open(os.environ["SILO_ASK_OUT"], "w", encoding="utf-8") as out:
    json.dump({"data": FreeCAD.getUserAppDataDir(), "freecad": FreeCAD.Version()[:2],
               "python": list(sys.version_info[:2]), "prefix": sys.base_exec_prefix, "missing": missing}, out)
"""
_ASK_SECONDS = 60.0
_PIP_SECONDS = 600.0


@dataclass(frozen=True)
class Place:
    """A FreeCAD: its data folder, its version and its Python's, where that Python may be started.

    ``missing``: the packages of the add-on that it does not find.
    """

    data: Path
    freecad: tuple[int, int]
    python: tuple[int, int]
    pythons: tuple[str, ...] = field(default=(), compare=False)
    missing: tuple[str, ...] = field(default=(), compare=False)

    @property
    def mod(self) -> Path:
        """Where the add-on goes."""
        return self.data / "Mod" / FOLDER

    @property
    def packages(self) -> Path:
        """Where FreeCAD finds additional Python packages."""
        base = self.data / "AdditionalPythonPackages"
        return base if self.freecad < (1, 0) else base / "py{}{}".format(*self.python)


def ask_freecad(freecadcmd: str | None = None, data: Path | None = None) -> Place:
    """Ask FreeCAD for its folders and versions. ``data`` stands for the data folder that it names."""
    command = find_freecadcmd(freecadcmd)
    shared = exchange_folder(command)
    if shared is not None:
        os.makedirs(shared, exist_ok=True)
    with scratch_folder("silo-ask-", shared) as folder:
        out = Path(folder) / "answer.json"
        try:
            env = {**os.environ, "SILO_ASK_OUT": str(out)}
            run = _run([*start(command), "-c", _ASK], _ASK_SECONDS, env=env, cwd=folder)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise ConfigError(f"{command} does not answer: {error}") from error
        if not out.is_file():
            raise ConfigError(f"{command} did not report where its folders are: {_last_words(run)}")
        told = json.loads(out.read_text(encoding="utf-8"))
    major, minor = (int(part) for part in told["freecad"])
    pythons = (*python_beside(told["prefix"]), *python_beside(os.path.dirname(os.path.realpath(command))))
    python = (told["python"][0], told["python"][1])
    return Place(data or Path(told["data"]), (major, minor), python, pythons, tuple(told["missing"]))


def _last_words(run: subprocess.CompletedProcess[str]) -> str:
    return next(iter((run.stderr or run.stdout).strip().splitlines()[-1:]), "it said nothing")


def _run(command: list[str], seconds: float, **more: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding="utf-8",
        errors="replace",
        timeout=seconds,
        check=False,
        **child_options(),
        **more,
    )


def _has_pip(python: str) -> bool:
    try:
        return (
            os.path.isfile(python) and _run([python, "-m", "pip", "--version"], _ASK_SECONDS).returncode == 0
        )
    except (OSError, subprocess.TimeoutExpired):
        return False


def _any_python() -> str:
    """A Python with pip. Inside FreeCAD, ``sys.executable`` is FreeCAD."""
    found = (sys.executable, shutil.which("python3"), shutil.which("python"), shutil.which("py"))
    for python in found:
        if python and "freecad" not in os.path.basename(python).lower() and _has_pip(python):
            return python
    raise ConfigError(
        "no Python with pip was found on this computer. Install pip (on Debian and Ubuntu: apt install "
        "python3-pip), or Python from python.org, then try again"
    )


def install_folder(place: Place, source: Path | None = None, *, copy: bool = False) -> str:
    """Link (or copy) the add-on into ``Mod``; returns what was done. A stranger's folder is left alone.

    source
        holds what FreeCAD's loaders want at its root: the checkout, or what a wheel ships, which is copied.
    """
    source = source or shipped()
    if not (source / "package.xml").is_file():
        raise InputError(f"{source} holds no package.xml; install silo-mod again")
    whole = (source / "mods" / "silo").is_dir()
    copy = copy or not whole
    target = place.mod
    if target.is_symlink() and target.resolve() == source:
        return f"{target} leads to this checkout already"
    if target.exists() or target.is_symlink():
        if not copy or target.is_symlink() or not (target / "package.xml").is_file():
            raise InputError(f"{target} is there already; move it away, then repeat")
        shutil.rmtree(target)
    target.parent.mkdir(parents=True, exist_ok=True)
    if copy:
        names = ("Init.py", "InitGui.py", "package.xml", "LICENSE", "README.md")
        target.mkdir()
        for name in names:
            shutil.copy2(source / name, target / name)
        modules = source / "mods" / "silo" if whole else Path(__file__).parent
        without = shutil.ignore_patterns("__pycache__", "shipped")
        shutil.copytree(modules, target / "mods" / "silo", ignore=without)
        if (source / "docs").is_dir():
            shutil.copytree(source / "docs", target / "docs", ignore=shutil.ignore_patterns("decisions"))
        return f"copied to {target}"
    try:
        target.symlink_to(source, target_is_directory=True)
    except OSError:  # Windows lets only administrators and developers make links
        return f"{install_folder(place, source, copy=True)} (this system makes no links)"
    return f"{target} now leads to this checkout"


def install_packages(place: Place) -> str:
    """Install what the add-on needs for FreeCAD's own Python; returns where."""
    version = "{}.{}".format(*place.python)
    if place.python < (3, 11):
        raise ConfigError(f"this FreeCAD has Python {version}; the add-on needs 3.11 or newer")
    install = ["install", "--quiet", "--upgrade", "--target", str(place.packages), *PACKAGES]
    own = next((python for python in place.pythons if _has_pip(python)), None)
    if own is not None:  # FreeCAD's own knows which packages fit it, and which processor it is made for
        command = [own, "-m", "pip", *install]
    else:
        command = [_any_python(), "-m", "pip", *install]
        command += ["--python-version", version, "--only-binary=:all:"]
    run = _run(command, _PIP_SECONDS)
    if run.returncode:
        names = ", ".join(PACKAGES)
        raise ConfigError(f"pip could not install {names} for Python {version}: {_last_words(run)}")
    return str(place.packages)
