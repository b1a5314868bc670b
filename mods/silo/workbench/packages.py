# SPDX-License-Identifier: LGPL-2.1-or-later
"""The Python packages that the add-on needs inside FreeCAD, and what to say where one is missing."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Sequence

from silo import FREECAD_PACKAGES
from silo.workbench.words import translate


def _is_installed(name: str) -> bool:
    return importlib.util.find_spec(name) is not None


def missing_packages(is_there: Callable[[str], bool] = _is_installed) -> tuple[str, ...]:
    """Return the packages that are not installed; they are imported by their names on PyPI."""
    return tuple(name for name in FREECAD_PACKAGES if not is_there(name))


def packages_hint(packages: Sequence[str], folder: str, python: tuple[int, int]) -> str:
    """Write the hint for the user in one line, with a command to copy for this very FreeCAD.

    folder
        where this FreeCAD looks for additional packages; ``python``: its version of Python.
    """
    # FreeCAD's own Python has no pip in some systems; any other of the same version serves.
    command = 'python{}.{} -m pip install --target "{}" {}'.format(*python, folder, " ".join(packages))
    return translate(
        "Silo",
        "Silo needs the Python packages {names}. Install them with silo-mod install-addon, or with: "
        "{command} – then start FreeCAD again.",
        names=", ".join(packages),
        command=command,
    )
