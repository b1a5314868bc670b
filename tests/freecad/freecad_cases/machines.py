# SPDX-License-Identifier: LGPL-2.1-or-later
"""The FreeCADs of this machine, as ``scripts/freecad-roots.sh --list`` prints them."""

from __future__ import annotations

import os
import subprocess
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NoReturn

import pytest

REPOSITORY = Path(__file__).resolve().parents[3]
ROOTS = REPOSITORY / "scripts" / "freecad-roots.sh"

# What the add-on must work in; the last part of a version does not matter.
WANTED = ("0.20", "1.0", "1.1")
# Of Python 3.11 with Qt 5 and of the newest: for what differs by Qt and by file formats, but in no other way.
ENDS = ("0.20", "1.1")
# For what the queue and the server do, which no version changes.
NEWEST = ("1.1",)
# The same for what runs in all of them with SILO_LONG=1.
MOSTLY_ENDS, MOSTLY_NEWEST = (WANTED, WANTED) if os.environ.get("SILO_LONG") else (ENDS, NEWEST)

# As it is before a test gives itself a home of its own.
_ENVIRONMENT = dict(os.environ)
_CODE = 'import os, runpy; runpy.run_path(os.environ["SILO_SCRIPT"], run_name="__main__")'


@dataclass(frozen=True)
class FreeCAD:
    """One FreeCAD.

    dependencies
        folder with requests and its like for this FreeCAD's Python; may be absent.
    """

    name: str
    version: tuple[int, ...]
    python: str
    command: str
    dependencies: Path

    @property
    def short(self) -> str:
        return ".".join(str(part) for part in self.version[:2])

    def sibling(self, program: str) -> str:
        """Another program of the same FreeCAD, such as ``freecad``."""
        beside = Path(self.command).parent / program
        return str(beside) if beside.exists() else program

    def profile(self, folder: Path, *, dependencies: bool = False) -> dict[str, str]:
        """Environment for a run with a profile of its own, in a new folder.

        dependencies
            with the Python packages that the Addon Manager would install; skips loudly without them.
        """
        folder.mkdir(parents=True)
        if dependencies:
            if not (self.dependencies / "requests").is_dir():
                miss(f"the Python packages for FreeCAD {self.short} are not in {self.dependencies}")
            (folder / "AdditionalPythonPackages").symlink_to(self.dependencies, target_is_directory=True)
        return {"FREECAD_USER_HOME": str(folder)}

    def run(
        self, script: Path, env: Mapping[str, str], *, cwd: Path, timeout_s: float = 300
    ) -> subprocess.CompletedProcess[str]:
        """Run a Python script inside this FreeCAD without a window, once, with the script's exit code."""
        return subprocess.run(
            [self.command, "-c", _CODE],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            cwd=cwd,
            env={**os.environ, "SILO_SCRIPT": str(script), **env},
            timeout=timeout_s,
            check=False,
        )

    def must_run(self, script: Path, env: Mapping[str, str], *, cwd: Path, timeout_s: float = 300) -> None:
        """Run a script that has to succeed."""
        done = self.run(script, env, cwd=cwd, timeout_s=timeout_s)
        assert done.returncode == 0, f"FreeCAD {self.short}, {script.name}: {done.stdout[-4000:]}"


@cache
def freecads() -> Mapping[str, FreeCAD]:
    """By version ("1.0"). Empty where there is none at all."""
    if os.name != "posix":
        return {}
    told = subprocess.run(
        [ROOTS, "--list"], capture_output=True, text=True, timeout=300, check=False, env=_ENVIRONMENT
    )
    found: dict[str, FreeCAD] = {}
    for line in told.stdout.splitlines():
        name, version, python, command, dependencies = line.split("\t")
        parts = tuple(int(part) for part in version.split(".") if part.isdigit())
        one = FreeCAD(name, parts, python, command, Path(dependencies))
        found.setdefault(one.short, one)
    return found


def need(version: str) -> FreeCAD:
    """The FreeCAD of this version; skips loudly without it, and fails where the machine was to have it."""
    found = freecads().get(version)
    if found is None:
        miss(f"no FreeCAD {version} on this machine; scripts/freecad-roots.sh builds it (as root on Debian)")
    return found


def miss(reason: str) -> NoReturn:
    """Skip, or fail where the machine was to have everything."""
    if os.environ.get("SILO_REQUIRE_FREECAD") == "1":
        pytest.fail(reason)
    pytest.skip(reason)


def wheel(folder: Path, name: str, version: str, content: str = "") -> None:
    """Write a package of one module as pip takes it."""
    info = f"{name}-{version}.dist-info"
    _pack(
        folder,
        info,
        {
            f"{name}/__init__.py": content.encode(),
            f"{info}/METADATA": f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n".encode(),
        },
    )


def wheels_of(installed: Path, folder: Path) -> None:
    """Write what pip installed into a folder as wheels again, so that a test needs no index."""
    for info in installed.glob("*.dist-info"):
        names = [line.partition(",")[0] for line in (info / "RECORD").read_text("utf-8").splitlines()]
        kept = [name for name in names if not name.startswith("..") and "__pycache__" not in name]
        _pack(folder, info.name, {name: (installed / name).read_bytes() for name in kept})


def _pack(folder: Path, info: str, files: Mapping[str, bytes]) -> None:
    kind = b"Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
    packed = {**files, f"{info}/WHEEL": kind}
    packed[f"{info}/RECORD"] = "".join(f"{path},,\n" for path in {**packed, f"{info}/RECORD": 0}).encode()
    with zipfile.ZipFile(folder / f"{info.removesuffix('.dist-info')}-py3-none-any.whl", "w") as out:
        for path, content in packed.items():
            out.writestr(path, content)
