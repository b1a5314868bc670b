# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where FreeCAD and Qt may come in, what a worker may know of them, and what FreeCAD's start may load."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

MODS = Path(__file__).resolve().parents[2] / "mods"
WORKBENCH = MODS / "silo" / "workbench"
# What runs in a worker thread, where no document and no widget may be touched, and what runs in any test.
WORKERS = (
    "activity/badges",
    "activity/box",
    "activity/events",
    "activity/feed",
    "activity/links",
    "activity/sent",
    "activity/team",
    "colleagues/announced",
    "colleagues/look",
    "colleagues/theirs",
    "commit/desk",
    "commit/flow",
    "commit/plan",
    "commit/take",
    "desk",
    "documents/opened",
    "documents/snapshot",
    "pane/banner",
    "pane/waiting",
    "preview/flow",
    "register/flow",
    "session/online",
    "session/session",
    "session/worker",
    "settings/server",
)


def imports(path: Path) -> Iterator[str]:
    """The modules that a file imports, anywhere in it."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@pytest.mark.parametrize(
    ("outside", "entry"),
    [
        (("FreeCAD", "FreeCADGui"), "freecad/host.py"),
        (("PySide", "PySide2", "PySide6", "PyQt5"), "gui/qt.py"),
    ],
)
def test_each_enters_through_one_file(outside: tuple[str, ...], entry: str) -> None:
    """So that what differs between versions is dealt with in one place."""
    found = {
        path.relative_to(MODS / "silo").as_posix()
        for path in (MODS / "silo").rglob("*.py")
        if any(name.split(".")[0] in outside for name in imports(path))
    }
    assert found == {f"workbench/{entry}"}


@pytest.mark.parametrize("name", WORKERS)
def test_workers_and_flows_know_neither_freecad_nor_widgets(name: str) -> None:
    """Workers are given values and hand values back; flows are given a desk."""
    forbidden = {
        "silo.workbench.freecad.host",
        "silo.workbench.gui.qt",
        "silo.workbench.freecad.saving",
        "silo.workbench.freecad.live",
        "silo.workbench.freecad.modified",
        "silo.workbench.freecad.opening",
    }
    assert not forbidden & set(imports(WORKBENCH / f"{name}.py"))


# FreeCAD and PySide as far as the start touches them: any attribute is a class that takes anything.
_START = """
import sys, types

class Anything:
    def __init__(self, *a, **k): pass
    def __getattr__(self, name): return Anything()
    def __call__(self, *a, **k): return Anything()
    def __int__(self): return 1
    def __str__(self): return "1"
    def __getitem__(self, key): return Anything()
    def __iter__(self): return iter(())

class Module(types.ModuleType):
    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return type(name, (Anything,), {})

for name in ("FreeCAD", "FreeCADGui", "PySide", "PySide.QtCore", "PySide.QtGui", "PySide.QtWidgets"):
    sys.modules[name] = Module(name)
    parent, _, last = name.rpartition(".")
    if parent:
        setattr(sys.modules[parent], last, sys.modules[name])
before = set(sys.modules)
import silo.workbench.start
print("\\n".join(sorted(set(sys.modules) - before)))
"""


def test_the_start_loads_next_to_nothing() -> None:
    """No network, no pydantic, no pane, no BOM: those come when they are wanted."""
    env = {**os.environ, "PYTHONPATH": str(MODS)}
    run = subprocess.run(
        [sys.executable, "-c", _START], capture_output=True, text=True, check=False, env=env, timeout=60
    )
    assert run.returncode == 0, run.stderr
    loaded = set(run.stdout.split())
    heavy = {"requests", "pydantic", "urllib3", "sqlite3", "socket", "ssl", "asyncio", "json", "dataclasses"}
    assert not heavy & loaded
    assert {name for name in loaded if name.startswith("silo.") and "workbench" not in name} == set()
    ours = {name.removeprefix("silo.workbench.") for name in loaded if name.startswith("silo.workbench.")}
    assert ours == {
        "commands",
        "documents",
        "documents.opened",
        "freecad",
        "freecad.host",
        "gui",
        "gui.qt",
        "packages",
        "save_menu",
        "start",
        "words",
    }


def test_differences_have_the_colours_of_the_pages() -> None:
    """A ghost in FreeCAD's window means what it means in a browser: their files say the same."""
    overlay = (WORKBENCH / "freecad" / "overlay.py").read_text(encoding="utf-8")
    names, values = re.search(r"^(LIT, .*?) = (.*)$", overlay, re.MULTILINE).groups()
    mine = dict(zip(names.split(", "), ast.literal_eval(values), strict=True))
    pages = (MODS / "silo_server" / "web" / "static" / "model.js").read_text(encoding="utf-8")
    viewer = (MODS / "silo" / "viewer" / "viewer.js").read_text(encoding="utf-8")
    (lit,) = re.findall(r'LIT = "(#\w{6})"', viewer)
    kinds = dict(re.findall(r'(\w+): "(#\w{6})"', re.search(r"const KINDS = {(.*)}", pages)[1]))
    assert mine == {"LIT": lit, **{name.upper(): kinds[name] for name in ("added", "removed", "moved")}}
