# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files that a running FreeCAD has open: its cache folder and its lock show them."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from running_freecad import UID, held, opened

from silo.freecads.open_documents import OpenInFreecad, open_in_others

pytestmark = pytest.mark.usefixtures("needs_locks")

PATH = "/vault/Cover.FCStd"
# SHA-1 of that path begins so.
HASH = "b82a72"


def own(cache: Path) -> str:
    """The cache folder of a document that is open here."""
    return str(cache / f"FreeCAD_Doc_{UID}_000000_1")


def test_a_file_in_a_running_freecad_is_open_elsewhere(tmp_path: Path) -> None:
    """By its path, whichever spelling of it was used; other files are not."""
    (tmp_path / f"FreeCAD_Doc_{UID}_{HASH}_42").mkdir()
    with held(tmp_path / "FreeCAD_42.lock"):
        found = open_in_others(own(tmp_path))
        assert found.has("/link/Cover.FCStd", PATH)
        assert not found.has("/vault/Guard.FCStd", "")


def test_what_a_crash_left_behind_is_not_open(tmp_path: Path) -> None:
    """The folder stays until FreeCAD offers to recover it; nobody holds the lock."""
    (tmp_path / f"FreeCAD_Doc_{UID}_{HASH}_42").mkdir()
    assert not open_in_others(own(tmp_path)).has(PATH)
    (tmp_path / "FreeCAD_42.lock").touch()
    assert not open_in_others(own(tmp_path)).has(PATH)


def test_our_own_documents_are_not_elsewhere(tmp_path: Path) -> None:
    """And our own lock is not touched: closing its file would give it up."""
    (tmp_path / f"FreeCAD_Doc_{UID}_{HASH}_1").mkdir()
    with held(tmp_path / "FreeCAD_1.lock"):
        assert not open_in_others(own(tmp_path)).has(PATH)


@pytest.mark.parametrize("folder", ["", "/nowhere/at/all", "/nowhere/FreeCAD_Doc_x"])
def test_without_a_document_of_our_own_nothing_is_said(folder: str) -> None:
    """Better no warning than a wrong one."""
    assert not open_in_others(folder).has(PATH)


@pytest.mark.usefixtures("needs_symlinks")
def test_the_file_is_known_by_each_of_its_paths(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """FreeCAD has the file by its real path; the user names it by a link, or from its folder."""
    file, link = tmp_path / "Cover.FCStd", tmp_path / "Link.FCStd"
    file.touch()
    link.symlink_to(file)
    with opened(tmp_path / "cache", file):
        found = OpenInFreecad([tmp_path / "nowhere", tmp_path / "cache"])
        monkeypatch.chdir(tmp_path)
        assert [found.has_file(name) for name in (str(file), str(link), "Cover.FCStd", "Guard.FCStd")] == [
            True,
            True,
            True,
            False,
        ]


def test_windows_paths_are_known_as_freecad_writes_them(tmp_path: Path) -> None:
    """With "/" in them."""
    with opened(tmp_path, "C:/vault/Cover.FCStd"):
        assert OpenInFreecad([tmp_path]).has_file(r"C:\vault\Cover.FCStd")


def test_this_process_is_not_another_freecad(tmp_path: Path) -> None:
    """The command line may run inside a FreeCAD; its own lock is not touched."""
    with opened(tmp_path, PATH, number=os.getpid()):
        assert not OpenInFreecad([tmp_path]).has_file(PATH)
