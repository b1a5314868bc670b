# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the tests with real FreeCAD share. ``freecad_cases`` beside this file is their common library."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

# Test folders are no packages (import mode "importlib"), so the library is made known by its folder.
if str(Path(__file__).parent) not in sys.path:
    sys.path.insert(0, str(Path(__file__).parent))

from freecad_cases.machines import WANTED


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What shares a running FreeCAD stays together when the tests are spread over several processes.

    That is a file and a version of FreeCAD; but the tests of the matrix share what all versions built.
    """
    for item in items:
        if Path(__file__).parent in item.path.parents and item.get_closest_marker("freecad"):
            item.add_marker(pytest.mark.xdist_group(f"{item.path.stem} {_version(item)}"))


def _version(item: pytest.Item) -> str:
    if item.path.stem == "test_matrix" or not isinstance(item, pytest.Function):
        return ""
    params = item.callspec.params.values() if hasattr(item, "callspec") else ()
    return next((str(value) for value in params if value in WANTED), "")
