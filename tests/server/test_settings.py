# SPDX-License-Identifier: LGPL-2.1-or-later
"""Settings: from the environment, with what is given winning; wrong values named."""

from __future__ import annotations

from pathlib import Path

import pytest

from silo.bom.errors import ConfigError
from silo_server.settings import Settings, default_database_url, settings_from_environment


def test_the_environment_sets_and_what_is_given_wins() -> None:
    """Every ``SILO_…`` variable is read in its type."""
    environ = {
        "SILO_DATABASE_URL": "sqlite:///a.db",
        "SILO_STORAGE_ROOT_DIR": "/srv/files",
        "SILO_READ_ONLY": "yes",
        "SILO_HEARTBEAT_SECONDS": "12.5",
        "SILO_MAX_BODY_BYTES": "1000",
        "SILO_ADMIN_USERNAME": "chief",
        "SILO_SECURE_COOKIES": "0",
        "SILO_FREECAD_VERSION": "1.0",
    }
    settings = settings_from_environment(environ, database_url="sqlite:///b.db")
    assert settings.database_url == "sqlite:///b.db"
    assert settings.storage == Path("/srv/files")
    assert settings.read_only is True
    assert settings.heartbeat_seconds == 12.5
    assert settings.max_body_bytes == 1000
    assert settings.admin_username == "chief"
    assert settings.secure_cookies is False
    assert settings.freecad_version == "1.0"


@pytest.mark.parametrize("version", ["newest", "1", "1.0.2", "1.0 "])
def test_the_team_s_freecad_is_two_numbers(version: str) -> None:
    """Else FreeCAD could not compare its own with it, and nobody would be told."""
    with pytest.raises(ConfigError, match="wanted two numbers"):
        settings_from_environment({"SILO_FREECAD_VERSION": version})


def test_without_anything_it_is_sqlite_in_the_user_s_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    """The embedded default follows XDG_DATA_HOME."""
    monkeypatch.setenv("XDG_DATA_HOME", "/data")
    assert default_database_url().endswith("silo-mod/silo.db")
    assert settings_from_environment({}).database_url == default_database_url()


@pytest.mark.parametrize(
    ("variable", "value"),
    [("SILO_READ_ONLY", "perhaps"), ("SILO_MAX_BODY_BYTES", "many"), ("SILO_HEARTBEAT_SECONDS", "x")],
)
def test_a_wrong_value_is_named(variable: str, value: str) -> None:
    """Which variable, what was wanted, what was got."""
    with pytest.raises(ConfigError, match=f"{variable}: wanted .*{value}"):
        settings_from_environment({variable: value})


@pytest.mark.parametrize("url", ["postgres://u:p@h/d", "postgresql://u:p@h/d"])
def test_postgresql_gets_our_driver(url: str) -> None:
    """Both common spellings work."""
    settings = Settings(database_url=url)
    assert settings.sqlalchemy_url == "postgresql+psycopg://u:p@h/d"
    assert not settings.is_sqlite
    assert settings.sqlite_path is None


def test_files_lie_beside_the_sqlite_file() -> None:
    """One folder to back up."""
    assert Settings(database_url="sqlite:////var/silo.db").storage == Path("/var/silo-files")


@pytest.mark.parametrize("url", ["sqlite://", "sqlite:///:memory:"])
def test_a_database_in_memory_is_refused(url: str) -> None:
    """Each thread would have its own."""
    with pytest.raises(ConfigError, match="in memory"):
        _ = Settings(database_url=url).sqlite_path
