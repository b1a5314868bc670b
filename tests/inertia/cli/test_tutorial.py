# SPDX-License-Identifier: LGPL-2.1-or-later
"""The model of the robotics engineer's first hour can fall, so that its standing means something."""

from __future__ import annotations

import re
import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[3]


def test_the_arm_falls_where_its_mass_is_not_over_the_plate(run: Callable[..., Any], arm: Path) -> None:
    """The tutorial's model can fall: a gripper of 10 kg tips it over. So standing means something."""
    pytest.importorskip("mujoco")
    stand = runpy.run_path(str(ROOT / "examples" / "arm" / "stand.py"))
    leans = []
    for mass in ("0.055 kg", "10 kg"):
        text = (arm / "bom.csv").read_text("utf-8")
        text = re.sub(r"0\.055 kg\*?", mass, text)
        (arm / "heavy.csv").write_text(text, "utf-8")
        out = arm / "out.urdf"
        files = ["--bom", arm / "heavy.csv", "--urdf", arm / "arm.urdf", "--urdf-out", out]
        assert run("inertia", arm / "arm.step", *files).code == 0
        _, data = stand["stand"](stand["build"](out), 3.0)
        leans.append(stand["tilt"](data))
    assert leans[0] < 0.01
    assert leans[1] > 0.3
