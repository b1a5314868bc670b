# SPDX-License-Identifier: LGPL-2.1-or-later
"""The commands as a user runs them, with the example arm in a folder of its own."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from silo.cli.main import main

EXAMPLE = Path(__file__).parents[3] / "examples" / "arm"


@dataclass(frozen=True)
class Ran:
    """What a command printed, and its exit code."""

    code: int
    out: str
    err: str

    def json(self) -> Any:
        return json.loads(self.out)


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Nothing of the user's own configuration or FreeCAD is read or written."""
    for name in ("SILO_API_URL", "SILO_API_TOKEN", "FREECAD_MATERIALS"):
        monkeypatch.delenv(name, raising=False)
    folder = tmp_path / "home"
    for name in ("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME"):
        monkeypatch.setenv(name, str(folder / name.lower()))
    return folder


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    """A copy of the example."""
    folder = tmp_path / "arm"
    shutil.copytree(EXAMPLE, folder)
    return folder


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Callable[..., Ran]:
    """Run ``silo-mod`` with these words."""

    def _run(*words: object) -> Ran:
        code = main([str(word) for word in words])
        captured = capsys.readouterr()
        return Ran(code, captured.out, captured.err)

    return _run
