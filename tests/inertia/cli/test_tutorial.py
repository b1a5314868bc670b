# SPDX-License-Identifier: LGPL-2.1-or-later
"""The tutorial, walked through: every command runs, and prints what the page says."""

from __future__ import annotations

import re
import runpy
import shlex
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "tutorial-robot.md").read_text("utf-8")
BLOCK = re.compile(r"```(sh|text)\n(.*?)```", re.DOTALL)


def plain(text: str) -> str:
    return " ".join(text.split())


def test_the_tutorial_does_what_it_says(
    run: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    """From STEP and BOM to an arm that stands."""
    pytest.importorskip("mujoco")
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    printed = ""
    said = 0
    for kind, block in BLOCK.findall(PAGE):
        if kind == "sh":
            printed = "".join(perform(line, run, monkeypatch, capsys) for line in block.splitlines())
            continue
        for line in block.splitlines():
            assert plain(line) in plain(printed), line
            said += 1
    assert said > 12
    assert (tmp_path / "my-arm" / "report.html").stat().st_size > 500_000
    assert (tmp_path / "my-arm" / "links.png").is_file()


def perform(line: str, run: Callable[..., Any], monkeypatch: pytest.MonkeyPatch, capsys: Any) -> str:
    """One line of the tutorial, as a shell would do it; what it prints."""
    words = shlex.split(line)
    if words[0] == "silo-mod":
        target = words[words.index(">") + 1] if ">" in words else None
        ran = run(*words[1 : words.index(">")] if target else words[1:])
        assert ran.code == 0, ran.err
        if target:
            Path(target).write_text(ran.out, "utf-8")
        return f"{ran.out}\n{ran.err}\n"
    if words[0] == "python":
        monkeypatch.setattr(sys, "argv", words[1:])
        runpy.run_path(words[1], run_name="__main__")
        return str(capsys.readouterr().out)
    if words[:2] == ["sed", "-i"]:
        _, old, new, _ = words[2].split("/")
        text = Path(words[3]).read_text("utf-8")
        assert re.search(old, text, re.MULTILINE)
        Path(words[3]).write_text(re.sub(old, new, text, flags=re.MULTILINE), "utf-8")
    elif words[0] == "cp":
        shutil.copytree(words[2], words[3])
    elif words[0] == "cd":
        monkeypatch.chdir(words[1])
    else:
        assert words[:2] == ["pip", "install"]
    return ""


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
