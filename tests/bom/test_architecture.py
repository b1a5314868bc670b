# SPDX-License-Identifier: LGPL-2.1-or-later
"""The core is pure: the standard library and itself, nothing read, nothing kept; its exports are reported."""

from __future__ import annotations

import importlib
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

import silo.bom

MODULES = sorted(module.name for module in pkgutil.walk_packages(silo.bom.__path__, "silo.bom."))
ROOT = Path(next(iter(silo.bom.__path__)))
SOURCES = sorted(ROOT.rglob("*.py"))


def test_importing_the_core_loads_the_standard_library_only() -> None:
    """In a fresh interpreter without the site's packages; nothing else of ours, no network, no database."""
    program = (
        f"import sys; before = set(sys.modules); sys.path.insert(0, {str(ROOT.parents[1])!r})\n"
        f"import {', '.join(MODULES)}\n"
        "print(*sorted({name.split('.')[0] if not name.startswith('silo') else name\n"
        "               for name in set(sys.modules) - before}))"
    )
    ran = subprocess.run(
        [sys.executable, "-I", "-S", "-c", program], capture_output=True, text=True, check=True
    )
    loaded = set(ran.stdout.split())
    ours = {name for name in loaded if name.startswith("silo")}
    assert ours == {"silo", "silo.bom", *MODULES}
    assert loaded - ours <= sys.stdlib_module_names
    assert not loaded & {"socket", "ssl", "http", "sqlite3", "subprocess", "threading", "asyncio", "tempfile"}


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_modules_fit_on_some_screens(source: Path) -> None:
    """One concept each, 800 lines at most."""
    assert len(source.read_text(encoding="utf-8").splitlines()) <= 800


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_the_core_opens_nothing_and_asks_no_clock(source: Path) -> None:
    """No files, no time, no chance: the same values in give the same values out."""
    text = source.read_text(encoding="utf-8")
    for word in (
        "open(",
        "import time",
        "datetime",
        "random",
        "os.environ",
        "print(",
        "logging",
        "realpath(",
    ):
        assert word not in text, word


def test_all_is_what_is_exported() -> None:
    """Each name is there, in order, and an unknown one is refused; the errors alone load no walker."""
    assert {getattr(silo.bom, name).__module__.partition(".")[0] for name in silo.bom.__all__} == {"silo"}
    assert silo.bom.__all__ == sorted(silo.bom.__all__)
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = silo.bom.no_such_name
    code = "import sys, silo.bom.errors; print(*(n for n in sys.modules if n.startswith('silo.bom.')))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["silo.bom.message", "silo.bom.errors"]


@pytest.mark.parametrize("module", MODULES)
def test_every_module_says_what_it_is(module: str) -> None:
    """The first thing a reader sees."""
    assert importlib.import_module(module).__doc__
