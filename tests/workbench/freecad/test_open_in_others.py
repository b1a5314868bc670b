# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files that another FreeCAD has open, told by its cache folder and its lock."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from silo.workbench.freecad.open_in_others import OpenInOthers

pytest.importorskip("fcntl")

PATH = "/vault/Cover.FCStd"
# SHA-1 of that path begins so.
HASH = "b82a72"
UID = "92908131-ab86-482d-a89e-136fb149a0da"
HOLD = """
import fcntl, sys
file = open(sys.argv[1], "w")
fcntl.lockf(file, fcntl.LOCK_EX)
print("held", flush=True)
sys.stdin.read()
"""


def own(cache: Path) -> str:
    """The cache folder of a document that is open here."""
    return str(cache / f"FreeCAD_Doc_{UID}_000000_1")


@contextmanager
def held(lock: Path) -> Iterator[None]:
    """Another process holds this lock, as a running FreeCAD does."""
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(lock)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"held\n"
        yield
        process.communicate()


def test_a_file_in_a_running_freecad_is_open_elsewhere(tmp_path: Path) -> None:
    """By its path, whichever spelling of it was used; other files are not."""
    (tmp_path / f"FreeCAD_Doc_{UID}_{HASH}_42").mkdir()
    with held(tmp_path / "FreeCAD_42.lock"):
        found = OpenInOthers(own(tmp_path))
        assert found.has("/link/Cover.FCStd", PATH)
        assert not found.has("/vault/Guard.FCStd", "")


def test_what_a_crash_left_behind_is_not_open(tmp_path: Path) -> None:
    """The folder stays until FreeCAD offers to recover it; nobody holds the lock."""
    (tmp_path / f"FreeCAD_Doc_{UID}_{HASH}_42").mkdir()
    assert not OpenInOthers(own(tmp_path)).has(PATH)
    (tmp_path / "FreeCAD_42.lock").touch()
    assert not OpenInOthers(own(tmp_path)).has(PATH)


def test_our_own_documents_are_not_elsewhere(tmp_path: Path) -> None:
    """And our own lock is not touched: closing its file would give it up."""
    (tmp_path / f"FreeCAD_Doc_{UID}_{HASH}_1").mkdir()
    with held(tmp_path / "FreeCAD_1.lock"):
        assert not OpenInOthers(own(tmp_path)).has(PATH)


@pytest.mark.parametrize("folder", ["", "/nowhere/at/all", "/nowhere/FreeCAD_Doc_x"])
def test_without_a_document_of_our_own_nothing_is_said(folder: str) -> None:
    """Better no warning than a wrong one."""
    assert not OpenInOthers(folder).has(PATH)
