# SPDX-License-Identifier: LGPL-2.1-or-later
"""The Python packages that the add-on needs inside FreeCAD, and what to say where one is missing."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Sequence

from silo import FREECAD_PACKAGES
from silo.workbench.words import translate


def _found(name: str) -> bool:
    return importlib.util.find_spec(name) is not None


def missing(found: Callable[[str], bool] = _found) -> tuple[str, ...]:
    """The packages that are not there; their names on PyPI are those by which they are imported."""
    return tuple(name for name in FREECAD_PACKAGES if not found(name))


def sentence(packages: Sequence[str], folder: str, python: tuple[int, int]) -> str:
    """The hint for the user, in one line: a command that can be copied, for this very FreeCAD.

    folder
        where this FreeCAD looks for additional packages; python: its version of Python.
    """
    text = translate(
        "Silo",
        "Silo needs the Python packages {names}. Install them with silo-mod install-addon, or with: "
        "{command} – then start FreeCAD again.",
    )
    # FreeCAD's own Python has no pip in some systems; any other of the same version serves.
    command = 'python{}.{} -m pip install --target "{}" {}'.format(*python, folder, " ".join(packages))
    return text.replace("{names}", ", ".join(packages)).replace("{command}", command)
