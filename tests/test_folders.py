# SPDX-License-Identifier: LGPL-2.1-or-later
"""The user's folders, by the XDG rules."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from silo.folders import cache_folder, config_folder, data_folder

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the rules of Linux")

FOLDERS = [
    (config_folder, "XDG_CONFIG_HOME", ".config"),
    (data_folder, "XDG_DATA_HOME", ".local/share"),
    (cache_folder, "XDG_CACHE_HOME", ".cache"),
]


@pytest.mark.parametrize(("folder", "variable", "default"), FOLDERS, ids=lambda v: getattr(v, "__name__", ""))
def test_folders(folder: object, variable: str, default: str) -> None:
    """The variable where it is an absolute path, else the default below the home."""
    assert callable(folder)
    home = {"HOME": "/home/designer"}
    below = Path("/home/designer") / default / "silo-mod"
    assert folder({**home, variable: "/data"}) == Path("/data/silo-mod")
    assert folder(home) == below
    assert folder({**home, variable: ""}) == below
    assert folder({**home, variable: "relative"}) == below, "XDG: relative paths are to be ignored"


def test_nothing_is_created(tmp_path: Path) -> None:
    """Asking where something would be leaves no trace."""
    for folder, _, _ in FOLDERS:
        folder({"HOME": str(tmp_path)})
    assert list(tmp_path.iterdir()) == []
