# SPDX-License-Identifier: LGPL-2.1-or-later
"""The user's folders, by each platform's rules."""

from __future__ import annotations

from pathlib import Path

import pytest

import silo.platform.whole_files
from silo.platform.user_folders import cache_folder, config_folder, data_folder
from silo.platform.whole_files import scratch_folder
from silo_server.settings import settings_from_environment

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
    assert folder({**home, variable: "/data"}, "linux") == Path("/data/silo-mod")
    assert folder(home, "linux") == below
    assert folder({**home, variable: ""}, "linux") == below
    assert folder({**home, variable: "relative"}, "linux") == below, "XDG: relative paths are to be ignored"


def test_windows_has_its_own_variables() -> None:
    """Only the configuration roams; a database or an outbox must not be copied between machines."""
    env = {"APPDATA": "/roaming", "LOCALAPPDATA": "/local", "HOME": "/elsewhere"}
    assert config_folder(env, "win32") == Path("/roaming/silo-mod")
    assert data_folder(env, "win32") == cache_folder(env, "win32") == Path("/local/silo-mod")
    assert data_folder({}, "win32") == Path.home() / "AppData" / "Local" / "silo-mod"


def test_macos_has_its_library() -> None:
    """Data and configuration together, the cache apart."""
    env = {"HOME": "/Users/designer"}
    library = Path("/Users/designer/Library")
    assert config_folder(env, "darwin") == data_folder(env, "darwin")
    assert data_folder(env, "darwin") == library / "Application Support" / "silo-mod"
    assert cache_folder(env, "darwin") == library / "Caches" / "silo-mod"


def test_the_server_keeps_its_database_where_the_client_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    """One rule for both, also where a variable moves the folder."""
    monkeypatch.setenv("XDG_DATA_HOME", "/data")
    assert settings_from_environment({}).sqlite_path == data_folder() / "silo.db"


def test_nothing_is_created(tmp_path: Path) -> None:
    """Asking where something would be leaves no trace."""
    for folder, _, _ in FOLDERS:
        folder({"HOME": str(tmp_path)})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("platform", ["linux", "darwin", "win32"])
def test_one_folder_can_stand_for_all(platform: str) -> None:
    """The demo and a portable installation keep everything in one place, on every platform."""
    env = {"SILO_HOME": "/stick/silo", "XDG_DATA_HOME": "/data", "APPDATA": "/roaming", "HOME": "/home/d"}
    found = [folder(env, platform) for folder in (config_folder, data_folder, cache_folder)]
    assert found == [Path("/stick/silo/config"), Path("/stick/silo/data"), Path("/stick/silo/cache")]
    usual = config_folder({**env, "SILO_HOME": ""}, platform)
    assert config_folder({**env, "SILO_HOME": "relative"}, platform) == usual


def test_a_scratch_folder_is_gone_afterwards(tmp_path: Path) -> None:
    """With the files in it."""
    with scratch_folder("silo-test-", tmp_path) as folder:
        (Path(folder) / "a").touch()
        assert Path(folder).parent == tmp_path
    assert list(tmp_path.iterdir()) == []


def test_all_temporary_folders_are_scratch_folders() -> None:
    """Any other fails on Windows where a program, such as a virus scanner, has a file in it open."""
    place = Path(silo.platform.whole_files.__file__)
    makers = [
        file.name
        for package in ("silo", "silo_server")
        for file in (place.parents[2] / package).rglob("*.py")
        if "TemporaryDirectory(" in file.read_text("utf-8")
    ]
    assert makers == [place.name]
