# SPDX-License-Identifier: LGPL-2.1-or-later
"""Tests that share a running program stay in one process; all others go wherever there is time."""

from __future__ import annotations

from sharing import group_of


def test_a_window_serves_all_tests_of_its_version() -> None:
    """Whatever else the test is called with; another version is another window."""
    file = "tests/freecad/test_gui_story.py"
    first, second = group_of(f"{file}::test_one[0.20]"), group_of(f"{file}::test_two[upload-0.20]")
    assert first == second == group_of(f"{file}::test_three[0.20-dark-2]")
    assert first != group_of(f"{file}::test_one[1.0]")
    assert first != group_of("tests/freecad/test_gui_corners.py::test_one[0.20]")


def test_the_matrix_and_a_browser_s_file_stay_whole() -> None:
    """The one shares what all versions built, the other a server."""
    for file in ("tests/freecad/test_matrix.py", "tests/browser/test_pages.py"):
        assert group_of(f"{file}::test_one[1.0-reads-1.1]") == group_of(f"{file}::test_two[dark]")


def test_others_go_alone() -> None:
    """Also those that are made for several values, and the longest of the browser."""
    assert len({group_of(f"tests/browser/test_accessibility.py::test_y[{n}]") for n in range(3)}) == 3
    assert len({group_of(f"tests/bom/test_x.py::test_y[{n}]") for n in range(3)}) == 3
    assert group_of("tests/freecad/test_gui_corners.py::test_new") != group_of(
        "tests/freecad/test_gui_corners.py::test_other"
    )
