# SPDX-License-Identifier: LGPL-2.1-or-later
"""The add-on into a FreeCAD on this machine: its folder into ``Mod``, its packages where FreeCAD looks.

FreeCAD itself is asked where that is and which Python it has (facts §7.2, §7.3): 0.20 takes packages from
``AdditionalPythonPackages``, later ones from ``AdditionalPythonPackages/py<XY>``. The packages are chosen for
FreeCAD's Python, not for the one that runs this, and FreeCAD imports them before this reports success.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from silo import FREECAD_PACKAGES, OPTIONAL_PACKAGES
from silo.bom.errors import ConfigError, InputError
from silo.bom.message import joined, message
from silo.freecads.run import ask_inside, find_freecadcmd
from silo.platform.processes import child_options, python_beside
from silo.platform.whole_files import remove_patiently
from silo.shipped_files import shipped

# The Addon Manager's name for it, so that there is only one folder; and the earlier name.
FOLDER, OLD_FOLDER = "silo-mod", "Silo"

ALL_PACKAGES = FREECAD_PACKAGES | OPTIONAL_PACKAGES

_ASK = """
import importlib, json, os, sys
import FreeCAD
version = [int(part) for part in FreeCAD.Version()[:2]]
data = os.environ["SILO_ASK_DATA"] or FreeCAD.getUserAppDataDir()
packages = os.path.join(data, "AdditionalPythonPackages")
if version >= [1, 0]:
    packages = os.path.join(packages, "py%d%d" % sys.version_info[:2])
if packages not in sys.path:
    sys.path.append(packages)
missing = {}
for name in os.environ["SILO_ASK_NAMES"].split():
    try:
        importlib.import_module(name)
    except Exception as error:
        missing[name] = "%s: %s" % (type(error).__name__, error)
try:
    from addonmanager_freecad_interface import Preferences
    constraints = Preferences().get("pip_constraints_path") or ""
except Exception:
    constraints = ""
with open(os.environ["SILO_OUT"], "w", encoding="utf-8") as out:
    json.dump({"data": data, "packages": packages, "freecad": version, "python": sys.version_info[:2],
               "prefix": sys.base_exec_prefix, "missing": missing, "constraints": constraints}, out)
