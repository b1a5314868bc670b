# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the tests with real FreeCAD share. ``freecad_cases`` beside this file is their common library."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

# Test folders are no packages (import mode "importlib"), so the library is made known by its folder.
if str(Path(__file__).parent) not in sys.path:
    sys.path.insert(0, str(Path(__file__).parent))

from freecad_cases.machines import WANTED


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """The window's tests run in the versions that their file names (``VERSIONS``), else in all."""
    if (
        metafunc.module.__name__.rpartition(".")[2].startswith("test_gui")
        and "freecad" in metafunc.fixturenames
    ):
        versions = getattr(metafunc.module, "VERSIONS", WANTED)
        metafunc.parametrize("freecad", versions, indirect=True, scope="module")


@pytest.fixture(name="freecad", scope="module")
def _freecad(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A FreeCAD with a window and a server, kept for all tests of a file; each version in turn."""
    from gui_cases.window import window

    with window(request.param, tmp_path_factory.mktemp("window")) as made:
        yield made