"""
_ASK_SECONDS, _PIP_SECONDS = 60.0, 600.0


@dataclass(frozen=True)
class Installation:
    """A FreeCAD: how it is started, its data folder, its folder for packages, its version and its Python's.

    pythons
        where that Python may be started.
    missing
        import name of a package that the add-on needs → what importing it inside FreeCAD says.
    constraints
        where FreeCAD's add-on manager has its list of versions that go together; "" without one.
    """

    command: str
    data: Path
    packages: Path
    freecad: tuple[int, int]
    python: tuple[int, int]
    pythons: tuple[str, ...] = ()
    missing: Mapping[str, str] = field(default_factory=dict)
    constraints: str = ""

    @property
    def mod(self) -> Path:
        """Return the folder into which the add-on is installed."""
        return self.data / "Mod" / FOLDER


def ask_freecad(freecadcmd: str | None = None, data: Path | None = None) -> Installation:
    """Ask FreeCAD for its folders and versions, and let it import what the add-on needs. Raises ConfigError.

    data
        replaces the data folder that FreeCAD names.
    """
    command = find_freecadcmd(freecadcmd)
    env = {"SILO_ASK_DATA": str(data or ""), "SILO_ASK_NAMES": " ".join(ALL_PACKAGES)}
    answer = ask_inside(command, _ASK, env)
    (major, minor), python = answer["freecad"], answer["python"]
    return Installation(
        command,
        Path(answer["data"]),
        Path(answer["packages"]),
        (major, minor),
        (python[0], python[1]),
        (*python_beside(answer["prefix"]), *python_beside(os.path.dirname(os.path.realpath(command)))),
        answer["missing"],
        answer["constraints"],
    )


def _pip_words(run: subprocess.CompletedProcess[str]) -> str:
    return next(iter((run.stderr or run.stdout).strip().splitlines()[-1:]), message("it said nothing"))


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


def _has_pip(python: str, version: tuple[int, int] | None = None) -> bool:
    """Return True if this is a Python with pip; if ``version`` is given, of that version."""
    code = "import pip, sys; print(*sys.version_info[:2])"
    try:
        ran = _run([python, "-c", code], _ASK_SECONDS)
    except (OSError, subprocess.TimeoutExpired):
        return False
    return not ran.returncode and (version is None or ran.stdout.split() == [str(part) for part in version])


def _any_python() -> str:
    """Find a Python with pip. Inside FreeCAD, ``sys.executable`` is FreeCAD."""
    paths = (sys.executable, shutil.which("python3"), shutil.which("python"), shutil.which("py"))
    for python in paths:
        if python and "freecad" not in os.path.basename(python).lower() and _has_pip(python):
            return python
    raise ConfigError(
        message(
            "no Python with pip was found on this computer. Install pip (on Debian and "
            "Ubuntu: apt install python3-pip), or Python from python.org, then try again"
        )
    )


def install_folder(place: Installation, source: Path | None = None, *, copy: bool = False) -> str:
    """Link (or copy) the add-on into ``Mod``; returns what was done. A folder that is not ours is left alone.

    source
        a folder whose root has the files that FreeCAD loads: the checkout, or the wheel's files, which are
        copied.
    """
    source = source or shipped()
    if not (source / "package.xml").is_file():
        raise InputError(message("{source} holds no package.xml; install silo-mod again", source=source))
    whole = (source / "mods" / "silo").is_dir()
    copy = copy or not whole
    _remove_old(place)
    target = place.mod
    if target.is_symlink() and target.resolve() == source:
        return message("{target} leads to this checkout already", target=target)
    if target.exists() or target.is_symlink():
        if not copy or target.is_symlink() or not (target / "package.xml").is_file():
            raise InputError(message("{target} is there already; move it away, then repeat", target=target))
        shutil.rmtree(target)
    target.parent.mkdir(parents=True, exist_ok=True)
    if copy:
        names = ("Init.py", "InitGui.py", "package.xml", "LICENSE", "README.md")
        target.mkdir()
        for name in names:
            shutil.copy2(source / name, target / name)
        modules = source / "mods" / "silo" if whole else Path(__file__).parents[1]
        without = shutil.ignore_patterns("__pycache__", "shipped")
        shutil.copytree(modules, target / "mods" / "silo", ignore=without)
        if (source / "docs").is_dir():
            shutil.copytree(source / "docs", target / "docs", ignore=shutil.ignore_patterns("decisions"))
        return message("copied to {target}", target=target)
    try:
        target.symlink_to(source, target_is_directory=True)
    except OSError:  # Windows lets only administrators and developers make links
        return message("{copy} (this system makes no links)", copy=install_folder(place, source, copy=True))
    return message("{target} now leads to this checkout", target=target)


def _remove_old(place: Installation) -> None:
    """Remove the add-on under the name of earlier versions: FreeCAD would start both."""
    old = place.data / "Mod" / OLD_FOLDER
    if (old / "package.xml").is_file() and (old / "mods" / "silo" / "workbench").is_dir():
        remove_patiently(old) if old.is_symlink() else shutil.rmtree(old)


def install_packages(place: Installation) -> str:
    """Install what the add-on lacks inside this FreeCAD, let FreeCAD import it, and return its folder.

    Packages that are there already stay unchanged, because other add-ons use them too. The needed packages
    come first, so that an optional one that pip does not find keeps none of them back. ConfigError if a
    package is not installed, or if FreeCAD still cannot import it.
    """
    if place.python < (3, 11):
        raise ConfigError(
            message(
                "this FreeCAD has Python {version}; the add-on needs 3.11 or newer",
                version="{}.{}".format(*place.python),
            )
        )
    if not place.missing:
        return str(place.packages)
    needed = [name for name in place.missing if name in FREECAD_PACKAGES]
    optional = [name for name in place.missing if name not in FREECAD_PACKAGES]
    pip = _pip(place)
    if needed and (failed := _install(place, pip, needed)):
        raise ConfigError(failed)
    failed = _install(place, pip, optional) if optional else ""
    missing = {
        name: reason
        for name, reason in ask_freecad(place.command, place.data).missing.items()
        if not failed or name not in optional
    }
    problems: list[str] = []
    if missing:
        reasons = [message("{name}: {reason}", name=name, reason=reason) for name, reason in missing.items()]
        problems.append(
            message(
                "the packages are in {packages}, but FreeCAD cannot import them: {reasons}",
                packages=place.packages,
                reasons=joined("; ", reasons),
            )
        )
    if failed:
        problems.append(
            message("{reason}. The add-on works without this package, but has no live events", reason=failed)
        )
    if problems:
        raise ConfigError(joined("; ", problems))
    return str(place.packages)


def _pip(place: Installation) -> list[str]:
    """Return how pip is run for this FreeCAD, with the options that choose packages for its Python."""
    install = ["-m", "pip", "install", "--quiet", "--target", str(place.packages)]
    own = next((python for python in place.pythons if _has_pip(python, place.python)), None)
    if own is not None:  # FreeCAD's own knows which packages fit it, and which processor it is made for
        return [own, *install]
    version = "{}.{}".format(*place.python)
    chosen = ["--python-version", version, "--implementation", "cp", "--only-binary=:all:"]
    return [_any_python(), *install, *chosen]


def _install(place: Installation, pip: Sequence[str], names: Sequence[str]) -> str:
    """Install packages by their import names; returns why that failed, "" if it did not."""
    packages = [ALL_PACKAGES[name] for name in names]
    command = [*pip, *packages]
    # Packages there that cannot be imported, such as those for another Python, are useless.
    if any((place.packages / name).exists() for name in names):
        command.append("--upgrade")
    run = _run([*command, *_constraint(place)], _PIP_SECONDS)
    if (
        run.returncode and place.constraints
    ):  # the list is on the Internet, the packages may be on a server nearby
        run = _run(command, _PIP_SECONDS)
    if not run.returncode:
        return ""
    return message(
        "pip could not install {names} for Python {version}: {run}",
        names=", ".join(packages),
        version="{}.{}".format(*place.python),
        run=_pip_words(run),
    )


def _constraint(place: Installation) -> list[str]:
    if not place.constraints:
        return []
    return ["--constraint", "{}/{}.{}/constraints.txt".format(place.constraints.rstrip("/"), *place.python)]
